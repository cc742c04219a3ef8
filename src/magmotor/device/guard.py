"""What all guards share: the search for the first wrong row among recorded states."""

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from numpy.typing import NDArray

from magmotor.device.states import finite, rows


class Fault(NamedTuple):
    """What may be wrong with a state."""

    wrong: NDArray
    """Which rows have it."""
    reason: Callable[[int], str]
    """What to say of one of them."""
    event: str = ""
    """Its name if it is physical, and no failure of the method."""


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

    def first_wrong(self, states: Any) -> tuple[int, tuple[str, str] | None]:
        """Number of rows before the first wrong one, and the reason and event of that.

        All rows, and None, if none is wrong.
        """
        good = finite(states)
        until = len(good) if good.all() else int(good.argmin())
        failures = [] if until == len(good) else [(until, ("a value is not finite, or huge", ""))]
        for wrong, reason, event in self._faults(rows(states, slice(until))):
            if wrong.any():
                row = int(wrong.argmax())
                failures.append((row, (reason(row), event)))
        return min(failures, default=(until, None))
