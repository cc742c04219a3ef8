"""Hamel's top as MJCF: ball, ring and stage, with a scene's parameters."""

from magmotor.engines.mujoco import contact, parts
from magmotor.engines.mujoco.coordinates import BallCoordinates
from magmotor.engines.mujoco.top_looks import decorate
from magmotor.scenes import Top
from magmotor.states.ball import start


def compose_top(scene: Top, *, looks: bool) -> parts.Element:
    """The top as one PyMJCF tree, without decoration unless `looks`."""
    root = parts.load("top")
    root.option.gravity = [0.0, 0.0, -scene.gravity]
    if looks:
        decorate(root, scene)
    _shape_ball(root, scene)
    _free_ball(root.find("body", "ball"), scene)
    _place_ring(root.find("body", "ring"), scene)
    contact.add_contacts(root, scene)
    if not looks:
        parts.strip(root)
        contact.tune_solver(root, scene)
    coordinates = BallCoordinates(scene.surface, scene.ball_radius)
    qpos, qvel = coordinates.joints(start(scene))
    root.keyframe.add("key", name="start", qpos=qpos, qvel=qvel)
    inverse_inertia = 1 / scene.ball_mass + scene.ball_radius**2 / scene.inertia[0]
    contact.calibrate_viscous(root, scene.friction, inverse_inertia)
    return root


def _shape_ball(root: parts.Element, scene: Top) -> None:
    body = root.find("body", "ball")
    body.pos = [0.0, 0.0, scene.ball_radius]
    body.add("inertial", pos=[0, 0, 0], mass=scene.ball_mass, diaginertia=scene.inertia)
    root.find("geom", "ball").size = [scene.ball_radius]
    root.find("site", "ball").user = [scene.moment]


def _free_ball(body: parts.Element, scene: Top) -> None:
    if scene.surface == "plane":
        body.add("freejoint", name="free")
    else:
        body.add("joint", name="x", type="slide", axis=[1, 0, 0])
        body.add("joint", name="y", type="slide", axis=[0, 1, 0])
        body.add("joint", name="orientation", type="ball")


def _place_ring(body: parts.Element, scene: Top) -> None:
    height, tilt = scene.ring_pose(0.0)
    body.pos = [0.0, 0.0, height]
    body.quat = scene.ring_quaternion(tilt)
    for i, (position, outward) in enumerate(zip(*scene.ring_dipole_frame(), strict=True)):
        place = {"pos": position, "zaxis": outward}
        body.add("site", name=f"ring{i}", dclass="dipole", user=[scene.moment], **place)
