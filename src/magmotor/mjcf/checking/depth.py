"""How deep points are below the surface of a geom, and the normal of the nearest surface."""

import contextlib
from collections.abc import Iterator

import mujoco
import numpy as np
from scipy.spatial import ConvexHull, QhullError

from magmotor.common.arrays import Array

GEOM = mujoco.mjtGeom

CONVEX = [int(getattr(GEOM, f"mjGEOM_{x}")) for x in (
    "SPHERE", "CAPSULE", "ELLIPSOID", "CYLINDER", "BOX", "MESH")]  # fmt: skip
"""Types of geoms of which `tips` knows the shape."""

DIRECTIONS = 300
"""Number of directions, evenly spread, in which hulls are sampled."""

NEVER = -np.inf
"""Depth in geoms of types that are not known here."""


def depth_and_normal(
    model: mujoco.MjModel, data: mujoco.MjData, geom: int, points: Array
) -> tuple[Array, Array]:
    """Return the depths (n,) of points in a geom, and the outward normals (n, 3) nearest to them.

    Points outside have a negative depth. In an ellipsoid, the depth is a lower bound; a mesh is its
    convex hull, as in MuJoCo's collisions.

    Parameters
    ----------
    model : mujoco.MjModel
    data : mujoco.MjData
    geom : int
    points : ndarray, shape (n, 3)
        World coordinates in m.
    """
    frame = data.geom_xmat[geom].reshape(3, 3)
    local = (points - data.geom_xpos[geom]) @ frame
    size, kind = model.geom_size[geom], model.geom_type[geom]
    if kind == GEOM.mjGEOM_PLANE:
        depth, normal = -local[:, 2], np.tile([0.0, 0, 1], (len(local), 1))
    elif kind == GEOM.mjGEOM_SPHERE:
        depth, normal = _rounded(local, size[0])
    elif kind == GEOM.mjGEOM_CAPSULE:
        along = np.clip(local[:, 2:], -size[1], size[1]) * [0, 0, 1]
        depth, normal = _rounded(local - along, size[0])
    elif kind == GEOM.mjGEOM_ELLIPSOID:
        depth, normal = _rounded(local / size, 1.0)
        normal = _unit(normal / size)
        depth = depth * np.where(depth > 0, size.min(), size.max())
    elif kind == GEOM.mjGEOM_CYLINDER:
        radius = np.hypot(local[:, 0], local[:, 1])
        depth, flat = _boxed(np.column_stack([radius, local[:, 2]]), size[:2])
        outward = _unit(local * [1, 1, 0])
        normal = outward * flat[:, :1] + np.array([0, 0, 1]) * flat[:, 1:]
    elif kind == GEOM.mjGEOM_BOX:
        depth, normal = _boxed(local, size)
    elif kind == GEOM.mjGEOM_MESH and model.geom_dataid[geom] >= 0:
        depth, normal = _hulled(model, model.geom_dataid[geom], local)
    else:
        depth, normal = np.full(len(local), NEVER), np.tile([0.0, 0, 1], (len(local), 1))
    return depth, normal @ frame.T


def tangent_planes(
    model: mujoco.MjModel, data: mujoco.MjData, geom: int, directions: Array
) -> Iterator[tuple[Array, Array]]:
    """Yield a point in m and the outward normal of the planes that bound a geom.

    Normals are its axes and these directions (k, 3).
    """
    center, size = model.geom_aabb[geom].reshape(2, 3)
    if model.geom_type[geom] == GEOM.mjGEOM_PLANE:
        return
    frame = data.geom_xmat[geom].reshape(3, 3)
    for direction in (*np.eye(3), *-np.eye(3)):
        yield data.geom_xpos[geom] + frame @ (center + size * direction), frame @ direction
    if model.geom_type[geom] in CONVEX:
        yield from zip(tips(model, data, geom, directions), directions, strict=True)


