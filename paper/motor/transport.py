"""The motor's transport over five decades of time, beside a rotor without wells and the disk."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from magmotor.common.arrays import Array
from magmotor.devices.disk.scene import Disk
from magmotor.devices.disk.theory.fokker_planck import ReducedDisk
from magmotor.devices.motor.scene import Motor
from paper.figure import OURS, Claim, Figure, judged
from paper.motor.long_runs import METHOD, LongRun, Size, long_run, stationary_run
from paper.motor.rotor import rotor
from paper.motor.spreading import (
    Measured,
    Slopes,
    correlations,
    green_kubo,
    half_octaves,
    local_slopes,
    over_replicas,
    rotor_square,
    square_increments,
)
from paper.motor.transport_picture import draw
from paper.motor.wandering import Wandering

ALPHA = 1e-3
"""Noise of the paper's first runs at uniform temperature, in N m sqrt(s)."""

FULL, QUICK = Size(64, 1e6, 5e4), Size(48, 1e5, 2e3)

PHYSICAL = {False: Size(64, 4e5, 2e4), True: Size(48, 8e4, 2e3)}
"""Sizes of the runs with the energy of ball and ring counted once."""

MUJOCO, MUJOCO_DURATION = "mujoco/baoab", {False: 3e4, True: 3e3}

SIGNIFICANT = 4
"""Standard errors of a significant difference."""

BALLISTIC = 100.0
"""Lag, in s, at which the ball has forgotten its thermal motion within the valley."""

WELLS = 200.0, 1000.0, 2000.0
"""Lags, in s, around those at which a ball of thermal rate crosses a well."""


class Spread(NamedTuple):
    """Mean square increments of the azimuth, of R replicas at L lags."""

    method: str
    lag: Array
    """In s, shape (L,)."""
    squares: Array
    """In rad^2, shape (R, L)."""

    @classmethod
    def of(cls, run: LongRun) -> "Spread":
        """Return the spread of a run at lags up to a third of its duration."""
        lags = half_octaves(run.azimuth.shape[1])
        return cls(
            run.method, (lags * run.interval).astype(float), square_increments(run.azimuth, lags)
        )

    @property
    def slopes(self) -> Slopes:
        """Local slopes."""
        return local_slopes(self.squares, self.lag)

    def slope_near(self, lag: float) -> Measured:
        """Return the local slope nearest to a lag in s, with its error."""
        found = self.slopes
        nearest = int(np.abs(np.log(found.lag / lag)).argmin())
        return Measured(found.slope[nearest], found.error[nearest])

    @property
    def diffusion(self) -> Measured:
        """Half the growth rate over the last two octaves, in rad^2/s."""
        return over_replicas(self.growth)

    @property
    def growth(self) -> Array:
        """The same of each replica, shape (R,)."""
        span = 2 * (self.lag[-1] - self.lag[-5])
        return (self.squares[:, -1] - self.squares[:, -5]) / span


@dataclass(frozen=True)
class Transport:
    """Data of the figure."""

    motor: Spread
    physical: Spread
    """with the energy of ball and ring counted once"""
    rate: float
    """root mean square rate of the rotors, in rad/s"""
    memory: float
    """of the rotors, in s"""
    correlation: Array
    """of the motor's rate, in rad^2/s^2, shape (R, lags)"""
    integral: Array
    """of the correlation up to each lag, in rad^2/s"""
    interval: float
    """between the lags of the two, in s"""
    halves: tuple[Measured, Measured]
    """mean square rates over the lag `BALLISTIC` in both halves of the run, in rad^2/s^2"""
    motor_wanders: Wandering
    rotor_wanders: Wandering
    by_mujoco: Spread
    """from the last states of the motor's run"""
    beside: Spread
    """the same by the reference, with other noise"""
    disk: Slopes
    """of the paper's disk; the lag is scaled to the motor's memory"""

    @property
    def rotor_slopes(self) -> Array:
        """Exact slopes of the rotor at the lags of `motor`."""
        squares = rotor_square(self.rate, self.memory, self.motor.lag)
        return local_slopes(squares[np.newaxis].repeat(2, axis=0), self.motor.lag).slope


