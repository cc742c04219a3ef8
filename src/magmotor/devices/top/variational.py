"""Variational integration of Hamel's top, without noise and with the ring at rest."""

from collections.abc import Generator

import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.device.job import Job
from magmotor.devices.ball.rigid_forces import Bodies, Magnets, floats
from magmotor.devices.ball.rigid_kernel import SIZE, on_plane, recorded_chunks
from magmotor.devices.ball.states import axes
from magmotor.devices.top.scene import Top
from magmotor.devices.top.states import BallStates
from magmotor.dipoles import pack_sources


def start(job: Job) -> NDArray[np.float64]:
    """Return the engine's initial state; see `Job`."""
    return pack(job.initial)


def run(job: Job) -> Generator[tuple[BallStates, Array]]:
    """Yield the recorded states that follow the initial one, in chunks; see `Job`."""
    scene = job.scene
    for times, records, last in recorded_chunks(
        job, bodies(scene), magnets(scene), pack(job.initial)
    ):
        yield unpack(times, records[:, 0], scene.ball_radius), last


def bodies(scene: Top) -> Bodies:
    """Masses and friction; the ring is not driven."""
    found = Bodies(
        mass=scene.ball_mass,
        radius=scene.ball_radius,
        inertia=scene.inertia[0],
        across=1.0,
        axial=1.0,
        slip_friction=scene.friction,
        slip_noise=0.0,
        torsion=scene.torsional_damping,
        ring_friction=0.0,
        ring_noise=0.0,
        downhill=scene.downhill_force,
        drag=scene.drag,
        rotational_drag=scene.rotational_drag,
        drag_noise=0.0,
        rotational_drag_noise=0.0,
    )
    return floats(found)


def magnets(scene: Top) -> Magnets:
    """Dipoles of the ball and of the ring, which does not rotate."""
    empty = np.zeros((0, 3))
    found = Magnets(
        moment=scene.moment,
        fixed=pack_sources(*scene.ring_sources()),
        frame=pack_sources(empty, empty),
        height=0.0,
        factor=0.0,
        background=scene.background_field,
    )
    return floats(found)


def pack(states: BallStates) -> Array:
    """Pack the last state for the kernel."""
    assert states.orientation is not None, "initial states always have orientations"
    packed = np.zeros((1, SIZE))
    packed[0, 0:2], packed[0, 2:4] = states.position[-1, :2], states.velocity[-1, :2]
    packed[0, 4:8], packed[0, 8:11] = states.orientation[-1], states.angular_velocity[-1]
    packed[0, 11] = 1.0
    return packed


def unpack(time: Array, records: Array, radius: float) -> BallStates:
    """Convert the kernel's records to states."""
    return BallStates(
        time=time,
        position=on_plane(records[:, 0:2], radius),
        velocity=on_plane(records[:, 2:4], 0.0),
        axis=axes(records[:, 4:8]),
        angular_velocity=records[:, 8:11],
        orientation=records[:, 4:8],
    )
