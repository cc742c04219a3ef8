"""Time averages along one path of the disk against the Gibbs measure, and how slowly they come."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from magmotor.common import style
from magmotor.devices.disk.gibbs import gibbs
from magmotor.devices.disk.scene import Disk
from magmotor.numerics.batch_means import mean_and_error
from magmotor.run.simulate import simulate
from magmotor.theory import gibbs_mean_squares, position_density
from paper.disk.relaxation import expected_correlation, expected_scatter, expected_stay, modes
from paper.figure import Claim, Figure, judged

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

METHOD = "variational/baoab"

TIMESTEP, INTERVAL = 0.05, 200
"""Timestep, and steps between records: 10 units of time, in which the slip is forgotten."""

UNIT = TIMESTEP * INTERVAL

FULL = {"duration": 1e7, "paths": 16, "stay": 2e5, "copies": 128}
QUICK = {"duration": 1e5, "paths": 128, "stay": 1.6e4, "copies": 64}
"""The first path starts at rest, the others in the Gibbs measure. `copies` start from each of
`STARTS` and last for `stay`."""

STARTS = (1.0, 2.0, 2.5, 3.0)
"""Values of d, in its standard deviations."""

BINS = 24

SIGNIFICANT = 5
"""Standard errors, from 16 paths, of a significant deviation: by chance one of 6000."""

COLORS = {"v + ω": style.GREEN, "d": style.BLUE, "d²": style.PURPLE}


@dataclass(frozen=True)
class Averages:
    """Statistics of the paths; velocities are in their standard deviations by Gibbs."""

    method: str
    duration: float
    densities: dict[str, tuple[Array, Array, Array]]
    """Centers of bins, density along the first path, and its error from eight batches."""
    squares: dict[str, Array]
    """Mean of the square along each path, shape (paths,)."""
    batches: tuple[float, float]
    """Error of the mean of d^2 along the first path, from eight batches and from many."""
    frozen: float
    """Mean of d^2 along one path on flat U that starts from d = 3."""
    times: Array
    scatter: dict[str, Array]
    """Root mean square, over windows of all paths, of averages over `times`."""
    lags: Array
    correlation: Array
    error: Array
    """C_d(t)/C_d(0) over `lags`, and its standard error from the scatter of the paths."""
    stay: Array
    """Times after the starts from given d."""
    kept: dict[float, tuple[Array, Array]]
    """Mean of d at these times over d at the start, and its standard error."""


@cache
def compute(quick: bool) -> Averages:
    """Simulate the paths."""
    scene, sizes = Disk(), QUICK if quick else FULL
    duration, paths = sizes["duration"], round(sizes["paths"])
    initial = gibbs(scene, paths, seed=40)
    for column in initial.values():
        column[0] = 0.0
    x, units = _simulated(scene, duration, initial)
    d = units["d"]
    own = {"v + ω": units["slip"], "d": d, "d²": (d**2 - 1) / 2**0.5}
    lengths = np.unique(np.geomspace(1, d.shape[1] / 2, 24).round().astype(int))
    shifts = np.unique(np.geomspace(1, d.shape[1] / 10, 20).round().astype(int))
    products = np.array([np.mean(d[:, :-n] * d[:, n:], axis=1) for n in shifts])
    densities = {"x": _density(np.mod(x[0], 2 * np.pi), 0.0, 2 * np.pi)}
    densities |= {name: _density(units[name][0], -4.0, 4.0) for name in ("v", "omega", "d")}
    flat = scene.replace(potential="flat")
    still = gibbs(flat, 1, seed=42, d=3 * gibbs_mean_squares(flat)["d"] ** 0.5)
    return Averages(
        METHOD,
        duration,
        densities,
        {name: np.mean(each**2, axis=1) for name, each in units.items()},
        (mean_and_error(d[0] ** 2)[1], _many_batches(d[0] ** 2)),
        float(np.mean(_simulated(flat, duration / 100, still)[1]["d"] ** 2)),
        lengths * UNIT,
        {name: np.array([_scatter(each, n) for n in lengths]) for name, each in own.items()},
        shifts * UNIT,
        products.mean(axis=1),
        products.std(axis=1, ddof=1) / paths**0.5,
        sizes["stay"] * np.geomspace(1 / 16, 1, 5),
        {start: _kept(scene, start, sizes) for start in STARTS},
    )


def _kept(scene: Disk, start: float, sizes: dict[str, float]) -> tuple[Array, Array]:
    """Return the mean of d at five times over d at the start, and its error."""
    copies, d = round(sizes["copies"]), start * gibbs_mean_squares(scene)["d"] ** 0.5
    initial = gibbs(scene, copies, seed=44, d=d)
    end = simulate(
        scene, method=METHOD, timestep=TIMESTEP, duration=sizes["stay"], replicas=copies, seed=45,
        record_interval=round(sizes["stay"] / 16 / TIMESTEP), initial=initial,
    ).isel(time=[1, 2, 4, 8, 16])  # fmt: skip
    left = ((scene.sigma * end.omega - end.v) / d).transpose("time", "replica").values
    return left.mean(axis=1), left.std(axis=1, ddof=1) / copies**0.5


def _simulated(scene: Disk, duration: float, initial: dict[str, Array]):
    """Return x, and velocities in their standard deviations, each of shape (paths, records)."""
    run = simulate(
        scene, method=METHOD, timestep=TIMESTEP, duration=duration, record_interval=INTERVAL,
        replicas=len(initial["x"]), seed=41, initial=initial,
    )  # fmt: skip
    x, v, omega = (run[name].transpose("replica", "time").values for name in ("x", "v", "omega"))
    values = {"v": v, "omega": omega, "slip": v + omega, "d": scene.sigma * omega - v}
    squares = gibbs_mean_squares(scene)
    return x, {name: each / squares[name] ** 0.5 for name, each in values.items()}


def _density(values: Array, least: float, most: float) -> tuple[Array, Array, Array]:
    edges = np.linspace(least, most, BINS + 1)
    width = edges[1] - edges[0]
    parts = [np.histogram(part, edges)[0] / len(part) for part in np.array_split(values, 8)]
    density = np.mean(parts, axis=0) / width
    return edges[:-1] + width / 2, density, np.std(parts, axis=0, ddof=1) / 8**0.5 / width


def _many_batches(series: Array) -> float:
    """Return the error of a mean from batches of 10 records, much shorter than the memory."""
    batches = series[: len(series) // 10 * 10].reshape(-1, 10).mean(axis=1)
    return float(batches.std(ddof=1) / len(batches) ** 0.5)


def _scatter(series: Array, size: int) -> float:
    count = series.shape[1] // size
    windows = series[:, : count * size].reshape(len(series), count, size).mean(axis=2)
    return float(np.sqrt(np.mean(windows**2)))


def claims(found: Averages) -> list[Claim]:
    """Return the claims of theorem 1, and ours about the time it takes."""
    return [_claim_of_ergodicity(found), _claim_of_mixing(found), _claim_of_the_gap(found)]


def _claim_of_ergodicity(found: Averages) -> Claim:
    paths = len(found.squares["d"])
    means = {name: float(each.mean()) for name, each in found.squares.items()}
    spreads = {name: float(each.std(ddof=1)) for name, each in found.squares.items()}
    firsts = {name: float(each[0]) for name, each in found.squares.items()}
    within = [abs(means[name] - 1) < SIGNIFICANT * spreads[name] / paths**0.5 for name in means]
    alone = [abs(firsts[name] - 1) < SIGNIFICANT * spreads[name] for name in firsts]
    names = {"v": "v²", "omega": "ω²", "slip": "(v + ω)²", "d": "d²"}
    listed = ", ".join(
        f"{names[name]} {firsts[name]:.3f} ± {spreads[name]:.3f}"
        f" ({means[name]:.3f} ± {spreads[name] / paths**0.5:.3f})"
        for name in names
    )
    return judged(
        "If U is non-constant, then the Gibbs measure μ is ergodic; furthermore, it is the unique,"
        " invariant probability measure (theorem)",
        f"means over time along one path from rest, T = {found.duration:g}, over those of Gibbs, in"
        f" brackets along {paths} paths; errors from the scatter of the paths: {listed}. On flat U"
        f" a path from d = 3 standard deviations keeps d² = {found.frozen:.2f}",
        all(within) and all(alone) and abs(found.frozen - 9) < 1e-6,
    )


def _claim_of_mixing(found: Averages) -> Claim:
    expected = expected_correlation(found.lags)
    agrees = (np.abs(found.correlation - expected) < SIGNIFICANT * found.error + 0.02).all()
    last = f"{found.correlation[-1]:.2f} ± {found.error[-1]:.2f} ({expected[-1]:.2f})"
    middle = int(np.abs(found.lags - 6684).argmin())
    return judged(
        "... and strongly mixing (theorem)",
        f"the correlation of d falls to {found.correlation[middle]:.2f} ± {found.error[middle]:.2f}"
        f" (reduced equation: {expected[middle]:.2f}) at a lag of {found.lags[middle]:.0f} and to"
        f" {last} at {found.lags[-1]:.0f}",
        bool(agrees and found.correlation[-1] + SIGNIFICANT * found.error[-1] < 1),
    )


def _claim_of_the_gap(found: Averages) -> Claim:
    rates, weights = modes(odd=False)
    memory = float(weights @ (1 / rates))
    last = {start: (mean[-1], error[-1]) for start, (mean, error) in found.kept.items()}
    listed = ", ".join(
        f"{mean:.2f} ± {error:.2f} ({expected_stay(start, found.stay)[-1]:.2f})"
        for start, (mean, error) in last.items()
    )
    agrees = all(
        (np.abs(mean - expected_stay(start, found.stay)) < 0.02 + SIGNIFICANT * error).all()
        for start, (mean, error) in found.kept.items()
    )
    eight, many = found.batches
    return judged(
        "Ours: there is no spectral gap, since D falls as d⁻⁴: the farther out d is, the longer it"
        " stays there, and averages wait for its rare stays",
        f"of d = {', '.join(f'{start:g}' for start in STARTS)} standard deviations, {listed} is"
        f" left after t = {found.stay[-1]:g} (reduced equation in brackets). The memory of d² is"
        f" {memory:.3g}, so that its mean along one path is known to 1 % after T ="
        f" {4 * memory / 1e-4:.1g}. Along one path, batches of 100 make the error of the mean of d²"
        f" {eight / many:.0f} times smaller than eight batches",
        agrees and last[3.0][0] > 0.4 + last[1.0][0],
    )


def draw(found: Averages, path: Path) -> None:
    """Draw marginals along one path, the scatter of averages, and the correlation of d."""
    with style.figure(12.5, 7.4) as figure:
        grid = figure.add_gridspec(2, 4)
        axes = [figure.add_subplot(grid[0, k]) for k in range(4)]
        _draw_marginals(axes, found)
        _draw_scatter(figure.add_subplot(grid[1, :2]), found)
        _draw_stays(figure.add_subplot(grid[1, 2:]), found)
        style.save(figure, path, dpi=85)


def _draw_marginals(row: list["Axes"], found: Averages) -> None:
    labels = {"x": "x mod 2π (dimensionless)", "v": "v", "omega": "ω", "d": "d = σω − v"}
    for axes, (name, (centers, density, error)) in zip(row, found.densities.items(), strict=True):
        line = np.linspace(centers[0], centers[-1], 200)
        gauss = np.exp(-(line**2) / 2) / (2 * np.pi) ** 0.5
        law = position_density(Disk(), line) if name == "x" else gauss
        axes.plot(line, law, color=style.ORANGE, label="Gibbs")
        axes.errorbar(
            centers, density, 2 * error, fmt="o", ms=3, lw=0.9, color=style.BLUE, label="one path"
        )
        in_units = "" if name == "x" else " (standard deviations)"
        axes.set(xlabel=labels[name] + in_units)
        if name == "x":
            axes.set(ylim=(0.15, 0.168), ylabel="density", title="From rest, T = 10⁷")
            axes.legend(loc="upper right")


def _draw_scatter(axes: "Axes", found: Averages) -> None:
    for name, scatter in found.scatter.items():
        axes.plot(found.times, scatter, "o", ms=4, color=COLORS[name], label=name)
    t = np.geomspace(UNIT, 1e10, 200)
    axes.plot(t, np.minimum(1, (UNIT / t) ** 0.5), color=style.GREEN, lw=1, label="independent")
    for odd, label in ((True, "reduced equation"), (False, None)):
        axes.plot(t, expected_scatter(odd, t), color=style.ORANGE, lw=1.2, label=label)
    axes.axhline(0.01, ls=":", color=style.INK, lw=1)
    axes.annotate("1 %", (15, 0.011), color=style.INK)
    axes.set(
        xscale="log", yscale="log", ylim=(1e-3, 1.6), xlabel="T (dimensionless)",
        ylabel="scatter of the average over T", title="How slowly averages converge",
    )  # fmt: skip
    axes.legend(loc="lower left", ncols=2)


def _draw_stays(axes: "Axes", found: Averages) -> None:
    t = np.geomspace(100, 1e8, 200)
    axes.plot(t, expected_correlation(t), "--", color=style.INK, lw=1.2, label="correlation of d")
    axes.errorbar(
        found.lags, found.correlation, 2 * found.error, fmt="x", ms=4, lw=0.8, color=style.INK
    )
    colors = (style.GREEN, style.BLUE, style.PURPLE, style.GRAY)
    for (start, (mean, error)), color, marker in zip(
        found.kept.items(), colors, "os^D", strict=True
    ):
        axes.errorbar(
            found.stay, mean, 2 * error, fmt=marker, ms=4, lw=1, color=color,
            label=f"from d = {start:g}",
        )  # fmt: skip
        axes.plot(t, expected_stay(start, t), color=style.ORANGE, lw=1.2)
    axes.set(
        xscale="log", xlim=(100, 1e8), ylim=(-0.15, 1.1), xlabel="t (dimensionless)",
        ylabel="part of d that is left",
        title="Mixing, without a spectral gap",
    )  # fmt: skip
    axes.legend(loc="upper right")


FIGURE = Figure(
    "disk_ergodicity",
    "Ergodicity of the disk",
    f"The paper's disk on U = sin x, by `{METHOD}` at h = {TIMESTEP}. Above: the fraction of"
    " time that one path spends in each bin, with two standard errors from eight batches, and"
    " the marginals of the Gibbs measure. Below left: the scatter of averages over a time T"
    f" along {FULL['paths']} paths, in units of the standard deviation of each quantity. Below"
    " right: the mean of d after starts from several values of d (in standard deviations of d,"
    f" {FULL['copies']} paths each), and the correlation of d. Curves: the reduced equation of d,"
    " with nothing fitted. For long T, the points on the left lie below the curves:"
    f" {FULL['paths']} paths hardly sample the rare stays beyond three standard deviations; the"
    " curves on the right are correct for these.",
    compute,
    claims,
    draw,
    methods=(METHOD,),
)
