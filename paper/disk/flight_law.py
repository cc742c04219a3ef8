"""The law of the disk's flights: a slope near -2 for decades, then a stretched exponential."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor import observables
from magmotor.common import style
from magmotor.device.provenance import scene_of
from magmotor.devices.disk.gibbs import gibbs
from magmotor.devices.disk.scene import Disk
from magmotor.run.ensemble import ensemble
from paper.disk.flight_theory import FlightLaw, stretched_time
from paper.figure import Claim, Figure, judged

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

METHOD = "variational/baoab"

COLD = Disk(potential=((0.1, 0.0),), friction=1 / 3, noise=(2 / 3) ** 0.5)
"""A disk at kT = 1 in a weak potential, whose law of flights ends sooner."""

FULL = {
    "paper": {"timestep": 0.05, "duration": 1e6, "replicas": 1024},
    "cold": {"timestep": 0.1, "duration": 2e5, "replicas": 2**14},
}
QUICK = {
    "paper": {"timestep": 0.05, "duration": 2e4, "replicas": 512},
    "cold": {"timestep": 0.1, "duration": 2e4, "replicas": 2048},
}

OCTAVES = {"paper": (2**13, 2**15, 2**17), "cold": (2**9, 2**11, 2**13)}
"""Beginnings of the octaves over which slopes are compared, in a geometric progression."""

QUICK_OCTAVES = {"paper": (2**10, 2**11, 2**12), "cold": (2**7, 2**9, 2**11)}

SIGNIFICANT = 4
"""Standard errors of a significant deviation."""

BLURRED = 0.06
"""Part of a slope by which the ends of flights are blurred, since U' is correlated as d passes."""

LONG = 64
"""Duration of the flights that are drawn, long against the time between two samples."""

COLORS = {"paper": style.BLUE, "cold": style.GREEN}
LABELS = {"paper": "paper's disk, kT = 125, U = sin x", "cold": "kT = 1, c = 1/3, U = 0.1 sin x"}


@dataclass(frozen=True)
class Flights:
    """Ensembles in the Gibbs measure, with their flights, and the octaves that are compared."""

    runs: dict[str, xr.Dataset]
    octaves: dict[str, tuple[int, ...]]


def compute(quick: bool) -> Flights:
    """Simulate both disks."""
    sizes = QUICK if quick else FULL
    scenes = {"paper": Disk(), "cold": COLD}
    runs = {
        name: ensemble(
            scene, method=METHOD, seed=21, initial=gibbs(scene, sizes[name]["replicas"], seed=20),
            sample_interval=round(1 / sizes[name]["timestep"]), trajectories=1, **sizes[name],
        )
        for name, scene in scenes.items()
    }  # fmt: skip
    return Flights(runs, QUICK_OCTAVES if quick else OCTAVES)


def measured_slopes(run: xr.Dataset, begins: Sequence[float]) -> tuple[Array, Array]:
    """Return the slopes of log S over log t in octaves, and their standard errors."""
    found = observables.flight_survival(run)
    relative = (found.survival_error / found.survival).values
    times, survival = found.flight_duration.values, found.survival.values
    at = [[int(np.abs(times / t - 1).argmin()) for t in (begin, 2 * begin)] for begin in begins]
    slopes = [np.log2(survival[late] / survival[early]) for early, late in at]
    errors = [np.sqrt(relative[late] ** 2 - relative[early] ** 2) / np.log(2) for early, late in at]
    return np.array(slopes), np.array(errors)


def expected_slopes(law: FlightLaw, begins: Sequence[float]) -> Array:
    """Return the slopes in octaves by the reduced equation."""
    t = np.array(begins, float)
    return np.log2(law.survival(2 * t) / law.survival(t))


def exponent(slopes: Array, errors: Array, factor: float) -> tuple[float, float]:
    """Return q of S = t^-p exp(-k t^q), and its error, from slopes at times a factor apart.

    The slope is -p - k q t^q, so that its differences grow by `factor`^q; a power law has none.
    """
    first, second = slopes[1] - slopes[0], slopes[2] - slopes[1]
    q = np.log(second / first) / np.log(factor)
    parts = np.array([1 / first, -1 / first - 1 / second, 1 / second]) * errors
    return float(q), float(np.sqrt(np.sum(parts**2)) / np.log(factor))


