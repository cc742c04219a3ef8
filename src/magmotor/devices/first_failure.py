"""The first wrong row among recorded states, which all guards look for."""

from collections.abc import Callable, Iterable
from typing import Any

from numpy.typing import NDArray

from magmotor.states import finite, rows

Fault = tuple[NDArray, Callable[[int], str]]
"""Which rows have it, and what to say of one of them."""

ENERGY_GREW = "energy grew beyond what the motion can have"


def first_failure(states: Any, faults_of: Callable[[Any], Iterable[Fault]]) -> tuple[int, str]:
    """Number of rows before the first wrong one (all, if none is) and what is wrong with it.

    `faults_of` is asked about the rows before the first that is not finite.
    """
    good = finite(states)
    until = len(good) if good.all() else int(good.argmin())
    failures = [(until, "" if until == len(good) else "a value is not finite")]
    for wrong, reason in faults_of(rows(states, slice(until))):
        if wrong.any():
            row = int(wrong.argmax())
            failures.append((row, reason(row)))
    return min(failures)
