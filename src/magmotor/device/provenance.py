"""What the attributes of a dataset say of how it was made, and its scene, made of them again."""

import dataclasses
import json
from functools import cache
from importlib.metadata import version
from typing import Any

import xarray as xr

from magmotor.common.arguments import checked
from magmotor.common.checks import check_choice, check_type, reject
from magmotor.common.files import check_fields, fields_in
from magmotor.common.versions import machine_versions
from magmotor.device.device import SCENES, Scene


def attributes_of(scene: Scene, **attributes: Any) -> dict[str, Any]:
    """What says how a dataset was made: scene, versions, and those given that are not None."""
    return {
        "scene": type(scene).__name__,
        "scene_fields": json.dumps(dataclasses.asdict(scene)),
        "versions": _versions(),
        **{name: value for name, value in attributes.items() if value is not None},
    }


@cache
def _versions() -> str:
    names = ("magmotor", "mujoco", "numba", "numpy", "scipy")
    return json.dumps({name: version(name) for name in names} | machine_versions())


def scene_of(run: xr.Dataset) -> Scene:
    """The scene that a dataset was made from.

    Raises
    ------
    ValueError
        It is no dataset, or names no scene that is known here, or one that cannot be.
    """
    check_type("run", run, xr.Dataset)
    name = run.attrs.get("scene")
    if not isinstance(name, str) or name not in SCENES:
        raise ValueError(
            f"scene = {name!r} in the dataset's attributes: must be one of {[*SCENES]}"
        )
    return scene_from(name, fields_in(run.attrs, "scene_fields"))


@checked
def scene_from(kind: str, fields: dict[str, Any]) -> Scene:
    """The scene of a kind, a key of `SCENES`, with all its fields as JSON has them.

    Raises
    ------
    ValueError
        A field is missing, unknown, or cannot have its value: names it.
    """
    check_choice("kind", kind, tuple(SCENES))
    scene: Any = SCENES[kind]
    known = {field.name: field for field in dataclasses.fields(scene)}
    check_fields("scene_fields", fields, known)
    try:
        return scene(**{name: _as_tuples(value) for name, value in fields.items()})
    except (ArithmeticError, AttributeError, LookupError, TypeError, RecursionError) as error:
        sentence = f"must be those of a {kind} ({error})"
        raise reject("attributes['scene_fields']", fields, sentence) from error


def _as_tuples(value: Any) -> Any:
    """JSON's lists as the tuples that they were."""
    return tuple(_as_tuples(v) for v in value) if isinstance(value, list) else value
