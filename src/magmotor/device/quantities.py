"""Fields of scenes: defaults, units and bounds, and the check that enforces them."""

import dataclasses
import math
from typing import Any

import numpy as np

from magmotor.common.checks import check_choice, check_integer, check_number, reject

MOST = 10**5
"""Largest value of an integer field; all of them are numbers of dipoles."""


def quantity(
    default: Any,
    unit: str,
    doc: str,
    *,
    above: float = -math.inf,
    at_least: float = -math.inf,
    below: float = math.inf,
    choices: tuple[str, ...] = (),
    size: int | None = None,
) -> Any:
    """Declare a dataclass field that `check_fields` verifies.

    The elements of a tuple are checked one by one; `size` is its length if the default is None.
    """
    bounds: dict[str, Any] = {"above": above, "at_least": at_least, "below": below}
    bounds |= {"choices": choices, "size": len(default) if isinstance(default, tuple) else size}
    return dataclasses.field(default=default, metadata={"unit": unit, "doc": doc, **bounds})


def check_fields(scene: Any) -> None:
    """Check every declared field of a scene, and convert its numbers to Python's types.

    Raises
    ------
    ValueError
        A field is out of bounds; the message names the field, its value and the bound.
    """
    for field in dataclasses.fields(scene):
        object.__setattr__(scene, field.name, _checked(field, getattr(scene, field.name)))


def check_value(field: dataclasses.Field, value: Any, name: str) -> float:
    """Return a field's value, or a component of it, as a number within the field's bounds.

    Raises
    ------
    ValueError
        The value is out of bounds; the message has the name, the value and the bound.
    """
    names = ("above", "at_least", "below", "unit")
    bounds = {name: field.metadata[name] for name in names}
    if isinstance(field.default, int):
        return check_integer(name, value, at_least=int(bounds["at_least"]), at_most=MOST)
    return check_number(name, value, **bounds)


def _checked(field: dataclasses.Field, value: Any) -> Any:
    bounds = field.metadata
    if not bounds or (value is None and field.default is None):
        return value
    if choices := bounds["choices"]:
        check_choice(field.name, value, choices)
        return value
    if isinstance(field.default, str):
        return value  # the scene checks it
    size = bounds["size"]
    if size is None:
        return check_value(field, value, field.name)
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if not isinstance(value, tuple | list) or len(value) != size:
        raise reject(field.name, value, f"must be {size} numbers")
    return tuple(check_value(field, element, field.name) for element in value)
