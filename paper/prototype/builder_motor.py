"""What a builder of the motor meets first: a floor that leans, the earth's field, air, metal."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import xarray as xr

from magmotor.common import style
from magmotor.common.style import save_small
from magmotor.devices.ball.slip import eddy_drag
from magmotor.devices.motor.flights import censored_mean, flights
from magmotor.devices.motor.scene import Motor
from magmotor.devices.motor.theory import motor_wells
from magmotor.devices.motor.tolerances import Tolerances, motor_tolerances
from magmotor.run.simulate import simulate
from paper.figure import Claim, Figure, judged

if TYPE_CHECKING:
    from matplotlib.axes import Axes

METHOD = "variational/middle"
TIMESTEP, RECORD, DURATION = 0.4 / 244, 12, 1e5 / 244
"""In units of the motor's time T_0, which is 244 s for the paper's, and steps between records."""

SEED = 11
SIGNIFICANT = 4
"""Standard errors of a significant difference."""

PAPER, DESK = Motor(), Motor.desk()

LIMIT = 1 / 57
"""Damping rate of the rolling ball, in units of 1/T_0, that matters for its flights."""

SPIRIT_LEVEL, MACHINIST_LEVEL, EARTH, ALUMINUM = 5e-4, 2e-5, 20e-6, 3.5e7
"""Slopes, the horizontal field in Europe in T, a conductivity in S/m."""


class Flown(NamedTuple):
    """What the replicas of one scene fly."""

    turns: float
    """Revolutions in flights of each run."""
    turns_error: float
    lasts: float
    """Mean duration of a flight after its first revolution, in units of T_0."""
    lasts_error: float
    longest: float
    """Revolutions of the longest flight."""


@dataclass(frozen=True)
class BuilderMotor:
    """Flights with effects of various sizes."""

    paper: Flown
    desk: Flown
    """The desk motor, with other random numbers."""
    desk_in_air: Flown
    air: Flown
    """The paper's motor in air."""
    barriers: dict[str, dict[float, Flown]]
    """By the field of the scene, and the change of the potential around the valley in barriers."""
    damping: dict[str, dict[float, Flown]]
    """By the temperature of the background and the rate of damping in 1/T_0."""
    one_percent: Flown
    """With a background that has 1 % of the friction of the slip, and the same temperature."""
    replicas: int


def compute(quick: bool) -> BuilderMotor:
    """Run the ensembles."""
    replicas = 6 if quick else 32
    steps, rates = [1.0, 10.0], [LIMIT, 10 * LIMIT]
    if not quick:
        steps = [0.3, 1.0, 2.0, 4.5, 10.0]
        rates = [LIMIT * 10**k for k in (-2, -1, 0, 0.5, 1)]
    allowed = motor_tolerances(PAPER)

    def flown(scene: Motor, seed: int = SEED) -> Flown:
        return _flown(scene, replicas, seed)

    backgrounds = {"cold": 0.0} if quick else {"cold": 0.0, "warm": PAPER.kT}
    return BuilderMotor(
        paper=flown(PAPER),
        desk=flown(DESK, SEED + 1),
        desk_in_air=flown(_in_air(DESK)),
        air=flown(_in_air(PAPER)),
        barriers={
            name: {
                size: flown(PAPER.replace(**{name: (size * getattr(allowed, name), 0.0, *more)}))
                for size in steps
            }
            for name, more in (("floor_tilt", ()), ("background_field", (0.0,)))
        },
        damping={
            name: {rate: flown(_damped(rate).replace(drag_temperature=kT)) for rate in rates}
            for name, kT in backgrounds.items()
        },
        one_percent=flown(_damped(ONE_PERCENT)),
        replicas=replicas,
    )


def _flown(scene: Motor, replicas: int, seed: int) -> Flown:
    unit = scene.units.time
    run = simulate(
        scene, method=METHOD, timestep=TIMESTEP * unit, duration=DURATION * unit,
        replicas=replicas, record_interval=RECORD, seed=seed,
    )  # fmt: skip
    return flown_in(run, scene)


