"""Claims about the motor's transport, beside a rotor without wells, which can pass them, too."""

from typing import TYPE_CHECKING

import numpy as np

from magmotor.common.arrays import Array
from paper.figure import OURS, Claim, judged
from paper.motor.runs import SIGNIFICANT
from paper.motor.spreading import Measured, over_replicas

if TYPE_CHECKING:
    from paper.motor.transport import Spread, Transport

BALLISTIC = 100.0
"""Lag, in s, at which the ball has forgotten its thermal motion within the valley."""

CROSSING = 200.0, 1000.0
"""Lags, in s, in which a ball of thermal rate crosses a well."""

PAIRED, PAIRED_CLOSE = 640.0, 0.002
"""Time, in s, in which chaos does not yet part motors of the same noise, and the relative error
of their mean square by the timestep."""

STEEP = 1.85
"""Slope above which the motion is called ballistic."""


def claims(found: "Transport") -> list[Claim]:
    """Return the paper's claim about the motor's mean square displacement, and ours."""
    motor = found.motor
    last = motor.slopes.lag[-1]
    late, early = motor.slope_near(last), motor.slope_near(BALLISTIC)
    steep = np.log10(motor.slopes.lag[motor.slopes.slope > STEEP])
    decades = float(np.ptp(steep)) if len(steep) else 0.0
    falls = bool(early.value - late.value > SIGNIFICANT * np.hypot(early.error, late.error))
    return [
        judged(
            "The basic phenomenon, a ballistic mean squared displacement, arises in a more complex,"
            " rigid-body system",
            f"the local slope of E[(φ(t) - φ(0))²] is {early} at {BALLISTIC:g} s and above {STEEP}"
            f" for {decades:.1f} decades, but {motor.slope_near(1e4)} at 10⁴ s and {late}"
            f" at {last:.2g} s: a crossover to diffusion, with {_diffusion(motor)}",
            holds=not falls,
            otherwise="in part" if decades > 1 else "wrong",
        ),
        _same_with_factor_one(found),
        _green_kubo_agrees(found),
        _is_stationary(found),
        _mujoco_agrees(found),
        _slopes_show_wells(found),
        _rotor_is_like_the_motor(found),
    ]


def _diffusion(spread: "Spread") -> str:
    return f"D = {spread.diffusion} rad²/s between {spread.lag[-5]:.2g} and {spread.lag[-1]:.2g} s"


def _same_with_factor_one(found: "Transport") -> Claim:
    physical = found.physical
    last = float(physical.slopes.lag[-1])
    early, late = physical.slope_near(BALLISTIC), physical.slope_near(last)
    other = found.motor.slope_near(last)
    score = (late.value - other.value) / np.hypot(late.error, other.error)
    return judged(
        f"{OURS}the same holds if the energy of ball and ring counts once, as in physics",
        f"slope {early} at {BALLISTIC:g} s, {physical.slope_near(1e4)} at 10⁴ s and {late} at"
        f" {last:.2g} s, where it is {other} if the energy counts twice; {_diffusion(physical)}",
        bool(early.value > STEEP and abs(score) < SIGNIFICANT),
    )


def _green_kubo_agrees(found: "Transport") -> Claim:
    motor, lag = found.motor, found.motor.lag
    inside = slice(round(lag[-5] / found.interval), round(lag[-1] / found.interval) + 1)
    mean = found.integral[:, inside].mean(axis=1)
    difference = over_replicas(mean - motor.growth)
    one, other = over_replicas(mean[::2]), over_replicas(motor.growth[1::2])
    apart = (one.value - other.value) / np.hypot(one.error, other.error)
    return judged(
        f"{OURS}the bookkeeping is right: along the same paths, the integral of the rate's"
        " correlation (Green-Kubo) and the mean square give the same diffusion",
        f"{over_replicas(mean)} rad²/s, averaged over upper limits from {lag[-5]:.2g} to"
        f" {lag[-1]:.2g} s, against {motor.diffusion} rad²/s from the mean square; the"
        f" difference is {_scientific(difference)} rad²/s, as it must be, since the two are"
        " identical but for discretization and the ends of the runs. Of different halves of the"
        f" motors, {one} against {other} rad²/s",
        bool(abs(difference.value) < SIGNIFICANT * difference.error and abs(apart) < SIGNIFICANT),
    )


