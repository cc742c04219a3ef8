"""The motor as MJCF: ball, two rings and stage, with a scene's parameters."""

import numpy as np

from magmotor.engines.mujoco import contact, parts
from magmotor.engines.mujoco.compose_ball import add_ball
from magmotor.engines.mujoco.coordinates import MotorCoordinates
from magmotor.engines.mujoco.motor_looks import decorate
from magmotor.scenes import Motor
from magmotor.scenes.ring import ring_dipoles
from magmotor.states.motor import start_motor
from magmotor.theory.motor import slip_mobility


def compose_motor(scene: Motor, *, looks: bool) -> parts.Element:
    """The motor as one PyMJCF tree, without decoration unless `looks`."""
    root = parts.load("motor", looks=looks)
    if looks:
        decorate(root, scene)
    add_ball(root, scene, 3 * [scene.ball_inertia])
    _hang_rings(root, scene)
    _couple(root, scene.ball_ring_factor)
    _drive(root, scene)
    contact.add_contacts(root, scene.surface, scene.gravity, scene.friction_ball)
    if not looks:
        parts.disable_unused(root, keep=("damper",) if scene.friction_ring else ())
        contact.tune_solver(root, scene.surface, scene.friction_ball)
    qpos, qvel = MotorCoordinates(scene).joints(start_motor(scene))
    root.keyframe.add("key", name="start", qpos=qpos[0], qvel=qvel[0])
    contact.calibrate_viscous(root, scene.friction_ball, slip_mobility(scene))
    return root


def _hang_rings(root: parts.Element, scene: Motor) -> None:
    inner, outer = (root.find("body", name) for name in ("inner_ring", "outer_ring"))
    inner.pos = [0.0, 0.0, scene.inner_height]
    outer.pos = [0.0, 0.0, scene.outer_height]
    inner.add("inertial", pos=[0, 0, 0], mass=scene.inner_mass, diaginertia=scene.inner_moments)
    root.find("joint", "inner_ring").damping = scene.friction_ring or None
    parts.add_dipoles(inner, scene.moment, *scene.inner_dipole_frame())
    parts.add_dipoles(outer, scene.moment, *ring_dipoles(scene.outer_dipoles, scene.outer_radius))


def _couple(root: parts.Element, factor: float) -> None:
    """Have ball and inner ring act on one another `factor` times."""
    if factor != 1:
        pair = root.custom.add("tuple", name="coupling_ball_inner_ring")
        for body in ("ball", "inner_ring"):
            pair.add("element", objtype="body", objname=body, prm=factor)


def _drive(root: parts.Element, scene: Motor) -> None:
    """Write the noise where the compiled callback reads it.

    The ball's acts at the point that slips: the force comes with the torque -r e_z x force.
    """
    force, torque = np.eye(2, 3), np.eye(3)
    slip = np.hstack([force, np.cross([0.0, 0.0, -scene.ball_radius], force)])
    turn = np.hstack([np.zeros((3, 3)), torque])
    if scene.alpha_ball:
        root.find("body", "ball").user = scene.alpha_ball * slip.ravel()
    if scene.alpha_ring:
        root.find("body", "inner_ring").user = scene.alpha_ring * turn.ravel()
