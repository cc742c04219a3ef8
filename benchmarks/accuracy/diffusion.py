"""Error of the disk's diffusion coefficient D(d) at three standard deviations of d.

Replicas start from one d; once the oscillations with the potential have settled, the variance of d
grows by 2 D per unit of time.
"""

import math
from functools import cache, partial
from typing import Any

import xarray as xr

import magmotor as mm
from benchmarks.accuracy.scenes import DISK, record_of, stepping_methods
from benchmarks.harness.records import Case, Record
from magmotor.theory import gibbs_mean_squares

SETTLED, DURATION = 20.0, 200.0
STEPS = (1 / 60, 1 / 40, 1 / 30, 1 / 20, 1 / 15, 1 / 10, 1 / 8, 1 / 5)
MUJOCO_STEPS = STEPS[3::2]
REPLICAS = {"variational": 500_000, "mujoco": 500}
QUICK_REPLICAS = {"variational": 20_000, "mujoco": 100}
TRUTH = ("variational/baoab", 1 / 80, 1_500_000)
QUICK_TRUTH = ("variational/baoab", 1 / 80, 40_000)


def cases(quick: bool) -> list[Case]:
    """Return a case for each method and step."""
    return [
        _case(method, timestep, quick)
        for method in stepping_methods("disk")
        for timestep in (MUJOCO_STEPS if quick or method.startswith("mujoco") else STEPS)
    ]


def _case(method: str, timestep: float, quick: bool) -> Case:
    engine = method.split("/", maxsplit=1)[0]
    replicas = (QUICK_REPLICAS if quick else REPLICAS)[engine]
    steps = DURATION / timestep * replicas
    seconds = 0.3 + steps * (1e-9 if engine == "variational" else 1e-6)
    run = partial(_measure, method, timestep, replicas, QUICK_TRUTH if quick else TRUTH)
    return Case(f"diffusion/{method}/{timestep:.4g}", run, seconds)


def _measure(method: str, timestep: float, replicas: int, truth: tuple) -> Record:
    def errors() -> dict[str, list[float]]:
        return _errors(method, timestep, replicas, truth)

    return record_of("disk", method, timestep, ["diffusion"], errors)


def _errors(method: str, timestep: float, replicas: int, truth: tuple) -> dict[str, list[float]]:
    found, true = diffusion(method, timestep, replicas), _truth(*truth)
    deviations = [float(run.diffusion_error / run.diffusion) for run in (found, true)]
    error = abs(float(found.diffusion / true.diffusion) - 1)
    return {"diffusion": [error, 2 * math.hypot(*deviations)]}


@cache
def _truth(method: str, timestep: float, replicas: int) -> xr.Dataset:
    return diffusion(method, timestep, replicas)


def diffusion(method: str, timestep: float, replicas: int) -> xr.Dataset:
    """Measure `diffusion` and `diffusion_error`, from a number of replicas.

    The error is large for that number: a few replicas whose slip brings x to rest scatter far.
    """
    start = mm.theory.gibbs(DISK, replicas, seed=1, d=3 * gibbs_mean_squares(DISK)["d"] ** 0.5)
    numerics: dict[str, Any] = {
        "method": method, "timestep": timestep, "replicas": replicas, "seed": 1, "initial": start,
    }  # fmt: skip
    settled = round(SETTLED / timestep)
    if method.startswith("mujoco"):
        run = mm.simulate(DISK, duration=DURATION, record_interval=settled, **numerics)
        return mm.observables.d_diffusion(run.isel(time=slice(1, None)))
    last = [
        mm.ensemble(DISK, duration=time, sample_interval=settled // 4, **numerics)[["v", "omega"]]
        for time in (SETTLED, DURATION)
    ]
    times = xr.Variable("time", [SETTLED, DURATION])
    return mm.observables.d_diffusion(xr.concat(last, times, combine_attrs="override"))
