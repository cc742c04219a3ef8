"""Parts of an initial state as a user gives them: vectors and orientations of rigid bodies."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.checks import check_choice, reject
from magmotor.scenes import Motor, Top
from magmotor.states.ball import axes, smallest_turn

Array = NDArray[np.float64]


def given_parts(
    scene: Top | Motor,
    sizes: Mapping[str, int],
    initial: Mapping[str, Any] | xr.Dataset | None,
    replicas: int,
) -> dict[str, Array]:
    """The parts of the initial state that are given, by name, each of shape (replicas, size).

    An axis brings an orientation with it, and an orientation an axis: `axis` and `orientation`,
    `ring_axis` and `ring_orientation`. `sizes` says how many numbers each part has.

    Raises
    ------
    ValueError
        Names the part, its value and the bound.
    """
    if isinstance(initial, xr.Dataset):
        initial = {k: initial[k].isel(time=-1).values for k in sizes if k in initial}
        initial = {k: v for k, v in initial.items() if not _told_by_orientation(k, initial)}
    for axis in ("axis", "ring_axis"):
        both = {axis, axis.replace("axis", "orientation")}
        if initial is not None and both <= initial.keys():
            raise reject("initial", [*initial], f"given with {' or '.join(sorted(both))}, not both")
    parts = {k: _rows(scene, k, v, sizes, replicas) for k, v in (initial or {}).items()}
    for name in [*parts]:
        if name.endswith("orientation"):
            parts[name.replace("orientation", "axis")] = axes(parts[name])
        elif name.endswith("axis"):
            turns = np.array([smallest_turn(axis) for axis in parts[name]])
            parts[name.replace("axis", "orientation")] = turns
    return parts


def _told_by_orientation(name: str, initial: Mapping[str, Any]) -> bool:
    return name.endswith("axis") and name.replace("axis", "orientation") in initial


def _rows(scene, name: str, value: Any, sizes: Mapping[str, int], replicas: int) -> Array:
    check_choice("initial", name, tuple(sizes))
    label, size = f"initial[{name!r}]", sizes[name]
    rows = np.asarray(value, dtype=float)
    on_plane = {"position": scene.ball_radius, "velocity": 0.0}
    if name in on_plane and rows.shape in {(2,), (replicas, 2)}:
        rows = np.insert(rows, 2, on_plane[name], axis=-1)
    if rows.shape not in {(size,), (replicas, size)} or not np.isfinite(rows).all():
        each = f", or {replicas} times so many" if replicas > 1 else ""
        raise reject(label, value, f"{size} finite numbers{each}")
    rows = np.broadcast_to(rows, (replicas, size)).copy()
    if name in on_plane and scene.surface == "planar" and (rows[:, 2] != on_plane[name]).any():
        raise reject(label, value, f"{on_plane[name]:g} along z on the plane")
    if name.endswith(("axis", "orientation")):
        if not rows.any(axis=1).all():
            raise reject(label, value, "not all zero")
        rows /= np.linalg.norm(rows, axis=1, keepdims=True)
    return rows
