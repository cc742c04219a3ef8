"""How much dry friction lets the top acquire spin."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common import style
from magmotor.devices.ball.landscape import valley
from magmotor.devices.top.scene import SMALLEST_DRY_FRICTION, Top
from magmotor.run.simulate import simulate
from paper.bracket import bracket
from paper.figure import Claim, Figure, judged
from paper.top.dry_friction import (
    Rolling,
    hertz_torsional_coefficient,
    rolling,
    spin_per_coulomb,
    stopping_coefficients,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Bracket = tuple[float, float]

METHOD, TIMESTEP = "mujoco/euler", 0.004
"""The longest step, in s, that dry friction allows is 0.005."""

HALF, TWENTIETH, HUNDREDTH = 0.5, 0.05, 0.01
"""Levels of the spin relative to the paper's fourth case."""

STUCK = 1e-3
"""Slip, in m/s, that a sticking ball does not reach; in the fourth case it is 0.04."""

STEEL_ON_STEEL, HERTZ_FRICTION = 1.1e11, 0.3
"""E* in Pa, and the friction coefficient of a dry contact."""

WEAK = 1e-3
"""Coulomb coefficient up to which F = -c V_Q is the larger friction."""

AFTER = 1e-4
"""Friction torque over load, in m, at which the ball no longer moves in the valley."""


def _beside(coefficient: float) -> Top:
    return Top(surface="plane", coulomb_friction=coefficient)


def _instead(coefficient: float) -> Top:
    return _beside(coefficient).replace(friction=0.0)


def _torsional(coefficient: float) -> Top:
    return _beside(SMALLEST_DRY_FRICTION).replace(torsional_friction=coefficient)


def _rolling(coefficient: float) -> Top:
    return _torsional(SMALLEST_DRY_FRICTION).replace(rolling_friction=coefficient)


SCENES: dict[str, tuple[Callable[[float], Top], float]] = {
    "beside": (_beside, 1.0),
    "instead": (_instead, 1.0),
    "torsional": (_torsional, 1e-3),
    "rolling": (_rolling, 1e-3),
}
"""Scenes as functions of a coefficient, and its largest value; the smallest is MuJoCo's."""

DECADES: dict[tuple[str, float], Bracket] = {
    ("instead", HALF): (1e-3, 1e-4),
    ("instead", HUNDREDTH): (1e-4, 1e-5),
    ("torsional", HALF): (1e-5, 1e-4),
    ("torsional", TWENTIETH): (1e-5, 1e-4),
    ("torsional", HUNDREDTH): (1e-5, 1e-4),
    ("rolling", HALF): (1e-5, 1e-4),
    ("rolling", TWENTIETH): (1e-5, 1e-4),
    ("rolling", HUNDREDTH): (1e-4, 1e-3),
}
"""Coefficients between which the spin crosses a level: above it first, below it second."""


@dataclass(frozen=True)
class DryFriction:
    """Spins in rad/s; Coulomb coefficients are dimensionless, the others in m."""

    viscous: float
    """Spin without dry friction."""
    spins: dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]
    """Coefficients, and the spin for each, by type of friction."""
    thresholds: dict[tuple[str, float], Bracket]
    """By type and level: the coefficients with the spin above the level, and below it."""
    sticking: Bracket
    """Coulomb coefficients, without viscous friction, at which the ball slips, and sticks."""
    reach: float
    """Largest distance, in m, of the sticking ball from the center."""
    valley: float
    """Largest distance, in m, of the valley from the center."""
    stuck: Rolling
    """Predictions of energy and statics for the sticking ball."""
    slope: float
    """First-order estimate of the spin over a small Coulomb coefficient."""
    stopping: tuple[float, float]
    """Torsional and rolling coefficients that hold the ball in the valley, by statics."""
    hertz: float
    """Torsional coefficient of a hard contact."""
    step_error: float
    """Largest relative change of a spin with half the timestep."""


@cache
def compute(quick: bool) -> DryFriction:
    """Scan and bracket the coefficients."""
    duration, ratio, points = (60.0, 1.2, 3) if quick else (100.0, 1.02, 16)
    viscous = _spin(Top(surface="plane"), duration)
    spins = {}
    for kind, (scene_of, largest) in SCENES.items():
        coefficients = np.geomspace(SMALLEST_DRY_FRICTION, largest, points)
        values = [_spin(scene_of(float(b)), duration) for b in coefficients]
        spins[kind] = coefficients, np.array(values)
    thresholds = {}
    for (kind, level), ends in DECADES.items():

        def above(b: float, scene_of=SCENES[kind][0], level=level) -> bool:
            return _spin(scene_of(b), duration) > level * viscous

        thresholds[kind, level] = bracket(above, *ends, ratio)
    sticking = bracket(lambda mu: _slip(_run(_instead(mu), duration)) > STUCK, 1e-3, 0.1, ratio)
    held = _run(_instead(0.3), duration).position.values[:, :2]
    probes = [_beside(0.3), _instead(1e-3), _torsional(2e-5), _rolling(2e-5)]
    pairs = [[_spin(scene, duration, h) for h in (TIMESTEP, TIMESTEP / 2)] for scene in probes]
    return DryFriction(
        viscous,
        spins,
        thresholds,
        sticking,
        float(np.hypot(*held.T).max()),
        float(np.hypot(*valley(Top(), np.linspace(0.0, 2 * np.pi, 181)).T).max()),
        rolling(Top(surface="plane")),
        _first_order(Top()),
        stopping_coefficients(Top()),
        hertz_torsional_coefficient(Top(), HERTZ_FRICTION, STEEL_ON_STEEL),
        max(abs(whole / half - 1) for whole, half in pairs),
    )


