"""Parts of an initial state as a user gives them: vectors and orientations of rigid bodies."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common.checks import check_array, check_choice, reject
from magmotor.devices.ball.states import axes, smallest_turn
from magmotor.devices.motor.scene import Motor
from magmotor.devices.top.scene import Top

Array = NDArray[np.float64]

ROUNDING = 1e-14
"""Of the length of a direction or a quaternion that was of length 1."""


def given_parts(
    scene: Top | Motor,
    sizes: Mapping[str, int],
    initial: Mapping[str, Any] | xr.Dataset | None,
    replicas: int,
) -> dict[str, Array]:
    """The parts of the initial state that are given, by name, each of shape (replicas, size).

    An axis brings an orientation with it, and an orientation an axis: `axis` and `orientation`,
    `ring_axis` and `ring_orientation`. A dataset tells every part, to the bit. `sizes` says how
    many numbers each part has.

    Raises
    ------
    ValueError
        Names the part, its value and the bound.
    """
    if isinstance(initial, xr.Dataset):
        needed = [name for name in sizes if name in initial or _twin(name) not in initial]
        given = last_record(initial, needed)
    else:
        given = as_given(initial, sizes)
        _check_no_twins(given)
    parts = {k: _rows(scene, k, v, sizes, replicas) for k, v in given.items()}
    for name in {*parts} - {_twin(name) for name in parts}:
        if name.endswith("orientation"):
            parts[_twin(name)] = axes(parts[name])
        else:
            parts[_twin(name)] = np.array([smallest_turn(axis) for axis in parts[name]])
    return parts


def last_record(run: xr.Dataset, names: Sequence[str]) -> dict[str, Array]:
    """These variables of a run at its last time.

    Raises
    ------
    ValueError
        Names those that it does not have.
    """
    missing = [name for name in names if name not in run]
    if missing:
        raise reject("initial", [*run.data_vars], f"a dataset that has {', '.join(missing)}, too")
    for name in names:
        if not run[name].sizes.get("time"):
            raise reject(f"initial.{name}", run[name].dims, "of a run, with a dimension time")
    return {name: run[name].isel(time=-1).values for name in names}


def as_given(initial: Any, known: Iterable[str]) -> dict[str, Any]:
    """The parts that a mapping names, or none.

    Raises
    ------
    ValueError
        It is no mapping, or names a part that is not known.
    """
    if initial is None:
        return {}
    if not isinstance(initial, Mapping):
        raise reject("initial", initial, "a mapping or a dataset")
    for name in initial:
        check_choice("initial", name, tuple(known))
    return dict(initial)


def _twin(name: str) -> str:
    """Of an axis the orientation, of an orientation the axis, of others themselves."""
    if name.endswith("axis"):
        return name.replace("axis", "orientation")
    return name.replace("orientation", "axis")


def _check_no_twins(given: Mapping[str, Any]) -> None:
    for name in given:
        if name != _twin(name) and _twin(name) in given:
            raise reject("initial", [*given], f"given with {name} or {_twin(name)}, not both")


def _rows(scene, name: str, value: Any, sizes: Mapping[str, int], replicas: int) -> Array:
    label, size = f"initial[{name!r}]", sizes[name]
    rows = check_array(label, value)
    on_plane = {"position": scene.ball_radius, "velocity": 0.0}
    if name in on_plane and rows.shape in {(2,), (replicas, 2)}:
        rows = np.insert(rows, 2, on_plane[name], axis=-1)
    if rows.shape not in {(size,), (replicas, size)}:
        each = f", or {replicas} times so many" if replicas > 1 else ""
        raise reject(label, value, f"{size} finite numbers{each}")
    rows = np.broadcast_to(rows, (replicas, size)).copy()
    if name in on_plane and scene.surface == "planar" and (rows[:, 2] != on_plane[name]).any():
        raise reject(label, value, f"{on_plane[name]:g} along z on the plane")
    if name.endswith(("axis", "orientation")):
        if not rows.any(axis=1).all():
            raise reject(label, value, "not all zero")
        lengths = np.linalg.norm(rows, axis=1, keepdims=True)
        rows /= np.where(abs(lengths - 1) < ROUNDING, 1.0, lengths)
    return rows
