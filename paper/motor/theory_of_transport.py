"""The motor's transport beside the sliding disk that moves as its ball does, in theory."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from magmotor.common.arrays import Array
from magmotor.devices.disk.gibbs import gibbs
from magmotor.devices.disk.scene import Disk
from magmotor.devices.motor.flights import CORE
from magmotor.devices.motor.scene import Motor
from magmotor.run.ensemble import ensemble
from paper.figure import OURS, Claim, Figure, judged
from paper.motor.held_ring import remaining_friction
from paper.motor.long_runs import METHOD, LongRun, Size, stationary_run
from paper.motor.reduced_theory import Wells, equivalent_disk, ring_drag, rolling, wells
from paper.motor.runs import SIGNIFICANT
from paper.motor.spreading import Measured, over_replicas, square_increments
from paper.motor.theory_picture import draw
from paper.motor.transport import ALPHA, QUICK

ALPHAS = {False: (5e-4, 7.5e-4, ALPHA, 1.25e-3), True: (7.5e-4, ALPHA)}
"""Noise in N m sqrt(s). From 1.5e-3 on, the ball at times goes through the center."""

FIRST = {False: Size(64, 1e6, 5e4), True: QUICK}
OTHERS = {False: Size(64, 4e5, 2e4), True: Size(8, 2.5e4, 2e3)}
HELD = {False: Size(96, 6e4, 2e3), True: Size(8, 1.5e4, 2e3)}
"""Sizes of the runs at `ALPHA`, at other temperatures, and under held rings."""

DISK_METHOD, DISK_TIMESTEP = "variational/baoab", 2.0
DISKS = 1024

BINS = 24
"""Bins of the azimuth within a sector."""

CLOSE = 0.2
"""Relative difference of mean squares up to which a theory without a fitted number is close."""


class Case(NamedTuple):
    """A motor at one temperature, and its disks; mean square increments are in rad^2."""

    scene: Motor
    lag: Array
    """In s, shape (L,); each is twice the previous one."""
    squares: Array
    """Of R motors, shape (R, L)."""
    friction: Measured
    """Rate in 1/s at which P is forgotten under held rings."""
    drag: float
    """The same, by the drag of the inner ring, which leans."""
    disks: Measured
    """Mean squares of the disks with both, shape (L,)."""
    without: Measured
    """Mean squares of the disks without the friction under held rings, shape (L,)."""

    def ratio(self, theory: Measured) -> Measured:
        """Return the motor's mean squares over those of a theory, shape (L,)."""
        value, error = over_replicas(self.squares)
        ratio = value / theory.value
        return Measured(ratio, ratio * np.hypot(error / value, theory.error / theory.value))

    def diffusion(self, theory: Measured | None = None) -> Measured:
        """Return half the growth rate over the last octave, in rad^2/s, of the motor or disks."""
        span = 2 * (self.lag[-1] - self.lag[-2])
        if theory is None:
            return over_replicas((self.squares[:, -1] - self.squares[:, -2]) / span)
        return Measured(np.diff(theory.value)[-1] / span, theory.error[-1] / span)


@dataclass(frozen=True)
class Theory:
    """Data of the figure; the paper's factor 2 except for the last case of the full size."""

    cases: list[Case]
    main: Case
    """at `ALPHA` with factor 2"""
    wells: Wells
    """at the centers of the `BINS` bins"""
    density: Measured
    """of the azimuth in a sector, over the mean; shape (BINS,)"""
    core: Measured
    """share of the time in the cores of wells"""
    method: str = METHOD

    @property
    def by_temperature(self) -> list[Case]:
        """The cases with the paper's factor 2."""
        return [case for case in self.cases if case.scene.ball_ring_factor == 2]


def compute(quick: bool) -> Theory:
    """Simulate motors and disks at several temperatures."""
    pairs = [(alpha, 2.0) for alpha in ALPHAS[quick]] + ([] if quick else [(ALPHA, 1.0)])
    cases = [_case(alpha, factor, quick) for alpha, factor in pairs]
    main = cases[pairs.index((ALPHA, 2.0))]
    run = _run(ALPHA, 2.0, quick)
    sectors = run.azimuth * main.scene.outer_dipoles / (2 * np.pi) % 1
    shifted = (sectors + 0.5 / BINS) % 1  # a bin is centered at each azimuth of `wells`
    shares = np.array([np.histogram(row, BINS, (0, 1))[0] for row in shifted]) / sectors.shape[1]
    in_core = np.minimum(sectors, 1 - sectors) <= CORE
    return Theory(
        cases, main, wells(main.scene, BINS), over_replicas(BINS * shares),
        over_replicas(in_core.mean(axis=1)),
    )  # fmt: skip


