"""Argument checks derived from type hints.

`checked` reads the hints of a function once, at its first call, and checks numbers, integers,
arrays and instances of classes accordingly. Further requirements are part of the hint, as in
`Annotated[float, number(above=0)]`, so that no function repeats in code what its signature states.
"""

import inspect
import math
import types
import typing
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial, wraps
from pathlib import Path
from typing import Annotated, Any, Literal, ParamSpec, TypeVar, Union, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor.common.checks import (
    check_array,
    check_integer,
    check_number,
    check_type,
    did_you_mean,
)
from magmotor.common.exceptions import ArgumentError, InputError
from magmotor.common.hints import (
    Check,
    Shaped,
    check_path,
    choice,
)

P = ParamSpec("P")
R = TypeVar("R")


@overload
def checked(function: Callable[P, R], /) -> Callable[P, R]: ...
@overload
def checked(*, finite: bool = True) -> Callable[[Callable[P, R]], Callable[P, R]]: ...
def checked(function: Any = None, /, *, finite: bool = True) -> Any:
    """Make a function check its arguments against its type hints, and that its result is finite.

    Parameters
    ----------
    function : callable
    finite : bool
        Whether to check the result. Use False if the function documents infinite or NaN results.

    Returns
    -------
    callable
        A function with the same signature. It raises ValueError if an argument does not match its
        hint, or if the arguments are so large or so small that the result is not finite.
    """
    if function is None:
        return partial(checked, finite=finite)

    @wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        values, named = arguments_of(function, args, kwargs)
        return guarded(function, finite, values, named)

    return call


def guarded(function: Callable, finite: bool, args: Sequence[Any], kwargs: dict[str, Any]) -> Any:
    """Call a function and return its result; raise ValueError unless that is finite, if required.

    If the result must be finite, NumPy's overflow, division-by-zero and invalid-operation warnings
    are errors. Otherwise they are suppressed.
    """
    try:
        with np.errstate(all="raise" if finite else "ignore", under="ignore"):
            result = function(*args, **kwargs)
    except ArithmeticError as error:
        raise _extreme(function, str(error)) from error
    except TypeError:
        _check_call(function, args, kwargs)
        raise
    if finite and not _is_finite(result):
        raise _extreme(function, "the result is not finite")
    return result


def _check_call(function: Callable, args: Sequence[Any], kwargs: Mapping[str, Any]) -> None:
    """Raise TypeError, with what to do, if an argument is missing or unknown, or has no name."""
    name, parameters = function.__name__, inspect.signature(function).parameters
    if any(each.kind in (each.VAR_POSITIONAL, each.VAR_KEYWORD) for each in parameters.values()):
        return
    unknown = next((each for each in kwargs if each not in parameters), None)
    if unknown is not None:
        hint = did_you_mean(unknown, parameters) or f": its arguments are {', '.join(parameters)}"
        raise TypeError(f"{name}() has no argument {unknown!r}{hint}") from None
    positional = [key for key, each in parameters.items() if each.kind is not each.KEYWORD_ONLY]
    if len(args) > len(positional):
        following = next((key for key in parameters if key not in positional), None)
        named = f"; name the others, as in {following}=..." if following else ""
        takes = ", ".join(positional) or "no arguments"
        raise TypeError(f"{name}() takes {takes} and was given {len(args)} values{named}") from None
    given = {*positional[: len(args)], *kwargs}
    missing = [
        f"{key}=..." if each.kind is each.KEYWORD_ONLY else key
        for key, each in parameters.items()
        if each.default is each.empty and key not in given
    ]
    if missing:
        *first, last = missing
        needs = f"{', '.join(first)} and {last}" if first else last
        raise TypeError(f"{name}() needs {needs}") from None


def _extreme(function: Callable, reason: str) -> ValueError:
    """Return the error for arguments that are valid one by one, but too extreme together."""
    names = ", ".join(inspect.signature(function).parameters)
    return InputError(
        f"{function.__qualname__}({names}): {reason}; the arguments must be less extreme"
    )


def arguments_of(
    function: Callable, args: tuple, kwargs: dict[str, Any]
) -> tuple[list[Any], dict[str, Any]]:
    """Check the arguments of a call against their hints, and their shapes against each other.

    Returns the checked positional and keyword arguments.
    """
    names, checks, shapes = _checks(function)
    values = [
        _apply(checks.get(name), name, value) for name, value in zip(names, args, strict=False)
    ]
    values += args[len(values) :]
    if kwargs:
        kwargs = {name: _apply(checks.get(name), name, value) for name, value in kwargs.items()}
    if len(shapes) > 1:
        given = dict(zip(names, values, strict=False)) | kwargs
        _check_agreement({k: (given[k], shapes[k]) for k in shapes if given.get(k) is not None})
    return values, kwargs


def _check_agreement(arrays: dict[str, tuple[NDArray[Any], tuple[Any, ...]]]) -> None:
    """Check that the shapes of arrays are consistent; `arrays` holds (array, `Shaped.shape`)."""
    lengths: dict[str, tuple[str, int]] = {}
    axes, first = (), ""
    for name, (array, shape) in arrays.items():
        fixed = shape[shape[:1] == (...,) :]
        split = array.ndim - len(fixed)
        for size, length in zip(fixed, array.shape[split:], strict=True):
            other, known = lengths.setdefault(size, (name, length))
            if isinstance(size, str) and length != known:
                raise ArgumentError(
                    f"length {size} of {name}", length, f"must be {known}, as in {other}"
                )
        try:
            axes = np.broadcast_shapes(axes, array.shape[:split])
        except ValueError:
            sentence = f"the leading axes must broadcast with {axes}, the leading axes of {first}"
            raise ArgumentError(f"shape of {name}", array.shape, sentence) from None
        first = first or name