def claims(flights: Flights) -> list[Claim]:
    """Return the claims about the law of flights."""
    return [_claim_of_the_slope(flights), claim_of_the_end(flights)]


def _claim_of_the_slope(flights: Flights) -> Claim:
    run, begins = flights.runs["paper"], flights.octaves["paper"]
    law = _law(_scene(run))
    slopes, errors = measured_slopes(run, begins)
    expected = expected_slopes(law, begins)
    far = law.slope(np.array([1e6, 1e7, 1e8]))
    return judged(
        "Ours: at the paper's parameters, the survival of flights has a slope near −2 for decades,"
        " but it is a local slope: the reduced equation of d predicts it and where it ends",
        f"slopes over octaves from t = {_listed(begins, 'd')}: {_pairs(slopes, errors)}; by the"
        f" reduced equation, with nothing fitted, {_listed(expected, '.2f')}, and"
        f" {_listed(far, '.1f')} at t = 10⁶, 10⁷, 10⁸, where"
        f" {', '.join(f'{s:.0e}' for s in law.survival(np.array([1e6, 1e7, 1e8])))} of the flights"
        " are left",
        _agree(slopes, errors, expected) and far[2] < 2 * far[0],
    )


def claim_of_the_end(flights: Flights) -> Claim:
    """Return the claim of a stretched exponential, which neither of two other laws passes."""
    run, begins = flights.runs["cold"], flights.octaves["cold"]
    scene = _scene(run)
    law, tau = _law(scene), stretched_time(scene)
    slopes, errors = measured_slopes(run, begins)
    expected = expected_slopes(law, begins)
    q, error = exponent(slopes, errors, begins[1] / begins[0])
    theory, _ = exponent(expected, errors, begins[1] / begins[0])
    agrees = _agree(slopes, errors, expected)
    no_power = slopes[2] - slopes[0] < -SIGNIFICANT * np.hypot(errors[0], errors[2])
    no_exponential = q + SIGNIFICANT * error < 1
    return judged(
        "Ours: flights are stretched exponential in the end, exp[−(t/τ)^(1/2)] with"
        " τ = 6(kT)²/[c(1 + σ)Σa²], since D falls as d⁻⁴: a heavy tail with all moments",
        f"for a disk at kT = 1, whose τ is {tau:.0f}, slopes over octaves from t ="
        f" {_listed(begins, 'd')}: {_pairs(slopes, errors)} (reduced equation:"
        f" {_listed(expected, '.2f')}). A power law has one slope; an exponential law"
        f" {begins[2] // begins[0]} times the slope at the end. Exponent q of t⁻ᵖ exp(−ktᑫ) in this"
        f" range: {q:.2f} ± {error:.2f}, by the reduced equation {theory:.2f}, and 1/2 in the end",
        bool(agrees and no_power and no_exponential),
        otherwise="not decided" if agrees else "wrong",
    )


def _agree(slopes: Array, errors: Array, expected: Array) -> bool:
    allowed = BLURRED * np.abs(expected) + SIGNIFICANT * errors
    return bool((np.abs(slopes - expected) < allowed).all())


@cache
def _law(scene: Disk) -> FlightLaw:
    """Return the law, whose modes take a second."""
    return FlightLaw(scene)


def _scene(run: xr.Dataset) -> Disk:
    scene = scene_of(run)
    assert isinstance(scene, Disk)
    return scene


def _listed(numbers: Array | Sequence[float], form: str) -> str:
    return ", ".join(f"{number:{form}}" for number in numbers).replace("-", "−")


def _pairs(values: Array, errors: Array) -> str:
    pairs = zip(values, errors, strict=True)
    return ", ".join(f"{value:.2f} ± {error:.2f}" for value, error in pairs).replace("-", "−")


