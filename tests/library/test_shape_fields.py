"""Fields of magnetized shapes, compared with magpylib and with quadrature."""

import math
from itertools import product

import magpylib
import numpy as np
import pytest
from magnetized_shapes import KINDS, LENGTH, MODULES, SIZES, J, gradient, points_of, shape, worst
from numba import njit

from magmotor.numerics.shapes import cylinder, triangle

TRIANGLE = np.array([[0.01, 0.002, -0.003], [-0.007, 0.004, 0.001], [0.002, -0.009, 0.006]])


def magpylibs(name):
    """The same magnet by magpylib."""
    kind, argument = {
        "box": (magpylib.magnet.Cuboid, {"dimension": 2 * np.array(SIZES["box"])}),
        "cylinder": (magpylib.magnet.Cylinder, {"dimension": 2 * np.array(SIZES["cylinder"])}),
        "sphere": (magpylib.magnet.Sphere, {"diameter": 2 * SIZES["sphere"][0]}),
    }[name]
    return kind(polarization=J, **argument)


def field_of(source, points):
    """mu0 H of a source, with the constant by which magpylib divided."""
    return source.getH(points) * magpylib.mu_0


@pytest.mark.parametrize("where", ["near", "inside", "axis", "far"])
@pytest.mark.parametrize("name", ["box", "cylinder", "sphere"])
def test_fields_are_magpylibs(name, where):
    """Magpylib's cylinder across the axis has errors that quadrature finds to be its own."""
    body = shape(name)
    points = points_of(where, body.extent)
    bound = 3e-9 if name == "cylinder" else 1e-12  # 2e-10, 1e-13
    assert worst(body.field(points), field_of(magpylibs(name), points)) < bound


@pytest.mark.parametrize("name", SIZES)
def test_far_fields_are_those_of_dipoles(name):
    """At a thousand sizes, other moments and rounding errors are millionths of the field."""
    body = shape(name)
    points = points_of("far", body.extent)
    volume = {"box": 8, "cylinder": 2 * math.pi}.get(name, 4 / 3 * math.pi) * body.extent.prod()
    if name == "capsule":
        volume = math.pi * body.extent[0] ** 2 * (2 * body.extent[2] - 2 / 3 * body.extent[0])
    r = np.linalg.norm(points, axis=1, keepdims=True)
    along = (points @ J)[:, None]
    dipole = volume / (4 * math.pi) * (3 * along * points / r**2 - J) / r**3
    error = worst(body.field(points), dipole) / np.abs(dipole).max()
    assert error < 2e-5  # 1.4e-6
    potential = volume / (4 * math.pi) * along[:, 0] / r[:, 0] ** 3
    error = worst(body.potential(points), potential) / np.abs(potential).max()
    assert error < 2e-5  # 1.2e-6


def by_corners(points, extent):
    """The field of a box in extended precision, summed over the corners."""
    points = np.asarray(points, dtype=np.longdouble)
    field = np.zeros(points.shape, dtype=np.longdouble)
    for signs in product((1, -1), repeat=3):
        u = points + signs * extent
        sign, r = math.prod(signs), np.sqrt((u * u).sum(axis=1))
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            field[:, i] -= sign * J[i] * np.arctan(u[:, j] * u[:, k] / (u[:, i] * r))
            for one, other in ((j, k), (k, j)):
                across = np.hypot(u[:, i], u[:, one])
                field[:, i] += sign * J[one] * np.arcsinh(u[:, other] / across)
    return field / (4 * math.pi)


@pytest.mark.parametrize("distance", [1e-2, 1e-5, 1e-8])
def test_boxes_are_accurate_near_their_edges(distance):
    rng = np.random.default_rng(4)
    body = shape("box")
    for edge in product([1, -1], [1, -1], [0.3, 1.0]):
        turn = rng.permutation(3)
        point = (np.array(edge) + distance * rng.normal(size=3))[turn] * body.extent
        assert worst(body.field(point), by_corners([point], body.extent)[0]) < 1e-14  # 4.4e-16


