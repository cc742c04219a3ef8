"""Hamel's top as MJCF: ball, ring and stage, with a scene's parameters."""

from magmotor.engines.mujoco import contact, parts
from magmotor.engines.mujoco.compose_ball import add_ball
from magmotor.engines.mujoco.coordinates import BallCoordinates
from magmotor.engines.mujoco.top_looks import decorate
from magmotor.scenes import Top
from magmotor.states.ball import start


def compose_top(scene: Top, *, looks: bool) -> parts.Element:
    """The top as one PyMJCF tree, without decoration unless `looks`."""
    root = parts.load("top", looks=looks)
    if looks:
        decorate(root, scene)
    add_ball(root, scene, scene.inertia)
    _place_ring(root.find("body", "ring"), scene)
    contact.add_contacts(root, scene.surface, scene.gravity, scene.friction, scene.dry_friction)
    if not looks:
        parts.disable_unused(root)
        contact.tune_solver(root, scene.surface, scene.friction)
    coordinates = BallCoordinates(scene.surface, scene.ball_radius)
    qpos, qvel = coordinates.joints(start(scene))
    root.keyframe.add("key", name="start", qpos=qpos, qvel=qvel)
    inverse_inertia = 1 / scene.ball_mass + scene.ball_radius**2 / scene.inertia[0]
    contact.calibrate_viscous(root, scene.friction, inverse_inertia)
    return root


def _place_ring(body: parts.Element, scene: Top) -> None:
    height, tilt = scene.ring_pose(0.0)
    body.pos = [0.0, 0.0, height]
    body.quat = scene.ring_quaternion(tilt)
    parts.add_dipoles(body, scene.moment, *scene.ring_dipole_frame())
