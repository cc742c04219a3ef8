"""Friction of one combination of velocities against friction of both, at one temperature."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor import observables
from magmotor.common import style
from magmotor.devices.disk.gibbs import gibbs
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.run.ensemble import ensemble
from magmotor.theory import ReducedDisk, flat_msd_from_gibbs
from paper.disk.flights import slopes
from paper.figure import Claim, Figure, judged

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

METHOD = "variational/baoab"

TIMESTEP = 0.05


def dragged(part: float) -> Disk:
    """Return the paper's disk with the drag `part` c on v and sigma `part` c on omega.

    Both velocities then decay at the same rate, as in isotropic friction.
    """
    disk = Disk()
    drag = part * disk.friction
    return disk.replace(drag=drag, rotational_drag=disk.sigma * drag)


PARTS = (1e-3, 1e-2, 0.1, 1.0)
"""Drags, over the friction c of the slip."""

SLIP, FLAT, PARTICLE = "slip only, U = sin x", "slip only, U = 0", "no rotation"

SCENES: dict[str, Disk | LangevinParticle] = {
    FLAT: Disk(potential="flat"),
    SLIP: Disk(),
    **{f"drag {100 * part:g} % of c": dragged(part) for part in PARTS},
    PARTICLE: LangevinParticle(),
}

DRAGS = tuple(name for name in SCENES if name.startswith("drag"))

COLORS = (style.INK, style.BLUE, style.GREEN, style.ORANGE, style.PURPLE, style.GRAY, "#56b4e9")
MARKERS = "^os>vDx"

WEAK = Disk(friction_ratio=1e-3)
"""The paper's friction matrix with 0.1 % of its eigenvalue on the second direction."""

FULL = {"replicas": 1024, "duration": 131_072.0}
QUICK = {"replicas": 256, "duration": 4096.0}
"""Errors come from groups of 128 replicas."""

LAG = 1024.0
"""Lag from which the slopes of all systems are compared."""

SIGNIFICANT = 4
"""Standard errors of a significant deviation."""

THEORY = 0.05
"""Relative error of the reduced equation at the paper's temperature, at most."""


@dataclass(frozen=True)
class Displacements:
    """Ensembles in the Gibbs measure by name, and one from rest with weak second friction."""

    runs: dict[str, xr.Dataset]
    rest: xr.Dataset


def compute(quick: bool) -> Displacements:
    """Simulate all systems."""
    sizes = QUICK if quick else FULL
    replicas = round(sizes["replicas"])
    runs = {
        name: ensemble(
            scene, method=METHOD, timestep=TIMESTEP, duration=sizes["duration"], seed=51 + number,
            replicas=replicas, initial=gibbs(scene, replicas, seed=50), trajectories=1,
        )
        for number, (name, scene) in enumerate(SCENES.items())
    }  # fmt: skip
    rest = ensemble(
        WEAK, method=METHOD, timestep=TIMESTEP, duration=20_000.0, seed=61,
        replicas=2 * replicas, trajectories=2 * replicas, sample_interval=200,
    )  # fmt: skip
    return Displacements(runs, rest)


@cache
def _model(name: str) -> ReducedDisk:
    scene = SCENES[name]
    assert isinstance(scene, Disk)
    return ReducedDisk(scene)


def expected(name: str, t: Array) -> Array:
    """Return the mean square from the Gibbs measure: exact on flat U, else by theory."""
    scene = SCENES[name]
    if isinstance(scene, LangevinParticle) or not scene.coefficients:
        return flat_msd_from_gibbs(scene, t)
    return _model(name).msd_from_gibbs(t)


def claims(found: Displacements) -> list[Claim]:
    """Return the claims about degenerate and anisotropic friction."""
    return [
        _claim_of_degeneracy(found),
        _claim_of_three_attributes(found),
        _claim_of_anisotropy(found.rest),
        _claim_of_drag(found),
    ]


def _slope(found: Displacements, name: str) -> tuple[float, float]:
    run = found.runs[name]
    at = int(np.abs(run.lag.values - LAG).argmin())
    slope, error = slopes(run)
    return float(slope[at]), float(error[at])