def by_rings(points, radius, half, polarization):
    """The field of a cylinder from charges on its side and currents around it, as lines along z.

    The mean over the angle converges exponentially away from the side.
    """
    angle = (np.arange(2000) + 0.5) * (2 * math.pi / 2000)
    cos, sin = np.cos(angle), np.sin(angle)
    charge = polarization[0] * cos + polarization[1] * sin
    field = []
    for x, y, z in points:
        u, v = x - radius * cos, y - radius * sin
        square, h = u * u + v * v, 0.0
        for sign, height in ((1, z + half), (-1, z - half)):
            r = np.sqrt(square + height**2)
            line = height / (square * r)
            h += sign * np.array(
                [
                    np.mean(charge * u * line - polarization[2] * cos / r),
                    np.mean(charge * v * line - polarization[2] * sin / r),
                    np.mean(-charge / r - polarization[2] * (sin * v + cos * u) * line),
                ]
            )
        inside = math.hypot(x, y) < radius and abs(z) < half
        field.append(0.5 * radius * h - [0, 0, polarization[2] * inside])
    return np.array(field)


@pytest.mark.parametrize("half", [1e-3, 0.7, 1e3])
@pytest.mark.parametrize("where", ["near", "inside", "axis", "far"])
def test_cylinders_are_sums_of_lines(half, where):
    body = shape("cylinder", (1.0, half))
    points = points_of(where, body.extent, 60)
    points = points[np.abs(np.hypot(*points.T[:2]) - 1) > 0.03]
    assert len(points) > 50
    expected = by_rings(points, 1.0, half, J)
    assert worst(body.field(points), expected) < 1e-14  # 5.7e-16


@pytest.mark.parametrize("distance", [1e-2, 1e-4, 1e-6])
def test_cylinders_are_accurate_near_their_rims(distance):
    """Quadrature in a variable that resolves the distance, phi = distance sinh(t)."""
    nodes, weights = np.polynomial.legendre.leggauss(60)
    for direction in (0.5, 2.0, 4.0):
        away, height = distance * math.cos(direction), distance * math.sin(direction)
        r, z = 1 + away, 0.5 + height
        away, height = r - 1, z - 0.5
        step = math.asinh(math.pi / abs(away)) / 8
        t = step * (np.arange(8)[:, None] + 0.5 + nodes / 2).ravel()
        phi = abs(away) * np.sinh(t)
        weight = np.tile(weights, 8) * step * abs(away) * np.cosh(t) / (4 * math.pi)
        cos, sin, less = np.cos(phi), np.sin(phi), 2 * np.sin(phi / 2) ** 2
        u, square = away + less, away**2 + 2 * r * less
        expected = np.zeros(3)
        for sign, h in ((1, z + 0.5), (-1, height)):
            length = np.sqrt(square + h * h)
            line = h / (square * length)
            expected += sign * np.array(
                [
                    weight @ (J[0] * cos * u * line - J[2] * cos / length),
                    weight @ (-J[1] * sin**2 * line),
                    weight @ (-J[0] * cos / length + J[2] * (sin**2 - cos * u) * line),
                ]
            )
        expected[2] -= J[2] * (r < 1 and z < 0.5)
        found = cylinder.cylinder_field(r, 0.0, z, 1.0, 0.5, *J)
        assert worst(found, expected) < 3e-14  # 1.8e-15


