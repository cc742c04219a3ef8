"""Magnetized shapes of the tests of their fields, and points around them."""

from types import SimpleNamespace

import numpy as np

from magmotor.numerics.shapes import box, capsule, cylinder, ellipsoid

J = np.array([0.3, -0.8, 1.1])
"""Polarization in T, unless told otherwise."""

LENGTH = 0.01
"""A typical size in m."""

SIZES = {
    "box": (0.01, 0.02, 0.005),
    "capsule": (0.01, 0.007),
    "cylinder": (0.01, 0.007),
    "ellipsoid": (0.01, 0.02, 0.005),
    "sphere": (0.01,),
}
KINDS = ("field", "potential", "continued_field", "continued_potential")
MODULES = {
    "box": box, "capsule": capsule, "cylinder": cylinder, "ellipsoid": ellipsoid,
    "sphere": ellipsoid,
}  # fmt: skip


def shape(name, sizes=None, polarization=J):
    """The functions of a shape, of points (..., 3), and half the edges of the box around it."""
    sizes = sizes or SIZES[name]

    def of_points(function):
        def values(points):
            points = np.asarray(points)
            flat = [function(*p, *sizes, *polarization) for p in points.reshape(-1, 3)]
            return np.array(flat).reshape(points.shape if np.ndim(flat[0]) else points.shape[:-1])

        return values

    functions = {kind: of_points(getattr(MODULES[name], f"{name}_{kind}")) for kind in KINDS}
    extent = np.array({1: sizes * 3, 2: (*sizes[:1] * 2, *sizes[1:]), 3: sizes}[len(sizes)])
    if name == "capsule":
        extent[2] += sizes[0]
    return SimpleNamespace(extent=extent, **functions)


def points_of(where, extent, count=200, seed=1):
    rng = np.random.default_rng(seed)
    if where == "near":
        return rng.uniform(-1.5, 1.5, (count, 3)) * extent
    if where == "inside":
        return rng.uniform(-0.57, 0.57, (count, 3)) * extent
    if where == "axis":
        return rng.uniform(-2, 2, (count, 3)) * extent * [1e-9, 1e-9, 1]
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return {"around": 2, "far": 1000}[where] * extent.max() * directions


def worst(found, expected):
    return np.abs(np.asarray(found, dtype=float) - np.asarray(expected, dtype=float)).max()


def gradient(function, points, step):
    """Central differences, the derivatives along the last axis."""
    ends = [function(points[:, None] + s * step * np.eye(3)) for s in (1, -1)]
    return (ends[0] - ends[1]) / (2 * step)