def flown_in(run: xr.Dataset, scene: Motor) -> Flown:
    """Return what the replicas of a run fly."""
    found, unit, replicas = flights(run, scene), scene.units.time, run.sizes["replica"]
    revolutions = np.abs(found.revolutions.values)
    turns = np.bincount(found.replica.values, revolutions, minlength=replicas)
    mean = censored_mean((found.end - found.once).values / unit, found.censored.values)
    error = turns.std(ddof=1) / math.sqrt(replicas)
    longest = float(revolutions.max(initial=0.0))
    return Flown(float(turns.mean()), float(error), mean.mean, mean.error, longest)


def _isotropic(drag: float) -> Motor:
    """Return the paper's motor with a drag that acts on translation and rotation alike."""
    return PAPER.replace(drag=drag, rotational_drag=drag * PAPER.ball_radius**2)


def _damped(rate: float) -> Motor:
    return _isotropic(rate / rolling_rate(_isotropic(1.0)))


def rolling_rate(scene: Motor) -> float:
    """Return the rate at which drag damps the rolling ball, in units of 1/T_0.

    Of a ball that rolls without slip, both parts of the drag, (drag + rotational drag/r^2) v, slow
    the mass m + I/r^2 = 7/5 m.
    """
    drag = scene.drag + scene.rotational_drag / scene.ball_radius**2
    return drag / (1.4 * scene.ball_mass) * scene.units.time


ONE_PERCENT = rolling_rate(_isotropic(0.01 * PAPER.friction_ball))
"""Damping by a background that has 1 % of the friction of the slip, in 1/T_0."""


def _in_air(scene: Motor) -> Motor:
    """Return the motor in cold air, at the root mean square of its ball's thermal velocity."""
    speed = math.sqrt(scene.kT / (1.4 * scene.ball_mass))
    return scene.in_air(speed).replace(drag_temperature=0.0)


def _moment(scene: Motor) -> float:
    """Return the moment of the ball: in the desk motor, that of its magnet."""
    return scene.moment * (math.sqrt(scene.ball_ring_factor) if scene is DESK else 1.0)


def _field_allowed(scene: Motor) -> float:
    """Return the horizontal field that changes the valley by one barrier, in T."""
    return motor_tolerances(scene).background_field * scene.moment / _moment(scene)


def _aluminum(scene: Motor) -> float:
    """Return the distance of a thick sheet of aluminum that damps the ball at the rate `LIMIT`."""
    on_floor = eddy_drag(scene, ALUMINUM) * (_moment(scene) / scene.moment) ** 2
    ratio = rolling_rate(scene.replace(drag=on_floor)) / LIMIT
    return scene.ball_radius * ratio ** (1 / 3)


