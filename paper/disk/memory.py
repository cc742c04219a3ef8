"""What ends the disk's memory: the correlation of d = sigma omega - v with and without U."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common import style
from magmotor.devices.disk.gibbs import gibbs
from magmotor.devices.disk.scene import Disk
from magmotor.run.simulate import simulate
from magmotor.theory import ReducedDisk, gibbs_mean_squares
from paper.figure import Claim, Figure, judged

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

METHOD = "variational/baoab"

TIMESTEP, INTERVAL = 0.05, 200
"""Timestep, and steps between records."""

SCENES = {
    "U = 0": Disk(potential="flat"),
    "U = ½ sin x": Disk(potential=((0.5, 0.0),)),
    "U = sin x": Disk(),
    "U = 2 sin x": Disk(potential=((2.0, 0.0),)),
    "U = sin x, drag": Disk(drag=1e-3, rotational_drag=5e-4),
}
"""Disks at the paper's kT; the drag is 1 % of the friction, with the same temperature."""

FLAT, HALF, PAPERS, DOUBLE, DRAGGED = SCENES

COLORS = dict(
    zip(SCENES, (style.INK, style.GREEN, style.BLUE, style.PURPLE, style.GRAY), strict=True)
)
MARKERS = dict(zip(SCENES, "^soDv", strict=True))

SIGNIFICANT = 4
"""Standard errors of a significant deviation."""


@dataclass(frozen=True)
class Memory:
    """Correlations of d under the invariant law, and a few paths of d."""

    method: str
    lags: Array
    correlation: dict[str, Array]
    """C_d(t)/C_d(0) over `lags`, by the name of the scene."""
    error: dict[str, Array]
    paths: dict[str, xr.DataArray]
    """d(t) of three replicas, on flat U and on U = sin x."""
    drift: float
    """Largest change of d on flat U, in its standard deviations."""


@cache
def compute(quick: bool) -> Memory:
    """Simulate the disks from the Gibbs measure."""
    replicas, duration = (512, 4e3) if quick else (2048, 2e4)
    records = round(duration / TIMESTEP / INTERVAL)
    shifts = np.unique(np.geomspace(1, 0.75 * records, 16).round().astype(int))
    found, paths = {}, {}
    drift = 0.0
    for name, scene in SCENES.items():
        run = simulate(
            scene, method=METHOD, timestep=TIMESTEP, duration=duration, record_interval=INTERVAL,
            replicas=replicas, seed=31, initial=gibbs(scene, replicas, seed=30),
        )  # fmt: skip
        d = (scene.sigma * run.omega - run.v).transpose("replica", "time")
        found[name] = _correlation(d.values, shifts, gibbs_mean_squares(scene)["d"])
        if name in (FLAT, PAPERS):
            paths[name] = d.isel(replica=slice(3))
        if name == FLAT:
            change = np.abs(d.values - d.values[:, :1]).max()
            drift = float(change / gibbs_mean_squares(scene)["d"] ** 0.5)
    means = {name: each[0] for name, each in found.items()}
    errors = {name: each[1] for name, each in found.items()}
    return Memory(METHOD, shifts * TIMESTEP * INTERVAL, means, errors, paths, drift)


def _correlation(d: Array, shifts: NDArray[np.int64], variance: float) -> tuple[Array, Array]:
    """Return C_d/C_d(0) at lags, relative to each sample's own mean square, and its error.

    The replicas are independent; the error is that of a ratio of their means, to first order.
    """
    means, errors = [], []
    for shift in shifts:
        products = np.mean(d[:, :-shift] * d[:, shift:], axis=1) / variance
        squares = np.mean(d**2, axis=1) / variance
        ratio = products.mean() / squares.mean()
        means.append(ratio)
        errors.append(np.std(products - ratio * squares) / squares.mean() / len(d) ** 0.5)
    return np.array(means), np.array(errors)


@cache
def _model(name: str) -> ReducedDisk:
    return ReducedDisk(SCENES[name])


def _expected(name: str, lags: Array) -> Array:
    return _model(name).d_correlation(lags) / _model(name).mean_square