def compute(quick: bool) -> Transport:
    """Simulate the motors, the rotors, and MuJoCo's motors."""
    size = QUICK if quick else FULL
    run = stationary_run(ALPHA, 2.0, size, seed=1)
    motor = Spread.of(run)
    correlation = correlations(run.rate, int(motor.lag[-1] / run.interval) + 1)
    nearest = int(np.abs(motor.lag - BALLISTIC).argmin())
    rate_square = motor.squares[:, nearest].mean() / motor.lag[nearest] ** 2
    memory = float(motor.diffusion.value / rate_square)
    times = run.interval * np.arange(run.azimuth.shape[1])
    rate = float(np.sqrt(rate_square))
    rotors = rotor(rate, memory, times, size.replicas, seed=2)
    duration = MUJOCO_DURATION[quick]
    mujoco, beside = (
        Spread.of(long_run(Motor(), duration, size.replicas, 3, method, run.last))
        for method in (MUJOCO, METHOD)
    )
    middle = run.azimuth.shape[1] // 2
    stride = round(BALLISTIC / run.interval)
    first, second = (
        over_replicas(square_increments(part, np.array([stride]))[:, 0] / BALLISTIC**2)
        for part in (run.azimuth[:, :middle], run.azimuth[:, middle:])
    )
    ball, null = (Wandering.of(each[:, ::2], 2 * run.interval) for each in (run.azimuth, rotors))
    return Transport(
        motor,
        Spread.of(stationary_run(ALPHA, 1.0, PHYSICAL[quick], seed=2)),
        rate,
        memory,
        correlation,
        green_kubo(correlation, run.interval),
        run.interval,
        (first, second),
        ball,
        null,
        mujoco,
        beside,
        _disk_slopes(_forgetting(correlation, run.interval, rate_square)),
    )


def _forgetting(correlation: Array, interval: float, start: float) -> float:
    """Return the time, in s, at which the correlation has fallen to 1/e of its start."""
    mean = correlation.mean(axis=0)
    smooth = np.convolve(mean, np.ones(31) / 31, mode="valid")
    return interval * (15 + int((smooth < start / np.e).argmax()))


def _disk_slopes(memory: float) -> Slopes:
    """Return the slopes of the paper's disk, in theory, whose time is scaled to this memory."""
    theory = ReducedDisk(Disk())
    times = np.geomspace(1, 1e6, 60)
    correlation = theory.d_correlation(times)
    forgotten = np.interp(-1, -np.log(correlation[::-1] / theory.mean_square) * -1, times[::-1])
    return Slopes(times * memory / forgotten, theory.slope_from_gibbs(times), np.zeros(60))


def claims(found: Transport) -> list[Claim]:
    """Return the paper's claim about the motor's mean square displacement, and ours."""
    motor, physical = found.motor, found.physical
    last = motor.slopes.lag[-1]
    late, early = motor.slope_near(last), motor.slope_near(BALLISTIC)
    decades = np.log10(motor.slopes.lag[motor.slopes.slope > 1.85])
    falls = bool(early.value - late.value > SIGNIFICANT * np.hypot(early.error, late.error))
    return [
        judged(
            "The basic phenomenon, a ballistic mean squared displacement, arises in a more complex,"
            " rigid-body system",
            f"the local slope of E[(φ(t) - φ(0))²] is {early} at {BALLISTIC:g} s and above 1.85"
            f" for {np.ptp(decades):.1f} decades, but {motor.slope_near(1e4)} at 10⁴ s and {late}"
            f" at {last:.2g} s: a crossover to diffusion, with {_diffusion(motor)}",
            holds=not falls,
            otherwise="in part" if np.ptp(decades) > 1 else "wrong",
        ),
        _same_with_factor_one(physical),
        _green_kubo_agrees(found),
        _is_stationary(found),
        _mujoco_agrees(found),
        _slopes_show_wells(found),
        _rotor_is_like_the_motor(found),
    ]


def _diffusion(spread: Spread) -> str:
    return f"D = {spread.diffusion} rad²/s between {spread.lag[-5]:.2g} and {spread.lag[-1]:.2g} s"


def _same_with_factor_one(physical: Spread) -> Claim:
    late = physical.slope_near(physical.slopes.lag[-1])
    early = physical.slope_near(BALLISTIC)
    difference = (early.value - late.value) / np.hypot(early.error, late.error)
    return judged(
        f"{OURS}the same holds if the energy of ball and ring counts once, as in physics",
        f"slope {early} at {BALLISTIC:g} s, {physical.slope_near(1e4)} at 10⁴ s and {late} at"
        f" {physical.slopes.lag[-1]:.2g} s; {_diffusion(physical)}",
        bool(early.value > 1.85 and difference > SIGNIFICANT),
    )


