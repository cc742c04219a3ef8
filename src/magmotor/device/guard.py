"""What all guards share: the search for the first wrong row among recorded states."""

from collections.abc import Callable, Iterable
from typing import Any

from numpy.typing import NDArray

from magmotor.device.states import finite, rows

Fault = tuple[NDArray, Callable[[int], str]]
"""Which rows have it, and what to say of one of them."""

ENERGY_GREW = "energy grew beyond what the motion can have"

LARGEST_ERROR = 1 / 3
"""Energy that a method's own error may add, over what is in play: kinetic and potential energy.

At a third of their linear limits schemes of first order add up to 0.26 where the motion is widest;
in the paper's cases, up to the limits, 0.05. Beyond them what chaos adds is 0.4 and more.
"""


LARGEST_FLUCTUATION = 200.0
"""Energy, in kT, that the noise never gives: the probability is e^-200 a sample."""


class Guard:
    """Finds the first wrong row among recorded states; a device says what is wrong in `_faults`."""

    def _faults(self, states: Any) -> Iterable[Fault]:
        """What may be wrong; asked about the rows before the first that is not finite."""
        raise NotImplementedError

    def first_wrong(self, states: Any) -> tuple[int, str]:
        """Number of rows before the first wrong one (all, if none is) and what is wrong with it."""
        good = finite(states)
        until = len(good) if good.all() else int(good.argmin())
        failures = [(until, "" if until == len(good) else "a value is not finite, or huge")]
        for wrong, reason in self._faults(rows(states, slice(until))):
            if wrong.any():
                row = int(wrong.argmax())
                failures.append((row, reason(row)))
        return min(failures)
