"""Arrows of moments and fields: where they are, what they show, and that they are drawn so."""

from typing import Any, cast

import mujoco
import numpy as np
import pytest
from refusals import refused

import magmotor as mm

MAGNETS = """
<mujoco>
  <statistic extent="2" center="0 0 0"/>
  <visual><global orthographic="true" fovy="3"/></visual>
  <worldbody>
    <site pos="-0.5 0.4 0" zaxis="1 0 0" user="8"/>
    <site pos="0.5 -0.6 0.1" zaxis="1 2 2" user="-1"/>
    <site pos="0 0 -6e6" user="1e21"/>
    <body pos="0 0 0.3" euler="20 0 50"><freejoint/>
      <geom size="0.01"/><site pos="0.1 0 0" euler="70 10 0" user="0.027"/><site/></body>
  </worldbody>
</mujoco>
"""
POINTS = np.random.default_rng(1).uniform(-1, 1, (4, 5, 3))
BLUE, GREEN, ORANGE = (0x00, 0x72, 0xB2), (0x00, 0x9E, 0x73), (0xE6, 0x9F, 0x00)


@pytest.fixture
def magnets():
    model = mujoco.MjModel.from_xml_string(MAGNETS)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def arrows(view):
    """Return tails, heads and colors of the arrows of a view, as MuJoCo draws them."""
    geoms = [view.geoms[i] for i in range(view.ngeom)]
    assert all(geom.type == mujoco.mjtGeom.mjGEOM_ARROW for geom in geoms)
    tails = np.array([geom.pos for geom in geoms])
    spans = np.array([geom.mat[:, 2] * geom.size[2] / 2 for geom in geoms])
    return tails, tails + spans, np.array([geom.rgba for geom in geoms])


def test_moments_point_along_the_sites_and_are_as_long_as_magnets(magnets):
    model, data = magnets
    view = mujoco.MjvScene(model, 10)
    mm.draw_moments(view, model, data)
    tails, heads, _ = arrows(view)
    sites, lengths = [0, 1, 3], 0.3 * np.array([1, 1 / 2, 0.3 / 2])  # cube roots of the moments
    axes = data.site_xmat.reshape(-1, 3, 3)[sites, :, 2] * [[1], [-1], [1]]
    assert abs((tails + heads) / 2 - data.site_xpos[sites]).max() < 5e-7  # 2e-8: single precision
    assert abs(heads - tails - lengths[:, None] * axes).max() < 5e-7  # 2e-8
    mm.draw_moments(view, model, data, length=3)  # after those that are there
    tails, heads, _ = arrows(view)
    assert view.ngeom == 6
    assert abs(np.linalg.norm(heads - tails, axis=1).max() - 3) < 1e-6  # 0


def test_an_arrow_is_longer_than_the_magnet_that_would_hide_it():
    """Unless that would make it longer than a quarter of the model."""
    for apart, length in ((0.06, 3 * 0.005), (0.03, (0.03 + 2 * 0.005) / 4)):
        model = mujoco.MjModel.from_xml_string(f"""
            <mujoco><custom><text name="magmotor" data="dipoles"/></custom><worldbody>
            <body><freejoint/><geom size="0.005"/><site user="1"/></body>
            <body pos="0 0 {apart}"><freejoint/><geom size="0.005"/><site user="1"/></body>
            </worldbody></mujoco>""")
        data, view = mujoco.MjData(model), mujoco.MjvScene(model, 2)
        mujoco.mj_forward(model, data)
        mm.draw_moments(view, model, data)
        tails, heads, _ = arrows(view)
        found = np.linalg.norm(heads - tails, axis=1)
        np.testing.assert_allclose(found, length, rtol=3e-7)  # 2e-8: single precision