@pytest.mark.parametrize("where", ["near", "inside", "axis", "center"])
@pytest.mark.parametrize("half", [1e-3, 0.7, 3.0])
def test_capsules_are_their_surface_charges(half, where):
    """Points and weights on the caps and on the side, farther from the point than their spacing."""
    body = shape("capsule", (1.0, half))
    x, weights = np.polynomial.legendre.leggauss(120)
    angle = np.arange(240) * (math.pi / 120)
    normals, places, areas = [], [], []
    for sign in (1, -1):
        t, angles = np.meshgrid((1 + x) / 2, angle)
        s = np.sqrt(1 - t * t)
        normals.append(np.stack([s * np.cos(angles), s * np.sin(angles), sign * t], axis=-1))
        places.append(normals[-1] + [0, 0, sign * half])
        areas.append(np.broadcast_to(weights / 2, t.shape))
    pieces = math.ceil(half)
    for k in range(pieces):
        z, angles = np.meshgrid(half * ((2 * k + 1 + x) / pieces - 1), angle)
        normals.append(np.stack([np.cos(angles), np.sin(angles), 0 * z], axis=-1))
        places.append(normals[-1] + np.stack([0 * z, 0 * z, z], axis=-1))
        areas.append(np.broadcast_to(weights * half / pieces, z.shape))
    places, normals = np.concatenate(places), np.concatenate(normals)
    charges = normals @ J * np.concatenate(areas) / 480
    points = points_of("near" if where == "center" else where, body.extent, 30)
    if where == "center":
        points = np.array([0, 0, half]) + 0.06 * points / body.extent
        points[0] = [0, 0, half]
    beyond = np.maximum(np.abs(points[:, 2]) - half, 0)
    points = points[np.abs(np.hypot(np.hypot(*points.T[:2]), beyond) - 1) > 0.15]
    assert len(points) > 10
    for point in points:
        away = point - places
        r = np.sqrt((away**2).sum(-1))
        expected = (charges[..., None] * away / r[..., None] ** 3).sum((0, 1))
        bound = 1e-11 if where == "axis" else 5e-13  # 8e-13 next to the center of a cap, 5e-14
        assert worst(body.field(point), expected) < bound
        assert abs(body.potential(point) - (charges / r).sum()) < 5e-13  # 2.8e-14


@pytest.mark.parametrize("sizes", [(0.01, 0.02, 0.005), (0.01, 0.01, 0.01), (0.003, 0.003, 0.01)])
def test_ellipsoids_are_their_surface_charges(sizes):
    body = shape("ellipsoid", sizes)
    a, b, c = sizes
    u, weights = np.polynomial.legendre.leggauss(200)
    phi = np.arange(200) * (math.pi / 100)
    u, phi = np.meshgrid(u, phi)
    s = np.sqrt(1 - u * u)
    surface = np.stack([a * s * np.cos(phi), b * s * np.sin(phi), c * u], axis=-1)
    area = np.stack([b * c * s * np.cos(phi), a * c * s * np.sin(phi), a * b * u], axis=-1)
    charge = (area @ J) * weights / 100 / 4
    for point in points_of("around", body.extent, 20):
        away = point - surface
        r = np.sqrt((away**2).sum(-1))
        expected = (charge[..., None] * away / r[..., None] ** 3).sum((0, 1))
        assert worst(body.field(point), expected) < 2e-14  # 1.3e-15
        potential = (charge / r).sum()
        assert abs(body.potential(point) - potential) < 2e-14 * LENGTH  # 1.4e-15
    inside = body.field(points_of("inside", body.extent, 5))
    assert np.ptp(inside, axis=0).max() == 0


def test_thin_ellipsoids_have_the_field_of_their_root():
    """Bisection finds the confocal coordinate, and quadrature the integrals."""
    a, b, c = 1.0, 0.1, 1e-3
    body, squares = shape("ellipsoid", (a, b, c)), np.array([a, b, c]) ** 2
    t = np.arange(-40, 40, 0.05)  # s = l + exp(t)
    for point in points_of("around", np.array([0.6, 0.06, 6e-4]), 10):
        low, high = 0.0, float(point @ point)
        for _ in range(200):
            middle = 0.5 * (low + high)
            if (point**2 / (middle + squares)).sum() > 1:
                low = middle
            else:
                high = middle
        s = np.exp(t)[:, None] + low + squares
        terms = np.exp(t) / np.sqrt(s.prod(axis=1))
        factors = 0.5 * a * b * c * 0.05 * (terms @ (1 / s))
        assert abs(body.potential(point) - (J * point) @ factors) < 3e-17  # 1.3e-18


def test_a_sphere_is_an_ellipsoid():
    sphere, same = shape("sphere"), shape("ellipsoid", SIZES["sphere"] * 3)
    for where, kind in product(["near", "inside", "axis", "far"], KINDS):
        points = points_of(where, sphere.extent, 50)
        if kind.startswith("continued"):  # those of a sphere are continuous at half the radius
            points = points[np.linalg.norm(points, axis=1) > 0.5 * sphere.extent[0]]
        found, expected = getattr(sphere, kind)(points), getattr(same, kind)(points)
        assert worst(found, expected) < 5e-14 * np.abs(expected).max()  # 2.6e-15


