"""Fields of scenes: a default, a unit, bounds, and the check that enforces them."""

import dataclasses
import math
from typing import Any

from magmotor.checks import check_choice, check_integer, check_number, reject


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
    """Declare a dataclass field that `check_fields` verifies; tuples are checked by element.

    `size` is the length of a tuple whose default is none.
    """
    bounds: dict[str, Any] = {"above": above, "at_least": at_least, "below": below}
    bounds |= {"choices": choices, "size": len(default) if isinstance(default, tuple) else size}
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


def check_value(field: dataclasses.Field, value: Any, name: str) -> None:
    """Check a number, a field's own value or a component of it, against the field's bounds.

    Raises
    ------
    ValueError
        With the name, the value and the bound.
    """
    names = ("above", "at_least", "below", "unit")
    bounds = {name: field.metadata[name] for name in names}
    if isinstance(field.default, int):
        check_integer(name, value, at_least=int(bounds["at_least"]))
    else:
        check_number(name, value, **bounds)


def _check_field(field: dataclasses.Field, value: Any) -> None:
    bounds = field.metadata
    if not bounds or (value is None and field.default is None):
        return
    size = bounds["size"]
    if choices := bounds["choices"]:
        check_choice(field.name, value, choices)
    elif isinstance(field.default, str):
        return  # checked by the scene that has it
    elif size is not None:
        if not isinstance(value, tuple | list) or len(value) != size:
            raise reject(field.name, value, f"{size} numbers")
        for element in value:
            check_value(field, element, field.name)
    else:
        check_value(field, value, field.name)