def test_the_field_has_its_directions_and_colors(magnets):
    model, data = magnets
    view = mujoco.MjvScene(model, 20)
    limits = 1e-7, 1e-5
    mm.draw_field(view, model, data, POINTS, limits=limits)
    tails, heads, colors = arrows(view)
    points, vectors = POINTS.reshape(-1, 3), mm.field(model, data, POINTS).reshape(-1, 3)
    strengths = np.linalg.norm(vectors, axis=1)
    assert abs((tails + heads) / 2 - points).max() < 1e-6  # 7e-8
    expected = 0.1 * vectors / strengths[:, None]
    assert abs(heads - tails - expected).max() < 5e-7  # 3e-8
    level = np.interp(np.log10(strengths), (-7, -5), (-1, 1))[:, None]
    ends = np.where(level < 0, BLUE, ORANGE)
    mixed = (abs(level) * ends + (1 - abs(level)) * np.array(GREEN)) / 255
    assert abs(colors[:, :3] - mixed).max() < 5e-7  # 3e-8
    assert level.min() < 0 < level.max() == 1  # all of the scale


def test_by_default_the_colors_span_nine_tenths_of_the_points(magnets):
    model, data = magnets
    strengths = np.linalg.norm(mm.field(model, data, POINTS), axis=-1)
    found = []
    for limits in (None, np.quantile(strengths, (0.05, 0.95))):
        view = mujoco.MjvScene(model, 20)
        mm.draw_field(view, model, data, POINTS, limits=limits, length=0.7)
        tails, heads, colors = arrows(view)
        assert abs(np.linalg.norm(heads - tails, axis=1) - 0.7).max() < 1e-6  # 6e-8
        found.append(colors)
    np.testing.assert_array_equal(*found)
    order = np.argsort(strengths, axis=None)
    assert abs(found[0][order[[0, -1]], :3] - np.array((BLUE, ORANGE)) / 255).max() < 5e-7  # 2e-8


def test_a_model_without_dipoles_has_no_arrows():
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    data = mujoco.MjData(model)
    view = mujoco.MjvScene(model, 0)
    mm.draw_moments(view, model, data)
    mm.draw_field(view, model, data, POINTS)
    assert view.ngeom == 0


def test_a_point_at_a_dipole_has_no_arrow(magnets):
    model, data = magnets
    view = mujoco.MjvScene(model, 10)
    mm.draw_field(view, model, data, [*data.site_xpos, [0.5, 0.5, 0.5]])
    tails, heads, _ = arrows(view)
    middles = (tails + heads) / 2
    assert abs(middles - [data.site_xpos[4], [0.5] * 3]).max() < 5e-7  # 4e-8: not a dipole; no site


def test_what_cannot_be_drawn_adds_nothing(magnets):
    model, data = magnets
    view = mujoco.MjvScene(model, 21)
    mm.draw_moments(view, model, data)
    with refused("view.maxgeom"):
        mm.draw_field(view, model, data, POINTS)
    with refused("limits"):
        mm.draw_field(view, model, data, POINTS[0], limits=(1e-3, 1e-3))
    with refused("limits[0]"):
        mm.draw_field(view, model, data, POINTS[0], limits=(0, 1))
    with refused("view"):
        mm.draw_moments(cast(Any, model), model, data)
    assert view.ngeom == 3


def test_a_picture_shows_the_arrows_where_they_are(opengl, magnets):
    """From above, 100 pixels per meter, with the origin in the middle."""
    model, data = magnets
    camera = mujoco.MjvCamera()
    mujoco.mjv_defaultFreeCamera(model, camera)
    camera.azimuth, camera.elevation = 90, -90
    with mujoco.Renderer(model, 300, 300) as renderer:
        renderer.update_scene(data, camera)
        before = renderer.render().astype(int)
        mm.draw_moments(renderer.scene, model, data, length=1)
        after = renderer.render().astype(int)
    rows, columns = np.nonzero(abs(after - before).max(axis=-1) > 20)
    x, y = (columns + 0.5 - 150) / 100, (150 - rows - 0.5) / 100
    first = y > 0.2
    ends = x[first].min(), x[first].max(), y[first].min(), y[first].max()
    wide = 1.75 / 15  # half the width of the head
    assert ends == pytest.approx((-1, 0, 0.4 - wide, 0.4 + wide), abs=0.02)  # 0.005, of pixels 0.01
    assert x[y == y.max()].min() > -0.4  # -0.325: the head is at the end
    axis = np.array([-1, -2]) / 3  # of the second, which is half as long
    for end in (-axis / 4, axis / 4):
        assert np.hypot(x - 0.5 - end[0], y + 0.6 - end[1]).min() < 0.03  # 0.002, 0.012
