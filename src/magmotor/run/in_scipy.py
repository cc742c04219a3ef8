"""Runs by SciPy's DOP853, whose steps end at the recorded times."""

from collections.abc import Generator
from typing import Any

import numpy as np
from scipy.integrate import DOP853

from magmotor.common.arrays import Array
from magmotor.device.job import Job

RELATIVE_TOLERANCE = 1e-12
"""Relative tolerance of a step; the absolute one is this fraction of a variable's natural scale."""


def start(job: Job) -> Array:
    """Return the initial state of a run; see `Job`."""
    return job.scene.device.ode.problem(job.scene, job.initial)[1]


def run(job: Job) -> Generator[tuple[Any, Array]]:
    """Yield the recorded states after the initial one, in chunks; see `Job`.

    The integrator chooses its own steps, except that one ends at each recorded time, since an
    interpolated state would be less accurate. The job's timestep only sets when to record.
    """
    equation = job.scene.device.ode
    derivative, state, scales = equation.problem(job.scene, job.initial)
    state = state if job.state is None else job.state
    tolerance = RELATIVE_TOLERANCE * scales
    for first, times in job.chunks(1):
        begin = first * job.timestep
        solver = DOP853(derivative, begin, state, np.inf, rtol=RELATIVE_TOLERANCE, atol=tolerance)
        rows = np.array([_advance(solver, time) for time in times])
        state = rows[-1]
        yield equation.states(job.scene, times, rows), state


def _advance(solver: DOP853, time: float) -> Array:
    solver.t_bound, solver.status = time, "running"
    while solver.status == "running":
        failure = solver.step()
        if failure:
            raise ArithmeticError(f"dop853 stopped at t = {solver.t:g} s: {failure}")
    return solver.y.copy()
