"""The motor without its mechanism: isotropic friction, and a small background of it.

The paper's friction acts on the slip, two combinations of the ball's five velocities. Isotropic
friction acts on all of them alike: -f c v on the center and -f c r^2 omega on the rotation, with
noise of the same temperature. Gibbs' law, with wells and rates, remains the same.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr

from magmotor.common import style
from magmotor.devices.motor.flights import flights
from magmotor.devices.motor.observables import azimuth
from magmotor.devices.motor.scene import Motor
from magmotor.run.simulate import simulate
from paper.figure import OURS, Claim, Figure, judged
from paper.motor.lasting import lasting, times_apart
from paper.motor.long_runs import EVERY, METHOD, TIMESTEP, Size
from paper.motor.reduced_theory import rolling
from paper.motor.rolling_start import thermal_start
from paper.motor.rotor import rate_and_memory, rotor
from paper.motor.runs import SIGNIFICANT
from paper.motor.spreading import Measured, over_replicas
from paper.motor.wandering import whole_flights

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ALPHA = 1e-3
SLIP_ONLY = Motor(alpha_ball=ALPHA, alpha_ring=ALPHA)

AIR_SPEED = 2e-3
"""Speed of the ball in air, in m/s; its root mean square around the valley is 1.8 mm/s."""

SHARES = 1e-3, 1e-2, 1e-1
"""Isotropic friction beside that of the slip, over c."""

SIZE = {False: Size(64, 1e5, 2e3), True: Size(6, 2.5e4, 2e3)}


def isotropic(motor: Motor, share: float) -> Motor:
    """Return the motor with isotropic friction of this share of c, beside its own."""
    drag = share * SLIP_ONLY.friction_ball
    return motor.replace(drag=drag, rotational_drag=drag * motor.ball_radius**2)


WITHOUT_SLIP = Motor(
    temperature="nonuniform", alpha_ball=0.0, friction_ball=0.0, alpha_ring=ALPHA,
    friction_ring=SLIP_ONLY.friction_ring, drag_temperature=SLIP_ONLY.kT,
)  # fmt: skip
"""No friction and no noise on the slip; "nonuniform" only allows to give the drag's temperature."""

SCENES = {
    "slip only": SLIP_ONLY,
    "air": SLIP_ONLY.in_air(AIR_SPEED),
    **{f"{100 * share:g} %": isotropic(SLIP_ONLY, share) for share in SHARES},
    "isotropic": isotropic(WITHOUT_SLIP, 1.0),
}


class Flown(NamedTuple):
    """Flights of one scene."""

    method: str
    rate: float
    """Rate in 1/s at which isotropic friction makes the ball forget its rolling."""
    number: Measured
    """Flights in 1e5 s."""
    turns: Measured
    """Revolutions in flights in 1e5 s."""
    lasts: Measured
    """Mean duration after the first revolution, in s; NaN if there was none."""
    longest: float
    """In revolutions."""
    speed: Measured
    """Mean square velocity of the ball along the plane over 2 kT/m."""
    rotor: Measured
    """Flights in 1e5 s of rotors without wells, with the memory that is left."""
    rotor_lasts: float
    """Mean duration of the whole ones after the first revolution, in s; NaN if there was none."""


@dataclass(frozen=True)
class Ablation:
    """Data of the figure."""

    flown: dict[str, Flown]
    exposure: float
    """Observed time of all motors of a scene, in 1e5 s."""
    memory: float
    """Of the ball with friction of the slip only, in s."""


def compute(quick: bool) -> Ablation:
    """Simulate all scenes."""
    size = SIZE[quick]
    runs = {name: _simulated(scene, size) for name, scene in SCENES.items()}
    rows = azimuth(runs["slip only"]).values
    memory = rate_and_memory([*rows], TIMESTEP * EVERY).memory
    flown = {name: _flown(SCENES[name], run, memory) for name, run in runs.items()}
    return Ablation(flown, size.replicas * (size.duration - size.burn_in) / 1e5, memory)


