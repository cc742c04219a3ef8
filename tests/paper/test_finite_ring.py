"""The top with finite magnets on its ring: in MuJoCo, and compared with magpylib."""

import math

import magpylib
import mujoco
import numpy as np

import magmotor as mm
from magmotor import dipoles
from magmotor.numerics.magnet_shapes import cuboid
from paper.top.finite_ring import build_finite_ring, finite_ring_sources

EDGES = (0.02, 0.02, 0.02)


def test_magnets_in_mujoco_are_those_of_the_ring():
    scene = mm.Top()
    cloud = cuboid((0.06, 0.015, 0.015))
    model = build_finite_ring(scene, cloud)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    on_ring = model.site_bodyid == model.body("ring").id
    positions, moments = finite_ring_sources(scene, cloud)
    assert np.abs(data.site_xpos[on_ring] - positions).max() < 5e-16  # 0, or rounding
    axes = data.site_xmat[on_ring].reshape(-1, 3, 3)[:, :, 2]
    sized = model.site_user[on_ring, :1] * axes
    assert np.abs(sized - moments).max() < 2e-15  # 1e-16


def test_a_tilted_ring_of_cubes_against_magpylib():
    scene = mm.Top()
    polarization = (4e-7 * math.pi * scene.moment / math.prod(EDGES), 0, 0)
    cube = magpylib.magnet.Cuboid(dimension=EDGES, polarization=polarization)
    plane = np.random.default_rng(5).uniform(-0.2, 0.2, (50, 2))
    points = np.insert(plane, 2, scene.ball_radius, axis=1)
    normal = np.array([math.sin(scene.tilt), 0.0, math.cos(scene.tilt)])
    field = np.zeros((50, 3))
    for position, moment in zip(*scene.ring_sources(), strict=True):
        outward = moment / scene.moment
        turn = np.stack([outward, np.cross(normal, outward), normal], axis=1)
        field += cube.getB((points - position) @ turn) @ turn.T
    found = dipoles.field(points, *finite_ring_sources(scene, cuboid(EDGES)))
    assert np.abs(found - field).max() < 6e-11 * np.abs(field).max()  # 3e-12
