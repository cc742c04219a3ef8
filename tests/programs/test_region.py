"""Regions of pictures contain the spheres for which they are made, and little more."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from magmotor.render.region import MARGIN, Region

WHOLE = Region(0, 0, 800, 720)


def camera(seed):
    """Return a camera somewhere, with a frustum that is not centered."""
    view = mujoco.MjvGLCamera()
    random = np.random.default_rng(seed)
    right, up, forward = Rotation.random(rng=random).as_matrix()
    view.pos, view.up, view.forward = random.normal(size=3), up, -forward
    view.frustum_near, view.frustum_far = 0.01, 10.0
    view.frustum_bottom, view.frustum_top, view.frustum_center = -0.004, 0.005, 0.001
    return view, right, up, -forward


@pytest.mark.parametrize("seed", range(20))
def test_a_region_contains_its_spheres_and_little_more(seed):
    view, right, up, forward = camera(seed)
    random = np.random.default_rng(seed)
    depth = random.uniform(1.0, 3.0, 3)
    aside = random.uniform(-0.2, 0.2, (2, 3)) * depth
    centers = np.array([view.pos], float) + np.outer(depth, forward).astype(float)
    centers += np.outer(aside[0], right) + np.outer(aside[1], up)
    radii = random.uniform(0.01, 0.1, 3)
    directions = random.normal(size=(20_000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    points = (centers[:, None] + radii[:, None, None] * directions).reshape(-1, 3)
    x, y, z = ((points - np.array(view.pos)) @ axis for axis in (right, up, forward))
    half = 0.009 * 800 / 720 / 2
    column = (0.01 * x / z - 0.001 + half) / (2 * half) * 800
    row = (0.01 * y / z + 0.004) / 0.009 * 720
    region = WHOLE.around(centers, radii, view)
    for seen, start, length, size in (
        (column, region.left, region.width, 800),
        (row, region.bottom, region.height, 720),
    ):
        low, high = np.clip([seen.min(), seen.max()], 0, size)
        assert start <= max(0, low - MARGIN) + 0.5
        assert start + length >= min(size, high + MARGIN) - 0.5
        assert low - start < 30  # pixels; measured: at most 15, of spheres as wide as 180
        assert start + length - high < 30


def test_a_region_is_the_whole_picture_or_nothing_at_the_ends():
    view, right, _, forward = camera(1)
    position = np.array([view.pos], float)
    ahead = position + np.outer([2.0], forward)
    radius = np.array([0.1])
    for center, size in (
        (position, radius),  # around the camera
        (2 * position - ahead, radius),  # behind it
        (ahead, np.zeros(1)),  # an infinite plane
    ):
        assert WHOLE.around(center, size, view) == WHOLE
    assert WHOLE.around(np.empty((0, 3)), np.empty(0), view)[2:] == (0, 0)
    beside = WHOLE.around(ahead + 5 * right, radius, view)
    assert beside.width * beside.height == 0


@pytest.mark.parametrize("width", [0.0, 0.004])
def test_a_narrowed_camera_sees_the_part(width):
    view, *_ = camera(2)
    view.frustum_width = width
    half = width or 0.009 * 800 / 720 / 2
    WHOLE.narrow(view, Region(100, 60, 200, 360))
    left = view.frustum_center - view.frustum_width
    assert left == pytest.approx(0.001 - half + 2 * half / 8, rel=1e-5)  # single precision
    assert view.frustum_width == pytest.approx(half / 4, rel=1e-5)
    assert view.frustum_bottom == pytest.approx(-0.004 + 0.009 / 12, rel=1e-5)
    assert view.frustum_top == pytest.approx(-0.004 + 0.009 * 7 / 12, rel=1e-5)


def test_rows_are_counted_from_above():
    picture = np.zeros((720, 800))
    picture[Region(100, 60, 200, 300).rows_and_columns(720)] = 1
    rows, columns = np.nonzero(picture)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (360, 659, 100, 299)
