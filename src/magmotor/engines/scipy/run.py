"""Steps of DOP853, which end at recorded times."""

from collections.abc import Generator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magmotor.engines.job import Job
from magmotor.engines.scipy import ball, disk, motor
from magmotor.engines.scipy.dop853 import Integrator
from magmotor.scenes import Disk, Motor, Top

Array = NDArray[np.float64]

EQUATIONS = {Top: ball, Motor: motor, Disk: disk}

RELATIVE_TOLERANCE = 1e-12
"""Of each step's error; the absolute tolerance is as much of each variable's natural scale."""

FIRST_STEP = 1e-3
"""Part of the time between records that the first step takes; the error decides on the others."""


def start(job: Job) -> Array:
    """The state that a run begins with; see `Job`."""
    return EQUATIONS[type(job.scene)].problem(job.scene, job.initial)[1]


def run(job: Job) -> Generator[tuple[Any, Array]]:
    """Yield the recorded states that follow the initial one, in chunks; see `Job`.

    The steps are the integrator's own, but for those that end at a recorded time, where an
    interpolated state would be less accurate; the job's timestep says when to record.
    """
    equation = EQUATIONS[type(job.scene)]
    derivative, state, scales = equation.problem(job.scene, job.initial)
    state = state if job.state is None else job.state
    tolerance = RELATIVE_TOLERANCE * scales
    for first, times in job.chunks(1):
        begin = first * job.timestep
        first_step = FIRST_STEP * job.timestep * job.record_interval
        solver = Integrator(
            derivative, begin, state, first_step, relative=RELATIVE_TOLERANCE, absolute=tolerance
        )
        rows = np.array([solver.advance(time) for time in times])
        state = rows[-1]
        yield equation.states(job.scene, times, rows), state
