"""Steps of SciPy's DOP853, which end at recorded times."""

from collections.abc import Generator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853

from magmotor.device.job import Job

Array = NDArray[np.float64]

RELATIVE_TOLERANCE = 1e-12
"""Of each step's error; the absolute tolerance is as much of each variable's natural scale."""


def start(job: Job) -> Array:
    """The state that a run begins with; see `Job`."""
    return job.scene.device.ode.problem(job.scene, job.initial)[1]


def run(job: Job) -> Generator[tuple[Any, Array]]:
    """Yield the recorded states that follow the initial one, in chunks; see `Job`.

    The steps are the integrator's own, but for those that end at a recorded time, where an
    interpolated state would be less accurate; the job's timestep says when to record.
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
