"""Dipoles compared with magpylib and finite differences, and conservation laws of a pair."""

import magpylib
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.constants import mu_0

import magmotor as mm

# magpylib uses the measured mu0, which is 1.3e-10 less than 4 pi 1e-7.
TO_MEASURED = mu_0 / (4e-7 * np.pi)


def configuration(seed, sources=8):
    """A random dipole and random sources, all at least 0.05 m away from it."""
    rng = np.random.default_rng(seed)
    positions = rng.normal(size=(sources, 3))
    position = rng.normal(size=3)
    away = positions - position
    positions = position + away * np.maximum(1, 0.05 / np.linalg.norm(away, axis=1))[:, np.newaxis]
    return position, 10 * rng.normal(size=3), positions, 10 * rng.normal(size=(sources, 3))


def relative(value, expected):
    return np.abs(value - expected).max() / np.abs(expected).max()


@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.integers(0, 10**6))
def test_field_agrees_with_magpylib(seed):
    _, _, positions, moments = configuration(seed)
    points = np.random.default_rng(seed + 1).normal(size=(5, 3))
    sources = magpylib.Collection(
        *(
            magpylib.misc.Dipole(moment=m, position=p)
            for p, m in zip(positions, moments, strict=True)
        )
    )
    expected = magpylib.getB(sources, points)
    value = TO_MEASURED * mm.dipoles.field(points, positions, moments)
    assert relative(value, expected) < 3e-14  # measured: 1e-15


@pytest.mark.parametrize("seed", range(40))
def test_wrench_agrees_with_magpylib(seed):
    position, moment, positions, moments = configuration(seed)
    position, positions = 3 * position, 3 * positions  # where magpylib's differences are best
    target = magpylib.misc.Dipole(moment=moment, position=position)
    sources = [
        magpylib.misc.Dipole(moment=m, position=p) for p, m in zip(positions, moments, strict=True)
    ]
    expected = np.asarray(magpylib.getFT(sources, target)).sum(axis=1)
    force, torque = mm.dipoles.wrench(position, moment, positions, moments)
    assert relative(TO_MEASURED * force, expected[0]) < 1e-9  # measured: 3.1e-10, magpylib's own
    assert relative(TO_MEASURED * torque, expected[1]) < 3e-14  # measured: 1.5e-15


@pytest.mark.parametrize("seed", range(20))
def test_force_and_torque_are_the_gradient_of_the_energy(seed):
    position, moment, positions, moments = configuration(seed)
    force, torque = mm.dipoles.wrench(position, moment, positions, moments)
    step = 1e-4

    def energy(place, direction):
        return mm.dipoles.energy(place, direction, positions, moments)

    def slope(function):
        """Central differences of fourth order."""
        near, far = (function(s * step) - function(-s * step) for s in (1, 2))
        return (8 * near - far) / (12 * step)

    numeric_force = [-slope(lambda s, e=e: energy(position + s * e, moment)) for e in np.eye(3)]

    def turned(axis, angle):
        return (
            moment * np.cos(angle)
            + np.cross(axis, moment) * np.sin(angle)
            + axis * (axis @ moment) * (1 - np.cos(angle))
        )

    numeric_torque = [-slope(lambda s, e=e: energy(position, turned(e, s))) for e in np.eye(3)]
    assert relative(np.array(numeric_force), force) < 1e-10  # measured: 4e-12
    assert relative(np.array(numeric_torque), torque) < 2e-10  # measured: 1e-11


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.integers(0, 10**6))
def test_a_pair_obeys_newtons_third_law_and_keeps_its_angular_momentum(seed):
    a, ma, positions, moments = configuration(seed, sources=1)
    b, mb = positions[0], moments[0]
    force_a, torque_a = mm.dipoles.wrench(a, ma, [b], [mb])
    force_b, torque_b = mm.dipoles.wrench(b, mb, [a], [ma])
    assert np.abs(force_a + force_b).max() <= 1e-14 * np.abs(force_a).max()  # 6e-16
    total = torque_a + torque_b + np.cross(a, force_a) + np.cross(b, force_b)
    scale = (
        np.abs(torque_a).max()
        + np.abs(np.cross(a - b, force_a)).max()
        + np.abs(np.cross(a, force_a)).max()
    )
    assert np.abs(total).max() <= 1e-14 * scale  # 3.4e-16


def test_arrays_of_dipoles_are_evaluated_one_by_one():
    _, _, positions, moments = configuration(3)
    places = np.random.default_rng(4).normal(size=(2, 5, 3))
    forces, torques = mm.dipoles.wrench(places, moments[0], positions, moments)
    energies = mm.dipoles.energy(places, moments[0], positions, moments)
    assert forces.shape == torques.shape == (2, 5, 3)
    assert energies.shape == (2, 5)
    single = mm.dipoles.wrench(places[1, 2], moments[0], positions, moments)
    np.testing.assert_array_equal(forces[1, 2], single[0])
    np.testing.assert_array_equal(torques[1, 2], single[1])


@pytest.mark.parametrize("along", np.eye(3))
def test_dipoles_closer_than_a_nanometer_coincide(along):
    positions = [[9.0, 9.0, 9.0], [0.0, 0.0, 0.0]]
    field = mm.dipoles.field(1.1e-9 * along, positions, np.eye(3)[:2])
    assert np.isfinite(field).all()
    with pytest.raises(mm.InputError):
        mm.dipoles.field(0.9e-9 * along, positions, np.eye(3)[:2])
