"""Magnets as clouds of dipoles, compared with magpylib."""

import math
from functools import partial

import magpylib
import numpy as np
import pytest

from magmotor import dipoles
from magmotor.numerics.magnet_shapes import ball, cuboid, cylinder

MU0 = 4e-7 * math.pi
RNG = np.random.default_rng(5)


EDGES = {"cube": (0.02, 0.02, 0.02), "plate": (0.01, 0.04, 0.04), "bar": (0.06, 0.015, 0.015)}
LENGTH = 0.024


def magnet(shape, moment=10.0):
    """The same magnet by magpylib, its moment along x."""
    if shape == "cylinder":
        polarization = MU0 * moment / (math.pi / 4 * LENGTH**3)
        body = magpylib.magnet.Cylinder(
            dimension=(LENGTH, LENGTH), polarization=(0, 0, polarization)
        )
        return body.rotate_from_angax(90, "y")
    polarization = MU0 * moment / math.prod(EDGES[shape])
    return magpylib.magnet.Cuboid(dimension=EDGES[shape], polarization=(polarization, 0, 0))


def directions(count=100):
    points = RNG.normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


@pytest.mark.parametrize(
    ("shape", "bound"), [("cube", 3e-10), ("cylinder", 4e-9), ("plate", 3e-8), ("bar", 1e-6)]
)  # 1.5e-11, 2.2e-10, 1.6e-9, 7e-8
def test_shapes_against_magpylib(shape, bound):
    points = 0.2 * directions()
    true = magnet(shape).getB(points)
    cloud = cylinder(LENGTH, LENGTH / 2) if shape == "cylinder" else cuboid(EDGES[shape])
    found = dipoles.field(points, cloud[0], np.outer(cloud[1], [10.0, 0.0, 0.0]))
    assert np.abs(found - true).max() < bound * np.abs(true).max()
    dipole = dipoles.field(points, [[0.0, 0.0, 0.0]], [[10.0, 0.0, 0.0]])
    assert np.abs(dipole - true).max() > 1e-5 * np.abs(true).max()  # 2.2e-5 to 4e-2


def test_a_magnetized_ball_is_a_dipole():
    radius, points = 0.018, 0.05 * directions()
    moment = np.array([1.0, -2.0, 0.5])
    polarization = MU0 * moment / (4 / 3 * math.pi * radius**3)
    true = magpylib.magnet.Sphere(diameter=2 * radius, polarization=polarization).getB(points)
    dipole = dipoles.field(points, [[0.0, 0.0, 0.0]], [moment])
    assert np.abs(dipole - true).max() < 1e-14 * np.abs(true).max()  # 5e-16
    positions, parts = ball(radius)
    found = dipoles.field(points, positions, np.outer(parts, moment))
    assert np.abs(found - true).max() < 1e-5 * np.abs(true).max()  # 1.2e-6


def test_a_cylinder_of_the_right_length_has_no_second_order():
    points = 0.3 * directions()
    dipole = dipoles.field(points, [[0.0, 0.0, 0.0]], [[1.0, 0.0, 0.0]])

    def difference(radius):
        positions, parts = cylinder(math.sqrt(3) * radius, radius)
        field = dipoles.field(points, positions, np.outer(parts, [1.0, 0.0, 0.0]))
        return np.abs(field - dipole).max()

    order = math.log2(difference(0.02) / difference(0.01))
    assert order == pytest.approx(4.0, abs=0.05)  # 4.00


@pytest.mark.parametrize(
    ("fine", "coarse"),
    [
        (partial(cuboid, orders=(8, 8, 8)), partial(cuboid, orders=(2, 2, 1))),
        (partial(cuboid, orders=(8, 8, 8)), partial(cuboid, orders=(3, 2, 1))),
        (partial(cuboid, orders=(8, 8, 8)), partial(cuboid, orders=(4, 3, 2), even=True)),
        (partial(cuboid, orders=(8, 8, 8)), partial(cuboid, orders=(4, 3, 1), even=True)),
    ],
)
def test_a_single_point_or_even_ones_lose_no_second_order(fine, coarse):
    """The next error is of the fourth order, as for two points."""
    plate = fine((0.03, 0.02, 0.01)), coarse((0.03, 0.02, 0.01))
    assert order_of(*plate) == pytest.approx(4.0, abs=0.05)


@pytest.mark.parametrize(
    ("length", "radius", "inner", "orders", "even", "count"),
    [
        (0.01, 0.03, 0.0, (1, 1, 6), False, 6),
        (0.01, 0.03, 0.02, (1, 1, 6), False, 6),
        (0.08, 0.02, 0.01, (2, 1, 1), False, 2),
        (0.08, 0.02, 0.0, (3, 1, 1), True, 3),
        (0.01, 0.03, 0.0, (1, 4, 18), True, 37),
        (0.02, 0.03, 0.0, (2, 3, 9), True, 30),
        (0.02, 0.03, 0.02, (2, 2, 9), True, 36),
    ],
)
def test_one_disk_one_row_or_even_rings_lose_no_second_order(
    length, radius, inner, orders, even, count
):
    tube = (
        cylinder(length, radius, inner, (8, 4, 16)),
        cylinder(length, radius, inner, orders, even),
    )
    assert len(tube[1][0]) == count
    assert tube[1][1].sum() == pytest.approx(1, rel=1e-14, abs=0)
    assert order_of(*tube) > 3.9  # 4.0, and 5.6 where little is left of the fourth order


def order_of(fine, coarse):
    """Order in size over distance of the difference of two clouds' fields."""
    points, moment = 10 * directions(), [0.3, 1.0, 0.5]

    def difference(scale):
        fields = (
            dipoles.field(points, scale * places, np.outer(parts, moment))
            for places, parts in (fine, coarse)
        )
        return np.abs(np.subtract(*fields)).max()

    return math.log2(difference(20.0) / difference(10.0))
