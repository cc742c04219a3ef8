"""Rings of N dipoles with the total moment of the paper's twenty, and their continuum limit.

V_e converges to that limit like sqrt(N) exp(-N eta), cosh eta = (rho^2 + R^2 + z^2)/(2 rho R): the
N-th harmonic of the potential between two rings of radii rho and R at the distance z.
"""

import math
from functools import cache, partial

import numpy as np

import magmotor as mm
from benchmarks.detail.flight import DURATION, INTERVAL
from benchmarks.harness.records import Case, Record
from benchmarks.harness.stepping import Stepper
from benchmarks.harness.tables import number, seconds, table
from benchmarks.harness.timing import compare, run_seconds

TWENTY = mm.Top(tilt=0.0)
CONTINUUM = 128
"""Number of dipoles at which V_e equals its limit to rounding."""

NUMBERS = (5, 8, 10, 12, 16, 20, 24, 32, 40, 64)
QUICK = (8, 20, 40)
QUANTITIES = {
    "potential": "effective potential $V_e$ in the valley",
    "radius": "radius of the valley",
    "momentum": "J of case 4 over 60 s",
    "rest": "J of case 3 over 500 s, which should be 0",
}
"""Quantities compared with the continuum, relative to their size; J relative to case 4."""

STEPS = 200_000
METHOD, TIMESTEP = "variational/baoab", 0.0125


def ring(count: int, case: int = 3) -> mm.Top:
    """Return the scene of one of the paper's cases with another number of dipoles."""
    strength = TWENTY.ring_dipoles / count
    return mm.Top.paper(case, ring_dipoles=count, coupling=strength * TWENTY.coupling)


@cache
def valley() -> float:
    """Return the radius of the continuum's valley, in m."""
    return mm.observables.valley_radius(ring(CONTINUUM))


def decay_rate() -> float:
    """Return eta in the continuum's valley."""
    scene, rho = ring(CONTINUUM), valley()
    radius, z = scene.ring_radius, scene.ring_height - scene.ball_radius
    return math.acosh((rho**2 + radius**2 + z**2) / (2 * rho * radius))


def along_valley(count: int) -> np.ndarray:
    """Compute V_e in J along the continuum's valley, from one dipole of the ring to the next."""
    azimuth = np.linspace(0, 2 * math.pi / count, 65)
    points = valley() * np.stack([np.cos(azimuth), np.sin(azimuth)], axis=-1)
    return mm.observables.effective_potential(ring(count), points)


def cases(quick: bool) -> list[Case]:
    numbers = QUICK if quick else NUMBERS
    turns = 8 if quick else 40
    return [Case(f"detail/ring/{n}", partial(_measure, n, turns), 5) for n in numbers]


def _measure(count: int, turns: int) -> Record:
    limit, own = along_valley(CONTINUUM), along_valley(count)
    depth = abs(limit[0])
    radius = mm.observables.valley_radius(ring(count)) / valley()
    momentum, truth = _spin(count), _spin(CONTINUUM)
    largest = np.abs(truth).max()
    rest = mm.simulate(ring(count), method=METHOD, timestep=TIMESTEP, duration=500.0)
    kernel = {n: partial(_kernel_seconds, ring(n, case=4)) for n in (count, 20)}
    step = {n: Stepper(mm.build(ring(n, case=4))).seconds for n in (count, 20)}
    mujoco = compare(partial(step[count], magnetic=True), partial(step[20], magnetic=True), turns)
    return {
        "potential": float(np.abs(own - limit).max() / depth),
        "ripple": float(np.ptp(own)),
        "radius": abs(radius - 1),
        "momentum": float(np.abs(momentum - truth).max() / largest),
        "rest": float(np.abs(rest.momentum_map).max() / largest),
        "mujoco": mujoco,
        "kernel": compare(kernel[count], kernel[20], turns),
    }


@cache
def _spin(count: int) -> np.ndarray:
    run = mm.simulate(
        ring(count, case=4), method="scipy/dop853", timestep=INTERVAL, duration=DURATION
    )
    return run.momentum_map.values


def _kernel_seconds(scene: mm.Top) -> float:
    """Return the seconds per step, in a run long enough to make set-up negligible."""
    return run_seconds(STEPS, scene, METHOD, TIMESTEP) / STEPS


def tabulate(records: dict[str, Record]) -> str:
    columns = [
        "N", "error of V_e", "of the valley's radius", "of J, case 4, 60 s",
        "J of case 3, over case 4's", "ripple (J)", "MuJoCo's step", "over N = 20's",
        "reference's step", "over N = 20's",
    ]  # fmt: skip
    rows = []
    for n in measured(records):
        record = records[f"detail/ring/{n}"]
        errors = [number(record[name]) for name in (*QUANTITIES, "ripple")]
        mujoco, kernel = (
            [seconds(record[engine]["seconds"]), f"{record[engine]['ratio']:.2f}"]
            for engine in ("mujoco", "kernel")
        )
        rows.append([str(n), *errors, *mujoco, *kernel])
    return table(columns, rows)


def measured(records: dict[str, Record]) -> list[int]:
    return [n for n in NUMBERS if f"detail/ring/{n}" in records]