def tips(model: mujoco.MjModel, data: mujoco.MjData, geom: int, directions: Array) -> Array:
    """Return the points of a geom that are farthest in directions (k, 3)."""
    frame = data.geom_xmat[geom].reshape(3, 3)
    size, kind = model.geom_size[geom], model.geom_type[geom]
    local = directions @ frame
    side = np.sign(local)
    if kind == GEOM.mjGEOM_SPHERE:
        found = size[0] * local
    elif kind == GEOM.mjGEOM_CAPSULE:
        found = size[0] * local + size[1] * side * [0, 0, 1]
    elif kind == GEOM.mjGEOM_CYLINDER:
        around = local * [1, 1, 0]
        length = np.linalg.norm(around, axis=1, keepdims=True)
        found = size[0] * np.divide(around, length, out=around, where=length > 0)
        found = found + size[1] * side * [0, 0, 1]
    elif kind == GEOM.mjGEOM_ELLIPSOID:
        found = local * size**2 / np.linalg.norm(local * size, axis=1, keepdims=True)
    elif kind == GEOM.mjGEOM_BOX:
        found = size * side
    else:
        first = model.mesh_vertadr[model.geom_dataid[geom]]
        number = model.mesh_vertnum[model.geom_dataid[geom]]
        vertices = model.mesh_vert[first : first + number].astype(float)
        found = vertices[(local @ vertices.T).argmax(axis=1)]
    return data.geom_xpos[geom] + found @ frame.T


def hull_directions(
    model: mujoco.MjModel, data: mujoco.MjData, geoms: list[int], more: Array | None = None
) -> Array:
    """Return directions (k, 3), evenly spread and across the faces of the hull of convex geoms.

    They begin with those along the axes of the geoms, and with `more`.
    """
    frames = data.geom_xmat[geoms].reshape(-1, 3, 3).transpose(0, 2, 1).reshape(-1, 3)
    others = np.zeros((0, 3)) if more is None else more
    directions = np.vstack([frames, -frames, others, _evenly_spread(DIRECTIONS)])
    directions = directions[np.linalg.norm(directions, axis=1) > 0.5]
    sampled = np.vstack([tips(model, data, geom, directions) for geom in geoms])
    with contextlib.suppress(QhullError):  # as of geoms without volume
        directions = np.vstack([directions, ConvexHull(sampled).equations[:, :3]])
    return directions


def _evenly_spread(count: int) -> Array:
    """Return points on a sphere, shape (count, 3)."""
    heights = 1 - (2 * np.arange(count) + 1) / count
    angles = np.pi * (1 + 5**0.5) * np.arange(count)
    around = np.column_stack([np.cos(angles), np.sin(angles)]) * np.sqrt(1 - heights**2)[:, None]
    return np.column_stack([around, heights])


def _unit(vectors: Array) -> Array:
    """Return vectors (n, 3) of length 1, x where they are zero."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, length, out=np.tile([1.0, 0, 0], (len(vectors), 1)), where=length > 0)


def _rounded(local: Array, radius: float) -> tuple[Array, Array]:
    return radius - np.linalg.norm(local, axis=1), _unit(local)


def _boxed(local: Array, size: Array) -> tuple[Array, Array]:
    """Return depths and normals in a box of any dimension."""
    excess = abs(local) - size
    outside = np.maximum(excess, 0)
    beyond = np.linalg.norm(outside, axis=1)
    nearest = np.eye(len(size))[excess.argmax(axis=1)]
    normal = np.where(beyond[:, np.newaxis] > 0, outside, nearest)
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return -beyond - np.minimum(excess.max(axis=1), 0), np.copysign(normal, local)


def _hulled(model: mujoco.MjModel, mesh: int, local: Array) -> tuple[Array, Array]:
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    faces = ConvexHull(model.mesh_vert[first : first + count]).equations
    excess = local @ faces[:, :3].T + faces[:, 3]
    nearest = excess.argmax(axis=1)
    return -excess[np.arange(len(local)), nearest], faces[nearest, :3]
