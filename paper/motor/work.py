"""A load on the motor at one temperature: its response, its speed, and the law of its work."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.devices.motor.scene import Motor
from paper.figure import OURS, Claim, Figure, judged
from paper.motor.long_runs import METHOD, Size, long_run
from paper.motor.spreading import Measured, local_slopes, over_replicas
from paper.motor.work_law import slope_of_the_law
from paper.motor.work_picture import draw_load

SIZE = {False: Size(256, 4e4, 5e4), True: Size(8, 5e3, 5e3)}
"""Replicas, duration under a load, and the time before it, in s."""

TORQUES = {False: (-1e-7, 3e-8, 1e-7, 2e-7), True: (-2e-7, -1e-7, 1e-7, 2e-7)}
"""Loads in N m."""

SMALL = 1e-7
"""Largest load, in N m, whose response is judged as linear."""

WINDOW = 1e4
"""Time, in s, in which the work is measured, about the memory of the ball's rate."""

EVERY = 10
"""Records of a run between two that are kept."""

SIGNIFICANT = 3
"""Standard errors of a significant difference."""

LARGEST_ERROR = 0.25
"""Largest standard error of a slope of 1 that says anything."""


@dataclass(frozen=True)
class Load:
    """Data of the figure: R motors that start in equilibrium, under each of L loads."""

    method: str
    kT: float
    """in J"""
    time: Array
    """since the load began, in s, shape (N,)"""
    torque: Array
    """in N m, shape (L,)"""
    turned: Array
    """angles in rad, shape (L, R, N)"""
    free: Array
    """angles without a load, shape (R, N)"""

    @property
    def until(self) -> int:
        """Index of the time `WINDOW`."""
        return int(np.abs(self.time - WINDOW).argmin())

    @property
    def works(self) -> Array:
        """Work of each load over `WINDOW` in kT, shape (R, L)."""
        return (self.torque[:, np.newaxis] * self.turned[:, :, self.until] / self.kT).T

    @property
    def powers(self) -> Measured:
        """Mean power of each load over `WINDOW` in kT/s; what it gains, the ball delivers."""
        return over_replicas(self.works / WINDOW)

    @property
    def speeds(self) -> Measured:
        """Mean speed under each load in the second half of the run, in rad/s, shape (L,)."""
        return over_replicas(self._speed(self.turned).T)

    @property
    def mobility(self) -> Measured:
        """Einstein's prediction of speed over torque in the same time, in rad/(N m s)."""
        return over_replicas(self._speed(self.free**2 / (2 * self.kT)))

    def _speed(self, angles: Array) -> Array:
        half = len(self.time) // 2
        span = self.time[-1] - self.time[half]
        return (angles[..., -1] - angles[..., half]) / span

    @property
    def slope(self) -> Measured:
        """Slope of E[phi^2] without a load from half of `WINDOW` to twice; in the end it is 1."""
        near = np.array([self.until // 2, self.until, min(2 * self.until, len(self.time) - 1)])
        _, slope, error = local_slopes(self.free[:, near] ** 2, self.time[near])
        return Measured(slope[0], error[0])

    def response(self, loads: NDArray[np.bool_]) -> Measured:
        """Mean angle over torque of some loads, in rad/(N m), shape (N,).

        A load's weight is the square of its torque, which gives the least error.
        """
        weight = self.torque[loads] / np.sum(self.torque[loads] ** 2)
        return over_replicas(np.einsum("l,lrn->rn", weight, self.turned[loads]))

    @property
    def spread(self) -> Measured:
        """Einstein's prediction of it, E[phi^2]/(2 kT) without a load."""
        return over_replicas(self.free**2 / (2 * self.kT))


def compute(quick: bool) -> Load:
    """Simulate the motors, first without a load, and then under each load from the same states."""
    size, torques = SIZE[quick], TORQUES[quick]
    start = long_run(Motor(), size.burn_in, size.replicas, seed=1).last
    free, *loaded = (
        long_run(Motor(load_torque=torque), size.duration, size.replicas, seed, initial=start)
        for seed, torque in enumerate((0.0, *torques), start=2)
    )
    turned = np.stack([run.azimuth - run.azimuth[:, :1] for run in (free, *loaded)])[..., ::EVERY]
    time = EVERY * free.interval * np.arange(turned.shape[-1])
    return Load(METHOD, Motor().kT, time, np.array(torques), turned[1:], turned[0])


def claims(data: Load) -> list[Claim]:
    """Judge Einstein's relation, the second law, and the law of the work."""
    small = np.abs(data.torque) <= SMALL
    response, spread = data.response(small), data.spread
    value, other = response.value[data.until], spread.value[data.until]
    ratio = value / other
    relative = np.hypot(response.error[data.until] / value, spread.error[data.until] / other)
    einstein = Measured(ratio, ratio * relative)
    powers = data.powers
    scores = powers.value / powers.error
    largest = np.abs(data.torque) == np.abs(data.torque).max()
    each = ", ".join(
        f"{score:.1f} at {torque:g} N m" for score, torque in zip(scores, data.torque, strict=True)
    )
    output = float((SIGNIFICANT * powers.error - powers.value).max())
    law = slope_of_the_law(data.works)
    excluded = abs(law.value - 0.5) / law.error
    samples = data.works.size
    return [
        judged(
            f"{OURS}a small load turns the ball as far as Einstein's relation says of a finite"
            " time (linear response)",
            f"after {WINDOW:g} s, the mean angle per torque is {einstein} times E[phi^2]/(2 kT)"
            f" without a load, where kT = alpha^2/(2c); with the paper's alpha^2/c it would be 2"
            f" times ({len(data.free)} replicas, loads up to {SMALL:g} N m). Since E[phi^2] still"
            f" grows like t^({data.slope}) about then, this is not the mobility at long times",
            abs(einstein.value - 1) < SIGNIFICANT * einstein.error,
        ),
        judged(
            f"{OURS}at one temperature the motor lifts no load",
            f"mean work of each load on the ball in {WINDOW:g} s, in standard errors above 0:"
            f" {each}, where the largest load needs {SIGNIFICANT} and no other may be below"
            f" -{SIGNIFICANT}. The output is at most {max(output, 0.0) * data.kT:.1e} W (bound of"
            f" {SIGNIFICANT} standard errors)",
            bool(np.all(scores > np.where(largest, SIGNIFICANT, -SIGNIFICANT))),
        ),
        judged(
            f"{OURS}the load's work obeys the fluctuation theorem ln P(W)/P(-W) = W/kT",
            f"slope {law} in units of 1/kT, over {samples} works in {WINDOW:g} s, of which"
            f" {np.mean(data.works < 0):.0%} are negative; a slope of 1/2, for kT = alpha^2/c, is"
            f" {excluded:.0f} standard errors away. If the work were Gaussian, this would be"
            " linear response again; it is from the same runs, and so not an independent test",
            abs(law.value - 1) < SIGNIFICANT * law.error and law.error < LARGEST_ERROR,
        ),
    ]


FIGURE = Figure(
    name="motor_load",
    title="A load on the motor: Einstein's relation, the second law, and the law of its work",
    caption="A load is a constant torque on the ball's center about the rings' axis. It begins"
    " at t = 0, when the motor (alpha = 1e-3, factor 2) is in equilibrium. Left: mean"
    " angle divided by torque, and Einstein's prediction E[phi^2]/(2 kT) for the same"
    " time from motors without a load; bands are standard errors over the replicas."
    " Middle: speed in the second half of the runs. Right: the logarithm of how much"
    " more often the load does the work W in 1e4 s than the work -W. By the fluctuation"
    " theorem of Evans and Searles, this is W/kT at any time and for any load, without"
    " any correction, if the motor starts in equilibrium. No line has a fitted number.",
    compute=compute,
    claims=claims,
    draw=draw_load,
    methods=(METHOD,),
    undecided=(0, 1, 2),
)