def claims(data: BuilderMotor) -> list[Claim]:
    """Return what the flights say to a builder."""
    paper, desk = (motor_tolerances(scene) for scene in (PAPER, DESK))
    tilts, fields = data.barriers["floor_tilt"], data.barriers["background_field"]
    fields_allowed = [1e6 * _field_allowed(scene) for scene in (PAPER, DESK)]
    along = [2 * EARTH * _moment(scene) / motor_wells(scene).barrier for scene in (PAPER, DESK)]
    limit, ten = (data.damping["cold"][size] for size in (LIMIT, 10 * LIMIT))
    metal = [_aluminum(scene) for scene in (PAPER, DESK)]
    apart = [
        (data.paper[k] - data.desk[k]) / math.hypot(data.paper[k + 1], data.desk[k + 1])
        for k in (0, 2)
    ]
    return [
        judged(
            "Ours: the paper's motor needs a floor that is level to a third of a microradian, the"
            " desk motor one that is level to a tenth of a milliradian",
            f"a slope of {1e6 * paper.floor_tilt:.2f} µrad tilts the paper's valley by one barrier"
            f" between two wells, {1e3 * desk.floor_tilt:.3f} mrad that of the desk motor; with a"
            f" level floor, with 1 and with 10 barriers, the ball flies {_turns(data.paper)},"
            f" {_turns(tilts[1.0])} and {_turns(tilts[10.0])} turns in each run",
            tilts[10.0].turns < 0.1 * data.paper.turns
            and tilts[1.0].turns > 0.5 * data.paper.turns
            and abs(1e6 * paper.floor_tilt - 0.34) < 0.01
            and abs(1e3 * desk.floor_tilt - 0.107) < 0.01,
        ),
        judged(
            "Ours: in the earth's field the paper's motor does not fly",
            f"a horizontal field of {fields_allowed[0]:.2f} µT tilts the paper's valley by one"
            f" barrier, {fields_allowed[1]:.1f} µT that of the desk motor; if a field of 20 µT"
            f" along the moment is reversed, the energy changes by {along[0]:.0f} and"
            f" {along[1]:.1f} barriers; with 1 and with 10 barriers, the ball flies"
            f" {_turns(fields[1.0])} and {_turns(fields[10.0])} of {_turns(data.paper)} turns",
            fields[10.0].turns < 0.1 * data.paper.turns and 10e-6 * fields_allowed[0] < EARTH,
        ),
        judged(
            "Ours: air shortens the flights of the paper's motor; a cold background that damps ten"
            " times as fast ends them",
            f"air damps the rolling ball at {rolling_rate(_in_air(PAPER)):.4f}/T₀; flights last"
            f" {_lasts(data.air)} after their first revolution, and {_lasts(data.paper)} without"
            f" air; at {LIMIT:.4f}/T₀ and at ten times this rate, {_turns(limit)} and"
            f" {_turns(ten)} turns are flown in each run, and {_turns(data.paper)} without damping",
            ten.turns < 0.1 * data.paper.turns and data.air.lasts < data.paper.lasts,
        ),
        judged(
            "Ours: the desk motor may stand in air",
            f"its ball is damped at {rolling_rate(_in_air(DESK)):.4f}/T₀; flights last"
            f" {_lasts(data.desk_in_air)}, {_lasts(data.desk)} without air, and the ball flies"
            f" {_turns(data.desk_in_air)} and {_turns(data.desk)} turns in each run",
            data.desk_in_air.turns > 0.5 * data.desk.turns,
        ),
        judged(
            "Ours: with a background of 1 % of the slip's friction, no flight is longer than three"
            " turns",
            f"the longest flight of {data.replicas} runs has {data.one_percent.longest:.1f}"
            f" revolutions, and {data.paper.longest:.0f} without it; the temperature is the same",
            data.one_percent.longest < 3 < data.paper.longest,
        ),
        judged(
            "Ours: metal must be farther from the desk motor's ball than the inner ring is",
            f"eddy currents in aluminum damp the rolling ball at {LIMIT:.4f}/T₀ at a distance of"
            f" {metal[1]:.2f} m, where the ring is {DESK.inner_height - DESK.ball_radius:.2f} m"
            f" above the ball's center; in the paper's motor, at {metal[0]:.2f} m and"
            f" {PAPER.inner_height - PAPER.ball_radius:.2f} m",
            metal[1] > DESK.inner_height,
        ),
        judged(
            "Ours: the paper's ball must be balanced to less than a micrometer, that of the desk"
            " motor to some hundredths of a millimeter",
            "a center of mass beside the dipole rises and falls by one barrier as the ball rolls,"
            f" if its distance is {1e6 * paper.center_of_mass:.2f} and"
            f" {1e6 * desk.center_of_mass:.0f} µm",
            paper.center_of_mass < 1e-6 and 1e-5 < desk.center_of_mass < 1e-4,
        ),
        judged(
            "Ours: the desk motor flies as the paper's does",
            f"with other random numbers, {_turns(data.desk)} and {_turns(data.paper)} turns in each"
            f" run, and flights that last {_lasts(data.desk)} and {_lasts(data.paper)} after"
            f" their first revolution: the differences are {apart[0]:.1f} and {apart[1]:.1f}"
            " standard errors",
            max(map(abs, apart)) < SIGNIFICANT,
        ),
    ]


def _turns(flown: Flown) -> str:
    return f"{flown.turns:.1f} ± {flown.turns_error:.1f}"


def _lasts(flown: Flown) -> str:
    return f"{flown.lasts:.1f} ± {flown.lasts_error:.1f} T₀"


