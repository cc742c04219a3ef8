"""The barrier that the motor's ball has ahead when it hops to the next well, and its direction."""

import numpy as np

from magmotor.common.arrays import Array
from magmotor.devices.motor.ring_stability import ring_stiffness
from magmotor.devices.motor.scene import Motor
from paper.figure import OURS, Claim, Figure, judged
from paper.motor.azimuths import METHOD, Azimuths, azimuths
from paper.motor.barriers import Valley, gibbs_barriers
from paper.motor.crossings import LAGS, Crossings, Places, barriers, crossings
from paper.motor.flight_definitions import DEFINITIONS, remaining
from paper.motor.hop_barriers import Ahead, Found, Mean, Sample
from paper.motor.hops_picture import draw
from paper.motor.runs import SIGNIFICANT

NOW = np.zeros(1)
"""The lag of the crossing itself."""

CLOSE = 0.25
"""A barrier is close to its minimum if it is in the lowest quarter of all."""

LENT = 1
"""Distance of the number of the run that lends the lean of its ring, which the ball never felt."""


def compute(quick: bool) -> Found:
    """Find the crossings in two ensembles, and the barriers ahead of the ball."""
    valley = Valley(Motor())
    runs = {name: azimuths(name, quick) for name in ("uniform", "nonuniform")}
    found = {name: crossings(each) for name, each in runs.items()}
    uniform, nonuniform = (_ahead(valley, found[name], runs[name], quick) for name in runs)
    leans = np.array([np.hypot(*lean.T).mean() for lean in runs["uniform"].leans])
    flights = remaining(runs["uniform"].rows, DEFINITIONS["once"])
    hops = found["uniform"].hops
    clockwise = {
        "flights": (
            Sample((flights.direction < 0).astype(np.float64), flights.run).mean,
            len(flights.run),
        ),
        "hops": (Sample((hops.step < 0).astype(np.float64), hops.run).mean, len(hops.run)),
    }
    gibbs = gibbs_barriers(valley, (-0.25, 0.25), (0.5, 0.5))
    lean = Sample(leans, np.arange(len(leans))).mean
    return Found(METHOD, valley, uniform, nonuniform, lean, gibbs, clockwise)


def _ahead(valley: Valley, found: Crossings, runs: Azimuths, quick: bool) -> Ahead:
    many, few = (400, 20) if quick else (4000, 300)

    def sample(places: Places, lags: Array, other: int = 0) -> Sample:
        places = places.inside(runs, lags, other)
        return Sample(barriers(valley, places, runs, lags, other), places.run)

    now = {kind: sample(places.some(many), NOW) for kind, places in found._asdict().items()}
    hops = found.hops.some(few)
    around = {
        "hops": sample(hops, LAGS),
        "passes": sample(found.passes.some(few), LAGS),
        "other": sample(hops, LAGS, LENT),
    }
    return Ahead({kind: Sample(each.values[:, 0], each.run) for kind, each in now.items()}, around)


def claims(found: Found) -> list[Claim]:
    """Return the paper's claims on hops and directions, and ours."""
    return [
        _at_uniform_temperature(found),
        _at_nonuniform_temperature(found.nonuniform),
        _in_flight(found),
        _by_gibbs(found),
        _of_the_ring(found),
        _directions(found.clockwise),
    ]


def _at_uniform_temperature(found: Found) -> Claim:
    kT = found.valley.motor.kT
    hops, _, waiting = found.uniform.now.values()
    ranks = {name: found.uniform.rank(name) for name in ("hops", "other")}
    in_wells, lower = found.uniform.rank_in_wells, waiting.above(hops)
    return judged(
        "The ball is stuck in a well, and moves into another potential well when the energy"
        " barrier between the two wells is close to minimum (a phenomenon known as stochastic"
        " resonance)",
        f"at uniform temperature the barrier ahead at {len(hops.values)} hops is"
        f" {hops.mean.said(kT)} kT, against {waiting.mean.said(kT)} kT at random times in a well,"
        f" where it is lower than at a hop for {in_wells.said()} of the time; within {LAGS[-1]:g} s"
        f" before or after a hop, for {ranks['hops'].said()} of the time ({ranks['other'].said()}"
        " with the lean of another ring). Both parts are 0 if hops are at the minimum, 1/2 if the"
        f" barrier does not matter, and less than {CLOSE} if it is close to its minimum",
        max(ranks["hops"].value, in_wells.value) < CLOSE,
        otherwise="in part" if lower.value > SIGNIFICANT * lower.error else "wrong",
    )