def test_the_continued_field_of_a_sphere_is_continuous():
    """At half the radius, where its charges are."""
    sphere = shape("sphere")
    normals = np.random.default_rng(0).normal(size=(20, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    points = 0.5 * sphere.extent[0] * normals
    for kind in ("continued_field", "continued_potential"):
        ends = [getattr(sphere, kind)(points * (1 + side * 1e-9)) for side in (1, -1)]
        assert worst(*ends) < 5e-8 * np.abs(ends[0]).max()  # 2.7e-9, 4e-9


def test_a_disk_of_the_shop():
    """A disk of 12.7 mm by 3.175 mm with 1.32 T has 0.2952 T in the middle of its face."""
    half = 3.175e-3 / 2
    x, y, z = cylinder.cylinder_field(0.0, 0.0, half, 6.35e-3, half, 0.0, 0.0, 1.32)
    assert (x, y) == (0, 0)
    assert abs(z - 0.2952) < 5e-5  # 0.29516


@pytest.mark.parametrize("scale", [0.5, 2.0, 100.0])
def test_triangles_are_magpylibs(scale):
    charge = 0.7
    normal = np.cross(TRIANGLE[1] - TRIANGLE[0], TRIANGLE[2] - TRIANGLE[0])
    normal *= charge / np.linalg.norm(normal)
    theirs = magpylib.misc.Triangle(vertices=TRIANGLE, polarization=normal)
    corners = [tuple(corner) for corner in TRIANGLE.tolist()]
    points = TRIANGLE.mean(0) + scale * LENGTH * np.random.default_rng(2).normal(size=(100, 3))

    def values(function):
        return lambda p: np.array(
            [function(tuple(q), *corners, charge) for q in p.reshape(-1, 3)]
        ).reshape(*p.shape[:-1], -1)

    found = values(triangle.triangle_field)(points)
    expected = field_of(theirs, points)
    assert worst(found, expected) < 1e-10 * np.abs(expected).max()  # 1.4e-11
    potential = values(triangle.triangle_potential)
    slope = gradient(lambda p: potential(p)[..., 0], points, 1e-4 * scale * LENGTH)
    assert worst(-slope, found) < 2e-6 * np.abs(found).max()  # 7e-8


def test_triangles_have_finite_values_on_their_edges():
    corners = [tuple(corner) for corner in TRIANGLE.tolist()]
    for parts in ((1, 0, 0), (0, 0.5, 0.5), (0.2, 0.3, 0.5), (2, -1, 0), (-1, 0, 2)):
        point = tuple((np.array(parts) @ TRIANGLE).tolist())
        assert np.isfinite(triangle.triangle_field(point, *corners, 1.0)).all()
        assert math.isfinite(triangle.triangle_potential(point, *corners, 1.0))


def test_twelve_triangles_are_a_box():
    body = shape("box")
    points = points_of("near", body.extent, 30)
    field, potential = 0.0, 0.0
    for axis, sign in product(range(3), (1, -1)):
        normal = sign * np.eye(3)[axis]
        u, v = (np.eye(3)[(axis + k) % 3] * body.extent for k in (1, 2))
        center = normal * body.extent
        around = [center - u - v, center + u - v, center + u + v, center - u + v][::sign]
        for chosen in ((0, 1, 2), (0, 2, 3)):
            corners = [tuple(around[k].tolist()) for k in chosen]
            terms = [
                (
                    triangle.triangle_field(tuple(p), *corners, J @ normal),
                    triangle.triangle_potential(tuple(p), *corners, J @ normal),
                )
                for p in points
            ]
            field = field + np.array([term[0] for term in terms])
            potential = potential + np.array([term[1] for term in terms])
    assert worst(field, body.field(points)) < 1e-11  # 5.8e-13
    assert worst(potential, body.potential(points)) < 5e-12 * LENGTH  # 3.1e-13


@pytest.mark.slow
@pytest.mark.parametrize("name", SIZES)
def test_compiled_functions_have_the_values_of_python(name):
    body = shape(name)
    points = points_of("near", body.extent, 64)
    for kind in KINDS:
        function = njit(getattr(MODULES[name], f"{name}_{kind}").__wrapped__)
        found = [function(*point, *SIZES[name], *J) for point in points]
        assert worst(found, getattr(body, kind)(points)) < 5e-15  # 3.3e-16
