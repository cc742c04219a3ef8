"""Ballistic and normal diffusion: paths of the disk, and the durations of its flights."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.optimize import root_scalar

from magmotor import observables
from magmotor.common import style
from magmotor.device.provenance import scene_of
from magmotor.devices.disk.gibbs import gibbs
from magmotor.devices.disk.scene import Disk
from magmotor.run.ensemble import ensemble
from magmotor.run.simulate import simulate
from magmotor.theory import ReducedDisk
from paper import errata
from paper.disk.panels import draw_beside, draw_flights, survival
from paper.disk.systems import FULL, METHOD, QUICK, Disks, named, paper_disks
from paper.figure import Claim, Figure, judged

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

PATHS = 4

LASTING = (2500.0, 5000.0, 10_000.0)
"""Durations for which the fraction of flights that last twice as long is measured."""


COLORS = (style.BLUE, style.ORANGE, style.GREEN, style.PURPLE)


@dataclass(frozen=True)
class Paths:
    """Paths on U = sin x and on flat U, the ensembles of both, and two ensembles under mu."""

    symmetric: xr.Dataset
    flat: xr.Dataset
    disks: Disks
    flying: xr.Dataset
    """on U = sin x, long"""
    frozen: xr.Dataset
    """on flat U"""


def compute(quick: bool) -> Paths:
    """Simulate paths from rest at the paper's parameters."""
    numerics = QUICK if quick else FULL
    times = {name: numerics[name] for name in ("timestep", "duration")}
    paths = [
        simulate(
            Disk(potential=name), method=METHOD, replicas=PATHS,
            record_interval=round(numerics["duration"] / numerics["timestep"] / 1000), **times,
        )
        for name in ("symmetric", "flat")
    ]  # fmt: skip
    disks = paper_disks(quick)
    flying = named(disks.reference)["symmetric"].stationary
    if quick:
        flying = _under_mu("symmetric", duration=50_000.0, replicas=500)
    frozen = _under_mu("flat", duration=1000.0, replicas=2000)
    return Paths(paths[0], paths[1], disks, flying, frozen)


def _under_mu(potential: str, *, duration: float, replicas: int) -> xr.Dataset:
    scene = Disk(potential=potential)
    return ensemble(
        scene, method="variational/baoab", timestep=0.05, duration=duration, replicas=replicas,
        seed=2, initial=gibbs(scene, replicas, seed=1),
    )  # fmt: skip


def claims(paths: Paths) -> list[Claim]:
    """Return the claims of (fig:ballisticvsnormal) and of the introduction."""
    return [
        claim_of_the_theorem(paths.flying),
        claim_of_flights(paths.symmetric, paths.flat),
        claim_of_the_tail(paths.flying),
        _normal_on_flat(paths),
    ]


def claim_of_flights(symmetric: xr.Dataset, flat: xr.Dataset) -> Claim:
    """Return the claim that paths have flights, which Brownian motion of any size has not."""
    found = [longest_flight(run) for run in (symmetric, flat)]
    reach = [float(np.abs(run.x).max()) for run in (symmetric, flat)]
    interval = float(symmetric.time[1] - symmetric.time[0])
    return judged(
        "Numerically, flights are observed in the x-displacement",
        f"in one of {PATHS} paths, x moves to the same side in each interval of {interval:g} for a"
        f" time of {found[0]:.3g}; on flat U for {found[1]:.3g} at most, as in any Brownian motion."
        f" The paths reach |x| = {reach[0]:.3g}; on flat U, {reach[1]:.3g}",
        found[0] > 4 * found[1],
    )


def longest_flight(run: xr.Dataset) -> float:
    """Return the longest time, of all paths, in which x moves to one side between all records."""
    sides = np.sign(np.diff(run.x.transpose("replica", "time").values, axis=1))
    turns = [np.flatnonzero(np.append(np.diff(each) != 0, True)) for each in sides]
    longest = max(int(np.diff(turn, prepend=-1).max()) for turn in turns)
    return longest * float(run.time[1] - run.time[0])


def claim_of_the_theorem(run: xr.Dataset) -> Claim:
    """Return the claim that the mean squared displacement is ballistic: that its slope is 2."""
    scene = scene_of(run)
    assert isinstance(scene, Disk)
    slope, error = slopes(run)
    steepest, last = int(slope.argmax()), float(run.lag[-1])
    bound, square = errata.lower_ballistic_bound(scene), ReducedDisk(scene).msd_from_gibbs
    crossing = root_scalar(
        lambda log: float(square(np.exp(log)) / np.exp(2 * log)) - bound, bracket=(7.0, 16.0)
    )
    below = np.exp(crossing.root)
    return judged(
        "Theorem: if U is non-constant the mean squared displacement with respect to the invariant"
        " law is ballistic",
        f"its slope falls from {slope[steepest]:.2f} to {slope[-1]:.2f} ± {error[-1]:.2f} between"
        f" lags of {last:.0f} and {2 * last:.0f}; by theory the mean square"
        f" is below the paper's bound from t = {below:.3g} on, and its slope tends to 1",
        slope[-1] + 4 * error[-1] > 2,
    )


