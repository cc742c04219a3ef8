"""Steps of SciPy's DOP853, which end at recorded times."""

from collections.abc import Generator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853

from magmotor.engines.job import Job
from magmotor.engines.scipy import ball, disk
from magmotor.scenes import Disk, Top
from magmotor.states import CHUNK

EQUATIONS = {Top: ball, Disk: disk}

RELATIVE_TOLERANCE = 1e-12
"""Of each step's error; the absolute tolerance is as much of each variable's natural scale."""


def run(job: Job) -> Generator[Any]:
    """Yield the recorded states that follow the initial one, in chunks.

    The steps are the integrator's own, but for those that end at a recorded time, where an
    interpolated state would be less accurate; the job's timestep says when to record.
    """
    times = job.timestep * job.record_interval * np.arange(1, job.records + 1)
    equation = EQUATIONS[type(job.scene)]
    derivative, state, scales = equation.problem(job.scene, job.initial)
    tolerance = RELATIVE_TOLERANCE * scales
    solver = DOP853(derivative, 0.0, state, np.inf, rtol=RELATIVE_TOLERANCE, atol=tolerance)
    for first in range(0, job.records, CHUNK):
        time = times[first : first + CHUNK]
        yield equation.states(job.scene, time, np.array([_advance(solver, t) for t in time]))


def _advance(solver: DOP853, time: float) -> NDArray[np.float64]:
    solver.t_bound, solver.status = time, "running"
    while solver.status == "running":
        failure = solver.step()
        if failure:
            raise ArithmeticError(f"dop853 stopped at t = {solver.t:g} s: {failure}")
    return solver.y.copy()
