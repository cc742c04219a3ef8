"""The motor as MJCF: ball, two rings and stage with the parameters of a scene."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.common.exceptions import ArgumentError
from magmotor.device.job import Job
from magmotor.devices.ball.contacts import add_contacts, tune_solver
from magmotor.devices.ball.coordinates import BallCoordinates, neg_quat, rot_vec_quat
from magmotor.devices.ball.mjcf import add_ball, draw_ring, mark, size_arrows, start_ball
from magmotor.devices.ball.scene import ring_dipoles
from magmotor.devices.motor.heat_and_work import heat_and_work_sums
from magmotor.devices.motor.scene import Motor
from magmotor.devices.motor.states import MotorStates, start_motor
from magmotor.mjcf import model_parts
from magmotor.mjcf.forces.brownian_wrenches import userdata
from magmotor.mjcf.model_parts import fit_stage


def decorate(root: model_parts.Element, scene: Motor) -> None:
    """Draw the rings and fit lights and cameras to a scene."""
    size_arrows(root, scene.inner_radius * min(1.0, 20 / scene.inner_dipoles))
    draw_ring(root, "inner_ring", *scene.inner_dipole_frame())
    outer = ring_dipoles(scene.outer_dipoles, scene.outer_radius)
    draw_ring(root, "outer_ring", *outer)
    _mark(root, scene.inner_radius)
    highest = max(scene.inner_height, scene.outer_height)
    widest = max(scene.inner_radius, scene.outer_radius)
    radius = np.hypot(1.15 * widest, 0.5 * highest)
    fit_stage(root, [0.0, 0.0, highest / 2], radius)


def _mark(root: model_parts.Element, radius: float) -> None:
    """Mark the first dipole of the inner ring to make its yaw visible."""
    bead = root.find("geom", "inner_mark")
    bead.pos, bead.size = [radius, 0.0, 0.0], radius * bead.size


class MotorCoordinates:
    """Joint coordinates: those of the ball, then the ball joint of the inner ring."""

    def __init__(self, scene: Motor):
        self.ball = BallCoordinates(scene.surface, scene.ball_radius)

    def joints(self, states: MotorStates) -> tuple[Array, Array]:
        """Return `qpos` and `qvel` of the last state, shapes (replicas, nq) and (replicas, nv)."""
        qpos, qvel = self.ball.joints(states)
        orientation = states.ring_orientation[-1]
        spin = rot_vec_quat(neg_quat(orientation), states.ring_angular_velocity[-1])
        whole = np.concatenate([qpos, orientation], axis=-1)
        return whole, np.concatenate([qvel, spin], axis=-1)

    def states(self, time: Array, qpos: Array, qvel: Array, sums: Array) -> MotorStates:
        """Compute the states from joint coordinates and sums, shape (replicas, T, n)."""
        qpos, qvel, sums = (np.swapaxes(rows, 0, 1) for rows in (qpos, qvel, sums))
        orientation = qpos[..., -4:]
        ball_heat, ring_heat, ball_work, ring_work = np.moveaxis(sums, -1, 0)
        return MotorStates(
            time=time,
            **self.ball.vectors(qpos[..., :-4], qvel[..., :-3]),
            ring_angular_velocity=rot_vec_quat(orientation, qvel[..., -3:]),
            ring_orientation=orientation,
            ball_heat=ball_heat,
            ring_heat=ring_heat,
            ball_work=ball_work,
            ring_work=ring_work,
        )


class MotorAdapter:
    """See `magmotor.device.MujocoAdapter`; the sums are heat of ball and ring, then work."""

    control = int(mujoco.mjtState.mjSTATE_USERDATA)
    driven = True

    def __init__(self, job: Job):
        self.job = job
        self.coordinates = MotorCoordinates(job.scene)
        first = job.initial
        sums = [first.ball_heat[-1], first.ring_heat[-1], first.ball_work[-1], first.ring_work[-1]]
        self.start = np.hstack([*self.coordinates.joints(first), np.stack(sums, axis=-1)])
        self.userdata = userdata(job.path, job.first_step, len(self.start))

    def controls(self, steps: NDArray[np.int64]) -> Array:
        """Return the user data of the Brownian wrenches, the same in each step."""
        return self.userdata[:, np.newaxis]

    def sums(self, before: Array, paths: Array, first: int) -> Array:
        """Return heat and work after each step."""
        return heat_and_work_sums(self.job, self.coordinates.ball.linear, before, paths, first)

    def states(self, time: Array, qpos: Array, qvel: Array, sums: Array) -> MotorStates:
        """Compute the states from joint coordinates and sums, shape (replicas, T, n)."""
        return self.coordinates.states(time, qpos, qvel, sums)


def compose_motor(scene: Motor, *, visual: bool) -> model_parts.Element:
    """Compose the motor as one PyMJCF tree, decorated if `visual`.

    Raises
    ------
    ValueError
        The motor has a load, for which MuJoCo has no force.
    """
    if scene.load_torque:
        sentence = "must be zero in MuJoCo, which has no force around an axis; use another engine"
        raise ArgumentError("load_torque", scene.load_torque, sentence)
    root = model_parts.load("motor", visual=visual)
    if visual:
        decorate(root, scene)
    add_ball(root, scene, 3 * [scene.ball_inertia])
    _place_rings(root, scene)
    _couple(root, scene.ball_ring_factor)
    _drive(root, scene)
    mark(root, scene, "dipoles couplings noise")
    if not visual:
        damped = scene.friction_ring or scene.drag or scene.rotational_drag
        model_parts.disable_unused(root, keep=("damper",) * bool(damped))
        tune_solver(root, scene.surface, scene.friction_ball)
    qpos, qvel = MotorCoordinates(scene).joints(start_motor(scene))
    start_ball(root, scene, qpos[0])
    root.keyframe.add("key", name="start", qpos=qpos[0], qvel=qvel[0])
    add_contacts(root, scene, scene.friction_ball)
    return root


def _place_rings(root: model_parts.Element, scene: Motor) -> None:
    inner, outer = (root.find("body", name) for name in ("inner_ring", "outer_ring"))
    inner.pos = [0.0, 0.0, scene.inner_height]
    outer.pos = [0.0, 0.0, scene.outer_height]
    inner.add("inertial", pos=[0, 0, 0], mass=scene.inner_mass, diaginertia=scene.inner_moments)
    root.find("joint", "inner_ring").damping = scene.friction_ring or None
    model_parts.add_dipoles(inner, scene.moment, *scene.inner_dipole_frame())
    model_parts.add_dipoles(
        outer, scene.moment, *ring_dipoles(scene.outer_dipoles, scene.outer_radius)
    )


def _couple(root: model_parts.Element, factor: float) -> None:
    """Multiply the forces between ball and inner ring by `factor`."""
    if factor != 1:
        pair = root.custom.add("tuple", name="coupling_ball_inner_ring")
        for body in ("ball", "inner_ring"):
            pair.add("element", objtype="body", objname=body, prm=factor)


def _drive(root: model_parts.Element, scene: Motor) -> None:
    """Write the noise to the user data that the compiled callback reads.

    The noise of the ball acts at its contact point, so that it includes the torque -r e_z x force.
    """
    force, torque = np.eye(2, 3), np.eye(3)
    slip = np.hstack([force, np.cross([0.0, 0.0, -scene.ball_radius], force)])
    rotation = np.hstack([np.zeros((3, 3)), torque])
    strengths = zip((scene.alpha_ball, *scene.drag_noises), (
        slip, np.hstack([force, 0 * force]), rotation), strict=True)  # fmt: skip
    rows = [alpha * row.ravel() for alpha, row in strengths if alpha]
    if rows:
        root.find("body", "ball").user = np.concatenate(rows)
    if scene.alpha_ring:
        root.find("body", "inner_ring").user = scene.alpha_ring * rotation.ravel()
