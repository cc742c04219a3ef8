"""Attributes of datasets: what a file tells is data, and is checked before it is used."""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from magmotor.checks import reject


def as_told(attributes: Mapping[Any, Any]) -> dict[str, Any]:
    """The attributes with NumPy's numbers and arrays as Python's own."""
    numpys = np.generic | np.ndarray
    return {k: v.tolist() if isinstance(v, numpys) else v for k, v in attributes.items()}


def fields_in(attributes: Mapping[str, Any], name: str) -> dict[str, Any]:
    """What an attribute tells as a JSON object.

    Raises
    ------
    ValueError
        It is not there, or no JSON object: names it.
    """
    text = attributes.get(name)
    try:
        fields = json.loads(text) if isinstance(text, str) else None
    except (ValueError, RecursionError):
        fields = None
    if not isinstance(fields, dict):
        shown = text[:200] if isinstance(text, str) else text
        raise reject(f"attributes[{name!r}]", shown, "a JSON object")
    return fields


def check_fields(attribute: str, fields: Mapping[str, Any], known: Mapping[str, Any]) -> None:
    """Check that what an attribute tells are all the fields there are, and no others.

    Raises
    ------
    ValueError
        Names the attribute and the first field that is missing or unknown.
    """
    for name in {**fields, **known}:
        if name not in fields:
            raise reject(f"attributes[{attribute!r}]", fields, f"an object with a field {name!r}")
        if name not in known:
            bound = f"one of {', '.join(known)}"
            raise reject(f"a field in attributes[{attribute!r}]", name, bound)
