"""What a builder of the motor meets first: a floor that leans, the earth's field, air, metal."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr

from magmotor.common import style
from magmotor.devices.ball.slip import eddy_drag
from magmotor.devices.motor.flights import flights
from magmotor.devices.motor.scene import Motor
from magmotor.devices.motor.theory import motor_wells
from magmotor.devices.motor.tolerances import Tolerances, motor_tolerances
from magmotor.run.simulate import simulate
from paper.figure import Claim, Figure, judged
from paper.motor import molecular
from paper.motor.lasting import lasting

if TYPE_CHECKING:
    from matplotlib.axes import Axes

METHOD = "variational/middle"
TIMESTEP, RECORD, DURATION = 0.4 / 244, 12, 1e5 / 244
"""In units of the motor's time T_0, which is 244 s for the paper's, and steps between records."""

REPLICAS, QUICK_REPLICAS, QUICK_DURATION = 32, 2, DURATION / 2

SEED = 11
SIGNIFICANT = 4
"""Standard errors of a significant difference."""

FEW = 0.2
"""Share of the turns that is left where an effect ends the flights."""

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
    replicas, duration = (QUICK_REPLICAS, QUICK_DURATION) if quick else (REPLICAS, DURATION)
    steps, rates = [1.0, 10.0], [LIMIT, 10 * LIMIT]
    if not quick:
        steps = [0.3, 1.0, 2.0, 4.5, 10.0]
        rates = [LIMIT * 10**k for k in (-2, -1, 0, 0.5, 1)]
    allowed = motor_tolerances(PAPER)

    def flown(scene: Motor, seed: int = SEED) -> Flown:
        return _flown(scene, replicas, duration, seed)

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


def _flown(scene: Motor, replicas: int, duration: float, seed: int) -> Flown:
    unit = scene.units.time
    run = simulate(
        scene, method=METHOD, timestep=TIMESTEP * unit, duration=duration * unit,
        replicas=replicas, record_interval=RECORD, seed=seed,
    )  # fmt: skip
    return flown_in(run, scene)


def flown_in(run: xr.Dataset, scene: Motor) -> Flown:
    """Return what the replicas of a run fly."""
    found, unit, replicas = flights(run, scene), scene.units.time, run.sizes["replica"]
    revolutions = np.abs(found.revolutions.values)
    turns = np.bincount(found.replica.values, revolutions, minlength=replicas)
    lasts = lasting(found, replicas, unit)
    error = turns.std(ddof=1) / math.sqrt(replicas)
    longest = float(revolutions.max(initial=0.0))
    return Flown(float(turns.mean()), float(error), *lasts, longest)


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
    ball = scene.drag, scene.rotational_drag, scene.ball_mass, scene.ball_radius
    return molecular.rolling_rate(*ball) * scene.units.time


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
    left = [_share(data.air, data.paper), _share(data.desk_in_air, data.desk)]
    background = _share(data.one_percent, data.paper)
    lasts_apart = (data.paper.lasts - data.desk.lasts) / math.hypot(
        data.paper.lasts_error, data.desk.lasts_error
    )
    return [
        judged(
            "Ours: between one and ten barriers, a slope of the floor ends the flights; one barrier"
            f" is a slope of {1e6 * paper.floor_tilt:.2f} µrad for the paper's motor and of"
            f" {1e3 * desk.floor_tilt:.3f} mrad for the desk motor",
            f"the ball flies {_by_size(tilts)} barriers, {_turns(data.paper)} on a level floor; at"
            f" one barrier the difference from this is {_apart(data.paper, tilts[1.0]):.1f}"
            f" standard errors, from one to ten barriers {_apart(tilts[1.0], tilts[10.0]):.1f}",
            _ends(tilts[1.0], tilts[10.0]),
        ),
        judged(
            "Ours: in the earth's field the paper's motor does not fly",
            f"20 µT across the moment tilt its valley by {1e6 * EARTH / fields_allowed[0]:.0f}"
            f" barriers of {fields_allowed[0]:.2f} µT each, that of the desk motor by"
            f" {1e6 * EARTH / fields_allowed[1]:.1f} of {fields_allowed[1]:.1f} µT each; if they"
            f" are reversed along the moment, the energy changes by {along[0]:.0f} and"
            f" {along[1]:.1f} barriers; the ball flies {_by_size(fields)} barriers,"
            f" {_turns(data.paper)} without a field; at one barrier the difference from this is"
            f" {_apart(data.paper, fields[1.0]):.1f} standard errors, from one to ten barriers"
            f" {_apart(fields[1.0], fields[10.0]):.1f}",
            _ends(fields[1.0], fields[10.0]) and 10e-6 * fields_allowed[0] < EARTH,
        ),
        judged(
            "Ours: a cold background that damps the rolling ball ten times as fast as air damps"
            " that of the paper's motor ends the flights",
            f"air damps it at {rolling_rate(_in_air(PAPER)):.4f}/T₀; at {LIMIT:.4f}/T₀ and at ten"
            f" times this rate, {_turns(limit)} and {_turns(ten)} turns are flown in each run, and"
            f" {_turns(data.paper)} without damping",
            _ends(limit, ten),
        ),
        judged(
            "Ours: air takes more than half of the turns of the paper's motor, but less than half"
            " of those of the desk motor",
            f"the paper's ball is damped at {rolling_rate(_in_air(PAPER)):.4f}/T₀, and flies"
            f" {_turns(data.air)} instead of {_turns(data.paper)} turns, {100 * left[0][0]:.0f} ±"
            f" {100 * left[0][1]:.0f} %; that of the desk motor at"
            f" {rolling_rate(_in_air(DESK)):.4f}/T₀, {_turns(data.desk_in_air)} instead of"
            f" {_turns(data.desk)}, {100 * left[1][0]:.0f} ± {100 * left[1][1]:.0f} %: what it"
            f" loses is {_apart(data.desk, data.desk_in_air):.1f} standard errors; after"
            f" their first revolution, flights last {_lasts(data.air)} instead of"
            f" {_lasts(data.paper)}, and {_lasts(data.desk_in_air)} instead of {_lasts(data.desk)}",
            left[0][0] < 0.5 < left[1][0],
        ),
        judged(
            "Ours: a background of 1 % of the slip's friction, at the same temperature, takes most"
            " of the turns",
            f"{_turns(data.one_percent)} turns in each run and {_turns(data.paper)} without it,"
            f" that is {100 * background[0]:.0f} ± {100 * background[1]:.0f} %; the longest flights"
            f" of {data.replicas} runs have {data.one_percent.longest:.1f} and"
            f" {data.paper.longest:.0f} revolutions",
            background[0] + SIGNIFICANT * background[1] < 0.5,
        ),
        judged(
            "Ours: by theory, metal must be farther from the desk motor's ball than the inner ring"
            " is",
            f"eddy currents in aluminum damp the rolling ball at {LIMIT:.4f}/T₀ at a distance of"
            f" {metal[1]:.2f} m, where the ring is {DESK.inner_height - DESK.ball_radius:.2f} m"
            f" above the ball's center; in the paper's motor, at {metal[0]:.2f} m and"
            f" {PAPER.inner_height - PAPER.ball_radius:.2f} m",
            metal[1] > DESK.inner_height,
        ),
        judged(
            "Ours: by statics, a center of mass less than a micrometer beside the dipole tilts the"
            " valley of the paper's motor by one barrier, some hundredths of a millimeter that of"
            " the desk motor",
            "it rises and falls by one barrier as the ball rolls, if its distance is"
            f" {1e6 * paper.center_of_mass:.2f} and {1e6 * desk.center_of_mass:.0f} µm; no flights"
            " were simulated with it",
            paper.center_of_mass < 1e-6 and 1e-5 < desk.center_of_mass < 1e-4,
        ),
        judged(
            "Ours: a check of the scaling: in units of its own, the desk motor flies as the paper's"
            " does, since their groups are the same",
            f"with other random numbers, {_turns(data.desk)} and {_turns(data.paper)} turns in each"
            f" run, and flights that last {_lasts(data.desk)} and {_lasts(data.paper)} after"
            f" their first revolution: the differences are {_apart(data.paper, data.desk):.1f} and"
            f" {lasts_apart:.1f} standard errors",
            max(abs(_apart(data.paper, data.desk)), abs(lasts_apart)) < SIGNIFICANT,
        ),
    ]


def _apart(first: Flown, second: Flown) -> float:
    """Return the difference of the turns flown in standard errors."""
    return (first.turns - second.turns) / math.hypot(first.turns_error, second.turns_error)


def _ends(weak: Flown, strong: Flown) -> bool:
    """Return whether a strong effect leaves at most a fifth of a weak one's turns, with errors."""
    share, error = _share(strong, weak)
    return share + SIGNIFICANT * error < FEW


