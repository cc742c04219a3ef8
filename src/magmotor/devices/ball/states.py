"""Initial states of a ball and a ring as users give them, and conversions of orientations."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from magmotor.common.arrays import Array
from magmotor.common.checks import check_array
from magmotor.common.exceptions import ArgumentError
from magmotor.device.initial import initial_parts
from magmotor.devices.ball.scene import BallScene

ROUNDING = 1e-14
"""Largest error of the length of a direction or quaternion that is already normalized."""


def given_parts(
    scene: BallScene,
    sizes: Mapping[str, int],
    initial: Mapping[str, Any] | xr.Dataset | None,
    replicas: int,
) -> dict[str, Array]:
    """Return the given parts of an initial state by name, each of shape (replicas, size).

    A given axis also sets the orientation, and an orientation the axis: `axis` and `orientation`,
    `ring_axis` and `ring_orientation`. A dataset gives all parts, bit for bit. `sizes` has the
    length of each part.

    Raises
    ------
    ValueError
        A part is unknown or invalid; the message names the part, its value and the bound.
    """
    if isinstance(initial, xr.Dataset):
        names = [name for name in sizes if name in initial or _twin(name) not in initial]
        given = initial_parts(initial, names)
    else:
        given = initial_parts(initial, [*sizes])
        _check_no_twins(given)
    parts = {k: _rows(scene, k, v, sizes, replicas) for k, v in given.items()}
    for name in {*parts} - {_twin(name) for name in parts}:
        if name.endswith("orientation"):
            parts[_twin(name)] = axes(parts[name])
        else:
            parts[_twin(name)] = np.array([smallest_turn(axis) for axis in parts[name]])
    return parts


def _twin(name: str) -> str:
    """Return the orientation for an axis, the axis for an orientation, other names unchanged."""
    if name.endswith("axis"):
        return name.replace("axis", "orientation")
    return name.replace("orientation", "axis")


def _check_no_twins(given: Mapping[str, Any]) -> None:
    for name in given:
        if name != _twin(name) and _twin(name) in given:
            raise ArgumentError("initial", [*given], f"must have {name} or {_twin(name)}, not both")


def _rows(
    scene: BallScene, name: str, value: Any, sizes: Mapping[str, int], replicas: int
) -> Array:
    label, size = f"initial[{name!r}]", sizes[name]
    rows = check_array(label, value)
    on_plane = {"position": scene.ball_radius, "velocity": 0.0}
    if name in on_plane and rows.shape in {(2,), (replicas, 2)}:
        rows = np.insert(rows, 2, on_plane[name], axis=-1)
    if rows.shape not in {(size,), (replicas, size)}:
        each = f", or {replicas} rows of them" if replicas > 1 else ""
        raise ArgumentError(label, value, f"must be {size} finite numbers{each}")
    rows = np.broadcast_to(rows, (replicas, size)).copy()
    if name in on_plane and scene.surface == "planar" and (rows[:, 2] != on_plane[name]).any():
        raise ArgumentError(label, value, f"must have z = {on_plane[name]:g} on the plane")
    if name.endswith(("axis", "orientation")):
        if not rows.any(axis=1).all():
            raise ArgumentError(label, value, "must not be zero")
        lengths = np.linalg.norm(rows, axis=1, keepdims=True)
        rows /= np.where(abs(lengths - 1) < ROUNDING, 1.0, lengths)
    return rows


def smallest_turn(axis: ArrayLike) -> NDArray[np.float64]:
    """Return the orientation (w, x, y, z) that rotates e_z to `axis` by the smallest angle."""
    vector = np.asarray(axis, dtype=float)
    x, y, z = vector / np.linalg.norm(vector, axis=-1)
    across = math.sqrt(x * x + y * y)
    if z >= 0:
        half = math.sqrt(0.5 * (1.0 + z))  # the cosine of half the angle
        return np.array([half, 0.0 - 0.5 * y / half, 0.5 * x / half, 0.0])  # no minus zero
    half = math.sqrt(0.5 * (1.0 - z))  # the sine
    along = (-y / across, x / across) if across else (1.0, 0.0)
    return np.array([0.5 * across / half, half * along[0], half * along[1], 0.0])


def axes(orientation: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the body's z axis in the world frame; shapes (..., 4) -> (..., 3)."""
    w, x, y, z = np.moveaxis(orientation, -1, 0)
    square = w * w + x * x + y * y + z * z
    third = [2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z]
    return np.stack(third, axis=-1) / square[..., np.newaxis]