def draw(data: BuilderMotor, path: Path) -> None:
    """Draw turns flown and durations of flights over the sizes of the effects."""
    paper, desk = (motor_tolerances(scene) for scene in (PAPER, DESK))
    with style.figure(10.0, 6.0) as figure:
        axes = figure.subplots(2, 3, sharex="col", sharey="row")
        for column, (name, marks) in enumerate(_marks(paper, desk).items()):
            for row, each in enumerate(axes[:, column]):
                value, error = (data.paper[2 * row + k] for k in (0, 1))
                each.axhspan(value - error, value + error, color=style.GRAY, alpha=0.4, lw=0)
                for size, text, color in marks:
                    each.axvline(size, color=color, ls="--", lw=1.2)
                    if row == 0:
                        each.annotate(text, (size, 1.01), xycoords=("data", "axes fraction"),
                                      rotation=60, fontsize=8, color=color)  # fmt: skip
                each.set_xscale("log")
            if name == "damping":
                _points(axes[:, column], data.damping["cold"], style.BLUE, "o", "cold background")
                warm = data.damping.get("warm", {}) | {ONE_PERCENT: data.one_percent}
                _points(axes[:, column], warm, style.GREEN, "s", "background at kT")
                axes[1, column].legend(loc="upper right")
            else:
                _points(axes[:, column], data.barriers[name], style.BLUE, "o", "")
        axes[0, 0].set(ylabel="turns flown in 410 T₀", ylim=(0, 32))
        axes[1, 0].set(ylabel="rest of a flight after one turn (T₀)", ylim=(0, 45))
        axes[1, 0].set_xlabel("slope of the floor (barriers)")
        axes[1, 1].set_xlabel("horizontal field (barriers)")
        axes[1, 2].set_xlabel("damping of the rolling ball (1/T₀)")
        save_small(figure, path, dpi=110)


Mark = tuple[float, str, str]


def _marks(paper: Tolerances, desk: Tolerances) -> dict[str, list[Mark]]:
    """Return typical sizes: those of the paper's motor in purple, the desk motor in orange."""
    return {
        "floor_tilt": [
            (MACHINIST_LEVEL / desk.floor_tilt, "desk, 0.02 mm/m", style.ORANGE),
            (SPIRIT_LEVEL / desk.floor_tilt, "desk, 0.5 mm/m", style.ORANGE),
            (MACHINIST_LEVEL / paper.floor_tilt, "paper, 0.02 mm/m", style.PURPLE),
        ],
        "background_field": [
            (EARTH / _field_allowed(DESK), "desk, 20 µT", style.ORANGE),
            (EARTH / _field_allowed(PAPER), "paper, 20 µT", style.PURPLE),
        ],
        "damping": [
            (rolling_rate(_in_air(DESK)), "desk in air", style.ORANGE),
            (rolling_rate(_in_air(PAPER)), "paper in air", style.PURPLE),
            (ONE_PERCENT, "1 % of c", style.PURPLE),
        ],
    }


def _points(
    axes: "tuple[Axes, Axes]", found: dict[float, Flown], color: str, marker: str, label: str
) -> None:
    sizes = [*found]
    for row, each in enumerate(axes):
        values, errors = zip(
            *(flown[2 * row : 2 * row + 2] for flown in found.values()), strict=True
        )
        each.errorbar(
            sizes, values, errors, color=color, marker=marker, ms=4, capsize=2, label=label
        )


FIGURE = Figure(
    name="builder_motor",
    title="What a builder of the motor meets first",
    caption=(
        "Revolutions that the ball flies in a run of 410 T₀, and how long a flight lasts after"
        " its first revolution, over the sizes of effects, for the paper's motor at uniform"
        " temperature (α = 0.001, T₀ = 244 s, 1.0·10⁵ s). The desk motor (T₀ = 7.1 s) has the same"
        " dimensionless groups, so the curves hold for both. Gray: without any effect, one"
        " standard error. Slope and field are given by the change of the potential around the"
        " valley, in barriers between two wells. A background damps the ball's velocity and"
        " rotation alike; air and metal are cold: they add no noise of the motor's temperature."
        " Dashed: typical sizes."
    ),
    compute=compute,
    claims=claims,
    draw=draw,
    methods=(METHOD,),
)
