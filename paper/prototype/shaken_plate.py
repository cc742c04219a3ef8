"""The desk motor on a plate that is shaken with limited bandwidth and stroke."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from magmotor.common import style
from magmotor.devices.motor.modes import mode_temperatures
from magmotor.devices.motor.scene import Motor
from magmotor.devices.motor.shaking import plate_shaking
from magmotor.devices.motor.theory import motor_wells, small_motion
from magmotor.noise import BrownianPath
from magmotor.run.simulate import simulate
from paper.figure import Claim, Figure, judged
from paper.motor.spreading import Measured, over_replicas
from paper.prototype.builder_motor import (
    DURATION,
    METHOD,
    RECORD,
    SIGNIFICANT,
    TIMESTEP,
    Flown,
    flown_in,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DESK = Motor.desk()
STEP = TIMESTEP * DESK.units.time
"""In s."""

HALF_POWER = 0.443
"""Frequency at which the spectrum of held samples is one half, times the time of a hold."""

HOLDS = (1, 3, 8, 25, 75, 250, 800, 2500)
"""In steps; one step without a window is white noise."""

SLOW, SLOWEST = HOLDS[-2:]

SHORT_HOLD, WINDOWS = 3, (1.0, 3.0, 10.0, 20.0, 40.0, 100.0)
"""Hold in steps, and windows in s, of the runs that limit the stroke."""

BUILT = 25, 20.0
"""Hold in steps and window in s of the plate that we would build."""

SEED, BURN_IN = 21, 200.0
"""Burn-in in units of T_0, since rolling forgets a start from rest in about 80."""

MODES = ("slip", "rolling", "ring_1")


class Shaken(NamedTuple):
    """What replicas do on one plate."""

    flown: Flown
    temperature: dict[str, Measured]
    """Of the modes of the motion, relative to kT."""


@dataclass(frozen=True)
class ShakenPlate:
    """Flights of the desk motor."""

    holds: dict[int, Shaken]
    """By the hold in steps, without a window."""
    windows: dict[float, Shaken]
    """By the window in s, with `SHORT_HOLD`."""
    built: Shaken
    rolling: float
    """Frequency, in Hz, at which the ball rolls to and fro in a well."""
    relaxation: float
    """Friction over the stiffness of a well along the valley, in s."""


def compute(quick: bool) -> ShakenPlate:
    """Run the ensembles."""
    white, replicas = (2, 2) if quick else (192, 32)
    holds, windows = ((1, SLOWEST), (1.0,)) if quick else (HOLDS, WINDOWS)
    wells = motor_wells(DESK)
    return ShakenPlate(
        {hold: _shaken(white if hold == 1 else replicas, hold) for hold in holds},
        {window: _shaken(replicas, SHORT_HOLD, window) for window in windows},
        _shaken(replicas, *BUILT),
        rolling_frequency(DESK),
        2 * DESK.friction_ball * (wells.radius / DESK.outer_dipoles) ** 2 / wells.barrier,
    )


def _shaken(replicas: int, hold: int, window: float | None = None) -> Shaken:
    samples = None if window is None else round(window / (hold * STEP))
    run = simulate(
        DESK, method=METHOD, timestep=STEP, duration=DURATION * DESK.units.time,
        replicas=replicas, record_interval=RECORD,
        path=BrownianPath(SEED, STEP).held(hold, samples),
    )  # fmt: skip
    burn_in = BURN_IN * DESK.units.time
    each = [
        mode_temperatures(run.isel(replica=replica), DESK, burn_in=burn_in).temperature
        for replica in range(replicas)
    ]
    temperature = {
        mode: over_replicas([float(one.sel(mode=mode)) / DESK.kT for one in each]) for mode in MODES
    }
    return Shaken(flown_in(run, DESK), temperature)


def rolling_frequency(scene: Motor) -> float:
    """Return the frequency, in Hz, at which the ball rolls to and fro in its well.

    It is the lowest one of the small motions with friction.
    """
    generators = small_motion(scene).generators()
    frequencies = np.abs(np.linalg.eigvals(generators["A"] + generators["K"]).imag)
    return float(frequencies[frequencies > 1e-6 * frequencies.max()].min()) / (2 * math.pi)


def bandwidth(hold: int) -> float:
    """Return the frequency, in Hz, at which the spectrum of held samples is one half."""
    return HALF_POWER / (hold * STEP)


def stroke(window: float) -> float:
    """Return the root mean square displacement of the plate from its mean position, in mm.

    In one direction; from where the plate starts, it is larger by a factor of sqrt 2.
    """
    return 1e3 * plate_shaking(DESK).stroke(window) / math.sqrt(2)


def speed(hold: int) -> float:
    """Return the root mean square velocity of the plate in one direction, in mm/s."""
    return 1e3 * plate_shaking(DESK).speed(hold * STEP)


def claims(data: ShakenPlate) -> list[Claim]:
    """Return what a plate must do."""
    white, slow = data.holds[1], data.holds[SLOWEST]
    still = data.windows[1.0]
    hold, window = BUILT
    built = data.built
    apart = (built.flown.turns - white.flown.turns) / math.hypot(
        built.flown.turns_error, white.flown.turns_error
    )
    found = "no difference" if abs(apart) < SIGNIFICANT else "a difference"
    resolution = math.hypot(built.flown.turns_error, white.flown.turns_error)
    wander = 1e3 * math.sqrt(3600 * plate_shaking(DESK).density)
    rolling = white.temperature["rolling"]
    return [
        judged(
            "Ours: on a plate that is slower than the rolling to and fro in a well, the ball does"
            " not fly",
            f"in a well, the ball rolls to and fro at {data.rolling:.3f} Hz; in each run of"
            f" {DURATION * DESK.units.time:.0f} s, it flies {_turns(white)} turns with white noise"
            f" and {_by_bandwidth(data)} Hz",
            slow.flown.turns < 0.1 * white.flown.turns and bandwidth(SLOWEST) < data.rolling,
        ),
        judged(
            f"Ours: on a plate with a stroke of {stroke(1.0):.0f} mm, the root mean square about"
            " its mean position in each direction, the ball flies less than a quarter as far",
            f"with white noise the plate wanders {wander:.0f} mm in an hour; if what it moves is"
            f" taken back after 1 s, its stroke is {stroke(1.0):.1f} mm, and the ball flies"
            f" {_turns(still)} of {_turns(white)} turns",
            still.flown.turns < 0.25 * white.flown.turns,
        ),
        judged(
            f"Ours: on a plate with {bandwidth(hold):.1f} Hz, {speed(hold):.0f} mm/s and a stroke"
            f" of {stroke(window):.0f} mm (root mean squares in each direction, the stroke about"
            " the mean position), the ball flies more than half as far as with white noise",
            f"samples are held for {hold * STEP:.2f} s and taken back after {window:g} s, which"
            f" moves the plate by {math.sqrt(2) * stroke(window):.0f} mm from its start; the ball"
            f" flies {_turns(built)} turns, {_turns(white)} with white noise: {found} is"
            f" found, at a resolution of {resolution:.1f} turns, one standard error; the window is"
            f" shorter than the time c/k = {data.relaxation:.0f} s in which slip alone relaxes in a"
            f" well of the stiffness k; the ball rolls to and fro in {1 / data.rolling:.0f} s",
            built.flown.turns > 0.5 * white.flown.turns,
        ),
        judged(
            "Ours: such a plate does not give all motions one temperature",
            f"relative to kT, slip, rolling and lean of the ring have {_temperatures(built)} on it,"
            f" {_temperatures(white)} with white noise, where 1 is expected; of these, rolling is"
            f" {(rolling.value - 1) / rolling.error:.1f} standard errors from 1",
            built.temperature["slip"].value + SIGNIFICANT * built.temperature["slip"].error
            < 0.5
            < white.temperature["slip"].value,
        ),
    ]


def _by_bandwidth(data: ShakenPlate) -> str:
    """Return the turns flown at the smallest bandwidths, and these."""
    slow = sorted((hold for hold in data.holds if hold >= SLOW), reverse=True)
    turns, widths = (
        " and ".join(words)
        for words in (
            [_turns(data.holds[hold]) for hold in slow],
            [f"{bandwidth(hold):.3f}" for hold in slow],
        )
    )
    return f"{turns} with a bandwidth of {widths}"


def _turns(shaken: Shaken) -> str:
    return f"{shaken.flown.turns:.1f} ± {shaken.flown.turns_error:.1f}"


def _temperatures(shaken: Shaken) -> str:
    each = (shaken.temperature[mode] for mode in MODES)
    return ", ".join(map(str, each))


def draw(data: ShakenPlate, path: Path) -> None:
    """Draw turns, durations and temperatures over the bandwidth and over the stroke."""
    hold, window = BUILT
    with style.figure(9.0, 7.6) as figure:
        axes = figure.subplots(3, 2, sharex="col", sharey="row")
        by_bandwidth = {bandwidth(hold): found for hold, found in data.holds.items() if hold > 1}
        by_stroke = {stroke(window): found for window, found in data.windows.items()}
        built = ({bandwidth(hold): data.built}, {stroke(window): data.built})
        for column, found in enumerate((by_bandwidth, by_stroke)):
            _draw(axes[:, column], data.holds[1], found, built[column])
        for each in axes[:, 0]:
            each.axvline(data.rolling, color=style.ORANGE, ls="--", lw=1.2)
        note = "the ball rolls to\nand fro in a well"
        axes[0, 0].annotate(note, (data.rolling, 0.05), (3, 0), textcoords="offset points",
                            xycoords=("data", "axes fraction"), fontsize=8)  # fmt: skip
        axes[0, 0].set(ylabel="turns flown in 2900 s", ylim=(0, None))
        axes[1, 0].set(ylabel="rest of a flight\nafter one turn (s)", ylim=(0, None))
        axes[2, 0].set(ylabel="temperature over kT", ylim=(0, 1.6))
        axes[2, 0].set(xlabel="bandwidth of the plate (Hz)", xscale="log")
        axes[2, 1].set(xlabel="root mean square about the mean position (mm)", xscale="log")
        axes[2, 1].set_xticks([10, 20, 50], ["10", "20", "50"])
        axes[2, 1].minorticks_off()
        axes[2, 0].legend(loc="upper left", ncols=3)
        axes[0, 1].legend(loc="lower right")
        style.save(figure, path, dpi=110)


def _draw(
    axes: "tuple[Axes, Axes, Axes]", white: Shaken, found: dict[float, Shaken], built: dict
) -> None:
    turns, lasts, warmth = axes
    unit = DESK.units.time
    for each, k, scale in ((turns, 0, 1.0), (lasts, 2, unit)):
        value, error = white.flown[k], white.flown[k + 1]
        each.axhspan(scale * (value - error), scale * (value + error), color=style.GRAY,
                     alpha=0.4, lw=0, label="white noise")  # fmt: skip
        for points, color, marker, label in (
            (found, style.BLUE, "o", "limited noise"),
            (built, style.PURPLE, "D", "the plate that we would build"),
        ):
            values = [scale * shaken.flown[k] for shaken in points.values()]
            errors = [scale * shaken.flown[k + 1] for shaken in points.values()]
            each.errorbar([*points], values, errors, color=color, marker=marker, ms=5, capsize=2,
                          label=label)  # fmt: skip
    labels = {"slip": "slip", "rolling": "rolling", "ring_1": "lean of the ring"}
    looks = zip(labels.items(), (style.BLUE, style.GREEN, style.PURPLE), "os^", strict=True)
    for (mode, label), color, marker in looks:
        values, errors = zip(*(shaken.temperature[mode] for shaken in found.values()), strict=True)
        warmth.errorbar([*found], values, errors, color=color, marker=marker, ms=5, capsize=2,
                        label=label)  # fmt: skip


FIGURE = Figure(
    name="shaken_plate",
    title="The desk motor on a shaken plate",
    caption=(
        "Revolutions that the ball of the desk motor flies in a run of 2900 s, how long a"
        " flight lasts after its first revolution, and kinetic temperatures, on a plate shaken"
        " with limited noise, compared with white noise (gray: one standard error). Friction -c"
        " (V_Q - u) against a plate with the white velocity noise u = (α/c) dW/dt provides the"
        " friction and the noise of the contact at once. A digital source holds each sample for"
        " a time H, which limits the bandwidth (half of the power) to 0.443/H, and takes each"
        " sample back after a window. This limits the root mean square displacement in each"
        " direction about the mean position, the stroke, to (α/c) times the root of half the"
        " window; measured from where the plate starts, it is larger by √2. The torque on the"
        " inner ring has the same samples. Bars are standard errors over runs. Rolling has few"
        " independent values in a run, so a low mean comes with a low error: with white noise,"
        " 96 runs with the seed 122 give 1.10 ± 0.07. Left: without a window. Right: H = 0.035 s."
    ),
    compute=compute,
    claims=claims,
    draw=draw,
    methods=(METHOD,),
    undecided=(0, 1, 2),
)