def claims(memory: Memory) -> list[Claim]:
    """Return the claims of the paper's last remark on v_t, and ours."""
    at = int(np.abs(memory.lags - 2500).argmin())
    lag = memory.lags[at]
    kept = {name: (memory.correlation[name][at], memory.error[name][at]) for name in SCENES}
    said = {name: f"{value:.3f} ± {error:.3f}" for name, (value, error) in kept.items()}
    uneven = (HALF, PAPERS, DOUBLE, DRAGGED)
    apart, error = (
        np.concatenate(parts)
        for parts in (
            [memory.correlation[name] - _expected(name, memory.lags) for name in uneven],
            [memory.error[name] for name in uneven],
        )
    )
    worst = int(np.abs(apart).argmax())
    twice = np.interp(np.log(lag / 4), np.log(memory.lags), memory.correlation[DOUBLE])
    return [
        judged(
            "The long term memory effect has its origin in the term ∫∂U/∂x ds of the velocity,"
            " which is equal to zero when U is constant",
            f"correlation of d at a lag of {lag:.0f}: without U it is 1, since d changes by less"
            f" than {max(memory.drift, 1e-15):.0e} of its spread; U = ½ sin x {said[HALF]}, sin x"
            f" {said[PAPERS]}, 2 sin x {said[DOUBLE]}. U ends the memory. Only from rest, d = 0,"
            " must U first heat d",
            kept[PAPERS][0] > kept[FLAT][0] - SIGNIFICANT * kept[PAPERS][1],
        ),
        judged(
            "... and itself has its origin in the rigid body interaction between rotation and"
            " translation and the fact the friction matrix is singular",
            f"with a drag of 1 % of the friction on v and ω, which makes the matrix regular, the"
            f" correlation at a lag of {lag:.0f} is {said[DRAGGED]}, instead of {said[PAPERS]}",
            kept[DRAGGED][0] < kept[PAPERS][0] / 2,
        ),
        judged(
            "Ours: d forgets as by the reduced equation, with nothing fitted",
            f"at {len(memory.lags)} lags from {memory.lags[0]:.0f} to {memory.lags[-1]:.0f} and for"
            f" {len(uneven)} disks, the correlations differ by at most {abs(apart[worst]):.3f} ±"
            f" {error[worst]:.3f}",
            bool((np.abs(apart) < 0.02 + SIGNIFICANT * error).all()),
        ),
        judged(
            "Ours: a potential twice as high ends the memory four times as fast",
            f"2 sin x at a lag of {lag / 4:.0f}: {twice:.3f}; sin x at {lag:.0f}: {said[PAPERS]}",
            abs(twice - kept[PAPERS][0]) < SIGNIFICANT * 2**0.5 * kept[PAPERS][1] + 0.02,
        ),
    ]


def draw(memory: Memory, path: Path) -> None:
    """Draw paths of d, and its correlation."""
    with style.figure(11.5, 4.4) as figure:
        left, right = figure.subplots(1, 2)
        _draw_paths(left, memory)
        times = np.geomspace(memory.lags[0], 20 * memory.lags[-1], 40)
        right.axhline(1, color=style.INK, lw=1)
        for name in SCENES:
            right.errorbar(
                memory.lags, memory.correlation[name], 2 * memory.error[name], fmt=MARKERS[name],
                ms=4, lw=1, color=COLORS[name], label=name,
            )  # fmt: skip
            if name != FLAT:
                label = "theory, nothing fitted" if name == HALF else None
                right.plot(times, _expected(name, times), color=style.ORANGE, lw=1.2, label=label)
        right.set(
            xscale="log", xlabel="lag t (dimensionless)", ylim=(-0.08, 1.1),
            ylabel="correlation of d at two times",
            title="U ends the memory; without U it is perfect",
        )  # fmt: skip
        right.legend(loc="lower left")
        style.save(figure, path, dpi=90)


def _draw_paths(axes: "Axes", memory: Memory) -> None:
    for name, style_of_line in ((PAPERS, "-"), (FLAT, "--")):
        for row, d in enumerate(memory.paths[name]):
            label = name if row == 0 else None
            axes.plot(d.time, d, style_of_line, color=COLORS[name], lw=1, label=label)
    axes.set(
        xlabel="t (dimensionless)",
        ylabel="d = σω − v (dimensionless)",
        title="Three paths each under the invariant law",
    )
    bottom, top = axes.get_ylim()
    axes.set_ylim(bottom - 0.14 * (top - bottom), top)  # room for the legend
    axes.legend(loc="lower right", ncols=2)


FIGURE = Figure(
    "disk_memory",
    "What ends the disk's memory",
    f"Disks at the paper's σ, c and α, in the Gibbs measure, by `{METHOD}` at h = {TIMESTEP}."
    " Left: d = σω − v; friction and noise do not act on d, so ḋ = U′ exactly. Right: the"
    " correlation of d over time with two standard errors, for potentials of several heights,"
    " and with a background drag of 1 % of c on v and of 0.5 % on ω. Curves: the reduced"
    " equation of d.",
    compute,
    claims,
    draw,
    methods=(METHOD,),
)
