"""Hamel's top as MJCF: ball, ring and stage with the parameters of a scene."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.device.job import Job
from magmotor.devices.ball.contacts import add_contacts, tune_solver
from magmotor.devices.ball.coordinates import BallCoordinates
from magmotor.devices.ball.mjcf import add_ball, draw_ring, mark, size_arrows, start_ball
from magmotor.devices.ball.states import axes
from magmotor.devices.top.scene import Top
from magmotor.devices.top.states import BallStates, start
from magmotor.mjcf import model_parts
from magmotor.mjcf.model_parts import fit_stage


def decorate(root: model_parts.Element, scene: Top) -> None:
    """Draw the ring and fit lights and cameras to a scene."""
    size_arrows(root, scene.ring_radius * min(1.0, 20 / scene.ring_dipoles))
    draw_ring(root, "ring", *scene.ring_dipole_frame())
    highest = max([waypoint.height for waypoint in scene.ring_script] or [scene.ring_height])
    radius = np.hypot(1.15 * scene.ring_radius, 0.5 * highest)
    fit_stage(root, [0.0, 0.0, highest / 2], radius)


def placed_ring(scene: Top, time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return position (3,) in m and orientation (4,) of the ring's mocap body at a time (s)."""
    return np.array([0.0, 0.0, scene.ring_pose(time)[0]]), scene.ring_orientation(time)


class BallAdapter:
    """See `magmotor.device.MujocoAdapter`.

    Within a step, a scripted ring rests in its pose at the middle of the step, which is an error of
    second order.
    """

    control = int(mujoco.mjtState.mjSTATE_MOCAP_POS) | int(mujoco.mjtState.mjSTATE_MOCAP_QUAT)
    driven = True

    def __init__(self, job: Job):
        self.scene, self.timestep = job.scene, job.timestep
        self.coordinates = BallCoordinates(job.scene.surface, job.scene.ball_radius)
        self.start = np.concatenate(self.coordinates.joints(job.initial))[np.newaxis]

    def controls(self, steps: NDArray[np.int64]) -> NDArray[np.float64] | None:
        """Return the pose of a scripted ring in each step, or None if the ring has no script."""
        if not self.scene.ring_script:
            return None
        times = (steps + 0.5) * self.timestep
        return np.array([[np.concatenate(placed_ring(self.scene, time)) for time in times]])

    def sums(self, before, paths, first) -> NDArray[np.float64]:
        """Return no sums."""
        return paths[..., :0]

    def states(self, time, qpos, qvel, sums) -> BallStates:
        """Compute the states of the ball from joint coordinates, shape (1, T, n)."""
        vectors = self.coordinates.vectors(qpos[0], qvel[0])
        return BallStates(time=time, axis=axes(vectors["orientation"]), **vectors)


def compose_top(scene: Top, *, visual: bool) -> model_parts.Element:
    """Compose the top as one PyMJCF tree, decorated if `visual`."""
    root = model_parts.load("top", visual=visual)
    if visual:
        decorate(root, scene)
    add_ball(root, scene, scene.inertia)
    if scene.is_unbalanced:
        inertial = root.find("body", "ball").inertial
        inertial.pos, inertial.diaginertia = scene.center_of_mass, None
        inertial.fullinertia = [*scene.inertia, *scene.products_of_inertia]
    mark(root, scene, "dipoles")
    _add_torsion(root, scene.torsional_damping)
    _place_ring(root.find("body", "ring"), scene)
    if not visual:
        model_parts.disable_unused(
            root, keep=("damper",) * bool(scene.drag or scene.rotational_drag)
        )
        tune_solver(root, scene.surface, scene.friction)
    coordinates = BallCoordinates(scene.surface, scene.ball_radius)
    qpos, qvel = coordinates.joints(start(scene))
    start_ball(root, scene, qpos)
    root.keyframe.add("key", name="start", qpos=qpos, qvel=qvel)
    add_contacts(root, scene, scene.friction, scene.dry_friction)
    return root


def _add_torsion(root: model_parts.Element, damping: float) -> None:
    """Add a torque about the vertical, in proportion to the angular velocity about it."""
    if damping:
        root.worldbody.add("site", name="floor", dclass="dipole", user=[0.0])
        root.actuator.add(
            "general", name="torsion", site="ball", refsite="floor", gear=[0, 0, 0, 0, 0, 1],
            gainprm=[0.0], biastype="affine", biasprm=[0.0, 0.0, -damping],
        )  # fmt: skip


def _place_ring(body: model_parts.Element, scene: Top) -> None:
    body.pos, body.quat = placed_ring(scene, 0.0)
    model_parts.add_dipoles(body, scene.moment, *scene.ring_dipole_frame())
