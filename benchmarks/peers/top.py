"""The top's fourth case with other software: the cost of an error of J of at most 1 %.

The error is the largest over 60 s, relative to the largest |J|. Steps and tolerances are the
coarsest of a list that reach it; for another model they are stated.
"""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

import mujoco
import numpy as np
from scipy.integrate import solve_ivp

import magmotor as mm
from benchmarks.detail.flight import (
    DEFAULT_TIMESTEP,
    DURATION,
    EULER,
    INTERVAL,
    RK4,
    fly,
    momentum_error,
    plain_top,
)
from benchmarks.harness.records import Case, Record
from benchmarks.harness.tables import number, seconds, table
from benchmarks.harness.timing import seconds_of
from benchmarks.peers import top_numpy, wrench
from magmotor.common import style
from magmotor.devices.top import ode as ball
from magmotor.devices.top.device import TOP
from trials.numpy_twin import apply_magnetism

SCENE = mm.Top.paper(4)
LARGEST_ERROR = 0.01
TIMESTEPS = (0.1, 0.05, 0.025, 0.02, 0.0125, 0.01, 0.005, 0.0025)
"""They divide the record interval."""

TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
REPEATS = 3
LONG = 25_000.0
"""Seconds that the reference simulates, long enough to make set-up negligible."""

Result = tuple[float, float]
"""Error of J, and wall time per simulated second."""


def _in_mujoco(
    timestep: float,
    integrator: mujoco.mjtIntegrator,
    apply: wrench.Callback | None = None,
    model_of: Callable[[mm.Top], mujoco.MjModel] = mm.build,
) -> Result:
    """Run with our compiled callback, or a Python function."""
    model = model_of(SCENE)
    with mm.magnetism() if apply is None else _installed(apply):
        flights = [fly(model, SCENE, timestep, integrator) for _ in range(REPEATS)]
    return momentum_error(flights[0].momentum, SCENE), min(flight.seconds for flight in flights)


@contextmanager
def _installed(callback: wrench.Callback) -> Iterator[None]:
    mujoco.set_mjcb_control(callback)
    try:
        yield
    finally:
        mujoco.set_mjcb_control(None)


def _in_reference(timestep: float, method: str) -> Result:
    numerics = {"method": method, "timestep": timestep, "allow_unstable": True}
    run = mm.simulate(SCENE, duration=DURATION, **numerics)
    momentum = run.momentum_map.values[:: round(INTERVAL / timestep)][1:]
    steps = round(LONG / timestep)
    simulate = partial(mm.simulate, SCENE, duration=LONG, **numerics)
    return momentum_error(momentum, SCENE), _least(partial(simulate, record_interval=steps)) / LONG


def _in_scipy(tolerance: float, method: str, compiled: bool) -> Result:
    derivative, start, scales = ball.problem(SCENE, TOP.initial_state(SCENE, None, None))
    if not compiled:
        derivative, start = top_numpy.problem(SCENE)
    times = INTERVAL * np.arange(1, round(DURATION / INTERVAL) + 1)
    solve = partial(
        solve_ivp, derivative, (0, DURATION + INTERVAL), start, method=method, t_eval=times,
        rtol=tolerance, atol=tolerance * scales,
    )  # fmt: skip
    solution = solve()
    if not solution.success:
        return math.inf, math.inf
    momentum = np.sum(solution.y[4:7] * solution.y[7:], axis=0)
    error = momentum_error(momentum, SCENE)
    return error, _least(solve) / DURATION if error <= LARGEST_ERROR else math.inf


def _least(run: Callable[[], object]) -> float:
    """Return the minimum wall time of a run, in seconds."""
    return min(seconds_of(run) for _ in range(REPEATS))


CHOSEN: dict[str, Callable[[float], Result]] = {
    "variational/euler": partial(_in_reference, method="variational/euler"),
    "variational/verlet": partial(_in_reference, method="variational/verlet"),
    "variational/baoab": partial(_in_reference, method="variational/baoab"),
    "mujoco/euler": partial(_in_mujoco, integrator=EULER),
    "mujoco/rk4": partial(_in_mujoco, integrator=RK4),
    "mujoco/rk4, callback in NumPy": partial(_in_mujoco, integrator=RK4, apply=apply_magnetism),
    "mujoco/rk4, callback by magpylib": partial(
        _in_mujoco, integrator=RK4, apply=wrench.by_magpylib(SCENE)
    ),
    **{
        f"SciPy {method}, {kind}": partial(_in_scipy, method=method, compiled=compiled)
        for kind, compiled in (("compiled equation", True), ("equation in NumPy", False))
        for method in ("DOP853", "RK45", "LSODA")
    },
}
"""Variants with a timestep or tolerance to choose."""

STATED = {
    "mujoco/euler at MuJoCo's default step": partial(_in_mujoco, integrator=EULER),
    "MuJoCo's defaults, our callback": partial(_in_mujoco, integrator=EULER, model_of=plain_top),
}


def cases(quick: bool) -> list[Case]:
    """Return the cases, the same with and without --quick."""
    return [Case(f"peers/top/{name}", partial(_measure, name), 2) for name in (*CHOSEN, *STATED)]


def _measure(name: str) -> Record:
    if name in STATED:
        error, wall = STATED[name](DEFAULT_TIMESTEP)
        return {"error": error, "seconds": wall, "setting": f"{DEFAULT_TIMESTEP:g} s"}
    in_scipy = name.startswith("SciPy")
    for choice in TOLERANCES if in_scipy else TIMESTEPS:
        try:
            error, wall = CHOSEN[name](choice)
        except (ArithmeticError, mm.SimulationStopped):
            continue
        if error <= LARGEST_ERROR:
            setting = f"rtol {choice:g}" if in_scipy else f"{choice:g} s"
            return {"error": error, "seconds": wall, "setting": setting}
    return {"failed": f"no error of {LARGEST_ERROR:g}"}


def tabulate(records: dict[str, Record]) -> str:
    columns = [
        "the top",
        "step or tolerance",
        "error of J",
        "a simulated second",
        "over mujoco/rk4",
    ]
    least = records["peers/top/mujoco/rk4"]["seconds"]
    rows = []
    for name in (*CHOSEN, *STATED):
        found = records[f"peers/top/{name}"]
        if "failed" in found:
            rows.append([name, found["failed"], "", "", ""])
            continue
        wall = found["seconds"]
        rows.append(
            [name, found["setting"], number(found["error"]), seconds(wall), number(wall / least)]
        )
    return table(columns, rows)


def bars(records: dict[str, Record]) -> list[tuple[str, float | None, str, str]]:
    """Return the name, length, text and color of each bar."""
    found = []
    for name in (*CHOSEN, *STATED):
        record = records[f"peers/top/{name}"]
        own = name.startswith(("variational", "mujoco")) and "callback" not in name
        color = style.BLUE if own else style.GRAY
        if record.get("error", 0.0) > LARGEST_ERROR:
            color = style.ORANGE
        if "failed" in record:
            found.append((name, None, record["failed"], color))
            continue
        text = f"{seconds(record['seconds'])}, {number(100 * record['error'])} %"
        found.append((f"{name} ({record['setting']})", record["seconds"], text, color))
    return found
