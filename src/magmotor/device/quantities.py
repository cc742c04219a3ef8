"""Fields of scenes: defaults, units and bounds, the check that enforces them, and their docs."""

import dataclasses
import inspect
import math
import re
import textwrap
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from magmotor.common.checks import check_choice, check_integer, check_number
from magmotor.common.exceptions import ArgumentError

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


def described(default: Any, doc: str) -> Any:
    """Declare a dataclass field that the scene checks itself, and that has no flag and no axis."""
    return dataclasses.field(default=default, metadata={"doc": doc})


def is_quantity(field: dataclasses.Field) -> bool:
    """Whether a field is declared by `quantity`."""
    return "unit" in field.metadata


class FieldDescription(NamedTuple):
    """What the documentation says of a field."""

    name: str
    kind: str
    default: str
    unit: str
    """Empty for text, "1" for a dimensionless number."""
    doc: str
    bounds: str

    @property
    def meaning(self) -> str:
        """The field's doc and its bounds."""
        return "; ".join(filter(None, [self.doc, self.bounds]))


def field_descriptions(scene: Any) -> Iterator[FieldDescription]:
    """Yield the descriptions of a scene's fields, in the order of its arguments."""
    for field in dataclasses.fields(scene):
        about = field.metadata
        kind = re.sub(r"\b(\w+\.)+(?=\w)", "", inspect.formatannotation(field.type))
        if about.get("choices"):
            kind = f"{{{', '.join(map(repr, about['choices']))}}}"
        limits = {"above": "greater than", "at_least": "at least", "below": "less than"}
        bounds = " and ".join(
            f"{words} {about[name]:.6g}"
            for name, words in limits.items()
            if math.isfinite(about.get(name, math.inf))
        )
        unit, doc = about.get("unit", ""), about.get("doc", "")
        yield FieldDescription(field.name, kind, _default(field), unit, doc, bounds)


def _default(field: dataclasses.Field) -> str:
    """Return a default as text, numbers to six digits; empty without one."""
    if field.default is dataclasses.MISSING:
        return ""
    return f"{field.default:.6g}" if isinstance(field.default, float) else repr(field.default)


def add_parameters(scene: Any) -> None:
    """Add the section Parameters to the docstring of a scene class, before its other sections."""
    lines = ["Parameters", "----------"]
    for field in field_descriptions(scene):
        unit = f", in {field.unit}" if field.unit not in ("", "1") else ""
        usual = {"": "", "None": ", optional"}.get(field.default, f", default {field.default}")
        lines.append(f"{field.name} : {field.kind.removesuffix(' | None')}{unit}{usual}")
        lines += textwrap.wrap(field.meaning, 92, initial_indent="    ", subsequent_indent="    ")
    scene.__doc__ = with_section(scene.__doc__ or "", "\n".join(lines))


def with_section(docstring: str, section: str) -> str:
    """Return a docstring with a section before its other ones."""
    text = inspect.cleandoc(docstring)
    head, *rest = re.split(r"\n(?=\w[\w ]*\n-{3,}\n)", text, maxsplit=1)
    return "\n\n".join([head.rstrip(), section, *rest]).lstrip("\n")


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
    if not is_quantity(field) or (value is None and field.default is None):
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
        raise ArgumentError(field.name, value, f"must be {size} numbers")
    return tuple(check_value(field, part, f"{field.name}[{i}]") for i, part in enumerate(value))
