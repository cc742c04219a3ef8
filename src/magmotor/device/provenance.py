"""Attributes that record how a dataset was made, and the scene restored from them."""

import dataclasses
import json
from functools import cache
from typing import Any

import xarray as xr

from magmotor.common.arguments import checked
from magmotor.common.checks import check_choice, check_type
from magmotor.common.exceptions import ArgumentError, InputError
from magmotor.common.files import check_fields, fields_in
from magmotor.common.versions import machine_versions, versions_of
from magmotor.device.device import SCENES, Scene

IMPORT_FIRST = "; import the module that defines the scene class first"


def attributes_of(scene: Scene, **attributes: Any) -> dict[str, Any]:
    """Return a dataset's attributes: scene, versions, and the given ones that are not None."""
    return {
        "scene": type(scene).__name__,
        "scene_fields": json.dumps(fields_of(scene)),
        "versions": _versions(),
        **{name: value for name, value in attributes.items() if value is not None},
    }


@cache
def _versions() -> str:
    names = ("magmotor", "mujoco", "numba", "numpy", "scipy")
    return json.dumps(versions_of(*names) | machine_versions())


def scene_of(run: xr.Dataset) -> Scene:
    """Return the scene that a dataset was made from.

    Raises
    ------
    ValueError
        `run` is not a dataset, or its attributes name no registered scene class, or invalid fields.
    """
    check_type("run", run, xr.Dataset)
    name = run.attrs.get("scene")
    if not isinstance(name, str) or name not in SCENES:
        sentence = f"must be one of {[*SCENES]}{IMPORT_FIRST}"
        raise InputError(f"scene = {name!r} in the dataset's attributes: {sentence}")
    return scene_from(name, fields_in(run.attrs, "scene_fields"))


@checked
def scene_from(name: str, fields: dict[str, Any]) -> Scene:
    """Return the scene of a class, a key of `SCENES`, from all its fields as JSON stores them.

    Raises
    ------
    ValueError
        A field is missing, unknown or invalid; the message names it.
    """
    known = {field.name: field for field in dataclasses.fields(_scene_class(name))}
    check_fields("scene_fields", fields, known)
    return scene_with(name, fields, "attributes['scene_fields']")


def scene_with(name: str, fields: dict[str, Any], source: str) -> Scene:
    """Return the scene of a class from some of its fields; the others have their defaults.

    Parameters
    ----------
    name : str
        A key of `SCENES`.
    fields : dict
        Values as JSON and TOML store them: lists stand for tuples.
    source : str
        What the fields come from, for messages.

    Raises
    ------
    ValueError
        A field is unknown or invalid; the message names it.
    """
    scene: Any = _scene_class(name)
    known = tuple(field.name for field in dataclasses.fields(scene))
    for field in fields:
        check_choice("field", field, known)
    try:
        return scene(**{field: _as_tuples(value) for field, value in fields.items()})
    except (ArithmeticError, AttributeError, LookupError, TypeError, RecursionError) as error:
        raise ArgumentError(source, fields, f"must be fields of a {name} ({error})") from error


def _scene_class(name: str) -> type[Scene]:
    try:
        check_choice("scene", name, tuple(SCENES))
    except ValueError as error:
        raise InputError(f"{error}{IMPORT_FIRST}") from None
    return SCENES[name]


@checked
def fields_of(scene: Scene) -> dict[str, Any]:
    """Return the fields of a scene as JSON and TOML store them, with lists for tuples.

    Raises
    ------
    ValueError
        A field is neither a number, text nor None, nor a tuple of such.
    """
    fields = {field.name: getattr(scene, field.name) for field in dataclasses.fields(scene)}
    return {name: _as_lists(name, value) for name, value in fields.items()}


def _as_lists(name: str, value: Any) -> Any:
    """Convert tuples to the lists of JSON."""
    if isinstance(value, tuple | list):
        return [_as_lists(f"{name}[{i}]", part) for i, part in enumerate(value)]
    if value is not None and not isinstance(value, bool | int | float | str):
        raise ArgumentError(
            name, value, "cannot be stored: must be a number, text, or a tuple of those"
        )
    return value


def _as_tuples(value: Any) -> Any:
    """Convert the lists of JSON back to tuples."""
    return tuple(_as_tuples(v) for v in value) if isinstance(value, list) else value


def numerics_of(run: xr.Dataset) -> str:
    """Return the method of a run, its timestep and its number of replicas, as text."""
    unit = str(run.time.attrs.get("units", "1")).removeprefix("1")
    step = f"h = {run.attrs['timestep']:g} {unit}".rstrip()
    replicas = f", {run.sizes['replica']} replicas" if "replica" in run.sizes else ""
    return f"{run.attrs['method']}, {step}{replicas}"