def draw(flights: Flights, path: Path) -> None:
    """Draw the survival of flights and its local slope."""
    with style.figure(11.5, 4.6) as figure:
        left, right = figure.subplots(1, 2)
        for name, run in flights.runs.items():
            _draw_survival(left, name, run)
            _draw_slopes(right, name, run)
        t = np.array([4e3, 4e6])
        left.plot(t, 0.15 * (t / t[0]) ** -2, ":", color=style.INK, lw=1)
        left.annotate("t⁻²", (6e6, 1e-7), color=style.INK)
        left.set(
            xscale="log", yscale="log", xlim=(LONG, 2e8), ylim=(1e-10, 2),
            xlabel="duration t (dimensionless)",
            ylabel=f"of flights that last {LONG}, fraction that last longer", title="Flights",
        )  # fmt: skip
        left.legend(loc="upper right")
        scaled = np.logspace(-1, 2.3, 100)
        right.plot(
            scaled, -1 - np.sqrt(scaled) / 2, "--", color=style.INK, lw=1.2,
            label="−1 − ½(t/τ)$^{1/2}$",
        )  # fmt: skip
        right.axhline(-2, ls=":", color=style.INK, lw=1, label="t⁻²")
        right.set(
            xscale="log", xlim=(1e-5, 200), ylim=(-8, 0.3), xlabel="t/τ",
            ylabel="local slope of log S over log t", title="Their end: a stretched exponential",
        )  # fmt: skip
        right.legend(loc="lower left")
        style.save(figure, path, dpi=90)


def _draw_survival(axes: "Axes", name: str, run: xr.Dataset) -> None:
    law, found = _law(_scene(run)), observables.flight_survival(run)
    kept = found.isel(flight_duration=found.survival.values > 3 * found.survival_error.values)
    kept = kept.isel(flight_duration=kept.flight_duration.values >= LONG)
    lasting = float(kept.survival[0])
    axes.errorbar(
        kept.flight_duration, kept.survival / lasting, 2 * kept.survival_error / lasting, fmt="o",
        ms=3, lw=0.8, color=COLORS[name], label=LABELS[name],
    )  # fmt: skip
    t = np.geomspace(LONG, 2e8, 300)
    survival = law.survival(t) / law.survival(np.array([LONG]))
    axes.plot(t, np.where(survival > 1e-11, survival, np.nan), color=style.ORANGE, zorder=3, lw=1.2)


def _draw_slopes(axes: "Axes", name: str, run: xr.Dataset) -> None:
    scene = _scene(run)
    law, tau = _law(scene), stretched_time(scene)
    found = observables.flight_survival(run)
    enough = found.survival.values > 12 * found.survival_error.values
    times = found.flight_duration.values[enough & (found.flight_duration.values >= 2 * LONG)]
    begins = tuple(int(t) for t in times[::4] / 2)
    slopes, errors = measured_slopes(run, begins)
    axes.errorbar(
        np.sqrt(2) * np.array(begins) / tau, slopes, 2 * errors, fmt="o", ms=4, lw=1,
        color=COLORS[name], label=LABELS[name],
    )  # fmt: skip
    t = tau * np.logspace(-5, 2.3, 300)
    reached = law.survival(t) > 1e-200
    axes.plot(
        t[reached] / tau, law.slope(t)[reached], color=style.ORANGE, zorder=3, lw=1.2,
        label="reduced equation of d, nothing fitted" if name == "cold" else None,
    )  # fmt: skip


FIGURE = Figure(
    "disk_flight_law",
    "The law of the disk's flights",
    f"Left: of the flights that last at least {LONG}, the fraction that last longer, for the"
    f" disk of the paper ({FULL['paper']['replicas']} replicas for T = 10⁶) and for a colder one"
    f" in a weaker potential ({FULL['cold']['replicas']} for T = 2·10⁵), with two standard"
    " errors. Curves: the reduced equation of d = σω − v, with nothing fitted. Right: the local"
    " slopes, over t in units of τ = 6(kT)²/[c(1 + σ)Σa²], which is 6.3·10⁵ for the paper's"
    " disk. Dashed: the stretched exponential that all flights approach in the end. A flight is"
    " the time between two changes of sign of d, each by a tenth of its standard deviation; d is"
    " sampled once per unit of time.",
    compute,
    claims,
    draw,
    methods=(METHOD,),
)
