"""The MJCF model of the sliding disk, with a scene's parameters.

The disk slides along x and rotates about -y, so that its lowest point moves with v + omega. The
friction of a planar disk is the damping of fixed tendons: the length of tendon j changes at the
rate w_j . u. On the plane, it is that of a viscous contact, of a sphere with the disk's radius.
Background drag is the damping of the joints.
"""

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.device.job import Job
from magmotor.devices.disk.scene import Disk
from magmotor.devices.disk.states import DiskStates, start_disk
from magmotor.mjcf import model_parts
from magmotor.mjcf.forces.brownian_wrenches import userdata
from magmotor.mjcf.model_parts import fit_stage
from magmotor.mjcf.viscous_contact import ViscousContact


def joints(states: DiskStates) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return `qpos` and `qvel` of the last row, each of shape (replicas, 2)."""
    assert states.theta is not None, "a disk rotates"
    assert states.omega is not None, "a disk rotates"
    qpos = np.stack([states.x[-1], states.theta[-1]], axis=-1)
    return qpos, np.stack([states.v[-1], states.omega[-1]], axis=-1)


def disk_states(
    time: NDArray[np.float64], qpos: NDArray[np.float64], qvel: NDArray[np.float64]
) -> DiskStates:
    """Return the disk's states from joint coordinates, shape (replicas, T, 2)."""
    (x, theta), (v, omega) = qpos.T, qvel.T
    return DiskStates(time, x, v, theta, omega)


class DiskAdapter:
    """See `magmotor.device.MujocoAdapter`."""

    control = int(mujoco.mjtState.mjSTATE_USERDATA)

    def __init__(self, job: Job):
        self.driven = job.scene.noise > 0 or len(job.scene.coefficients) > 0
        self.start = np.hstack(joints(job.initial))
        self.userdata = userdata(job.path, job.first_step, len(self.start))

    def controls(self, steps: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the user data that the Brownian forces read, the same in each step."""
        return self.userdata[:, np.newaxis]

    def sums(self, before, paths, first) -> NDArray[np.float64]:
        """Return no sums."""
        return paths[..., :0]

    def states(self, time, qpos, qvel, sums) -> DiskStates:
        """Return the disk's states from joint coordinates, shape (replicas, T, 2)."""
        return disk_states(time, qpos, qvel)


TENDONS = ("slip", "across")


def compose_disk(scene: Disk, *, visual: bool) -> model_parts.Element:
    """Return the disk as a PyMJCF tree, with decoration if `visual`."""
    root = model_parts.load("disk", visual=visual)
    root.option.gravity = [0, 0, 0]
    if visual:
        _fit_floor(root)
    _set_inertia(root.find("body", "disk"), scene)
    _add_noise_and_potential(root, scene)
    model_parts.mark(root, "noise potentials")
    _add_friction(root, scene)
    if not visual:
        damped = root.tendon.fixed or any(scene.drags)
        model_parts.disable_unused(root, keep=("damper",) if damped else ())
        if root.find("contact", "viscous") is None:
            root.option.flag.set_attributes(constraint="disable", contact="disable")
        else:
            model_parts.solve_in_one_step(root)
    qpos, qvel = joints(start_disk(scene))
    root.keyframe.add("key", name="start", qpos=qpos[0], qvel=qvel[0])
    return root


def _fit_floor(root: model_parts.Element) -> None:
    """Fit the stage, with an infinite floor, since the disk travels far."""
    fit_stage(root, [0, 0, 1], 3.0)
    root.find("geom", "floor").size = [0, 0, 0.5]
    root.find("material", "grid").texrepeat = [2, 2]


def _set_inertia(body: model_parts.Element, scene: Disk) -> None:
    mass, inertia = scene.masses
    across = inertia / 2  # as for a thin disk; it has no effect
    body.add("inertial", pos=[0, 0, 0], mass=mass, diaginertia=[across, inertia, across])


def _add_noise_and_potential(root: model_parts.Element, scene: Disk) -> None:
    """Write noise and potential to the user fields that the compiled callback reads."""
    if scene.noise > 0:
        rows = [(force, 0, 0, 0, -torque, 0) for force, torque in scene.noise_matrix.T]
        root.find("body", "disk").user = np.ravel(rows)
    if scene.coefficients:
        root.find("joint", "x").user = np.ravel(scene.coefficients)


def _add_friction(root: model_parts.Element, scene: Disk) -> None:
    for name, drag in zip(("x", "theta"), scene.drags, strict=True):
        if drag:
            root.find("joint", name).damping = drag
    planar = scene.surface == "planar"
    directions = scene.slip_directions if planar and scene.friction > 0 else []
    for name, wrench in zip(TENDONS, directions, strict=False):
        tendon = root.find("tendon", name)
        tendon.damping = scene.friction
        for joint, coefficient in zip(tendon.joint, wrench, strict=True):
            joint.coef = coefficient
    for name in TENDONS[len(directions) :]:
        root.find("tendon", name).remove()
    if planar:
        root.find("geom", "rim").remove()
    elif scene.friction > 0:
        viscous = ViscousContact(scene.friction, "rim", "floor", bears_load=False)
        viscous.add_to(root)
        viscous.complete(root)
