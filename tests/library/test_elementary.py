"""The arctangent, compared with the C library's."""

import math
from itertools import product
from typing import Any

import numpy as np
from numba import njit

from magmotor.numerics import elementary

arctangent: Any = njit(elementary.arctangent.__wrapped__)


def test_arctangents_are_accurate_in_all_quadrants():
    rng = np.random.default_rng(1)
    x, y = rng.normal(size=(2, 10000)) * 10.0 ** rng.uniform(-150, 150, (1, 10000))
    y *= 10.0 ** rng.uniform(-5, 5, 10000)
    found = np.array([arctangent(*point) for point in zip(y, x, strict=True)])
    expected = np.array([math.atan2(*point) for point in zip(y, x, strict=True)])
    assert np.abs(found / expected - 1).max() < 1e-15  # 2.2e-16


def test_arctangents_on_the_axes_and_the_diagonals():
    for y, x in product([0.0, -0.0, 1.0, -1.0], [0.0, 1.0, -1.0]):
        found, expected = arctangent(y, x), math.atan2(y, x)
        assert abs(found - expected) < 1e-15  # 0
        assert math.copysign(1.0, found) == math.copysign(1.0, expected)


def test_python_uses_the_c_library():
    assert elementary.arctangent(1.0, -2.0) == math.atan2(1.0, -2.0)
    assert elementary.logarithm(3.0) == math.log(3.0)
    assert elementary.cosine(0.125) == math.cos(math.pi / 4)