def _at_nonuniform_temperature(ahead: Ahead) -> Claim:
    hops, _, waiting = ahead.now.values()
    rank, in_wells, lower = ahead.rank("hops"), ahead.rank_in_wells, waiting.above(hops)
    lowest = min(each.value - SIGNIFICANT * each.error for each in (rank, in_wells))
    return judged(
        f"{OURS}at nonuniform temperature, the barrier at hops is not close to its minimum",
        f"it is lower at random times in a well than at a hop for {in_wells.said()} of the time,"
        f" and within {LAGS[-1]:g} s before or after a hop for {rank.said()}; four standard errors"
        f" below, the lower one is {lowest:.2f}, and {CLOSE} or less is close. On average the"
        f" barrier ahead is {hops.mean.said(1e-6, 1)} µJ at {len(hops.values)} hops, and"
        f" {waiting.mean.said(1e-6, 1)} µJ at random times in a well: it is lower at hops by"
        f" {lower.said(1e-6, 1)} µJ, {lower.value / lower.error:.1f} standard errors",
        lowest > CLOSE,
    )


def _in_flight(found: Found) -> Claim:
    kT = found.valley.motor.kT
    hops, passes, waiting = found.uniform.now.values()
    difference, lower = passes.above(hops), waiting.above(hops)
    most = abs(difference.value) + SIGNIFICANT * difference.error
    bound = lower.value / 2
    return judged(
        f"{OURS}the barrier is as low where the ball passes in flight as at hops",
        f"where the ball passes from well to well in flight, the barrier ahead is"
        f" {passes.mean.said(kT)} kT, at hops {hops.mean.said(kT)} kT: a difference of"
        f" {difference.said(kT)} kT. Within four standard errors it is at most {most / kT:.2f} kT"
        " (bound: half of the difference between random times in a well and hops,"
        f" {bound / kT:.2f} kT). Gibbs' law says so, too, whatever the dynamics, since the ball is"
        " halfway at both: these barriers do not tell whether the ball waits for the ring",
        most < bound,
    )


def _by_gibbs(found: Found) -> Claim:
    kT = found.valley.motor.kT
    hops, passes, waiting = found.uniform.now.values()
    core, halfway = found.gibbs
    in_wells, crossing = waiting.mean, hops.and_also(passes).mean
    misses = [
        abs(mean.value - theory) / mean.error
        for mean, theory in ((in_wells, core), (crossing, halfway))
    ]
    return judged(
        f"{OURS}Gibbs' law gives these barriers",
        f"without a fitted number: {core / kT:.3f} kT while the ball is in the core of a well"
        f" (measured {in_wells.said(kT, 3)}), and {halfway / kT:.3f} kT while it is halfway to"
        f" the next one (at all crossings {crossing.said(kT, 3)}): {misses[0]:.1f} and"
        f" {misses[1]:.1f} standard errors",
        max(misses) < SIGNIFICANT,
    )


def _of_the_ring(found: Found) -> Claim:
    valley, kT = found.valley, found.valley.motor.kT
    tilted = valley.energies(np.array([[0.005, 0.0], [-0.005, 0.0]]))
    well = int(np.abs(valley.azimuths).argmin())
    slope = (tilted[1, well] - tilted[0, well]) / 0.01
    level = float(valley.ahead(valley.energies(np.zeros((1, 2))))[0])
    swing = 2 * slope * found.lean.value
    expected = np.sqrt(np.pi * kT / (2 * ring_stiffness(valley.motor)))
    return judged(
        f"{OURS}the wells are mostly the ring's",
        f"a lean of the ring lowers the valley on one side by {slope / kT:.0f} kT per rad and"
        f" raises it on the other: at the mean lean of {np.degrees(found.lean.value):.2f}°"
        f" ({np.degrees(expected):.2f}° without the ball, by equipartition) by {swing / kT:.1f} kT"
        f" from side to side, {swing / level:.1f} times the barrier under a level ring,"
        f" {level / kT:.2f} kT",
        swing > 2 * level,
    )


def _directions(clockwise: dict[str, tuple[Mean, int]]) -> Claim:
    said = ", ".join(
        f"{mean.said(digits=3)} of {count} {kind}" for kind, (mean, count) in clockwise.items()
    )
    fair = all(abs(mean.value - 0.5) < SIGNIFICANT * mean.error for mean, _ in clockwise.values())
    return judged(
        "The ball spins in circles clockwise or counter-clockwise in a directed way",
        f"{said} are clockwise at uniform temperature: both directions are alike, as for a rotor"
        " without wells",
        fair,
    )


FIGURE = Figure(
    "motor_hops",
    "Motor: the barrier ahead of the ball when it hops",
    "A *hop* is a passage from one well to the next outside of flights: the ball passes halfway"
    " and reaches the core of the next well. The *barrier ahead* is the barrier of V_e along the"
    " valley, from the well that the ball leaves to the next one, at the current lean of the"
    " inner ring. Uniform temperature: α = 0.001, h = 0.4 s; nonuniform: nonuniform-a, h = 0.1"
    " s. Bars and ± are standard errors from the differences between runs, since the hops of one"
    " run need not be independent. With the lean of another run's ring, the same hops show what"
    " to expect if the ring plays no part in them.",
    compute,
    claims,
    draw,
    (),
    (METHOD,),
    undecided=(0, 1, 2, 3, 5),
)
