"""Runs of the disk and the Langevin particle by the compiled kernel, recorded as they go."""

from collections.abc import Generator

import numpy as np
from numpy.typing import NDArray

from magmotor.engines.job import Job
from magmotor.engines.variational.lanes import PADDING, TURN, kernel, law
from magmotor.states import CHUNK
from magmotor.states.disk import DiskStates


def run(job: Job) -> Generator[DiskStates]:
    """Yield the recorded states that follow the initial one, in chunks."""
    scene, interval, path = job.scene, job.record_interval, job.path
    advance, rule = kernel(scene, job.scheme), law(scene, job.scheme, job.timestep)
    lanes = pack(job.initial)
    replicas = job.initial.x.shape[1]
    rows = max(1, CHUNK // replicas)
    for done in range(0, job.records, rows):
        recorded = np.empty((min(rows, job.records - done), *lanes.shape))
        first = job.first_step + done * interval
        advance(lanes, recorded, first, interval, path.seed, 0, path.factor, path.level, rule)
        steps = interval * (done + 1 + np.arange(len(recorded)))
        yield unpack(steps * job.timestep, recorded[..., :replicas], job.initial.theta is not None)


def pack(states: DiskStates) -> NDArray[np.float64]:
    """The last of the states as the kernel takes it: padded, and x in turns."""
    replicas = states.x.shape[1]
    lanes = np.zeros((4, -(-replicas // PADDING) * PADDING))
    lanes[0, :replicas], lanes[2, :replicas] = states.x[-1] / TURN, states.v[-1]
    if states.theta is not None and states.omega is not None:
        lanes[1, :replicas], lanes[3, :replicas] = states.theta[-1], states.omega[-1]
    return lanes


def unpack(time: NDArray, states: NDArray[np.float64], turns: bool) -> DiskStates:
    """Recorded states from the kernel's, shape (T, 4, replicas)."""
    x, theta, v, omega = states.transpose(1, 0, 2)
    return DiskStates(time, TURN * x, v, theta if turns else None, omega if turns else None)
