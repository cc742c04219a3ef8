"""Error of the disk's diffusion coefficient D(d) at three standard deviations of d.

Replicas start from one d, anywhere in the well and with Gibbs' slip; the variance of d then grows
by 2 D a unit of time, once what oscillates with the potential has settled.
"""

from functools import cache, partial

import numpy as np
from numpy.typing import NDArray

import magmotor as mm
from benchmarks.accuracy.subjects import DISK, record_of, stepping_methods
from benchmarks.harness.records import Case, Record
from magmotor.theory import gibbs_mean_squares

Array = NDArray[np.float64]

SETTLED, DURATION = 20.0, 200.0
STEPS = (1 / 60, 1 / 40, 1 / 30, 1 / 20, 1 / 15, 1 / 10, 1 / 8, 1 / 5)
MUJOCO_STEPS = STEPS[3::2]
REPLICAS = {"variational": 500_000, "mujoco": 500}
QUICK_REPLICAS = {"variational": 20_000, "mujoco": 100}
TRUTH = ("variational/baoab", 1 / 80, 1_500_000)
QUICK_TRUTH = ("variational/baoab", 1 / 80, 40_000)


def cases(quick: bool) -> list[Case]:
    """One for each method and step."""
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
    found, deviation = diffusion(method, timestep, replicas)
    true, its_deviation = _truth(*truth)
    return {"diffusion": [abs(found / true - 1), 2 * float(np.hypot(deviation, its_deviation))]}


@cache
def _truth(method: str, timestep: float, replicas: int) -> tuple[float, float]:
    return diffusion(method, timestep, replicas)


def diffusion(method: str, timestep: float, replicas: int) -> tuple[float, float]:
    """D(d) and its relative standard error, from so many replicas.

    That error is from the scatter of squares: a few replicas whose slip brings x to rest are
    scattered far.
    """
    after = _after if method.startswith("variational") else _after_in_mujoco
    early, late = (d - d.mean() for d in after(method, timestep, replicas))
    grown = late**2 - early**2
    found = float(grown.mean())
    error = float(grown.std()) / replicas**0.5
    return found / (2 * (DURATION - SETTLED)), error / found


def _start(replicas: int) -> dict[str, Array]:
    """Prepared states; v and omega from the slip s = v + omega and d = -v + sigma omega."""
    squares, sigma = gibbs_mean_squares(DISK), DISK.sigma
    random = np.random.default_rng(1)
    slip = squares["slip"] ** 0.5 * random.standard_normal(replicas)
    d = 3 * squares["d"] ** 0.5
    return {
        "x": random.uniform(0, 2 * np.pi, replicas),
        "v": (sigma * slip - d) / (1 + sigma),
        "omega": (slip + d) / (1 + sigma),
    }


def _after(method: str, timestep: float, replicas: int) -> list[Array]:
    """Return d of each replica after both times."""
    runs = [
        mm.ensemble(
            DISK, method=method, timestep=timestep, duration=duration, replicas=replicas, seed=1,
            sample_interval=round(SETTLED / 4 / timestep), initial=_start(replicas),
        )
        for duration in (SETTLED, DURATION)
    ]  # fmt: skip
    return [DISK.sigma * run.omega.values - run.v.values for run in runs]


def _after_in_mujoco(method: str, timestep: float, replicas: int) -> list[Array]:
    run = mm.simulate(
        DISK, method=method, timestep=timestep, duration=DURATION, replicas=replicas, seed=1,
        record_interval=round(SETTLED / timestep), initial=_start(replicas),
    )  # fmt: skip
    d = (DISK.sigma * run.omega - run.v).sel(time=[SETTLED, DURATION], method="nearest")
    return [*d.values.T]