@cache
def _spin(scene: Top, duration: float, timestep: float = TIMESTEP) -> float:
    """Return the largest |J|/I_3, in rad/s."""
    momentum = _run(scene, duration, timestep).momentum_map
    return float(np.abs(momentum).max()) / scene.inertia[2]


def _first_order(scene: Top) -> float:
    smooth = scene.replace(friction=0.0)
    run = simulate(smooth, method="scipy/dop853", timestep=0.02, duration=30.0)
    return spin_per_coulomb(run, smooth)


def _slip(run: xr.Dataset) -> float:
    """Return the largest slip along the plane, in m/s."""
    return float(np.linalg.norm(run.slip_velocity.values[:, :2], axis=1).max())


def _run(scene: Top, duration: float, timestep: float = TIMESTEP) -> xr.Dataset:
    interval = round(0.02 / timestep)
    return simulate(
        scene, method=METHOD, timestep=timestep, duration=duration, record_interval=interval
    )


def claims(data: DryFriction) -> list[Claim]:
    """Return the claims that the scans decide."""
    half, hundredth = data.thresholds["instead", HALF], data.thresholds["instead", HUNDREDTH]
    least = float(data.spins["beside"][1].min())
    strong = float(data.spins["instead"][1][-1])
    torsional, stops = (data.thresholds["torsional", level] for level in (HALF, HUNDREDTH))
    by_torsion, by_rolling = data.stopping
    coefficients, beside = data.spins["beside"]
    changed = float(np.abs(beside[coefficients <= WEAK] / data.viscous - 1).max())
    left = {kind: np.interp(AFTER, *data.spins[kind]) for kind in ("torsional", "rolling")}
    return [
        judged(
            "“the magnetic top exhibits this curious rotation even on oily surfaces”",
            f"with Coulomb friction alone the spin is half of the viscous case's"
            f" {data.viscous:.3g} rad/s at μ {_between(half)}, 1 % of it at {_between(hundredth)}"
            f" (first order: {HALF * data.viscous / data.slope:.1e},"
            f" {HUNDREDTH * data.viscous / data.slope:.1e})",
            half[0] < 0.01,
        ),
        judged(
            "Ours: Coulomb friction, however large, does not hinder the spin",
            f"beside the viscous friction the spin is at least {least:.3g} rad/s for all"
            f" μ ≤ 1; alone, with μ = 1, it is {strong:.4g} rad/s, by rolling"
            f" (energy: {data.stuck.spin:.4g} rad/s)",
            min(least, strong) > 0.9 * data.viscous,
        ),
        judged(
            "“This law assumes zero static friction but, is nevertheless reasonable on very"
            " slippery surfaces where static friction is negligible” (F = -c V_Q)",
            f"where it is, μ ≤ {WEAK:g}, Coulomb friction beside F = -c V_Q changes the spin by at"
            f" most {100 * changed:.2g} %; where it is not, the law fails: from μ"
            f" {_between(data.sticking)} on, Coulomb friction alone makes the contact stick"
            " (statics:"
            f" {data.stuck.coulomb:.3g}, or {data.stuck.coulomb_librating:.3g} while the axis"
            f" librates), and the ball rolls in a closed curve within {data.reach:.3f} m of the"
            f" center, while F = -c V_Q takes it to the valley at {data.valley:.3f} m",
            changed < 0.1 and data.sticking[0] < 0.1 and data.reach < 0.9 * data.valley,
        ),
        judged(
            "“A more refined model of friction would include rotational torque and dry frictional"
            " effects (Coulomb friction)”",
            f"torsional friction halves the spin at {_millimeters(torsional)} and leaves 1 % at"
            f" {_millimeters(stops)} (statics: it holds the ball above {1e3 * by_torsion:.3f} mm);"
            f" a Hertzian contact of steel with μ = {HERTZ_FRICTION} has"
            f" {1e3 * data.hertz:.3f} mm",
            stops[0] < 1e-4,
        ),
        judged(
            "Ours: rolling friction stops the top as torsional friction does",
            "rolling and torsional friction leave half the spin at"
            f" {_against(data, HALF)}, 5 % at {_against(data, TWENTIETH)} (statics:"
            f" {1e3 * by_rolling:.3f} against {1e3 * by_torsion:.3f} mm), but 1 % at"
            f" {_against(data, HUNDREDTH)}: at {1e3 * AFTER:g} mm {left['rolling']:.2f} against"
            f" {left['torsional']:.2f} rad/s remain, which the ball acquired on its way to the"
            " valley",
            _alike(data, HALF) and _alike(data, TWENTIETH) and _alike(data, HUNDREDTH),
            otherwise="in part" if _alike(data, HALF) and _alike(data, TWENTIETH) else "wrong",
        ),
        judged(
            "Ours: the timestep does not affect these spins",
            f"half the timestep changes them by at most {100 * data.step_error:.2g} %",
            data.step_error < 0.02,
        ),
    ]


