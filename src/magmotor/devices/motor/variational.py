"""Variational integration of the motor."""

from collections.abc import Generator

import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.device.job import Job
from magmotor.devices.ball.rigid_forces import Bodies, Magnets, floats
from magmotor.devices.ball.rigid_kernel import on_plane, recorded_chunks
from magmotor.devices.motor.scene import Motor
from magmotor.devices.motor.states import MotorStates
from magmotor.dipoles import pack_sources


def start(job: Job) -> NDArray[np.float64]:
    """Return the engine's initial state; see `Job`."""
    return pack(job.initial)


def run(job: Job) -> Generator[tuple[MotorStates, Array]]:
    """Yield the recorded states that follow the initial one, in chunks; see `Job`."""
    scene = job.scene
    for times, records, last in recorded_chunks(
        job, bodies(scene), magnets(scene), pack(job.initial)
    ):
        yield unpack(times, records, scene.ball_radius), last


def bodies(scene: Motor) -> Bodies:
    """Masses, friction and noise."""
    across, _, axial = scene.inner_moments
    found = Bodies(
        mass=scene.ball_mass,
        radius=scene.ball_radius,
        inertia=scene.ball_inertia,
        across=across,
        axial=axial,
        slip_friction=scene.frictions[0],
        slip_noise=scene.noises[0],
        torsion=0.0,
        ring_friction=scene.frictions[-1],
        ring_noise=scene.noises[-1],
        downhill=scene.downhill_force,
        drag=scene.drag,
        rotational_drag=scene.rotational_drag,
        drag_noise=scene.drag_noises[0],
        rotational_drag_noise=scene.drag_noises[1],
        load_torque=scene.load_torque,
    )
    return floats(found)


def magnets(scene: Motor) -> Magnets:
    """Dipoles of the ball, of the outer ring and of the inner ring."""
    positions, outward = scene.inner_dipole_frame()
    found = Magnets(
        moment=scene.moment,
        fixed=pack_sources(*scene.outer_sources()),
        frame=pack_sources(positions, scene.moment * outward),
        height=scene.inner_height,
        factor=scene.ball_ring_factor,
        background=scene.background_field,
    )
    return floats(found)


def pack(states: MotorStates) -> Array:
    """Pack the last state for the kernel."""
    last = MotorStates(*[column[-1] for column in states])
    sums = [column[:, np.newaxis] for column in last[-4:]]
    motion = [
        last.position[:, :2],
        last.velocity[:, :2],
        last.orientation,
        last.angular_velocity,
        last.ring_orientation,
        last.ring_angular_velocity,
    ]
    return np.hstack([*motion, *sums])


def unpack(time: Array, records: Array, radius: float) -> MotorStates:
    """Convert the kernel's records to states."""
    return MotorStates(
        time=time,
        position=on_plane(records[..., 0:2], radius),
        velocity=on_plane(records[..., 2:4], 0.0),
        orientation=records[..., 4:8],
        angular_velocity=records[..., 8:11],
        ring_orientation=records[..., 11:15],
        ring_angular_velocity=records[..., 15:18],
        ball_heat=records[..., 18],
        ring_heat=records[..., 19],
        ball_work=records[..., 20],
        ring_work=records[..., 21],
    )
