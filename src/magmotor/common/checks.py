"""Input checks and their common error message.

The checks return Python's own numbers, since small NumPy integers overflow and JSON supports none.
"""

import difflib
import itertools
import math
import operator
import os
import sys
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magmotor.common.exceptions import ArgumentError, InputError

SMALLEST, LARGEST = 1e-30, 1e30
"""Range of magnitudes of nonzero numbers, chosen so that no formula overflows."""


def check_choice(name: str, value: Any, choices: tuple[str, ...]) -> None:
    """Check that a name is one of `choices`; the error suggests the closest match."""
    if not isinstance(value, str) or value not in choices:
        hint = did_you_mean(str(value), choices)
        raise ArgumentError(name, value, f"must be one of {', '.join(choices)}{hint}")


def did_you_mean(name: str, choices: Iterable[str]) -> str:
    """Return a question in parentheses about the choices that a wrong name may mean, or nothing.

    Of a choice like `mujoco/rk4`, the name may be the last part only.
    """
    ends: dict[str, list[str]] = {}
    for choice in choices:
        ends.setdefault(choice.rpartition("/")[2].lower(), []).append(choice)
    near = ends.get(name.lower()) or difflib.get_close_matches(name, [*choices], n=1)
    for end in difflib.get_close_matches(name.lower(), ends, n=1):
        near = near or ends[end]
    return f" (did you mean {' or '.join(map(repr, near))}?)" if near else ""


def check_type(name: str, value: Any, *classes: type) -> None:
    """Check that a value is an instance of one of these classes, which the message lists."""
    if not isinstance(value, classes):
        known = [getattr(each, "registered", lambda: ())() or [each] for each in classes]
        *first, last = map(_public_name, itertools.chain(*known))
        sentence = f"must be an instance of {', '.join(first)}{' or ' * bool(first)}{last}"
        if last == "mujoco.MjModel" and isinstance(value, (str, os.PathLike)):
            sentence += ", such as mujoco.MjModel.from_xml_path(...)"
        elif last == "mujoco.MjModel" and hasattr(type(value), "registered"):
            sentence += ", such as magmotor.build(scene)"
        elif first and type(value).__name__ == "MjModel":
            sentence += "; step models of your own by mujoco.mj_step or magmotor.Langevin"
        raise ArgumentError(name, value, sentence)


def _public_name(cls: type) -> str:
    """Return the name by which users import a class: xarray.Dataset, magmotor.noise.X."""
    package = cls.__module__.partition(".")[0]
    short = f"{package}.{cls.__qualname__}".removeprefix("builtins.")
    exported = getattr(sys.modules[package], "__all__", None)
    if package != "magmotor" or exported is None or cls.__qualname__ in exported:
        return short
    return ".".join([*cls.__module__.split(".")[:2], cls.__qualname__])


def elements(name: str, values: Any, sentence: str) -> Iterator[Any]:
    """Return an iterator over any iterable other than a string; reject others with `sentence`."""
    try:
        if not isinstance(values, str | bytes | bytearray):
            return iter(values)
    except TypeError:
        pass
    raise ArgumentError(name, values, sentence)


def check_number(
    name: str,
    value: Any,
    *,
    above: float = -math.inf,
    at_least: float = -math.inf,
    below: float = math.inf,
    unit: str = "",
) -> float:
    """Return a value as a float if it is a finite number inside its bounds.

    The magnitude of a nonzero number must be from 1e-30 to 1e30.
    """
    try:
        number = None if np.ma.is_masked(value) else float(value)
    except OverflowError:
        number = math.inf
    except (TypeError, ValueError):
        number = None
    if number is None or isinstance(value, str | bytes | bytearray):
        raise ArgumentError(name, value, "must be a number")
    if isinstance(value, bool | np.bool_):
        raise ArgumentError(name, value, "must be a number, not True or False")
    if not math.isfinite(number):
        raise ArgumentError(name, value, "must be a finite number")
    shown = f" {unit}" if unit not in ("", "1") else ""
    bound = ""
    if number <= above:
        bound = f"greater than {above:g}"
    elif number < at_least:
        bound = f"at least {at_least:g}"
    elif number >= below:
        bound = f"less than {below:g}"
    if bound:
        radians = math.radians(number)
        if unit == "rad" and above < radians < below and radians >= at_least:
            shown += f" ({number:g} degrees are {radians:.4g} rad)"
        raise ArgumentError(name, value, f"must be {bound}{shown}")
    if number and not SMALLEST <= abs(number) <= LARGEST:
        zero = "" if above >= 0 else "zero or "
        raise ArgumentError(
            name, value, f"must be {zero}from {SMALLEST:g} to {LARGEST:g} in magnitude"
        )
    return number


