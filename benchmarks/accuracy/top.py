"""Errors of the top, which has no noise: against SciPy's DOP853 with the paper's equations."""

import time
from functools import cache, partial
from unittest.mock import patch

import numpy as np
import xarray as xr

import magmotor as mm
from benchmarks.accuracy.scenes import SCENES, record_of, stepping_methods
from benchmarks.harness.records import Case, Record
from magmotor.advice.measured_quantities import relative
from magmotor.run import in_scipy as dop853

QUICK_NUMBERS = sorted({2**k for k in range(8)} | {500})
NUMBERS = sorted({*QUICK_NUMBERS, 256, 512} | {round(2 ** (k / 3)) for k in range(17)})
"""Numbers of steps per second, so that all runs have the same records; 500 is MuJoCo's default."""

TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10, 1e-12)
TRUTH = 1e-13

QUANTITIES = {
    "top": ("position", "momentum_map", "momentum_map_20"),
    "free top": ("position", "momentum_map", "energy"),
    "top on a plane": ("position", "momentum_map", "momentum_map_20"),
}
DURATIONS = {"top": 60, "free top": 500, "top on a plane": 60}
COMPARED_AT = 20
"""Time at which positions are compared, in s: within the free top's Lyapunov time of 20 to 40 s."""


def cases(quick: bool) -> list[Case]:
    """Return a case for each scene, method and step or tolerance."""
    numbers = QUICK_NUMBERS if quick else NUMBERS
    stepping = [
        Case(f"error/{name}/{method}/{number}", partial(_step, name, method, number), cost)
        for name in DURATIONS
        for method in stepping_methods(name)
        for number in numbers
        for cost in [0.05 + DURATIONS[name] * number * (6e-6 if "rk4" in method else 1e-6)]
    ]
    adaptive = [
        Case(f"error/top/scipy/dop853/{tolerance:g}", partial(_adapt, "top", tolerance), 0.1)
        for tolerance in TOLERANCES
    ]
    return stepping + adaptive


def _step(name: str, method: str, number: int) -> Record:
    def errors() -> dict[str, list[float]]:
        return _errors(name, _run(name, method, number))

    return record_of(name, method, 1 / number, QUANTITIES[name], errors)


def _run(name: str, method: str, number: int) -> xr.Dataset:
    return mm.simulate(
        SCENES[name].scene, method=method, timestep=1 / number, duration=DURATIONS[name],
        record_interval=number, allow_unstable=True,
    )  # fmt: skip


def _adapt(name: str, tolerance: float) -> Record:
    """Measure an adaptive method, which has a tolerance instead of a step."""
    begin = time.perf_counter()
    run = _solution(name, tolerance)
    seconds = (time.perf_counter() - begin) / DURATIONS[name]
    record = record_of(name, "scipy/dop853", 1.0, QUANTITIES[name], lambda: _errors(name, run))
    return {**record, "tolerance": tolerance, "seconds": seconds}


def _solution(name: str, tolerance: float, duration: int = 0) -> xr.Dataset:
    scene, duration = SCENES[name].scene, duration or DURATIONS[name]
    with patch.object(dop853, "RELATIVE_TOLERANCE", tolerance):
        return mm.simulate(scene, method="scipy/dop853", timestep=1.0, duration=duration)


@cache
def _truth(name: str) -> xr.Dataset:
    return _solution(name, TRUTH, COMPARED_AT if name == "free top" else DURATIONS[name])


def _errors(name: str, run: xr.Dataset) -> dict[str, list[float]]:
    truth = _truth("free top" if name == "free top" else "top")
    one, other = (data.position.values[: COMPARED_AT + 1, :2] for data in (run, truth))
    found = {"position": largest_error(one[-1:], other[-1:], truth.position.values[:, :2])}
    if name == "free top":
        for kept in ("momentum_map", "energy"):
            values = run[kept].values
            found[kept] = largest_error(values, values[:1], values[:1])
    else:
        values, true = run.momentum_map.values, truth.momentum_map.values
        found["momentum_map"] = largest_error(values, true, true)
        at = slice(COMPARED_AT, COMPARED_AT + 1)
        found["momentum_map_20"] = largest_error(values[at], true[at], true)
    return {quantity: [error, 0.0] for quantity, error in found.items()}


def largest_error(values: np.ndarray, truth: np.ndarray, of: np.ndarray) -> float:
    """Return the largest distance (records, ...) from the truth over the largest size of `of`."""
    return relative(_sizes(values - truth), _sizes(of).max())


def _sizes(values: np.ndarray) -> np.ndarray:
    return np.linalg.norm(values.reshape(len(values), -1), axis=1, keepdims=True)
