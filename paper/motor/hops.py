"""The barrier that the motor's ball has ahead when it hops to the next well, and its direction."""

import numpy as np
from numpy.typing import NDArray

from magmotor.devices.motor.ring_stability import ring_stiffness
from magmotor.devices.motor.scene import Motor
from paper.figure import OURS, Claim, Figure, judged
from paper.motor.azimuths import METHOD, Azimuths, azimuths
from paper.motor.barriers import Valley, gibbs_barriers
from paper.motor.crossings import LAGS, Crossings, barriers, crossings
from paper.motor.flight_definitions import DEFINITIONS, remaining
from paper.motor.hop_barriers import Ahead, Found, Mean
from paper.motor.hops_picture import draw
from paper.motor.runs import SIGNIFICANT

NOW = np.zeros(1)
"""The lag of the crossing itself."""

CLOSE = 0.25
"""A barrier is close to its minimum if it is in the lowest quarter of those around that time."""

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
        "flights": (_part(flights.direction < 0, flights.run), len(flights.run)),
        "hops": (_part(hops.step < 0, hops.run), len(hops.run)),
    }
    gibbs = gibbs_barriers(valley, (-0.25, 0.25), (0.5, 0.5))
    return Found(METHOD, valley, uniform, nonuniform, Mean.of(leans), gibbs, clockwise)


def _ahead(valley: Valley, found: Crossings, runs: Azimuths, quick: bool) -> Ahead:
    many, few = (600, 80) if quick else (4000, 300)
    now = {
        kind: barriers(valley, places.some(many), runs, NOW)[:, 0]
        for kind, places in found._asdict().items()
    }
    hops = found.hops.some(few)
    around = {
        "hops": barriers(valley, hops, runs, LAGS),
        "passes": barriers(valley, found.passes.some(few), runs, LAGS),
        "other": barriers(valley, hops, runs, LAGS, LENT),
    }
    return Ahead(now, around)


def _part(flags: NDArray[np.bool_], run: NDArray[np.int_]) -> Mean:
    """Return the part of flags that are set; runs are independent."""
    part, size = float(flags.mean()), len(flags)
    return Mean(part, float(np.linalg.norm(np.bincount(run, flags - part)) / size))


def claims(found: Found) -> list[Claim]:
    """Return the paper's claims on hops and directions, and ours."""
    kT = found.valley.motor.kT
    hops, passes, waiting = (Mean.of(values) for values in found.uniform.now.values())
    ranks = {name: found.uniform.rank(name) for name in ("hops", "other")}
    low = waiting.above(hops) > SIGNIFICANT
    core, halfway = found.gibbs
    crossing = Mean.of(np.concatenate([found.uniform.now[kind] for kind in ("hops", "passes")]))
    misses = [
        abs(mean.value - theory) / mean.error
        for mean, theory in ((waiting, core), (crossing, halfway))
    ]
    return [
        judged(
            "The ball is stuck in a well, and moves into another potential well when the energy"
            " barrier between the two wells is close to minimum (a phenomenon known as stochastic"
            " resonance)",
            f"at uniform temperature the barrier ahead at {len(found.uniform.now['hops'])} hops is"
            f" {hops.said(kT)} kT, against {waiting.said(kT)} kT at random times in a well. It is"
            f" lower, but not close to its minimum: within {LAGS[-1]:g} s before or after a hop,"
            f" it is lower than at the hop for {ranks['hops'].said()} of the time (0 at the"
            f" minimum; {ranks['other'].said()} with the lean of another ring)",
            ranks["hops"].value < CLOSE,
            otherwise="in part" if low else "wrong",
        ),
        _at_nonuniform_temperature(found.nonuniform),
        judged(
            f"{OURS}it is the ring that follows the ball, rather than the ball that waits for the"
            " ring",
            f"where the ball passes from well to well in flight, without waiting, the barrier ahead"
            f" is {passes.said(kT)} kT, as at hops ({hops.said(kT)} kT, in wells"
            f" {waiting.said(kT)} kT)",
            abs(hops.above(passes)) < SIGNIFICANT < waiting.above(passes),
        ),
        judged(
            f"{OURS}Gibbs' law gives these barriers",
            f"without a fitted number: {core / kT:.3f} kT while the ball is in the core of a well"
            f" (measured {waiting.said(kT, 3)}), and {halfway / kT:.3f} kT while it is halfway to"
            f" the next one (at all crossings {crossing.said(kT, 3)}): {misses[0]:.1f} and"
            f" {misses[1]:.1f} standard errors",
            max(misses) < SIGNIFICANT,
        ),
        _of_the_ring(found),
        _directions(found.clockwise),
    ]


def _at_nonuniform_temperature(ahead: Ahead) -> Claim:
    hops, _, waiting = (Mean.of(values) for values in ahead.now.values())
    rank = ahead.rank("hops")
    return judged(
        f"{OURS}at nonuniform temperature, hops do not wait for a low barrier",
        f"at {len(ahead.now['hops'])} hops the barrier ahead is {hops.said(1e-6, 1)} µJ, at random"
        f" times in a well {waiting.said(1e-6, 1)} µJ; within {LAGS[-1]:g} s before or after a"
        f" hop, it is lower than at the hop for {rank.said()} of the time (1/2 if it does not"
        " matter). The ring swings in 30 s, and a hop takes minutes",
        abs(rank.value - 0.5) < 0.5 - CLOSE and waiting.above(hops) < SIGNIFICANT,
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
    "A *hop* is a passage from one well to the next outside of flights: the ball passes halfway and"
    " reaches the core of the next well. The *barrier ahead* is that of V_e along the valley, from"
    " the well that the ball leaves to the next one, with the lean that the inner ring has at the"
    " time. Uniform temperature: α = 0.001, h = 0.4 s; nonuniform: nonuniform-a, h = 0.1 s; bars:"
    " standard error. With the lean of another run's ring, the same hops show what hops look like"
    " that the ring has no part in.",
    compute,
    claims,
    draw,
    (),
    (METHOD,),
)