@cache
def _checks(function: Callable) -> tuple[list[str], dict[str, Check], dict[str, tuple[Any, ...]]]:
    """Return a function's positional argument names, its checks, and the shapes of its arrays."""
    hints = typing.get_type_hints(function, include_extras=True)
    positional: list[str] = []
    checks: dict[str, Check] = {}
    shapes: dict[str, tuple[Any, ...]] = {}
    for name, parameter in inspect.signature(function).parameters.items():
        check = check_of(hints.get(name, Any))
        for part in map(check_of, _parts(hints.get(name, Any))):
            if isinstance(part, Shaped):
                shapes[name] = part.shape
        if check is not None and parameter.default is None:
            check = _or_none(check)
        if parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD):
            continue
        if parameter.kind is not parameter.KEYWORD_ONLY:
            positional.append(name)
        if check is not None:
            checks[name] = check
    return positional, checks, shapes


def _parts(hint: Any) -> tuple[Any, ...]:
    """Return the members of a union, or any other hint as its only member."""
    union = typing.get_origin(hint) in (Union, types.UnionType)
    return typing.get_args(hint) if union else (hint,)


@cache
def check_of(hint: Any) -> Check | None:
    """Return the check that a type hint implies, or None if it implies none."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin is Annotated:
        return arguments[1]
    if origin is Literal:
        return choice(*arguments)
    if origin in (Union, types.UnionType):
        return _check_of_union(arguments)
    if origin is np.ndarray:
        return check_array
    if origin is not None:
        return _check_of_container(origin, arguments)
    if hint in _SIMPLE:
        return _SIMPLE[hint]
    if not isinstance(hint, type) or hint in (Any, object):
        return None
    if issubclass(hint, tuple) and hasattr(hint, "_fields"):
        return _check_of_named_tuple(hint)
    return _check_of_classes(hint)


def _check_of_classes(*classes: type) -> Check:
    def check(name: str, value: Any) -> Any:
        if not isinstance(value, classes):
            check_type(name, value, *classes)
        return value

    return check


def _check_of_union(members: tuple[Any, ...]) -> Check | None:
    rest = tuple(member for member in members if member is not type(None))
    if len(rest) < len(members):
        inner = check_of(Union[rest])  # noqa: UP007
        return None if inner is None else _or_none(inner)
    if {*members} == {*typing.get_args(ArrayLike)}:
        return check_array
    if {*members} == {str, Path}:
        return check_path
    classes = tuple(typing.get_origin(member) or member for member in members)
    if not all(isinstance(each, type) for each in classes):
        return None
    return _check_of_classes(*classes)


def _check_of_container(origin: type, arguments: tuple[Any, ...]) -> Check | None:
    if not isinstance(origin, type):
        return None
    if issubclass(origin, Callable):
        return _check_callable
    if issubclass(origin, Mapping):
        keys, values = map(check_of, arguments)

        def check_mapping(name: str, value: Any) -> Any:
            check_type(name, value, origin)
            for key, element in value.items():
                _apply(keys, f"key of {name}", key)
                _apply(values, f"{name}[{key!r}]", element)
            return value

        return check_mapping
    if issubclass(origin, Sequence) and len(arguments) == 1:
        inner = check_of(arguments[0])

        def check_sequence(name: str, value: Any) -> Any:
            if isinstance(value, str | bytes):
                raise ArgumentError(name, value, "must be a list or another sequence, not a string")
            check_type(name, value, origin)
            return [_apply(inner, f"{name}[{i}]", element) for i, element in enumerate(value)]

        return check_sequence
    return _check_of_classes(origin)


def _check_of_named_tuple(record: type) -> Check:
    """Return a check for instances of a named tuple, whose fields must match their own hints."""
    hints = typing.get_type_hints(record, include_extras=True)
    fields = {field: check_of(hint) for field, hint in hints.items()}

    def check(name: str, value: Any) -> Any:
        check_type(name, value, record)
        for field, inner in fields.items():
            _apply(inner, f"{name}.{field}", getattr(value, field))
        return value

    return check


def _or_none(check: Check) -> Check:
    return lambda name, value: None if value is None else check(name, value)


def _apply(check: Check | None, name: str, value: Any) -> Any:
    return value if check is None else check(name, value)


def check_flag(name: str, value: Any) -> bool:
    """Return a value as a bool if it is True or False."""
    if not isinstance(value, bool | np.bool_):
        raise ArgumentError(name, value, "must be True or False")
    return bool(value)


def _check_text(name: str, value: Any) -> str:
    if not isinstance(value, str):
        raise ArgumentError(name, value, "must be a string")
    return value


def _check_callable(name: str, value: Any) -> Any:
    if not callable(value) or isinstance(value, type):
        raise ArgumentError(name, value, "must be a function or another callable object")
    return value


_SIMPLE: dict[Any, Check] = {
    float: check_number,
    int: check_integer,
    bool: check_flag,
    str: _check_text,
    Path: check_path,
}


def _is_finite(result: Any) -> bool:
    """Whether a result contains neither infinities nor NaN."""
    if isinstance(result, float):
        return math.isfinite(result)
    if isinstance(result, tuple | list):
        return all(map(_is_finite, result))
    if isinstance(result, Mapping):  # including datasets
        return all(map(_is_finite, result.values()))
    kind = getattr(getattr(result, "dtype", None), "kind", "")
    return kind != "f" or bool(np.isfinite(result).all())
