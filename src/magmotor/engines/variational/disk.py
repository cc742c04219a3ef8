"""Runs of the disk and the Langevin particle by the compiled kernel, recorded as they go."""

from collections.abc import Generator

import numpy as np
from numpy.typing import NDArray

from magmotor.eights import COUNT
from magmotor.engines.job import Job
from magmotor.engines.variational.lanes import TURN, kernel, law
from magmotor.states.disk import DiskStates


def run(job: Job) -> Generator[tuple[DiskStates, NDArray[np.float64]]]:
    """Yield the recorded states that follow the initial one, in chunks; see `Job`."""
    scene, path = job.scene, job.path
    advance, rule = kernel(scene, job.scheme), law(scene, job.scheme, job.timestep)
    lanes = pack(job.initial) if job.state is None else job.state.copy()
    replicas = job.initial.x.shape[1]
    for step, times in job.chunks(replicas):
        recorded = np.empty((len(times), *lanes.shape))
        for first, interval in job.pieces(step, len(times), replicas):
            advance(lanes, recorded, first, interval, path.seed, 0, path.factor, path.level, rule)
        yield unpack(times, recorded[..., :replicas], job.initial.theta is not None), lanes.copy()


def pack(states: DiskStates) -> NDArray[np.float64]:
    """The last of the states as the kernel takes it: padded, and x in turns."""
    replicas = states.x.shape[1]
    lanes = np.zeros((4, -(-replicas // COUNT) * COUNT))
    lanes[0, :replicas], lanes[2, :replicas] = states.x[-1] / TURN, states.v[-1]
    if states.theta is not None and states.omega is not None:
        lanes[1, :replicas], lanes[3, :replicas] = states.theta[-1], states.omega[-1]
    return lanes


def unpack(time: NDArray, states: NDArray[np.float64], turns: bool) -> DiskStates:
    """Recorded states from the kernel's, shape (T, 4, replicas)."""
    x, theta, v, omega = states.transpose(1, 0, 2)
    return DiskStates(time, TURN * x, v, theta if turns else None, omega if turns else None)
