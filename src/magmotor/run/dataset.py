"""A run as a labelled dataset that says, in its attributes, how to make it again."""

import dataclasses
import json
from functools import cache
from importlib.metadata import version
from typing import Any

import numpy as np
import xarray as xr

import magmotor.devices  # noqa: F401  (datasets may name its scenes)
from magmotor.common.arguments import checked
from magmotor.common.checks import check_choice, check_kind, reject
from magmotor.common.files import check_fields, fields_in
from magmotor.device.device import KINDS, Scene
from magmotor.device.states import concatenate
from magmotor.run.versions import machine_versions


def assemble(
    scene: Scene, chunks: list[Any], *, replicas: int | None = None, **attributes: Any
) -> xr.Dataset:
    """Make the dataset of a run from its recorded states.

    Parameters
    ----------
    scene : Top, Motor, Disk or LangevinParticle
        Goes into the attributes as JSON.
    chunks : list of states
        In the order of time, the initial state first.
    replicas : int, optional
        How many, if the dataset is to have that dimension.
    **attributes
        Method, timestep, seed and so on.

    Returns
    -------
    xarray.Dataset
        Dimensions time; replica; space (x, y, z) and component (of quaternions) for vectors. The
        coordinates `replica` and `step` number the replicas and the steps of the Brownian path, so
        that a part of the dataset still tells which noise it had.
    """
    states = concatenate(chunks)
    columns = scene.device.columns(scene, states, replicas)
    unit = scene.device.time_unit
    coordinates: dict[str, Any] = {
        "time": ("time", states.time, {"units": unit, "long_name": "time"})
    }
    dimensions = {dim for column in columns.values() for dim in column.dimensions}
    if "replica" in dimensions:
        coordinates["replica"] = np.arange(replicas or 1)
    if "record_interval" in attributes:
        steps = attributes["record_interval"] * np.arange(len(states.time))
        steps += attributes.get("first_step") or 0
        label = "number of the step on the Brownian path"
        coordinates["step"] = ("time", steps, {"units": "1", "long_name": label})
    if "space" in dimensions:
        coordinates["space"] = ["x", "y", "z"]
    data = xr.Dataset(
        {
            name: (dims, values, {"units": unit, "long_name": label})
            for name, (dims, values, unit, label) in columns.items()
        },
        coords=coordinates,
    )
    data.attrs = attributes_of(scene, replicas=replicas, **attributes)
    return data


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
    check_kind("run", run, xr.Dataset)
    name = run.attrs.get("scene")
    if not isinstance(name, str) or name not in KINDS:
        raise ValueError(f"scene = {name!r} in the dataset's attributes: must be one of {[*KINDS]}")
    return scene_from(name, fields_in(run.attrs, "scene_fields"))


@checked
def scene_from(kind: str, fields: dict[str, Any]) -> Scene:
    """The scene of a kind, a key of `KINDS`, with all its fields as JSON has them.

    Raises
    ------
    ValueError
        A field is missing, unknown, or cannot have its value: names it.
    """
    check_choice("kind", kind, tuple(KINDS))
    scene: Any = KINDS[kind]
    known = {field.name: field for field in dataclasses.fields(scene)}
    check_fields("scene_fields", fields, known)
    try:
        return scene(**{name: _as_tuples(value) for name, value in fields.items()})
    except (ArithmeticError, AttributeError, LookupError, TypeError, RecursionError) as error:
        bound = f"those of a {kind} ({error})"
        raise reject("attributes['scene_fields']", fields, bound) from error


def _as_tuples(value: Any) -> Any:
    """JSON's lists as the tuples that they were."""
    return tuple(_as_tuples(v) for v in value) if isinstance(value, list) else value
