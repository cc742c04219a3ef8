"""Claims on the angular position of the ball, at nonuniform temperature and at uniform."""

from typing import NamedTuple

from magmotor.figures.claim import Claim, judged
from magmotor.figures.motor.flight_law import Flights, claim_of_the_law, many_flights
from magmotor.figures.motor.runs import of_temperature, paper_runs
from magmotor.plots.motor_panels import MotorRun


class Theta(NamedTuple):
    """The paper's seven runs, and the flights of many more."""

    runs: list[MotorRun]
    flights: list[Flights]
    """at nonuniform temperature, at uniform"""


def compute_theta(quick: bool) -> Theta:
    """Runs of full length; fewer of those whose flights are only timed, at reduced size."""
    return Theta(paper_runs(), many_flights(quick))


def claims_of_theta(theta: Theta) -> list[Claim]:
    """Of (fig:nctmagmotortheta) and (fig:ctmagmotortheta), and of the text on them."""
    hot, even = (of_temperature(theta.runs, kind) for kind in ("nonuniform", "uniform"))
    warm, cool = (
        [run for run in even if (run.scene.noises[-1] < 1e-3) == below] for below in (False, True)
    )
    waited = max(
        (float(run.flights.begin[0]) for run in cool if run.flights.sizes["flight"]), default=0.0
    )
    return [
        judged(
            "The plots show the magnetic ball transition between two metastable states:"
            " noise-driven and inertia-driven motion",
            _told(hot),
            _all_fly(hot),
            figures=(3,),
        ),
        judged(
            "The same, of (a) and (b) (α = 0.001; the caption gives the α of the other figure)",
            _told(warm),
            _all_fly(warm),
            figures=(4,),
        ),
        judged(
            "Realization (d) never transitions to a metastable state of the second kind"
            " (α = 0.00075)",
            f"{_told(cool)}; the first begins after up to {waited:.0f} s, so that it depends on"
            " the duration, which is not told",
            not _all_fly(cool),
            otherwise="in part",
            figures=(4,),
        ),
        *(
            claim_of_the_law(found, figure)
            for found, figure in zip(theta.flights, (3, 4), strict=True)
        ),
    ]


def _told(runs: list[MotorRun]) -> str:
    counts = ", ".join(f"{run.name[-1]}: {run.flights.sizes['flight']}" for run in runs)
    longest = max(runs, key=lambda run: run.longest_turns)
    return f"flights of run {counts}; the longest has {longest.longest_turns:.0f} revolutions"


def _all_fly(runs: list[MotorRun]) -> bool:
    return all(run.flights.sizes["flight"] for run in runs)
