"""Faces that lie on each other: terms of one face, and forces of magnets that slide in contact.

The judges are quadrature of 1/r, finite differences, and magpylib's field on many charges.
"""

import mujoco
import numpy as np
import pytest
from energy_slopes import forces_by_energy
from scipy.spatial.transform import Rotation
from test_shaped_magnets import FLOOR, IRON, Shape, loaded, wrenches

from magmotor.numerics.shapes.faces import disk, rectangle

FACES = {"rectangle": (rectangle, (1.1, 0.7)), "disk": (disk, (1.2,))}


def around(function, point, step=1e-5):
    """Return the derivatives of a function of a point along x, y and z, one row each."""
    ends = ((point + step * e, point - step * e) for e in np.eye(3))
    return np.array([(np.array(function(a)) - function(b)) / (2 * step) for a, b in ends])


@pytest.mark.parametrize("name", FACES)
def test_terms_of_a_face_are_derivatives_of_one_another(name):
    """The derivatives of U contain V, and those of V contain the gradient of phi."""
    face, lengths = FACES[name]
    rng = np.random.default_rng(0)
    errors = []
    for _ in range(30):
        point = rng.uniform([-2, -2, 0.05], [2, 2, 1])
        phi, v, u = face(*point, *lengths)
        by = [
            around(lambda p, k=k: face(*p, *lengths)[k][: 2 if k else 1], point) for k in range(3)
        ]
        errors += [
            abs(by[0][:, 0] - phi[1:]).max(),
            abs(by[1] - [[v[2], v[3]], [v[3], v[4]], [phi[1], phi[2]]]).max(),
            abs(by[2] - [[u[2], u[3]], [u[3], u[4]], [-v[0], -v[1]]]).max(),
            abs(u[2] + u[4] - phi[0]),
            abs(v[2] + v[4] + phi[3]),
        ]
    assert max(errors) < 2e-7  # 1.1e-8, by the differences


@pytest.mark.parametrize("name", FACES)
def test_the_potential_of_a_face_is_the_integral_of_one_over_r(name):
    face, lengths = FACES[name]
    x, w = np.polynomial.legendre.leggauss(200)
    if name == "rectangle":
        u, v = np.meshgrid(lengths[0] * x, lengths[1] * x)
        area = np.outer(w, w) * np.prod(lengths)
    else:
        radius, angle = lengths[0] * np.sqrt((1 + x) / 2), 2 * np.pi * np.arange(400) / 400
        u, v = np.outer(radius, np.cos(angle)), np.outer(radius, np.sin(angle))
        area = np.outer(w / 2, np.full(400, 1 / 400)) * np.pi * lengths[0] ** 2
    for point in np.random.default_rng(1).uniform([-2, -2, 0.3], [2, 2, 1], (10, 3)):
        whole = (area / np.sqrt((u - point[0]) ** 2 + (v - point[1]) ** 2 + point[2] ** 2)).sum()
        assert face(*point, *lengths)[0][0] == pytest.approx(whole, rel=1e-12)  # 1e-14


def judged(one, other, count=40000):
    """Return the force and torque on `one`, from many equal charges on its ends.

    Quadrature of a high order would not see where the outline of the other magnet runs.
    """
    k = np.arange(count) + 0.5
    if one.kind == "box":
        # The R2 sequence of M. Roberts fills a square evenly, whatever the direction of a line.
        disk_x, disk_y = (
            one.size[axis] * (2 * (k * step % 1) - 1)
            for axis, step in enumerate((0.7548776662466927, 0.5698402909980532))
        )
        area = 4 * one.size[0] * one.size[1]
    else:
        radius, angle = one.size[0] * np.sqrt(k / count), k * np.pi * (3 - np.sqrt(5))
        disk_x, disk_y = radius * np.cos(angle), radius * np.sin(angle)
        area = np.pi * one.size[0] ** 2
    half = one.size[-1]
    force = torque = 0.0
    for sign in (1, -1):
        points = np.stack([disk_x, disk_y, np.full(count, sign * half)], axis=-1)
        points = one.rotation.apply(points) + one.position
        forces = sign * one.polarization[2] * area / count * other.source().getH(points)
        force, torque = (
            force + forces.sum(0),
            torque + np.cross(points - one.position, forces).sum(0),
        )
    return force, torque