def _said(slope: tuple[float, float]) -> str:
    return f"{slope[0]:.2f} ± {slope[1]:.2f}"


def _claim_of_degeneracy(found: Displacements) -> Claim:
    only, most = _slope(found, SLIP), _slope(found, DRAGS[-1])
    between = ", ".join(_said(_slope(found, name)) for name in DRAGS[:-1])
    return judged(
        "One can obtain anomalous diffusion by introducing degenerate noise and friction in the"
        " momentums (introduction)",
        f"slope of the mean square from a lag of {LAG:.0f} to twice it, in the Gibbs measure:"
        f" {_said(only)} if friction and noise act on the slip only, {_said(most)} if a drag as"
        f" large as c at the same temperature acts on v and ω, and {between} if it is 0.1, 1 and"
        " 10 % of c. (By theory, all slopes are 1 in the end.)",
        only[0] - SIGNIFICANT * only[1] > 1.5 > most[0] + SIGNIFICANT * most[1],
    )


def _claim_of_three_attributes(found: Displacements) -> Claim:
    regular, still = _slope(found, DRAGS[-1]), _slope(found, PARTICLE)
    flat = _slope(found, FLAT)
    normal = all(abs(each[0] - 1) < 0.1 + SIGNIFICANT * each[1] for each in (regular, still))
    potential = flat[0] + SIGNIFICANT * flat[1] < 1.5
    return judged(
        "This phenomenon is caused by interaction of three attributes: a non flat potential energy"
        " landscape, a rigid body effect, and the degeneracy of the noise/friction tensor"
        " (abstract)",
        f"the same slope without degeneracy: {_said(regular)}; without rotation: {_said(still)};"
        f" but without the potential: {_said(flat)}, forever. From rest, where d = 0, the potential"
        " is needed to heat d",
        normal and potential,
        otherwise="in part" if normal else "wrong",
    )


def _claim_of_anisotropy(rest: xr.Dataset) -> Claim:
    local = observables.local_slope(rest)
    late = local.sel(time=local.time > 30)
    steepest, last = late.isel(time=int(late.slope.values.argmax())), late.isel(time=-1)
    theory = ReducedDisk(WEAK)
    times = np.geomspace(30, 20_000, 100)
    slope = theory.slope_from_rest(times)
    decades = np.log10(times[-1] / times[0]) / (len(times) - 1)
    steep, ballistic = (decades * np.sum(near) for near in (slope > 1.5, np.abs(slope - 2) < 0.1))
    agrees = abs(steepest.slope - theory.slope_from_rest(float(steepest.time))) < 0.1
    return judged(
        "Adding a non-degenerate, but anisotropic dissipation matrix: if the anisotropy is large"
        " enough, E[x²] is ballistic for a long period of time",
        f"from rest, with 0.1 % of the eigenvalue on the second direction, the slope is"
        f" {float(steepest.slope):.2f} ± {float(steepest.slope_error):.2f} at t ="
        f" {float(steepest.time):.0f} and {float(last.slope):.2f} ± {float(last.slope_error):.2f}"
        f" at {float(last.time):.0f}. By theory it is above 1.5 for {steep:.1f} decades, but within"
        f" 0.1 of 2 for only {ballistic:.1f} of them, in passing",
        bool(agrees and ballistic > 1),
        otherwise="in part" if agrees and steep > 1 else "wrong",
    )


def _diffusion(run: xr.Dataset) -> tuple[float, float, float]:
    """Return a lag with eight windows, and the mean square over twice it, with its error."""
    lag = float(run.lag[-2])
    square = float(run.mean_square_increment[-2]) / (2 * lag)
    return lag, square, float(run.mean_square_increment_error[-2]) / (2 * lag)


