"""Errors of the disk and the motor along Brownian paths that all methods and steps share.

Sampling hardly affects the difference of two runs along one path, and the remaining error is
known from the scatter of the replicas. The reference takes very short steps.
"""

from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

import magmotor as mm
from benchmarks.accuracy.scenes import DISK, MOTOR, SCENES, record_of, stepping_methods
from benchmarks.harness.records import Case, Record
from magmotor.advice.statistics_errors import paired
from magmotor.devices.disk.gibbs import gibbs
from magmotor.noise import BrownianPath
from magmotor.observables import mode_temperatures
from magmotor.theory import gibbs_mean_squares

Array = NDArray[np.float64]

QUANTITIES = {
    "disk": ("path", "temperature"),
    "motor": (
        "path",
        "slip_path",
        "ring_path",
        "temperature",
        "slip_temperature",
        "ring_temperature",
    ),
}
DURATIONS = {"disk": 160.0, "motor": 320.0}
INTERVAL, RECORDS = 3 * 2**10, 64
"""Steps of the reference per record, which all steps divide, and number of records."""

STRONG = 4
"""Record at which states are compared: later, chaos makes all errors equally large."""

SETTLED = 16
"""First record at which temperatures are compared."""

FACTORS = (8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024, 1536, 3072)
"""Steps relative to the reference's."""

QUICK_FACTORS = FACTORS[8::3]
MODES = ["slip", "ring_1", "ring_2", "ring_3"]
"""Modes of the motor that forget their initial state within 100 s."""

REPLICAS = {"variational": {"disk": 256, "motor": 64}, "mujoco": {"disk": 64, "motor": 64}}
QUICK_REPLICAS = 16
GROUPS = 16
"""Groups of the motor's replicas, each with one temperature; errors come from their scatter."""


def cases(quick: bool) -> list[Case]:
    """Return a case for each scene, method and step."""
    return [
        _case(name, method, factor, quick)
        for name in DURATIONS
        for method in stepping_methods(name)
        for factor in (QUICK_FACTORS if quick else FACTORS)
    ]


def _case(name: str, method: str, factor: int, quick: bool) -> Case:
    replicas = QUICK_REPLICAS if quick else REPLICAS[method.split("/", maxsplit=1)[0]][name]
    # Every run draws all increments of the path, whatever its step.
    increments = INTERVAL * RECORDS * replicas
    a_step = 6e-6 if "rk4" in method else 2e-6 if "mujoco" in method else 3e-7
    seconds = 0.1 + increments * ((7e-8 if name == "motor" else 1.5e-8) + a_step / factor)
    key = f"error/{name}/{method}/{factor}"
    return Case(key, partial(_measure, name, method, factor, replicas), seconds)


def _measure(name: str, method: str, factor: int, replicas: int) -> Record:
    timestep = DURATIONS[name] / (INTERVAL * RECORDS) * factor

    def errors() -> dict[str, list[float]]:
        run = _run(name, method, factor, replicas)
        return ERRORS[name](run, _reference(name, replicas))

    return record_of(name, method, timestep, QUANTITIES[name], errors)


def _run(name: str, method: str, factor: int, replicas: int) -> xr.Dataset:
    scene, timestep = SCENES[name].scene, DURATIONS[name] / (INTERVAL * RECORDS)
    path = BrownianPath(1, timestep).coarsened(factor)
    start: Any = gibbs(scene, replicas, seed=1) if isinstance(scene, mm.Disk) else None
    return mm.simulate(
        scene, method=method, timestep=path.timestep, duration=DURATIONS[name], path=path,
        replicas=replicas, initial=start, record_interval=INTERVAL // factor, allow_unstable=True,
    )  # fmt: skip


@cache
def _reference(name: str, replicas: int) -> xr.Dataset:
    return _run(name, "variational/baoab", 1, replicas)


def _disk_errors(run: xr.Dataset, reference: xr.Dataset) -> dict[str, list[float]]:
    unit = gibbs_mean_squares(DISK)["slip"]
    hot = [(data.v + data.omega).values ** 2 / unit for data in (run, reference)]
    return {
        "path": [strong_error(run.x.values, reference.x.values), 0.0],
        "temperature": _paired((hot[0] - hot[1])[:, SETTLED:].mean(axis=1)),
    }


def _motor_errors(run: xr.Dataset, reference: xr.Dataset) -> dict[str, list[float]]:
    """Return the errors; the temperature's is the largest of the slip's and the ring's three."""
    differences = (_mode_temperatures(run) - _mode_temperatures(reference)).T
    slip, *ring = (_paired(differences[mode]) for mode in range(len(MODES)))
    paths = {"path": "position", "slip_path": "slip_velocity", "ring_path": "ring_axis"}
    strong = {k: [strong_error(run[v].values, reference[v].values), 0.0] for k, v in paths.items()}
    hot = {"slip_temperature": slip, "ring_temperature": max(ring, key=max)}
    return {**strong, **hot, "temperature": max(hot.values(), key=max)}


def _mode_temperatures(run: xr.Dataset) -> Array:
    """Return mode temperatures over kT of groups of replicas, shape (groups, modes)."""
    burn_in = float(run.time[SETTLED])
    found = [
        mode_temperatures(run.isel(replica=slice(group, None, GROUPS)), MOTOR, burn_in)
        for group in range(GROUPS)
    ]
    return np.array([modes.temperature.sel(mode=MODES).values for modes in found]) / MOTOR.kT


ERRORS: dict[str, Callable[[xr.Dataset, xr.Dataset], dict[str, list[float]]]] = {
    "disk": _disk_errors,
    "motor": _motor_errors,
}


def strong_error(values: Array, true: Array) -> float:
    """Return the rms error over the rms distance traveled; shapes (replicas, T, ...)."""
    wrong, covered = values[:, STRONG] - true[:, STRONG], true[:, STRONG] - true[:, 0]
    return float(np.sqrt(np.mean(wrong**2) / np.mean(covered**2)))


def _paired(differences: Array) -> list[float]:
    """Return the size of the mean difference, and twice its standard error; shape (pairs,)."""
    error, doubt = paired(differences[:, np.newaxis])
    return [error, 2 * doubt]
