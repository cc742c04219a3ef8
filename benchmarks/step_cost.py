"""What a step costs: without compilation and set-up, on an otherwise idle machine."""

from collections.abc import Callable

SHORT = 5_000
"""Steps of the run that shows what set-up takes."""


def seconds_a_step(seconds: Callable[[int], float], long: int, repeats: int = 5) -> float:
    """Return the difference of a long and a short run, each the least over repeats, by step.

    Parameters
    ----------
    seconds : callable
        Wall time of a run of so many steps.
    long : int
        Steps that take 0.1 s and more, against which interruptions are short.
    repeats : int
        As often at least: where a busy machine delays the short runs more than the long ones, until
        it does not.
    """
    seconds(SHORT)
    least_short = least_long = float("inf")
    done = 0
    while done < repeats or least_long <= least_short:
        least_short = min(least_short, seconds(SHORT))
        least_long = min(least_long, seconds(long))
        done += 1
    return (least_long - least_short) / (long - SHORT)
