"""The paper's statistics of the sliding disk, with theory superposed."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import xarray as xr

from magmotor import observables, theory
from magmotor.devices.disk.scene import Disk
from paper import errata
from paper.disk.pictures import disk_figure
from paper.disk.system import System
from paper.disk.systems import BESIDE, FULL, METHOD, Disks, named, paper_disks
from paper.figure import Claim, Figure, judged, repeated

SIGNIFICANT = 4
"""Standard errors of a significant deviation; the chance of more is one in 16 000."""

TRANSIENT = 30
"""Time in units of 1/lambda before which times and lags are not considered."""


THEOREM = "disk_flights"
"""The figure that judges the theorem that the mean squared displacement grows like t^2."""

UNEVEN, EVEN = ("symmetric", "asymmetric"), ("flat", "control")
"""Systems in which d changes, and systems in which d is constant or absent."""


def _pair(systems: list[System], names: tuple[str, str]) -> list[System]:
    return [named(systems)[name] for name in names]


def _slopes(system: System) -> str:
    slope = system.last_slope
    return f"{system.name} {slope.slope:.3f} ± {slope.error:.3f}"


def claims_of_the_mean(systems: list[System]) -> list[Claim]:
    """Return the claims of (fig:meanX)."""
    uneven = _pair(systems, UNEVEN)
    means = [float(system.x("mean")[-1]) for system in uneven]
    errors = [float(system.x("mean_error")[-1]) for system in uneven]
    spreads = [float(np.sqrt(system.variance[-1])) for system in uneven]
    pushes = [float(system.theory.mean(system.end)) for system in uneven]
    listed = [
        f"{system.name} {mean:.0f} ± {error:.0f} ({push:.0f})"
        for system, mean, error, push in zip(uneven, means, errors, pushes, strict=True)
    ]
    largest = max(
        float(np.abs(system.x("mean")[-1] / system.x("mean_error")[-1]))
        for system in _pair(systems, EVEN)
    )
    return [
        judged(
            "The means are very small compared with the spread",
            f"t = {uneven[0].end:g}: "
            + ", ".join(
                f"{system.name} {mean:.0f} against {spread:.3g}"
                for system, mean, spread in zip(uneven, means, spreads, strict=True)
            ),
            all(abs(m) < 0.1 * spread for m, spread in zip(means, spreads, strict=True)),
        ),
        judged(
            "(a) and (b) show that when U is non-constant, directed motion as a meta-stable state"
            " is possible",
            f"the means are {', '.join(listed)}; in brackets, theory's remnant of the initial push"
            " at x = 0, which has the opposite sign at x = π: nothing else is seen in the means;"
            " single paths have flights",
            any(
                abs(mean - push) > SIGNIFICANT * error
                for mean, push, error in zip(means, pushes, errors, strict=True)
            ),
            otherwise="in part",
        ),
        judged(
            "On the other hand, (c) and (d) do not show such behavior (U flat and control)",
            f"their means are within {largest:.1f} standard errors of 0",
            largest < SIGNIFICANT,
        ),
    ]


def claims_of_the_logarithmic_mean_square(systems: list[System]) -> list[Claim]:
    """Return the claims of (fig:loglogX2)."""
    uneven, skewed = _pair(systems, UNEVEN)
    flat, control = _pair(systems, EVEN)
    anomalous = [uneven.last_slope, skewed.last_slope]
    normal, last = [flat.last_slope, control.last_slope], uneven.last_slope
    everywhere = observables.local_slope(uneven.rest)
    late = everywhere.sel(time=everywhere.time > TRANSIENT)
    steepest = late.isel(time=int(late.slope.values.argmax()))
    return [
        judged(
            "Anomalous diffusion when U is symmetric or asymmetric",
            f"slope over the last octave to t = {uneven.end:g}: {_slopes(uneven)},"
            f" {_slopes(skewed)}",
            all(found.slope > 1 + SIGNIFICANT * found.error for found in anomalous),
        ),
        judged(
            "In the control and flat U cases the diffusion is normal",
            f"slope {_slopes(flat)}, {_slopes(control)}",
            all(abs(found.slope - 1) < SIGNIFICANT * found.error for found in normal),
        ),
        repeated(
            "E[x²] grows like t² as soon as U is non-constant",
            f"slope {float(steepest.slope):.2f} ± {float(steepest.slope_error):.2f} at t ="
            f" {float(steepest.time):.0f} falls to {last.slope:.2f} at the end (theory:"
            f" {last.expected:.2f}) and, by theory, to 1: a crossover",
            THEOREM,
        ),
    ]


def claims_of_the_correlation(systems: list[System]) -> list[Claim]:
    """Return the claims of (fig:corX), stationary and, as in the paper, late in runs from rest."""
    uneven, even = _pair(systems, UNEVEN), _pair(systems, EVEN)
    scene = uneven[0].theory.scene
    assert isinstance(scene, Disk)
    shortest = TRANSIENT / theory.slip_rate(scene)
    kept = [
        _correlations(run, shortest)
        for system in uneven
        for run in (system.rest, system.stationary)
    ]
    lost = [_correlations(system.rest, shortest) for system in even]
    lag = float(kept[0].lag[0])
    first = [float(found[0]) for found in kept]
    last = [float(found[-1]) for found in kept]
    largest = max(float(np.abs(found).max()) for found in lost)
    return [
        judged(
            "With U symmetric or asymmetric the correlation is nonzero for longer than the"
            " time-scales of U and of friction",
            f"{min(first):.2f} to {max(first):.2f} at s = {lag:.0f}, {TRANSIENT} times 1/λ (λ: the"
            f" slip's decay rate); {min(last):.2f} to {max(last):.2f} at s ="
            f" {float(kept[0].lag[-1]):.0f}",
            min(first) > 0.5,
        ),
        judged(
            "In the other cases the correlation is negligible",
            f"at most {largest:.3f} from the same lag on, from rest as in the paper (on flat U"
            " under the invariant law it would tend to 1)",
            largest < 0.1,
        ),
    ]


def _correlations(run: xr.Dataset, shortest: float) -> xr.DataArray:
    """Return the correlations of increments at lags of at least `shortest`."""
    return run.increment_correlation.sel(lag=run.lag >= shortest)


def claims_of_the_mean_square(systems: list[System]) -> list[Claim]:
    """Return the claims of (fig:meanX2), and of (kskjhs3) for x + theta."""
    uneven, flat = _pair(systems, UNEVEN), named(systems)["flat"]
    grown = {system.name: 2**system.last_slope.slope for system in (*uneven, flat)}
    listed = ", ".join(f"{name} {factor:.2f}" for name, factor in grown.items())
    scene = flat.theory.scene
    assert isinstance(scene, Disk)
    rate, error = flat.rate("y")
    right, paper = theory.y_diffusion(scene), errata.y_diffusion(scene)
    return [
        repeated(
            "The mean squared displacement shows ballistic diffusion in the cases when U is"
            " symmetric or asymmetric and normal diffusion otherwise",
            f"increases by factors of {listed} as t doubles to {flat.end:g}; ballistic is 4,"
            " normal 2",
            THEOREM,
        ),
        judged(
            f"var(x + θ)/t tends to 2α²σ²/(c²(σ² + 1)) = {paper:.0f}",
            f"{rate:.0f} ± {error:.0f} (flat); correct is α²/c² = {right:.0f}",
            abs(rate - paper) < SIGNIFICANT * error,
        ),
    ]


def claims_of_the_diffusion(systems: list[System]) -> list[Claim]:
    """Return the claims of (fig:diffusionX), and of the theorem for flat U."""
    uneven, even = _pair(systems, UNEVEN), _pair(systems, EVEN)
    flat = even[0]
    rates = [system.rate("x") for system in even]
    expected = [float(system.theory.variance(system.end) / system.end) for system in even]
    listed = ", ".join(
        f"{system.name} {rate:.1f} ± {error:.1f} ({exact:.1f})"
        for system, (rate, error), exact in zip(even, rates, expected, strict=True)
    )
    scene = flat.theory.scene
    assert isinstance(scene, Disk)
    paper, right = errata.flat_x_diffusion(scene), theory.flat_x_diffusion(scene)
    slopes = [system.last_slope for system in uneven]
    doubled = ", ".join(f"{2 ** (slope.slope - 1):.2f}" for slope in slopes)
    return [
        repeated(
            "For the cases when U is flat and the control, the diffusion is normal",
            f"var(x)/t at t = {flat.end:g}, exact value in brackets: {listed}",
            "disk_msd",
        ),
        judged(
            f"If U is constant, var(x)/t tends to 2α²σ²/(c²(σ² + 1)(σ + 1)²) = {paper:.1f}",
            f"{rates[0][0]:.1f} ± {rates[0][1]:.1f}; correct is σ²α²/((1 + σ)²c²) = {right:.1f}",
            abs(rates[0][0] - paper) < SIGNIFICANT * rates[0][1],
        ),
        repeated(
            "Whereas in the other cases the diffusion is ballistic",
            f"var(x)/t increases by factors of {doubled} as t doubles to {flat.end:g} (symmetric,"
            " asymmetric), not by 2; by theory it tends to a constant",
            THEOREM,
        ),
    ]


def claims_of_the_histogram(systems: list[System]) -> list[Claim]:
    """Return the claims of (fig:histX)."""
    by_name = named(systems)
    spread = {name: float(np.sqrt(system.variance[-1])) for name, system in by_name.items()}
    listed = ", ".join(f"{name} {value:.3g}" for name, value in spread.items())
    return [
        judged(
            "A wider spread when U is symmetric or asymmetric",
            f"standard deviations of x at t = {systems[0].end:g}: {listed}",
            min(spread[name] for name in UNEVEN) > 2 * max(spread[name] for name in EVEN),
        )
    ]


def claim_of_agreement(disks: Disks) -> Claim:
    """Return the claim that MuJoCo's ensembles have the mean squares of the reference.

    MuJoCo's few replicas take their spread from the reference. Of three means of 64 squares, one is
    beyond four standard errors by chance in less than one of 300 samples.
    """
    reference = named(disks.reference)
    found, listed = [], []
    for system in disks.mujoco:
        many = reference[system.name]
        squares = [float(each.x("mean_square")[-1]) for each in (system, many)]
        ratio = many.rest.sizes["replica"] / system.rest.sizes["replica"]
        error = float(many.x("mean_square_error")[-1]) * np.sqrt([ratio, 1])
        found.append((squares[0] - squares[1]) / float(np.hypot(*error)))
        listed.append(
            f"{system.name} {squares[0]:.3g} ± {error[0]:.1g} against {squares[1]:.3g} ±"
            f" {error[1]:.1g}"
        )
    return judged(
        "Ours: MuJoCo's disk has the mean square of the reference",
        f"E[x²] at t = {disks.mujoco[0].end:g} by `{METHOD}` and by `{FULL['method']}`:"
        f" {', '.join(listed)}; the differences are {', '.join(f'{z:.1f}' for z in found)} standard"
        " errors",
        max(map(abs, found)) < SIGNIFICANT,
    )


def _claims(decided: Callable[[list[System]], list[Claim]], disks: Disks) -> list[Claim]:
    """Return the claims that the reference decides, and in one figure that MuJoCo agrees."""
    agreement = decided is claims_of_the_logarithmic_mean_square
    return decided(disks.reference) + [claim_of_agreement(disks)] * agreement


def _draw(name: str, disks: Disks, path: Path) -> None:
    systems = disks.reference
    guide = errata.paper_lines(systems, name)
    disk_figure(systems, name, path, guide=guide, beside=disks.mujoco)


PARAMETERS = (
    f"σ = 1/2, α = 5, c = 0.1, T = {FULL['duration']:g}, from rest at x = 0: {FULL['replicas']}"
    f" realizations by `{FULL['method']}` at h = {FULL['timestep']}; on top of these, in white in"
    f" the lower panels, {BESIDE['replicas']} realizations of each disk by `{METHOD}` at h ="
    f" {BESIDE['timestep']}."
)

DRAWN = {
    "mean": (
        "mean of the x-displacement",
        "E[x(t)] with a band of two standard errors. Dashed: theory.",
        claims_of_the_mean,
        8,
    ),
    "msd": (
        "mean squared displacement, logarithmic",
        "E[x(t)²]. Dashed: theory, continued beyond the paper's T. Dotted: the paper's t².",
        claims_of_the_logarithmic_mean_square,
        9,
    ),
    "correlation": (
        "correlation of the x-displacement",
        "Correlation of successive increments over s, stationary and late in a run from rest.",
        claims_of_the_correlation,
        10,
    ),
    "mean_square": (
        "mean squared position",
        "E[x(t)²] over t. Dashed: theory. Dotted: the paper's claim.",
        claims_of_the_mean_square,
        11,
    ),
    "diffusion": (
        "“diffusion” of the x-displacement",
        "var x(t) / t. Dashed: theory. Dotted: the paper's claim.",
        claims_of_the_diffusion,
        12,
    ),
    "histogram": (
        "histogram of the x-displacement",
        "Density of x at the end, with a Gaussian of the theoretical variance.",
        claims_of_the_histogram,
        13,
    ),
}

FIGURES = [
    Figure(
        f"disk_{name}",
        f"Sliding disk: {title}",
        f"{caption} {PARAMETERS}",
        paper_disks,
        partial(_claims, claims),
        partial(_draw, name),
        (number,),
        (METHOD, FULL["method"]),
    )
    for name, (title, caption, claims, number) in DRAWN.items()
]
