"""Guards: they find the first recorded state that no accurate solution can have."""

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from numpy.typing import NDArray

from magmotor.device.states import finite, rows


class Fault(NamedTuple):
    """One test of recorded states, and its outcome."""

    wrong: NDArray
    """Which rows fail the test: booleans, shape (T,)."""
    reason: Callable[[int], str]
    """Returns the reason to report for a row that fails."""
    event: str = ""
    """Name of the physical event; empty if the method has failed."""


ENERGY_GREW = "energy grew beyond what the motion can have"
"""Reason to report for a run whose energy is too large."""

LARGEST_ERROR = 1 / 3
"""Largest energy that a method's error may add, relative to the kinetic and potential energy.

At a third of their linear limits, first-order schemes add up to 0.26 in the widest motions; in the
paper's cases, up to 0.05 at any stable timestep. Beyond the limits, chaos adds 0.4 and more.
"""

LARGEST_FLUCTUATION = 200.0
"""Energy, in kT, that the noise never adds: the probability is e^-200 per sample."""


class Guard:
    """Base of the guards, which finds the first wrong row; a device implements `faults`."""

    def faults(self, states: Any) -> Iterable[Fault]:
        """Return or yield the tests of these states; all their values are finite."""
        raise NotImplementedError

    def first_wrong(self, states: Any) -> tuple[int, tuple[str, str] | None]:
        """Return the number of rows before the first wrong one, and its reason and event.

        If no row is wrong, return the number of rows, and None.
        """
        good = finite(states)
        until = len(good) if good.all() else int(good.argmin())
        failures = [] if until == len(good) else [(until, ("a value is not finite, or huge", ""))]
        for wrong, reason, event in self.faults(rows(states, slice(until))):
            if wrong.any():
                row = int(wrong.argmax())
                failures.append((row, (reason(row), event)))
        return min(failures, default=(until, None))