def check_integer(
    name: str, value: Any, *, at_least: int = -(2**53), at_most: float = 2**53
) -> int:
    """Return a value as an int if it is an integer (not a float) inside its bounds."""
    try:
        number = operator.index(value)
    except TypeError:
        raise ArgumentError(name, value, "must be an integer") from None
    if isinstance(value, bool):
        raise ArgumentError(name, value, "must be an integer")
    if number < at_least:
        raise ArgumentError(name, value, f"must be at least {at_least}")
    if number > at_most:
        raise ArgumentError(name, value, f"must be at most {at_most}")
    return number


def check_array(name: str, value: Any, *shape: Any) -> NDArray[np.float64]:
    """Return a value as an array of floats if all its numbers are finite and at most 1e30 in size.

    Parameters
    ----------
    name : str
    value : array_like
    *shape : int, str or ...
        Lengths of the axes. A name stands for any length, the same wherever the name is repeated;
        a leading `...` stands for any number of axes. Without lengths, any shape is allowed.
    """
    array = check_floats(name, value, *shape)
    if not (np.abs(array) <= LARGEST).all():
        bad = array[~(np.abs(array) <= LARGEST)].flat[0]
        raise InputError(
            f"{name} contains {bad}: every value must be finite and at most {LARGEST:g} in"
            " magnitude"
        )
    return array


def check_floats(name: str, value: Any, *shape: Any) -> NDArray[np.float64]:
    """Return a value as an array of floats, finite or not; see `check_array` for `shape`."""
    array = _plain(name, value)
    if array.dtype.kind not in "iuf":
        if array.size:
            raise ArgumentError(name, value, "must be an array of numbers")
        array = np.empty(array.shape)
    _check_shape(name, array, shape)
    return array.astype(float, copy=False)


def check_flags(name: str, value: Any, *shape: Any) -> NDArray[np.bool_]:
    """Return a value as an array if all elements are booleans; see `check_array` for `shape`."""
    array = _plain(name, value)
    if array.dtype.kind != "b" and array.size:
        raise ArgumentError(name, value, "must be an array of booleans")
    _check_shape(name, array, shape)
    return array.astype(bool, copy=False)


def _plain(name: str, value: Any) -> NDArray[Any]:
    try:
        array = np.asanyarray(value)
    except (TypeError, ValueError):  # a ragged array, or an object that cannot be converted
        raise ArgumentError(name, value, "must be an array of numbers") from None
    if np.ma.is_masked(array):
        raise ArgumentError(name, value, "must be an array without masked values")
    return np.asarray(array)


def _check_shape(name: str, array: NDArray[Any], shape: tuple[Any, ...]) -> None:
    if not shape:
        return
    free = shape[0] is ...
    wanted = shape[1:] if free else shape
    found = array.shape[len(array.shape) - len(wanted) :] if free else array.shape
    named = dict(zip(wanted, found, strict=False))
    fits = len(found) == len(wanted) and all(
        length == (named[size] if isinstance(size, str) else size)
        for length, size in zip(found, wanted, strict=True)
    )
    if not fits:
        lengths = ", ".join("..." if size is ... else str(size) for size in shape)
        lengths += "," * (len(shape) == 1)
        raise InputError(f"{name} has shape {array.shape}: must have shape ({lengths})")