def _simulated(scene: Motor, size: Size) -> xr.Dataset:
    run = simulate(
        scene, method=METHOD, timestep=TIMESTEP, duration=size.duration, replicas=size.replicas,
        record_interval=EVERY, seed=11, initial=thermal_start(SLIP_ONLY, size.replicas),
    )  # fmt: skip
    return run.isel(time=slice(round(size.burn_in / (TIMESTEP * EVERY)), None))


def _flown(scene: Motor, run: xr.Dataset, memory: float) -> Flown:
    found, replicas = flights(run), run.sizes["replica"]
    span = float(run.time[-1] - run.time[0])
    revolutions = np.abs(found.revolutions.values)
    counts, turns = (
        np.bincount(found.replica.values, weights, minlength=replicas) * 1e5 / span
        for weights in (None, revolutions)
    )
    speed = np.sum(run.velocity.values**2, axis=-1).mean(axis=1)
    rate = background_rate(scene)
    return Flown(
        METHOD,
        rate,
        over_replicas(counts),
        over_replicas(turns),
        lasting(found, replicas),
        float(revolutions.max(initial=0.0)),
        over_replicas(speed * scene.ball_mass / (2 * SLIP_ONLY.kT)),
        *_rotors(1 / (rate + 1 / memory), replicas, span),
    )


def _rotors(memory: float, replicas: int, span: float) -> tuple[Measured, float]:
    """Return flights in 1e5 s, and their mean duration, of rotors of the ball's rate."""
    rate = np.sqrt(SLIP_ONLY.kT / rolling(SLIP_ONLY).inertia)
    times = np.arange(0, span, TIMESTEP * EVERY)
    each = [whole_flights(row) for row in rotor(rate, memory, times, replicas, seed=12)]
    counts = np.array([float(len(lasts)) for lasts in each])
    together = TIMESTEP * EVERY * np.concatenate(each)
    mean = float(together.mean()) if len(together) else np.nan
    return over_replicas(counts * 1e5 / span), mean


def background_rate(scene: Motor) -> float:
    """Return the rate in 1/s at which drag makes the rolling ball forget its momentum P.

    Rolling at the rate W, the ball's center moves at rho W, and it turns with the angular velocity
    that leaves (M - m rho^2) W^2 for twice its rotational energy.
    """
    ball = rolling(SLIP_ONLY)
    turning = (ball.inertia - scene.ball_mass * ball.radius**2) / scene.ball_inertia
    return (scene.drag * ball.radius**2 + scene.rotational_drag * turning) / ball.inertia


def claims(found: Ablation) -> list[Claim]:
    """Return our claims about what flights need."""
    flown = found.flown
    own, air, bare = (flown[name] for name in ("slip only", "air", "isotropic"))
    little, hundredth, tenth = (flown[f"{share} %"] for share in (0.1, 1, 10))
    speeds = [flown[name].speed for name in ("slip only", "isotropic")]
    alike = abs(speeds[0].value - speeds[1].value) < SIGNIFICANT * np.hypot(
        speeds[0].error, speeds[1].error
    )
    apart = [
        times_apart(longer.lasts, shorter.lasts)
        for longer, shorter in ((own, little), (little, hundredth))
    ]
    upper = 3 / found.exposure
    return [
        judged(
            f"{OURS}wells, ring and temperature are enough for flights, whatever the friction",
            f"with isotropic friction at the same kT there are {_count(bare)} flights in 10⁵ s,"
            f" against {_count(own)}; a rotor without wells loses them alike if its memory becomes"
            f" as short: {bare.rotor}, against {own.rotor}",
            bool(bare.number.value > own.number.value - SIGNIFICANT * own.number.error),
        ),
        judged(
            f"{OURS}isotropic friction leaves Gibbs' law as it is",
            f"mean square velocity {speeds[1]} times 2kT/m, with the slip's friction {speeds[0]}",
            bool(alike),
        ),
        judged(
            f"{OURS}isotropic friction beside that of the slip makes flights shorter; 10 % of c"
            " ends them",
            f"after the first revolution they last {_duration(own)} with friction of the slip only,"
            f" {_duration(air)} in air, {_duration(little)} with 0.1 % of c and"
            f" {_duration(hundredth)} with 1 %; without and with 0.1 %, the logarithms differ by"
            f" {apart[0]:.1f} standard errors, with 0.1 and 1 % by {apart[1]:.1f}."
            f" {own.turns}, {air.turns}, {little.turns} and {hundredth.turns} turns are flown in"
            f" 10⁵ s, in {_count(own)}, {_count(air)}, {_count(little)} and {_count(hundredth)}"
            f" flights; the longest of this sample have {own.longest:.0f}, {air.longest:.0f},"
            f" {little.longest:.1f} and {hundredth.longest:.1f} revolutions. With 10 %, there are"
            f" {_count(tenth)} flights (at 95 %, none in this sample means fewer than {upper:.2f})",
            min(apart) > SIGNIFICANT and bool(tenth.turns.value < 0.01 * own.turns.value),
        ),
    ]


