"""Checks of input, and the one form of their message.

Numbers come back as Python's own: NumPy's wrap around when they are small, and JSON has none.
"""

import difflib
import math
import operator
from typing import Any

import numpy as np


def reject(name: str, value: Any, bound: str) -> ValueError:
    """The one form of the message for bad input."""
    told = value.item() if isinstance(value, np.generic) else value
    return ValueError(f"{name} = {told!r}: must be {bound}")


def check_choice(name: str, value: Any, choices: tuple[str, ...]) -> None:
    """Check that a name is one of those known, and say which is nearest when it is not."""
    if value not in choices:
        near = difflib.get_close_matches(str(value), choices, n=1)
        hint = f" (did you mean {near[0]!r}?)" if near else ""
        raise reject(name, value, "one of " + ", ".join(choices) + hint)


def check_kind(name: str, value: Any, kind: type) -> None:
    """Check that a value is an object of a class, which is told with its package."""
    if not isinstance(value, kind):
        package = kind.__module__.split(".")[0]
        raise reject(name, value, f"an object of {package}.{kind.__name__}")


def check_number(
    name: str,
    value: Any,
    *,
    above: float = -math.inf,
    at_least: float = -math.inf,
    below: float = math.inf,
    unit: str = "",
) -> float:
    """Return a value as a float if it is a finite number inside its bounds."""
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    except (TypeError, ValueError):
        number = None
    if number is None or isinstance(value, str):
        raise reject(name, value, "a number")
    if isinstance(value, bool | np.bool_) or not math.isfinite(number):
        raise reject(name, value, "a finite number")
    unit = f" {unit}" if unit not in ("", "1") else ""
    if number <= above:
        raise reject(name, value, f"greater than {above:g}{unit}")
    if number < at_least:
        raise reject(name, value, f"at least {at_least:g}{unit}")
    if number >= below:
        raise reject(name, value, f"less than {below:g}{unit}")
    return number


def check_integer(name: str, value: Any, *, at_least: int) -> int:
    """Return a value as an int if it is an integer, not a float that looks like one, in bounds."""
    try:
        number = operator.index(value)
    except TypeError:
        raise reject(name, value, "an integer") from None
    if isinstance(value, bool):
        raise reject(name, value, "an integer")
    if number < at_least:
        raise reject(name, value, f"at least {at_least}")
    return number