def _claim_of_drag(found: Displacements) -> Claim:
    listed, apart, lag = [], [], 0.0
    for name in (SLIP, *DRAGS):
        lag, measured, error = _diffusion(found.runs[name])
        theory = float(expected(name, np.array([lag]))[0]) / (2 * lag)
        listed.append(f"{measured:.3g} ± {error:.1g} ({theory:.3g})")
        apart.append(abs(measured / theory - 1) - SIGNIFICANT * error / theory)
    limits = [float(_model(name).x_diffusion) for name in (SLIP, *DRAGS)]
    ratio = limits[0] / limits[1]
    return judged(
        "Ours: a drag of 0.1 % of the friction takes most of the diffusion that degeneracy gives",
        f"mean square over 2t at t = {lag:.0f} with a drag of 0, 0.1, 1, 10 and 100 % of c (theory,"
        f" nothing fitted): {', '.join(listed)}. In the end it is, by theory,"
        f" {', '.join(f'{limit:.3g}' for limit in limits[1:])}, and {limits[0]:.3g} without drag:"
        f" {ratio:.0f} times as much as with the least",
        max(apart) < THEORY and ratio > 2,
    )


def draw(found: Displacements, path: Path) -> None:
    """Draw the growth of the mean square, and the diffusion over the drag."""
    with style.figure(12.0, 4.8) as figure:
        left, right = figure.subplots(1, 2)
        for (name, run), color, marker in zip(found.runs.items(), COLORS, MARKERS, strict=True):
            _draw_growth(left, name, run, color, marker)
        left.set(
            xscale="log", yscale="log", xlabel="t (dimensionless)",
            ylabel="mean square of x(t) − x(0), over 2t",
            title="In the Gibbs measure, kT = 125",
        )  # fmt: skip
        left.legend(loc="upper left", fontsize=8)
        _draw_diffusion(right, found)
        style.save(figure, path, dpi=90)


def _draw_growth(axes: "Axes", name: str, run: xr.Dataset, color: str, marker: str) -> None:
    known = run.isel(lag=slice(0, -1))
    lag = known.lag.values
    axes.errorbar(
        lag, known.mean_square_increment / (2 * lag), known.mean_square_increment_error / lag,
        fmt=marker, ms=4, lw=1, color=color, label=name,
    )  # fmt: skip
    t = np.geomspace(lag[0], 100 * lag[-1], 60)
    axes.plot(t, expected(name, t) / (2 * t), color=color, lw=1)


def _draw_diffusion(axes: "Axes", found: Displacements) -> None:
    parts = np.geomspace(1e-6, 3, 30)
    curves = {
        "U = sin x, theory": [ReducedDisk(dragged(part)).x_diffusion for part in parts],
        "U = 0, exact": [float(flat_msd_from_gibbs(dragged(part), 1e12)) / 2e12 for part in parts],
    }
    for (label, values), color in zip(curves.items(), (style.BLUE, style.INK), strict=True):
        axes.plot(100 * parts, values, color=color, lw=1.3, label=label)
    measured = [_diffusion(found.runs[name]) for name in DRAGS]
    axes.errorbar(
        100 * np.array(PARTS), [each[1] for each in measured], [2 * each[2] for each in measured],
        fmt="o", ms=5, color=style.BLUE, label=f"measured at t = {measured[0][0]:.0f}",
    )  # fmt: skip
    axes.axhline(_model(SLIP).x_diffusion, ls=":", color=style.BLUE, label="U = sin x, no drag")
    axes.set(
        xscale="log", yscale="log", xlabel="drag, % of the friction c",
        ylabel="mean square of x over 2t, in the end", title="A little drag ends the long flights",
    )  # fmt: skip
    axes.legend(loc="lower left")


FIGURE = Figure(
    "disk_friction",
    "Friction of the slip only, and of all velocities",
    "The paper's disk at its kT, with friction and noise on the slip v + ω only, and with a"
    " drag on v and ω that obeys the same fluctuation-dissipation relation, from 0.1 to 100 % of"
    f" c (σ times as much on ω). {FULL['replicas']} replicas of each in the Gibbs measure, by"
    f" `{METHOD}` at h = {TIMESTEP}, for T = {FULL['duration']:g}, with two standard errors."
    " Left: the curves are theory, exact for flat U and for the particle. Right: the diffusion"
    " coefficient of x in the end, over the drag.",
    compute,
    claims,
    draw,
    methods=(METHOD,),
)