def _share(some: Flown, all_of: Flown) -> tuple[float, float]:
    """Return the ratio of the turns flown and its standard error."""
    ratio = some.turns / all_of.turns
    error = math.hypot(some.turns_error, ratio * all_of.turns_error) / all_of.turns
    return ratio, error


def _by_size(found: dict[float, Flown]) -> str:
    sizes, turns = [f"{size:g}" for size in found], [_turns(flown) for flown in found.values()]
    return f"{_listed(turns)} turns in each run at {_listed(sizes)}"


def _listed(words: list[str]) -> str:
    return f"{', '.join(words[:-1])} and {words[-1]}"


def _turns(flown: Flown) -> str:
    return f"{flown.turns:.1f} ± {flown.turns_error:.1f}"


def _lasts(flown: Flown) -> str:
    return f"{flown.lasts:.1f} ± {flown.lasts_error:.1f} T₀"


def draw(data: BuilderMotor, path: Path) -> None:
    """Draw turns flown and durations of flights over the sizes of the effects."""
    paper, desk = (motor_tolerances(scene) for scene in (PAPER, DESK))
    with style.figure(10.0, 6.6) as figure:
        axes = figure.subplots(2, 3, sharex="col", sharey="row")
        for column, (name, marks) in enumerate(_marks(paper, desk).items()):
            for row, each in enumerate(axes[:, column]):
                value, error = (data.paper[2 * row + k] for k in (0, 1))
                each.axhspan(value - error, value + error, **UNDISTURBED)
                for size, text, color in marks:
                    each.axvline(size, color=color, ls="--", lw=1.2)
                    if row == 0:
                        each.annotate(text, (size, 1.01), xycoords=("data", "axes fraction"),
                                      rotation=60, fontsize=9, color=color)  # fmt: skip
                each.set_xscale("log")
            if name == "damping":
                _points(axes[:, column], data.damping["cold"], style.BLUE, "o", "cold background")
                warm = data.damping.get("warm", {}) | {ONE_PERCENT: data.one_percent}
                _points(axes[:, column], warm, style.GREEN, "s", "background at kT")
            else:
                _points(axes[:, column], data.barriers[name], style.BLUE, "o", "")
        figure.legend(handles=_legend(axes[0, 2]), loc="outside lower center", ncols=2)
        axes[0, 0].set(ylabel="turns flown in 410 T₀", ylim=(0, 34))
        axes[1, 0].set(ylabel="rest of a flight after one turn (T₀)", ylim=(0, 48))
        axes[1, 0].set_xlabel("slope of the floor (barriers)")
        axes[1, 1].set_xlabel("horizontal field (barriers)")
        axes[1, 2].set_xlabel("damping of the rolling ball (1/T₀)")
        style.save(figure, path, dpi=110, shaded=True)