def _between(limits: Bracket) -> str:
    low, high = sorted(limits)
    return f"{low:.3g} to {high:.3g}"


def _alike(data: DryFriction, level: float) -> bool:
    """Whether rolling and torsional friction cross a level within a factor of two."""
    rolls, turns = (data.thresholds[kind, level][0] for kind in ("rolling", "torsional"))
    return 0.5 < rolls / turns < 2


def _against(data: DryFriction, level: float) -> str:
    rolls, turns = (1e3 * data.thresholds[kind, level][0] for kind in ("rolling", "torsional"))
    return f"{rolls:.2g} against {turns:.2g} mm"


def _millimeters(limits: Bracket) -> str:
    low, high = (1e3 * value for value in sorted(limits))
    return f"{low:.3g} to {high:.3g} mm"


def draw(data: DryFriction, path: Path) -> None:
    """Draw the spin against the Coulomb coefficient, and against torsional and rolling friction."""
    with style.figure(9.0, 4.6) as figure:
        left, right = figure.subplots(1, 2, sharey=True)
        _draw_coulomb(left, data)
        _draw_torques(right, data)
        for axes in (left, right):
            axes.axhline(data.viscous, color=style.GRAY, lw=1)
            axes.set(xscale="log", yscale="log", ylim=(1e-2, 40))
            axes.legend(loc="lower right" if axes is left else "upper right")
        note = f"viscous alone: {data.viscous:.2f} rad/s"
        left.annotate(note, (1.0, data.viscous), (0, -13), textcoords="offset points", ha="right")
        left.set(ylabel="largest spin (rad/s)")
        style.save(figure, path, dpi=110)


def _draw_coulomb(axes: "Axes", data: DryFriction) -> None:
    small, one = np.array([1e-5, 1e-3]), np.array([data.stuck.coulomb, 1.0])
    marks = (("beside", style.BLUE, "o", "beside viscous friction"),
             ("instead", style.GREEN, "s", "instead of it"))  # fmt: skip
    for kind, color, marker, label in marks:
        axes.plot(*data.spins[kind], marker=marker, ms=4, color=color, label=label)
    label = "theory: weak friction, pure rolling"
    axes.plot(small, data.slope * small, "--", color=style.ORANGE, label=label)
    axes.plot(one, np.full(2, data.stuck.spin), "--", color=style.ORANGE)
    axes.set(title="Coulomb friction", xlabel="coefficient μ")


def _draw_torques(axes: "Axes", data: DryFriction) -> None:
    marks = (("torsional", style.BLUE, "o", data.stopping[0]),
             ("rolling", style.PURPLE, "D", data.stopping[1]))  # fmt: skip
    for kind, color, marker, stop in marks:
        coefficients, spins = data.spins[kind]
        axes.plot(1e3 * coefficients, spins, marker=marker, ms=4, color=color, label=kind)
        label = "statics: held in the valley" if kind == "torsional" else None
        axes.axvline(1e3 * stop, color=style.ORANGE, ls="--", label=label)
    axes.set(title="Friction torques, beside viscous friction", xlabel="torque over load (mm)")


FIGURE = Figure(
    name="dry_friction",
    title="The top under dry friction",
    caption=(
        "Largest spin |J|/I₃ about the ball's axis ξ₃ within 100 s of the paper's fourth case"
        " (N = 20, H = 20 cm, θ_R = π/64, c = 0.3 kg/s or, where stated, 0) on a plane that"
        " bears the ball, over the coefficients of Coulomb, torsional and rolling friction."
        " MuJoCo allows torsional friction only with Coulomb friction, and rolling friction only"
        " with both; here, these have MuJoCo's smallest coefficient, 10⁻⁵. V_Q is the velocity"
        " of the contact point over the floor; the valley is the circle of least magnetic energy"
        " around the center. The axis follows the field, so the ball can spin only about its"
        " axis. Coulomb friction makes the ball roll and hence spin; only the torque of an"
        " extended contact resists the spin itself."
    ),
    compute=compute,
    claims=claims,
    draw=draw,
    methods=(METHOD, "scipy/dop853"),
)