def _run(alpha: float, factor: float, quick: bool) -> LongRun:
    if (alpha, factor) == (ALPHA, 2.0):
        return stationary_run(alpha, factor, FIRST[quick], seed=1)
    return stationary_run(alpha, factor, OTHERS[quick], seed=2)


def _case(alpha: float, factor: float, quick: bool) -> Case:
    run = _run(alpha, factor, quick)
    scene = Motor(alpha_ball=alpha, alpha_ring=alpha, ball_ring_factor=factor)
    most = run.azimuth.shape[1] / 4
    records = 2 ** np.arange(int(np.log2(most)) + 1)
    lags = (run.interval * records).astype(float)
    friction = remaining_friction(scene, HELD[quick])
    drag = ring_drag(scene, wells(scene)) / rolling(scene).inertia
    disks, without = (
        _spread_of_disks(equivalent_disk(scene, rate), lags, DISKS, scene)
        for rate in (max(0.0, float(friction.value)), 0.0)
    )
    squares = square_increments(run.azimuth, records)
    return Case(scene, lags, squares, friction, drag, disks, without)


def _spread_of_disks(disk: Disk, lags: Array, replicas: int, motor: Motor) -> Measured:
    """Return mean square increments, in rad^2, of disks that start from Gibbs' law."""
    many = ensemble(
        disk, method=DISK_METHOD, timestep=DISK_TIMESTEP, duration=5 * float(lags[-1]),
        replicas=replicas, seed=4, sample_interval=round(float(lags[0]) / DISK_TIMESTEP),
        initial=gibbs(disk, replicas, seed=5),
    ).sel(lag=lags)  # fmt: skip
    around = motor.outer_dipoles**2
    return Measured(
        many.mean_square_increment.values / around, many.mean_square_increment_error.values / around
    )


def claims(found: Theory) -> list[Claim]:
    """Return our claims about the reduced theory."""
    main = found.main
    return [
        _wells_have_gibbs_law(found),
        _rolls_with_its_inertia(main),
        _forgets_by_wells_and_ring(main),
        _with_friction_it_is_close(main),
        _at_all_temperatures(found),
    ]


def _wells_have_gibbs_law(found: Theory) -> Claim:
    scores = np.abs(found.density.value - found.wells.density) / found.density.error
    sectors = np.arange(BINS) / BINS
    distance = np.minimum(sectors, 1 - sectors)
    inside = np.where(np.isclose(distance, CORE), 0.5, distance < CORE)
    expected = float(found.wells.density @ inside) / BINS
    return judged(
        f"{OURS}the ball stays in the wells as Gibbs' law says",
        f"{found.core} of the time in the cores of wells, {expected:.3f} by Gibbs' law integrated"
        " over the ball's distance, its axis and the lean of the ring; of the density in"
        f" {BINS} bins the largest difference is {scores.max():.1f} standard errors",
        bool(scores.max() < SIGNIFICANT),
    )


def _rolls_with_its_inertia(main: Case) -> Claim:
    ratio = main.ratio(main.without)
    near = int(np.abs(main.lag - 160).argmin())
    value, error = ratio.value[near], ratio.error[near]
    inertia, kT = rolling(main.scene).inertia, main.scene.kT
    return judged(
        f"{OURS}the ball rolls around the valley without friction, with the inertia of the"
        " momentum P that slip conserves",
        f"M = {inertia:.3f} kg m² gives the rate sqrt(kT/M) = {1e3 * np.sqrt(kT / inertia):.2f}"
        f" mrad/s; the mean square over {main.lag[near]:.0f} s is {value:.3f} ± {error:.3f} times"
        " that of the sliding disk of this inertia and these wells, without a number from a run"
        f" (bound: 10 % and {SIGNIFICANT} standard errors)",
        bool(abs(value - 1) < 0.1 + SIGNIFICANT * error),
    )