UNDISTURBED: dict[str, Any] = {"color": style.GRAY, "alpha": 0.4, "lw": 0}

Mark = tuple[float, str, str]


def _legend(damping: "Axes") -> list[Any]:
    """Return the legend's entries, the first of them from the panel of the damping."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    band = Patch(label="without any effect, ± one standard error", **UNDISTURBED)
    typical = [
        Line2D([], [], color=color, ls="--", lw=1.2,
               label=f"typical for the {name} (unit of time T₀ = {scene.units.time:.3g} s)")
        for color, name, scene in ((style.PURPLE, "paper's motor", PAPER),
                                   (style.ORANGE, "desk motor", DESK))
    ]  # fmt: skip
    return [*damping.get_legend_handles_labels()[0], band, *typical]


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
            (ONE_PERCENT, "1 % of friction", style.PURPLE),
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
        " its first revolution, over the size of each effect, for the paper's motor at uniform"
        " temperature (α = 0.001, T₀ = 244 s, 1.0·10⁵ s). The desk motor (T₀ = 7.1 s) has the"
        " same dimensionless groups, so the curves hold for both. Gray: without any effect, one"
        " standard error. Slope and field are given by how much they change the potential around"
        " the valley, in units of the barrier between two wells. A background damps the ball's"
        " velocity and rotation alike; air and metal are cold: they add no noise of the motor's"
        " temperature. Dashed: typical sizes."
    ),
    compute=compute,
    claims=claims,
    draw=draw,
    methods=(METHOD,),
    undecided=(0, 1, 2, 3, 4, 7),
)