def claim_of_the_tail(run: xr.Dataset) -> Claim:
    """Return the claim of a heavy tail.

    For an exponential law, S(2t)/S(t) is squared each time t doubles.
    """
    fractions, errors = zip(*(_fraction_lasting_twice(run, t) for t in LASTING), strict=True)
    exponential = fractions[0] ** (LASTING[-1] / LASTING[0])
    listed = ", ".join(f"{fraction:.3f}" for fraction in fractions)
    return judged(
        "The probability distributions of the flight-durations have a heavy tail (introduction)",
        f"of the flights that last t = {', '.join(f'{t:g}' for t in LASTING)}, {listed} last 2t"
        f" (the last ± {errors[-1]:.3f}); an exponential law with the first fraction would have"
        f" {exponential:.3f} for the last",
        fractions[-1] - 4 * errors[-1] > 2 * exponential,
    )


def _fraction_lasting_twice(run: xr.Dataset, t: float) -> tuple[float, float]:
    """Return the fraction of flights lasting t that last 2t, and its standard error."""
    found = observables.flight_survival(run).isel(flight_duration=slice(1, None))
    log = np.log(found.flight_duration.values)
    once, twice = (np.interp(np.log(q), log, np.log(found.survival.values)) for q in (t, 2 * t))
    relative = (found.survival_error / found.survival).values
    before, after = (np.interp(np.log(q), log, relative) for q in (t, 2 * t))
    fraction = float(np.exp(twice - once))
    return fraction, fraction * float(np.sqrt(after**2 - before**2))


def _normal_on_flat(paths: Paths) -> Claim:
    flat = named(paths.disks.reference)["flat"]
    x = flat.rest.x.values
    kurtosis = float(np.mean(x**4) / np.mean(x**2) ** 2)
    fluctuation = float(np.sqrt(24 / len(x)))
    last = flat.last_slope
    slope, error = slopes(paths.frozen)
    normal = abs(last.slope - 1) < 4 * last.error and abs(kurtosis - 3) < 4 * fluctuation
    return judged(
        "However, if U is constant this diffusion is normal, i.e., x behaves like Brownian motion",
        f"from rest: slope {last.slope:.2f} ± {last.error:.2f}, kurtosis {kurtosis:.2f} ±"
        f" {fluctuation:.2f} (Gaussian: 3). With respect to the invariant law, which the statement"
        f" refers to, d is frozen: slope {slope[-1]:.2f} ± {error[-1]:.2f}, ballistic forever,"
        " unless E[x(t) given the start] is subtracted",
        normal and slope[-1] + 4 * error[-1] < 1.5,
        otherwise="in part" if normal else "wrong",
    )


def slopes(run: xr.Dataset) -> tuple[Array, Array]:
    """Return slopes of the logarithmic mean square of increments from each lag to twice it.

    For a stationary process the mean square at twice a lag is 2 (1 + rho) times that at the lag,
    where rho is the correlation of successive increments. The second array contains the errors.
    """
    rho = run.increment_correlation.values
    return 1 + np.log2(1 + rho), run.increment_correlation_error.values / ((1 + rho) * np.log(2))


def draw(paths: Paths, path: Path) -> None:
    """Draw paths on both potentials, and the survival of flights."""
    with style.figure(11.6, 4.0) as figure:
        left, middle, right = figure.subplots(1, 3)
        _draw_paths(left, paths.symmetric, f"U = sin x: flights ({METHOD})")
        _draw_paths(middle, paths.flat, f"U = 0: diffusion ({METHOD})")
        reference, mujoco = (named(systems)["symmetric"] for systems in paths.disks)
        draw_flights(right, reference)
        draw_beside(right, mujoco, survival(mujoco))
        right.set(title=f"Flights (white: {METHOD})", xlim=(None, 5e6), ylim=(None, 3))
        style.save(figure, path, dpi=90)


def _draw_paths(axes: "Axes", run: xr.Dataset, title: str) -> None:
    for x, color in zip(run.x.transpose("replica", "time").values, COLORS, strict=True):
        axes.plot(run.time, x, color=color, lw=0.9)
    axes.set(
        xlabel="t (dimensionless)",
        ylabel="x(t) of four paths (dimensionless)",
        title=title,
        xlim=(0, float(run.time[-1])),
    )


FIGURE = Figure(
    "disk_flights",
    "Ballistic against normal diffusion",
    f"Four paths by `{METHOD}` on U = sin x and four on flat U (note the scales), from rest; σ ="
    f" 1/2, α = 5, c = 0.1, h = {FULL['timestep']}, T = {FULL['duration']:g}. A flight is the"
    " time between two changes of sign of d = σω − v, each by a tenth of its standard deviation;"
    " d is sampled once per unit of time. Right: the fraction of flights that last longer, under"
    " the invariant law, from the ensembles of the next figures, with two standard errors.",
    compute,
    claims,
    draw,
    (6,),
    (METHOD, FULL["method"], "variational/baoab"),
)