def _forgets_by_wells_and_ring(main: Case) -> Claim:
    rate, error = 1e5 * main.friction.value, 1e5 * main.friction.error
    last = main.ratio(main.without)
    return judged(
        f"{OURS}only the wells, the slip and the drag of the leaning ring make the ball forget its"
        " motion",
        f"the drag alone makes it forget at {1e5 * main.drag:.1f}·10⁻⁵/s, but under held rings"
        f" without wells it still forgets at ({rate:.2f} ± {error:.2f})·10⁻⁵/s, since its distance"
        " and its axis fluctuate. Without that, theory has no number from a run, and the motor's"
        f" mean square at {main.lag[-1]:.2g} s is {last.value[-1]:.2f} ± {last.error[-1]:.2f} times"
        f" that of theory (D = {main.diffusion(main.without)} rad²/s)",
        bool(rate < SIGNIFICANT * error),
    )


def _with_friction_it_is_close(main: Case) -> Claim:
    ratio = main.ratio(main.disks)
    value, error = ratio
    worst = int(np.abs(value - 1).argmax())
    return judged(
        f"{OURS}with one rate that is measured in other runs, the friction under held rings, and"
        " nothing fitted, the sliding disk spreads as the motor's ball does, to"
        f" {100 * CLOSE:.0f} % and two standard errors",
        "the motor's mean square is"
        f" {value[4]:.2f} ± {error[4]:.2f} times the disk's at {main.lag[4]:.0f} s,"
        f" {value[9]:.2f} ± {error[9]:.2f} times at {main.lag[9]:.0f} s and {value[-1]:.2f} ±"
        f" {error[-1]:.2f} times at {main.lag[-1]:.2g} s; the largest difference is"
        f" {abs(value[worst] - 1):.2f} ± {error[worst]:.2f} at {main.lag[worst]:.2g} s, which would"
        f" have to exceed {CLOSE} by two standard errors to refute this. Without the measured rate"
        f" the last ratio is {main.ratio(main.without).value[-1]:.2f}."
        f" D = {main.diffusion()} against {main.diffusion(main.disks)} rad²/s, {_window(main)}",
        _is_close(ratio),
    )


def _window(case: Case) -> str:
    return f"between {case.lag[-2]:.2g} and {case.lag[-1]:.2g} s"


def _is_close(ratio: Measured) -> bool:
    """Return whether no mean square differs by more than `CLOSE` by more than two errors."""
    return bool(np.all(np.abs(ratio.value - 1) - CLOSE < 2 * ratio.error))


def _at_all_temperatures(found: Theory) -> Claim:
    parts, ratios, holds = [], [], True
    for case in found.cases:
        ratio = case.ratio(case.disks)
        value, error = ratio.value[-1], ratio.error[-1]
        once = ", counted once" if case.scene.ball_ring_factor == 1 else ""
        parts.append(f"{value:.2f} ± {error:.2f} (α = {case.scene.noises[0]:g}{once})")
        ratios.append((value, error))
        holds &= _is_close(ratio)
    mean = _weighted_mean(*np.array(ratios).T)
    listed = ", ".join(str(case.diffusion()) for case in found.cases)
    return judged(
        f"{OURS}the same at other temperatures and with ball and ring counted once, to"
        f" {100 * CLOSE:.0f} % and two standard errors each",
        f"at the longest lags, {found.main.lag[-1]:.2g} s or less, the motor's mean square is"
        f" {', '.join(parts)} times the disk's, {mean} in their weighted mean; D = {listed} rad²/s"
        f" over the last octave, {_window(found.main)} or earlier, which grows faster than the"
        " temperature",
        holds,
    )


def _weighted_mean(value: Array, error: Array) -> Measured:
    weight = error**-2.0
    return Measured(np.sum(weight * value) / np.sum(weight), np.sum(weight) ** -0.5)


FIGURE = Figure(
    "motor_reduced_theory",
    "Motor: the ball as a sliding disk",
    "A ball that rolls around its valley while its axis follows the field does not slip, and"
    " slip friction conserves its momentum P = L - (ρ/(r ξ_ρ)) J. So the ball is a sliding disk."
    " Its inertia and slip follow from the geometry, its potential from Gibbs' law, and its"
    " background drag from the ring, which leans toward the ball. One rate, that of the"
    " remaining friction, is measured in other runs, under held rings without wells; nothing is"
    f" fitted. The disks are an ensemble of {DISKS} `mm.Disk` by `{DISK_METHOD}`, from Gibbs'"
    f" law. Top left: mean square of the azimuth at α = {ALPHA:g}. Top right: density of the"
    " azimuth. Bottom left: diffusion over temperature, from the last octave of lags. Bottom"
    " right: rates at which P is forgotten without wells.",
    compute,
    claims,
    draw,
    (),
    (METHOD,),
    undecided=(2,),
)