def _green_kubo_agrees(found: Transport) -> Claim:
    motor, lag = found.motor, found.motor.lag
    inside = slice(round(lag[-5] / found.interval), round(lag[-1] / found.interval) + 1)
    mean = found.integral[:, inside].mean(axis=1)
    difference = over_replicas(mean - motor.growth)
    return judged(
        f"{OURS}the integral of the rate's correlation is the diffusion coefficient (Green-Kubo)",
        f"{over_replicas(mean)} rad²/s, averaged over upper limits from {lag[-5]:.2g} to"
        f" {lag[-1]:.2g} s, against {motor.diffusion} rad²/s from the mean square; the"
        f" difference is {_scientific(difference)} rad²/s",
        bool(abs(difference.value) < SIGNIFICANT * difference.error),
    )


def _scientific(found: Measured) -> str:
    return f"{float(found.value):.1e} ± {float(found.error):.0e}"


def _is_stationary(found: Transport) -> Claim:
    first, second = found.halves
    score = float((first.value - second.value) / np.hypot(first.error, second.error))
    return judged(
        f"{OURS}after the burn-in the ensemble is stationary",
        f"the mean square rate over {BALLISTIC:g} s is {1e6 * first.value:.2f} ±"
        f" {1e6 * first.error:.2f} in the first half and {1e6 * second.value:.2f} ±"
        f" {1e6 * second.error:.2f} (mrad/s)² in the second",
        abs(score) < SIGNIFICANT,
    )


def _mujoco_agrees(found: Transport) -> Claim:
    ours, reference = found.by_mujoco, found.beside
    ratio = ours.squares.mean(axis=0) / reference.squares.mean(axis=0)
    weights = reference.squares.mean(axis=0)
    residual = (ours.squares - ratio * reference.squares) / weights
    error = over_replicas(residual).error
    worst = int((np.abs(ratio - 1) / error).argmax())
    return judged(
        f"{OURS}MuJoCo's motor spreads as the reference's",
        f"of {len(ours.squares)} motors by `{ours.method}`, from the same states and with the same"
        f" noise as the reference's, the mean square is {_ratio(ratio[0], error[0])} times as large"
        f" at {ours.lag[0]:g} s and {_ratio(ratio[-1], error[-1])} times at {ours.lag[-1]:.2g} s;"
        f" it differs most at {ours.lag[worst]:.2g} s, by"
        f" {abs(ratio[worst] - 1) / error[worst]:.1f} standard errors",
        bool(np.all(np.abs(ratio - 1) < SIGNIFICANT * error)),
    )


def _ratio(value: float, error: float) -> Measured:
    return Measured(value, error)


def _slopes_show_wells(found: Transport) -> Claim:
    slopes = found.rotor_slopes
    return judged(
        f"{OURS}slopes that fall from 2 to 1 show wells or flights",
        f"those of a rotor without wells, whose rate is an Ornstein-Uhlenbeck process of"
        f" {1e3 * found.rate:.2f} mrad/s with a memory of {found.memory:.0f} s, fall from"
        f" {slopes[0]:.3f} to {slopes[-1]:.2f} at the same lags",
        bool(slopes[0] - slopes[-1] < 0.2),
    )


def _rotor_is_like_the_motor(found: Transport) -> Claim:
    """Return the claim that only statistics which the rotor fails can refute."""
    ball, null = found.motor_wanders, found.rotor_wanders
    lag, slope, error = found.motor.slopes
    crossing = (lag > WELLS[0]) & (lag < WELLS[1])
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
        f" {null.variation}. The rotor passes the late slopes and the diffusion",
        bool(abs(score) < SIGNIFICANT),
    )


FIGURE = Figure(
    "motor_transport",
    "Motor: transport over five decades",
    f"Top left: local slope of E[(φ(t) - φ(0))²] of the ball's azimuth φ, {FULL.replicas} motors"
    f" over {FULL.duration:g} s at α = {ALPHA:g} and uniform temperature, of which the first"
    f" {FULL.burn_in:g} s are left out; the same with the energy of ball and ring counted once;"
    " MuJoCo's motors; a rotor without wells, whose rate is an Ornstein-Uhlenbeck process with the"
    " ball's mean square rate and diffusion; and the paper's sliding disk, in theory, with its time"
    " scaled to the same memory. Top right: the mean squares. Bottom left: correlation of the"
    " ball's rate. Bottom right: its integral, and half the mean square over the lag; both tend to"
    " the diffusion coefficient. Bars and bands are standard errors over replicas.",
    compute,
    claims,
    draw,
    (),
    (METHOD, MUJOCO),
)
