"""Checks of input, and the one form of their message."""

import difflib
import math
from typing import Any


def reject(name: str, value: Any, bound: str) -> ValueError:
    """The one form of the message for bad input."""
    return ValueError(f"{name} = {value!r}: must be {bound}")


def check_choice(name: str, value: Any, choices: tuple[str, ...]) -> None:
    """Check that a name is one of those known, and say which is nearest when it is not."""
    if value not in choices:
        near = difflib.get_close_matches(str(value), choices, n=1)
        hint = f" (did you mean {near[0]!r}?)" if near else ""
        raise reject(name, value, "one of " + ", ".join(choices) + hint)


def check_number(
    name: str,
    value: Any,
    *,
    above: float = -math.inf,
    at_least: float = -math.inf,
    below: float = math.inf,
    unit: str = "",
) -> None:
    """Check that a value is a finite number inside its bounds."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise reject(name, value, "a number") from None
    if isinstance(value, bool) or not math.isfinite(number):
        raise reject(name, value, "a finite number")
    unit = f" {unit}" if unit not in ("", "1") else ""
    if number <= above:
        raise reject(name, value, f"greater than {above:g}{unit}")
    if number < at_least:
        raise reject(name, value, f"at least {at_least:g}{unit}")
    if number >= below:
        raise reject(name, value, f"less than {below:g}{unit}")


def check_integer(name: str, value: Any, *, at_least: int) -> None:
    """Check that a value is an integer, not a float that looks like one, and not too small."""
    if isinstance(value, bool) or not hasattr(value, "__index__"):
        raise reject(name, value, "an integer")
    check_number(name, value, at_least=at_least)
