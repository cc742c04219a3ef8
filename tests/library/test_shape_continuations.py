"""Shapes' potentials, divergence and curl, values on the surface, and smooth continuations."""

import math
from itertools import product

import numpy as np
import pytest
from magnetized_shapes import KINDS, LENGTH, SIZES, J, gradient, points_of, shape, worst


@pytest.mark.parametrize("kind", ["", "continued_"])
@pytest.mark.parametrize("where", ["near", "inside"])
@pytest.mark.parametrize("name", SIZES)
def test_fields_are_gradients_of_potentials(name, where, kind):
    """At points whose neighbors are not beyond a face, or continued in another way."""
    body = shape(name)
    potential, field = (getattr(body, kind + what) for what in ("potential", "field"))
    points = points_of(where, body.extent, 100)
    level = measures(name, points)
    off = np.abs(level) > 0.02
    if kind and name == "cylinder":
        off &= np.hypot(*points.T[:2]) > 0.52 * SIZES[name][0]
    points = points[off & ~(kind == "continued_" and crossing(name, points))]
    assert len(points) > 20
    error = worst(-gradient(potential, points, 1e-4 * LENGTH), field(points))
    assert error < 5e-6  # 4.2e-7


def measures(name, points):
    """Distances outside of the surface, in parts of the size; negative inside."""
    extent = shape(name).extent
    if name == "box":
        return ((np.abs(points) - extent) / LENGTH).max(axis=1)
    if name == "cylinder":
        r = np.hypot(*points.T[:2])
        return np.maximum(r - extent[0], np.abs(points[:, 2]) - extent[2]) / LENGTH
    if name == "capsule":
        return (from_axis(points, extent) - extent[0]) / LENGTH
    return np.linalg.norm(points / extent, axis=1) - 1


def from_axis(points, extent):
    """Distances from the line between the centers of a capsule's caps."""
    beyond = np.maximum(np.abs(points[..., 2]) - extent[2] + extent[0], 0)
    return np.hypot(np.hypot(points[..., 0], points[..., 1]), beyond)


def crossing(name, points):
    """Where two faces are about equally near, or the depth is that to which fields continue."""
    extent = shape(name).extent
    if name == "box":
        heights = np.sort(np.abs(points) - extent, axis=1)
        return heights[:, 2] - heights[:, 1] < 0.02 * LENGTH
    if name == "cylinder":
        difference = np.hypot(*points.T[:2]) - extent[0] - np.abs(points[:, 2]) + extent[2]
        return np.abs(difference) < 0.02 * LENGTH
    if name == "capsule":
        inside = from_axis(points, extent) < extent[0]
        at_plane = np.abs(np.abs(points[:, 2]) - extent[2] + extent[0]) < 0.02 * LENGTH
        deep = np.abs(from_axis(points, extent) - 0.5 * extent[0]) < 0.02 * LENGTH
        return inside & at_plane | deep
    lowest = (points**2 / (extent**2 - 0.75 * extent.min() ** 2)).sum(axis=1)
    return np.abs(lowest - 1) < 0.1


@pytest.mark.parametrize("name", SIZES)
def test_fields_outside_have_no_divergence(name):
    body = shape(name)
    points = points_of("near", body.extent, 60)
    points = points[measures(name, points) > 0.05]
    slopes = gradient(body.field, points, 1e-4 * LENGTH)  # from, along
    size = np.abs(slopes).max(axis=(1, 2))
    assert (np.abs(np.trace(slopes, axis1=1, axis2=2)) / size).max() < 1e-5  # 7e-7
    curl = np.abs(slopes - np.swapaxes(slopes, 1, 2)).max(axis=(1, 2))
    assert (curl / size).max() < 1e-5  # 5e-7


def surface(name, count=10, seed=3):
    """Points on the surface, away from edges, and the normals there."""
    rng = np.random.default_rng(seed)
    extent = shape(name).extent
    if name == "box":
        for axis, sign in product(range(3), (1, -1)):
            point, normal = rng.uniform(-0.8, 0.8, 3) * extent, sign * np.eye(3)[axis]
            point[axis] = sign * extent[axis]
            yield point, normal
        return
    for k in range(count):
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        if name == "capsule":
            half, (x, y, z) = extent[2] - extent[0], direction
            normal = direction if k % 2 else np.array([x, y, 0]) / math.hypot(x, y)
            middle = math.copysign(half, z) if k % 2 else 0.8 * half * z
            yield extent[0] * normal + [0, 0, middle], normal
        elif name == "cylinder":
            flat = np.append(direction[:2] / math.hypot(*direction[:2]), 0)
            if k % 2:
                sign = 1 if k % 4 == 1 else -1
                yield 0.7 * flat * extent + [0, 0, sign * extent[2]], np.array([0, 0, sign])
            else:
                yield flat * extent + [0, 0, 0.5 * direction[2] * extent[2]], flat
        else:
            normal = direction / extent
            yield direction * extent, normal / np.linalg.norm(normal)


@pytest.mark.parametrize("name", SIZES)
def test_continuations_are_smooth_across_the_surface(name):
    body = shape(name)
    for point, normal in surface(name):
        for what in ("field", "potential"):
            continued = getattr(body, f"continued_{what}")
            unit = 1.0 if what == "field" else LENGTH

            def along(t, continued=continued, point=point, normal=normal):
                return continued(point + t * LENGTH * normal)

            jump = worst(along(1e-9), along(-1e-9))
            assert jump < 2e-7 * unit  # 1.1e-8
            out, into = (
                s * (4 * along(s * 1e-3) - along(s * 2e-3) - 3 * along(s * 1e-9)) / 2e-3
                for s in (1, -1)
            )
            assert worst(out, into) < 3e-4 * unit  # 2.9e-5
            assert worst(along(0.01), getattr(body, what)(point + 0.01 * LENGTH * normal)) == 0
        ends = [body.field(point + s * 1e-9 * LENGTH * normal) for s in (1, -1)]
        assert worst(ends[0] - ends[1], (J @ normal) * normal) < 1e-7  # 6e-9


@pytest.mark.parametrize("name", SIZES)
def test_faces_edges_and_corners_have_finite_values(name):
    body = shape(name)
    for where in product([-1.0, 0.0, 0.5, 1.0], repeat=3):
        for kind in KINDS:
            assert np.isfinite(getattr(body, kind)(np.array(where) * body.extent)).all()


@pytest.mark.parametrize("name", ["box", "cylinder"])
def test_the_field_on_a_face_is_that_outside(name):
    body = shape(name)
    faces = [np.array([0.3, 0.4, 1]), np.array([-0.3, 0.4, -1]), np.array([1, 0, 0.2])]
    for face in faces:
        found = body.field(face * body.extent)
        assert worst(found, body.field((1 + 1e-9) * face * body.extent)) < 3e-8  # 1.3e-9
        assert worst(found, body.field((1 - 1e-9) * face * body.extent)) > 0.2  # 0.3
