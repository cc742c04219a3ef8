"""Fields of scenes: a default, a unit, bounds, and the check that enforces them."""

import dataclasses
import difflib
import math
from typing import Any


def quantity(
    default: Any,
    unit: str,
    doc: str,
    *,
    above: float = -math.inf,
    at_least: float = -math.inf,
    below: float = math.inf,
    choices: tuple[str, ...] = (),
) -> Any:
    """Declare a dataclass field that `check_fields` verifies; tuples are checked by element."""
    bounds = {"above": above, "at_least": at_least, "below": below, "choices": choices}
    return dataclasses.field(default=default, metadata={"unit": unit, "doc": doc, **bounds})


def check_fields(scene: Any) -> None:
    """Check every declared field of a scene.

    Raises
    ------
    ValueError
        Names the field, its value and the bound.
    """
    for field in dataclasses.fields(scene):
        _check_field(field, getattr(scene, field.name))


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


def _check_field(field: dataclasses.Field, value: Any) -> None:
    bounds = dict(field.metadata)
    if not bounds or (value is None and field.default is None):
        return
    del bounds["doc"]
    if choices := bounds.pop("choices"):
        check_choice(field.name, value, choices)
    elif isinstance(field.default, str):
        return  # checked by the scene that has it
    elif isinstance(field.default, tuple):
        if not isinstance(value, tuple | list) or len(value) != len(field.default):
            raise reject(field.name, value, f"{len(field.default)} numbers")
        for element in value:
            check_number(field.name, element, **bounds)
    elif isinstance(field.default, int):
        check_integer(field.name, value, at_least=int(bounds["at_least"]))
    else:
        check_number(field.name, value, **bounds)