def _count(flown: Flown) -> str:
    return f"{flown.number.value:.2f} ± {flown.number.error:.2f}"


def _duration(flown: Flown) -> str:
    return f"{flown.lasts.value:.0f} ± {flown.lasts.error:.0f} s"


def draw(found: Ablation, path: Path) -> None:
    """Draw how many flights there are, and how long they last."""
    flown = list(found.flown.values())
    labels = [_label(name, each.rate) for name, each in found.flown.items()]
    with style.figure(12.0, 4.8) as figure:
        left, right = figure.subplots(1, 2)
        numbers, lasts = ([getattr(each, name) for each in flown] for name in ("number", "lasts"))
        _draw_row(left, numbers, [each.rotor.value for each in flown])
        _draw_row(right, lasts, [each.rotor_lasts for each in flown])
        left.set_title("Flights in 10⁵ s")
        right.set_title("Mean duration after the first revolution (s)")
        for axes in (left, right):
            axes.set_xticks(range(len(labels)), labels, fontsize=8)
            axes.set_xlabel("isotropic friction, and the time in which it stops a ball that rolls")
            axes.set(ylim=(0, None), xlim=(-0.5, len(labels) - 0.5))
        right.ticklabel_format(axis="y", style="plain")
        right.legend(loc="upper right")
        style.save(figure, path, 80)


def _draw_row(axes: "Axes", motors: list[Measured], rotors: list[float]) -> None:
    mean, error = np.array(motors, dtype=float).T
    at = np.arange(len(motors))
    axes.errorbar(at, mean, error, fmt="o", color=style.BLUE, label="motor")
    look: dict[str, Any] = {"ms": 16, "mew": 2, "color": style.ORANGE}
    axes.plot(at, rotors, "_", **look, label="rotor without wells, of the memory that is left")


def _label(name: str, rate: float) -> str:
    """Return a name and, to two digits, the time in which isotropic friction stops rolling."""
    return f"{name}\n{float(f'{1 / rate:.2g}'):g} s" if rate else f"{name}\nnever"


FIGURE = Figure(
    "motor_ablation",
    "Motor: flights with isotropic friction",
    f"Flights of {SIZE[False].replicas} motors over {SIZE[False].duration:g} s at α = {ALPHA:g}"
    " and uniform temperature: with the paper's friction of the slip only; with the drag of air"
    f" at {1e3 * AIR_SPEED:g} mm/s added; with isotropic friction of 0.1 %, 1 % and 10 % of c"
    " added; and with isotropic friction alone, -c v and -c r² ω. The temperature is the same"
    " for all. Motors without a flight have no duration. Below each name is the time in which"
    " the isotropic friction alone would stop a rolling ball. The rotors have the rate given by"
    " Gibbs' law; their memory is that of the ball with friction of the slip only, shortened by"
    " the rate of the isotropic friction. Bars are standard errors over motors.",
    compute,
    claims,
    draw,
    (),
    (METHOD,),
    undecided=(0, 2),
)
