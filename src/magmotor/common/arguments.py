"""Public functions check their arguments by their own type hints.

`checked` reads the hints of a function once, at its first call: a number, an integer, an array or
an object of a class is checked as such. What else an argument must be stands in the hint, too, as
`Annotated[float, number(above=0)]`, so that no function checks what its signature says.
"""

import inspect
import math
import types
import typing
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial, wraps
from pathlib import Path
from typing import Annotated, Any, ParamSpec, TypeVar, Union, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor.common.checks import (
    check_array,
    check_integer,
    check_number,
    check_type,
    reject,
)
from magmotor.common.hints import (
    Check,
    Shaped,
    check_path,
)

P = ParamSpec("P")
R = TypeVar("R")


@overload
def checked(function: Callable[P, R], /) -> Callable[P, R]: ...
@overload
def checked(*, finite: bool = True) -> Callable[[Callable[P, R]], Callable[P, R]]: ...
def checked(function: Any = None, /, *, finite: bool = True) -> Any:
    """Let a function check its arguments by its type hints, and its result by being finite.

    Parameters
    ----------
    function : callable
    finite : bool
        The function's docstring says nothing of results that are infinite or not a number.

    Returns
    -------
    callable
        The same, with the same signature. It raises ValueError where an argument is not what its
        hint says, and where numbers so large or small were given that the result is not finite.
    """
    if function is None:
        return partial(checked, finite=finite)

    @wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        values, named = arguments_of(function, args, kwargs)
        return guarded(function, finite, values, named)

    return call


def guarded(function: Callable, finite: bool, args: Sequence[Any], kwargs: dict[str, Any]) -> Any:
    """The result of a function, if it has one that is finite.

    NumPy's warnings of overflow, division by zero and invalid operations are errors in a function
    whose result must be finite, and are not shown otherwise.
    """
    try:
        with np.errstate(all="raise" if finite else "ignore", under="ignore"):
            result = function(*args, **kwargs)
    except ArithmeticError as error:
        raise beyond(function, str(error)) from error
    if finite and not _is_finite(result):
        raise beyond(function, "not finite")
    return result


def beyond(function: Callable, what: str) -> ValueError:
    """What to raise where the arguments of a function are right one by one, but not together."""
    names = ", ".join(inspect.signature(function).parameters)
    return ValueError(
        f"{function.__qualname__}({names}): the result is {what}: must be finite, with arguments"
        " that are less extreme"
    )


def arguments_of(
    function: Callable, args: tuple, kwargs: dict[str, Any]
) -> tuple[list[Any], dict[str, Any]]:
    """The arguments of a call, each checked by its hint, and their shapes against each other."""
    names, checks, shapes = _checks(function)
    values = [
        _passed(checks.get(name), name, value) for name, value in zip(names, args, strict=False)
    ]
    values += args[len(values) :]
    if kwargs:
        kwargs = {name: _passed(checks.get(name), name, value) for name, value in kwargs.items()}
    if len(shapes) > 1:
        given = dict(zip(names, values, strict=False)) | kwargs
        _check_agreement({k: (given[k], shapes[k]) for k in shapes if given.get(k) is not None})
    return values, kwargs


def _check_agreement(arrays: dict[str, tuple[NDArray[Any], tuple[Any, ...]]]) -> None:
    """Check that arrays with their shapes, as `Shaped` has them, agree."""
    lengths: dict[str, tuple[str, int]] = {}
    axes, first = (), ""
    for name, (array, shape) in arrays.items():
        fixed = shape[shape[:1] == (...,) :]
        split = array.ndim - len(fixed)
        for size, length in zip(fixed, array.shape[split:], strict=True):
            other, known = lengths.setdefault(size, (name, length))
            if isinstance(size, str) and length != known:
                raise reject(
                    f"length {size} of {name}", length, f"must be {known}, as that of {other}"
                )
        try:
            axes = np.broadcast_shapes(axes, array.shape[:split])
        except ValueError:
            sentence = f"its axes before the last must broadcast with {axes}, those of {first}"
            raise reject(f"shape of {name}", array.shape, sentence) from None
        first = first or name


@cache
def _checks(function: Callable) -> tuple[list[str], dict[str, Check], dict[str, tuple[Any, ...]]]:
    """Names of a function's arguments by place, their checks, and the shapes of arrays."""
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
    """The members of a union; of another hint, itself."""
    union = typing.get_origin(hint) in (Union, types.UnionType)
    return typing.get_args(hint) if union else (hint,)


@cache
def check_of(hint: Any) -> Check | None:
    """The check that a type hint stands for, if it stands for any."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin is Annotated:
        return arguments[1]
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
        return _check_of_record(hint)
    return _check_of_kinds(hint)


def _check_of_kinds(*kinds: type) -> Check:
    def check(name: str, value: Any) -> Any:
        if not isinstance(value, kinds):
            check_type(name, value, *kinds)
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
    kinds = tuple(typing.get_origin(member) or member for member in members)
    if not all(isinstance(kind, type) for kind in kinds):
        return None
    return _check_of_kinds(*kinds)


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
                _passed(keys, f"key of {name}", key)
                _passed(values, f"{name}[{key!r}]", element)
            return value

        return check_mapping
    if issubclass(origin, Sequence) and len(arguments) == 1:
        inner = check_of(arguments[0])

        def check_sequence(name: str, value: Any) -> Any:
            if isinstance(value, str | bytes):
                raise reject(name, value, "must be a sequence, such as a list")
            check_type(name, value, origin)
            return [_passed(inner, f"{name}[{i}]", element) for i, element in enumerate(value)]

        return check_sequence
    return _check_of_kinds(origin)


def _check_of_record(kind: type) -> Check:
    """Of a named tuple: an object of its class, whose fields are what their own hints say."""
    hints = typing.get_type_hints(kind, include_extras=True)
    fields = {field: check_of(hint) for field, hint in hints.items()}

    def check(name: str, value: Any) -> Any:
        check_type(name, value, kind)
        for field, inner in fields.items():
            _passed(inner, f"{name}.{field}", getattr(value, field))
        return value

    return check


def _or_none(check: Check) -> Check:
    return lambda name, value: None if value is None else check(name, value)


def _passed(check: Check | None, name: str, value: Any) -> Any:
    return value if check is None else check(name, value)


def check_flag(name: str, value: Any) -> bool:
    """Return a value as a bool if it is True or False."""
    if not isinstance(value, bool | np.bool_):
        raise reject(name, value, "must be True or False")
    return bool(value)


def _check_text(name: str, value: Any) -> str:
    if not isinstance(value, str):
        raise reject(name, value, "must be text")
    return value


def _check_callable(name: str, value: Any) -> Any:
    if not callable(value) or isinstance(value, type):
        raise reject(name, value, "must be a function, or another object that can be called")
    return value


_SIMPLE: dict[Any, Check] = {
    float: check_number,
    int: check_integer,
    bool: check_flag,
    str: _check_text,
    Path: check_path,
}


def _is_finite(result: Any) -> bool:
    """Whether no number in a result is infinite or not a number."""
    if isinstance(result, float):
        return math.isfinite(result)
    if isinstance(result, tuple | list):
        return all(map(_is_finite, result))
    if isinstance(result, Mapping):  # a dataset, too
        return all(map(_is_finite, result.values()))
    kind = getattr(getattr(result, "dtype", None), "kind", "")
    return kind != "f" or bool(np.isfinite(result).all())