def sliding_pair(kinds, rng, tilt, gap):
    """Return two magnets in contact: the first one lies on the other, beside its middle."""
    one, other = (
        Shape(
            kind,
            np.append(rng.uniform(4e-3, 6e-3, 2 if kind == "box" else 1), rng.uniform(1e-3, 4e-3)),
            [0, 0, rng.uniform(0.5, 1.4)],
        )
        for kind in kinds
    )
    one.rotation = Rotation.from_rotvec(rng.uniform(-1, 1, 3) * [0, 0, np.pi])
    if rng.random() < 0.5:
        one.rotation = Rotation.identity()
    turn = rng.uniform(0, 2 * np.pi)
    one.rotation = (
        Rotation.from_rotvec(tilt * np.array([np.cos(turn), np.sin(turn), 0])) * one.rotation
    )
    up = [0, 0, 1]
    one.position = np.append(rng.uniform(-6e-3, 6e-3, 2), one.extent(up) + other.extent(up) + gap)
    rotation, place = Rotation.random(rng=rng), rng.uniform(-0.1, 0.1, 3)
    for magnet in (one, other):
        magnet.position = rotation.apply(magnet.position) + place
        magnet.rotation = rotation * magnet.rotation
    return one, other


KINDS = [("box", "box"), ("cylinder", "cylinder"), ("box", "cylinder"), ("cylinder", "box")]


@pytest.mark.parametrize("tilt", [0.0, 1e-3, 0.03, 0.1])
@pytest.mark.parametrize("kinds", KINDS)
def test_faces_that_overlap_in_part(kinds, tilt):
    """Errors in parts of the true force, or of a twentieth of the greatest one.

    Charges at Gauss points alone have errors of up to 66 %.
    """
    rng = np.random.default_rng(6)
    errors, turns = [], []
    for _ in range(6):
        one, other = sliding_pair(kinds, rng, tilt, 2e-6)
        model, data = loaded(one.body(), other.body())
        found = wrenches(model, data)[0]
        force, torque = judged(one, other)
        pressure = one.polarization[2] * other.polarization[2] / (8e-7 * np.pi)
        scale = max(np.linalg.norm(force), 0.05 * pressure * 4 * 25e-6)
        errors.append(np.linalg.norm(found[:3] - force) / scale)
        turns.append(np.linalg.norm(found[3:] - torque) / (scale * 5e-3))
    assert max(errors) < 0.04  # 0.012, 0.012, 0.015, 0.025 for these tilts
    assert max(turns) < 0.1  # 0.035, 0.035, 0.037, 0.063


@pytest.mark.parametrize("tilt", [0.0, 0.03, 0.4])
@pytest.mark.parametrize("kinds", [*KINDS, ("mirror", "box"), ("mirror", "cylinder")])
def test_forces_between_faces_are_the_gradient_of_the_energy(kinds, tilt):
    rng = np.random.default_rng(8)
    for gap in (1e-4, 3e-4, -1e-5):
        if kinds[0] == "mirror":
            one = sliding_pair((kinds[1], "box"), rng, tilt, 0.0)[0]
            one.rotation = Rotation.from_rotvec([tilt, 0, 1])
            one.position = np.array([0.01, 0, one.extent([0, 0, 1]) + abs(gap)])
            custom = IRON.format(500, "floor")
            model, data = loaded(one.body(), act="magnets iron", custom=custom, more=FLOOR)
        else:
            model, data = loaded(*(magnet.body() for magnet in sliding_pair(kinds, rng, tilt, gap)))
        mujoco.mj_forward(model, data)
        forces, expected = data.qfrc_passive, forces_by_energy(model, data, 2e-8)
        largest = abs(forces[:3]).max()
        scale = np.tile(np.repeat([largest, 0.005 * largest], 3), model.nv // 6)
        assert (abs(forces - expected) / scale).max() < 5e-6  # 7e-7, by the differences
