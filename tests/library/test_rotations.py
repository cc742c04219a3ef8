"""Rotations compared with SciPy, and their tangents with finite differences."""

from types import SimpleNamespace

import numpy as np
import pytest
from numba import njit
from scipy.spatial.transform import Rotation

from magmotor.numerics import rotations
from magmotor.numerics.deferred import Subroutine

r = SimpleNamespace(
    **{n: njit(f.__wrapped__) for n, f in vars(rotations).items() if isinstance(f, Subroutine)}
)
"""The functions, compiled for calls from Python."""

VECTORS = np.random.default_rng(3).normal(size=(5, 3)) * [[1e-9], [1e-3], [0.1], [0.3], [1.0]]
"""Rotation vectors, some of them short enough for the series."""

MAPS = {
    "exp": (r.exponential, r.exponential_momentum),
    "cay": (r.cayley, r.cayley_momentum),
}


def hat(W):
    return np.cross(np.eye(3), W)


def rotation(quaternion):
    return Rotation.from_quat(quaternion, scalar_first=True)


@pytest.mark.parametrize("W", VECTORS)
def test_maps_are_those_of_linear_algebra(W):
    one = np.eye(3)
    cay = np.linalg.solve(one - hat(W) / 2, one + hat(W) / 2)
    assert np.abs(rotation(r.cayley(tuple(W))).as_matrix() - cay).max() < 1e-15  # 3e-16
    exp = Rotation.from_rotvec(W).as_matrix()
    assert np.abs(rotation(r.exponential(tuple(W))).as_matrix() - exp).max() < 1e-15  # 2e-16


def test_vectors_are_rotated():
    q, a = r.exponential((0.3, -0.2, 0.5)), (1.0, -2.0, 0.7)
    assert np.abs(np.array(r.rot_vec_quat(q, a)) - rotation(q).apply(a)).max() < 1e-15  # 4e-16


@pytest.mark.parametrize("turn", [r.exponential, r.cayley])
def test_the_vector_zero_turns_nothing(turn):
    assert turn((0.0, 0.0, 0.0)) == (1.0, 0.0, 0.0, 0.0)


def test_products_columns_and_axes():
    rng = np.random.default_rng(4)
    p, q = (tuple(Rotation.random(rng=rng).as_quat(scalar_first=True)) for _ in range(2))
    both = (rotation(p) * rotation(q)).as_matrix()
    assert np.abs(np.array(r.columns(r.mul_quat(p, q))).T - both).max() < 1e-15  # 4e-16
    assert r.third_axis(p) == r.columns(p)[2]


def test_normalization_removes_rounding_errors():
    rng = np.random.default_rng(5)
    q = Rotation.random(rng=rng).as_quat(scalar_first=True)
    found = np.array(r.normalized(tuple((1 + 1e-7) * q)))
    assert np.abs(found - q).max() < 1e-13  # 1.2e-14


def test_what_is_no_rotation_becomes_nan():
    assert np.isnan(r.normalized((0.0, 0.0, 0.0, 0.0))).all()
    assert np.isnan(r.normalized((np.inf, 0.0, 0.0, 0.0))).all()
    assert np.isnan(r.normalized(r.cayley((1e200, 0.0, 0.0)))).all()


def test_stretching_is_a_matrix():
    rng = np.random.default_rng(6)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    a, outer = rng.normal(size=3), np.outer(axis, axis)
    expected = (2.0 * (np.eye(3) - outer) + 5.0 * outer) @ a
    found = r.stretched(tuple(a), tuple(axis), 2.0, 5.0)
    assert np.abs(found - expected).max() < 5e-15  # 2e-16


@pytest.mark.parametrize("name", MAPS)
@pytest.mark.parametrize("W", VECTORS)
def test_momenta_are_adjoints_of_inverse_tangents(name, W):
    """dtau_W V = d/de tau(W + e V) tau(W)^-1, column by column, by central differences."""
    tau, momentum = MAPS[name]
    e, pi = 1e-4, np.random.default_rng(7).normal(size=3)
    columns = []
    for V in np.eye(3):
        ends = [rotation(tau(tuple(W + s * e * V))) for s in (1, -1)]
        columns.append((ends[0] * ends[1].inv()).as_rotvec() / (2 * e))
    expected = np.linalg.solve(np.array(columns), pi)  # the transpose of dtau
    assert np.abs(np.array(momentum(tuple(W), tuple(pi))) - expected).max() < 5e-9  # 1e-9


@pytest.mark.parametrize("name", MAPS)
@pytest.mark.parametrize("W", VECTORS)
def test_a_step_back_from_its_end_has_the_momentum_of_a_step_on(name, W):
    """(dtau^-1_W)* pi = (dtau^-1_{-W})* tau(W) pi."""
    tau, momentum = MAPS[name]
    pi = np.random.default_rng(8).normal(size=3)
    turned = rotation(tau(tuple(W))).apply(pi)
    ahead = np.array(momentum(tuple(W), tuple(pi)))
    back = np.array(momentum(tuple(-W), tuple(turned)))
    assert np.abs(ahead - back).max() < 1e-14  # 4e-16


@pytest.mark.parametrize("angle", [0.1, 0.2499, 0.2501, 1.0])
def test_series_and_closed_form_meet(angle):
    """Compare with the closed form in extended precision."""
    W = angle * np.array([2.0, 1.0, 2.0]) / 3
    pi = np.array([1.0, -1.0, 0.5])
    half = np.longdouble(angle) / 2
    second = (1 - half / np.tan(half)) / (4 * half**2)
    first = np.cross(W, pi)
    expected = pi + first / 2 + float(second) * np.cross(W, first)
    found = np.array(r.exponential_momentum(tuple(W), tuple(pi)))
    assert np.abs(found - expected).max() < 1e-15  # 2e-16


def test_dipoles_are_placed():
    rng = np.random.default_rng(9)
    frame = np.vstack([rng.normal(size=(6, 4)), np.ones(4)])
    turn = Rotation.random(rng=rng)
    placed = np.zeros((7, 4))
    axes = r.columns(tuple(turn.as_quat(scalar_first=True)))
    r.place_dipoles(placed, axes, (1.0, 2.0, 3.0), frame)
    assert np.abs(placed[:3].T - [1, 2, 3] - turn.apply(frame[:3].T)).max() < 1e-14  # 4e-16
    assert np.abs(placed[3:6].T - turn.apply(frame[3:6].T)).max() < 6e-15  # 2.2e-16