def _scientific(found: Measured) -> str:
    return f"{float(found.value):.1e} ± {float(found.error):.0e}"


def _is_stationary(found: "Transport") -> Claim:
    first, second = found.halves
    score = float((first.value - second.value) / np.hypot(first.error, second.error))
    return judged(
        f"{OURS}after the burn-in the ensemble is stationary",
        f"the mean square rate over {BALLISTIC:g} s is {1e6 * first.value:.2f} ±"
        f" {1e6 * first.error:.2f} in the first half and {1e6 * second.value:.2f} ±"
        f" {1e6 * second.error:.2f} (mrad/s)² in the second",
        abs(score) < SIGNIFICANT,
    )


def _mujoco_agrees(found: "Transport") -> Claim:
    ours, reference = found.by_mujoco, found.beside
    early = _paired(*found.since_start)
    near = int(np.abs(ours.lag - PAIRED).argmin())
    ratio, error = _paired(ours.squares, reference.squares)
    worst = int((np.abs(ratio - 1) / error).argmax())
    off, bound = abs(early.value[near] - 1), PAIRED_CLOSE + SIGNIFICANT * early.error[near]
    return judged(
        f"{OURS}MuJoCo's motor spreads as the reference's",
        f"{len(ours.squares)} motors by `{ours.method}` start from the same states and have the"
        f" same noise as the reference's. {ours.lag[near]:.0f} s later, before chaos parts them,"
        f" their mean square angle is {early.value[near]:.4f} ± {early.error[near]:.4f} times as"
        f" large, by paired differences (bound: 1 ± {bound:.4f}). Over the whole run, in which"
        f" chaos parts them, it is {Measured(ratio[0], error[0])} times at {ours.lag[0]:g} s and"
        f" {Measured(ratio[-1], error[-1])} times at {ours.lag[-1]:.2g} s; it differs most at"
        f" {ours.lag[worst]:.2g} s, by {abs(ratio[worst] - 1) / error[worst]:.1f} standard errors",
        bool(off < bound and np.all(np.abs(ratio - 1) < SIGNIFICANT * error)),
    )


def _paired(ours: Array, reference: Array) -> Measured:
    """Return the ratio of two mean squares, shape (L,), with errors by differences of replicas."""
    mean = reference.mean(axis=0)
    ratio = ours.mean(axis=0) / mean
    return Measured(ratio, over_replicas((ours - ratio * reference) / mean).error)


def _slopes_show_wells(found: "Transport") -> Claim:
    slopes = found.rotor_slopes
    return judged(
        f"{OURS}slopes that fall from 2 to 1 show wells or flights",
        f"those of a rotor without wells, whose rate is an Ornstein-Uhlenbeck process of"
        f" {1e3 * found.rate:.2f} mrad/s with a memory of {found.memory:.0f} s, fall from"
        f" {slopes[0]:.3f} to {slopes[-1]:.2f} at the same lags",
        bool(slopes[0] - slopes[-1] < 0.2),
    )


def _rotor_is_like_the_motor(found: "Transport") -> Claim:
    """Return the claim that only statistics which the rotor fails can refute."""
    ball, null = found.motor_wanders, found.rotor_wanders
    lag, slope, error = found.motor.slopes
    crossing = (lag > CROSSING[0]) & (lag < CROSSING[1])
    lowest = int(np.flatnonzero(crossing)[slope[crossing].argmin()])
    score = (ball.residence.value - null.residence.value) / np.hypot(
        ball.residence.error, null.residence.error
    )
    return judged(
        f"{OURS}a rotor without wells, of the same rate and memory, moves as the ball does",
        f"in the cores of wells, half of the circle, the ball spends {ball.residence} of the time,"
        f" the rotor {null.residence}; the slope has a minimum of {slope[lowest]:.3f} ±"
        f" {error[lowest]:.3f} at {lag[lowest]:.0f} s, where the ball crosses a well, and the"
        f" rotor's is {found.rotor_slopes[lowest]:.3f}; what is left of flights after a revolution"
        f" has the squared coefficient of variation {ball.variation}, the rotor's"
        f" {null.variation}. The rotor passes the last slope, {found.rotor_slopes[-1]:.2f} against"
        f" {slope[-1]:.2f} ± {error[-1]:.2f}, and has the same diffusion",
        bool(abs(score) < SIGNIFICANT),
    )
