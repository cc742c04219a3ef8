"""The motor's transport over five decades of time, beside a rotor without wells and the disk."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from magmotor.common.arrays import Array
from magmotor.devices.disk.scene import Disk
from magmotor.devices.disk.theory.fokker_planck import ReducedDisk
from magmotor.devices.motor.scene import Motor
from paper.figure import Figure
from paper.motor.long_runs import METHOD, LongRun, Size, long_run, stationary_run
from paper.motor.rotor import rotor
from paper.motor.spreading import (
    Measured,
    Slopes,
    correlations,
    green_kubo,
    half_octaves,
    local_slopes,
    logarithmic_slope,
    over_replicas,
    rotor_square,
    square_increments,
)
from paper.motor.transport_claims import BALLISTIC, claims
from paper.motor.transport_picture import draw
from paper.motor.wandering import Wandering

ALPHA = 1e-3
"""Noise of the paper's first runs at uniform temperature, in N m sqrt(s)."""

FULL, QUICK = Size(32, 4e6, 5e4), Size(24, 2.7e4, 2e3)

PHYSICAL = {False: Size(64, 4e5, 2e4), True: Size(12, 2.5e4, 2e3)}
"""Sizes of the runs with the energy of ball and ring counted once."""

MUJOCO, MUJOCO_DURATION = "mujoco/baoab", {False: 3e4, True: 3e3}


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
    """the same by the reference, with the same noise"""
    since_start: tuple[Array, Array]
    """square angles in rad^2 since the start of the two, at the lags of `beside`, shape (R, L)"""
    disk: Slopes
    """of the paper's disk; the lag is scaled to the motor's memory"""

    @property
    def rotor_slopes(self) -> Array:
        """Exact slopes of the rotor at the lags of `motor`."""
        lag = self.motor.lag
        return logarithmic_slope(rotor_square(self.rate, self.memory, lag), lag)


def compute(quick: bool) -> Transport:
    """Simulate the motors, also by MuJoCo, and the rotors."""
    size = QUICK if quick else FULL
    run = stationary_run(ALPHA, 2.0, size, seed=1)
    physical = stationary_run(ALPHA, 1.0, PHYSICAL[quick], seed=2)
    mujoco, beside = (
        long_run(Motor(), MUJOCO_DURATION[quick], size.replicas, 3, method, run.last)
        for method in (MUJOCO, METHOD)
    )
    return transport_of(run, physical, mujoco, beside)


def transport_of(run: LongRun, physical: LongRun, mujoco: LongRun, beside: LongRun) -> Transport:
    """Return the data of the figure from the motor's runs, beside rotors of the first one's rate.

    Parameters
    ----------
    run, physical : LongRun
        With the energy of ball and ring counted twice, and once.
    mujoco, beside : LongRun
        By MuJoCo and by the reference, from the same states.
    """
    motor = Spread.of(run)
    correlation = correlations(run.rate, int(motor.lag[-1] / run.interval) + 1)
    nearest = int(np.abs(motor.lag - BALLISTIC).argmin())
    rate_square = motor.squares[:, nearest].mean() / motor.lag[nearest] ** 2
    rate, memory = float(np.sqrt(rate_square)), float(motor.diffusion.value / rate_square)
    replicas, records = run.azimuth.shape
    rotors = rotor(rate, memory, run.interval * np.arange(records), replicas, seed=2)
    stride = round(BALLISTIC / run.interval)
    first, second = (
        over_replicas(square_increments(part, np.array([stride]))[:, 0] / BALLISTIC**2)
        for part in np.array_split(run.azimuth, 2, axis=1)
    )
    ball, null = (Wandering.of(each[:, ::2], 2 * run.interval) for each in (run.azimuth, rotors))
    return Transport(
        motor,
        Spread.of(physical),
        rate,
        memory,
        correlation,
        green_kubo(correlation, run.interval),
        run.interval,
        (first, second),
        ball,
        null,
        Spread.of(mujoco),
        Spread.of(beside),
        (_since_start(mujoco), _since_start(beside)),
        _disk_slopes(_forgetting(correlation, run.interval, rate_square)),
    )


def _since_start(run: LongRun) -> Array:
    lags = half_octaves(run.azimuth.shape[1])
    return (run.azimuth[:, lags] - run.azimuth[:, :1]) ** 2


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
    forgotten = np.interp(-1, np.log(correlation[::-1] / theory.mean_square), times[::-1])
    return Slopes(times * memory / forgotten, theory.slope_from_gibbs(times), np.zeros(60))


FIGURE = Figure(
    "motor_transport",
    "Motor: transport over five decades",
    "Top left: local slope of E[(φ(t) - φ(0))²], where φ is the ball's azimuth, for"
    f" {FULL.replicas} motors over {FULL.duration:g} s at α = {ALPHA:g} and uniform temperature,"
    f" without the first {FULL.burn_in:g} s; the same with the energy of ball and ring counted"
    " once; MuJoCo's motors; a rotor without wells, whose rate is an Ornstein-Uhlenbeck process"
    " with the ball's mean square rate and diffusion; and the paper's sliding disk, in theory,"
    " with its time scaled to the same memory. Top right: the mean squares. Bottom left: the"
    " correlation of the ball's rate. Bottom right: the integral of this correlation, and half"
    " the mean square divided by the lag; both tend to the diffusion coefficient, and they are"
    " the same but for bookkeeping. Bars and bands are standard errors over replicas.",
    compute,
    claims,
    draw,
    (),
    (METHOD, MUJOCO),
    undecided=(0, 1, 6),
)
