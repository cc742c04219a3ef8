"""The effective potential V_e = -m |B| on the plane: values, valley, and critical points.

V_e is the energy of a ball whose axis is aligned with the field; on a tilted floor, that of its
weight is added. The paper writes -kappa_2 B.B, which is the same with kappa_2 = 1/|B|. The motor's
inner ring is assumed to be level.

If the center of mass is a distance a along the axis and b across it, V_e is the least energy over
all attitudes. With the weight W, it is minus the greatest value of xi.(m B + a W) + n.(b W) over
unit vectors xi and n at right angles: the sum of the singular values of [m B + a W, b W].
"""

import math
from functools import lru_cache
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.checks import check_array
from magmotor.common.exceptions import ArgumentError, InputError
from magmotor.common.hints import shaped
from magmotor.devices.ball.scene import BallScene, gravitational_energy
from magmotor.dipoles import NOBODY, Packed, field_of, force_of, pack_sources

Points = Annotated[ArrayLike, shaped(..., 2)]

REACH = 1.5
"""Radius of the search for critical points, in ring radii."""

SECTIONS = 128
"""A search divides an interval into this many parts, at little more than the cost of one."""

SMALLEST = 1e-15
"""Distance from the center, in ring radii, that counts as zero."""

MOST_DIPOLES = 500
"""Largest number of dipoles in a search for critical points, which then takes seconds."""

FINENESS = (1, 1), (1, 8), (2, 8), (4, 8)
"""Refinement of the grid, and of each cell that may have a critical point, in each attempt."""

MANY = 4
"""Critical points per dipole beyond which refinement stops; a level ring has two per dipole.

If the valley is flat to rounding, all its points are critical, and no grid is fine enough.
"""


class CriticalPoint(NamedTuple):
    """A point of the plane where V_e is stationary."""

    kind: str
    """minimum, saddle or maximum"""
    position: tuple[float, float]
    """Position on the plane, in meters."""
    energy: float
    """V_e at this point, in joules."""


@checked
def effective_potential(scene: BallScene, points: Points, time: float = 0.0) -> Array:
    """Return V_e = -m |B| at the height of the ball's center.

    Parameters
    ----------
    points : array_like, shape (..., 2)
        Points on the plane, in meters.
    time : float
        Time in the script of the ring, in seconds.

    Returns
    -------
    ndarray, shape (...)
        V_e in joules.
    """
    return aligned_energy(scene, points, packed_sources(scene, time))


@checked
def critical_points(scene: BallScene, time: float = 0.0) -> list[CriticalPoint]:
    """Return all critical points of V_e within 1.5 ring radii, deepest first.

    Newton's method starts at the center and in every cell of a polar grid in which both components
    of the gradient change sign; the grid has 160 sectors or eight per dipole. Cells and grid are
    refined until the number of minima and maxima minus that of saddles equals the winding number of
    the gradient on the circle of 1.5 ring radii (Poincare and Hopf). Critical points can then only
    be missed in pairs. This succeeds for rings that clear the ball, unless the valley is level to
    rounding.

    Parameters
    ----------
    scene : Top or Motor
    time : float
        Time in the script of the ring, in seconds.

    Returns
    -------
    list of CriticalPoint

    Raises
    ------
    ValueError
        The rings have more than 500 dipoles; the effort grows with the square of their number.
    """
    sources = packed_sources(scene, time)
    if _count(sources) > MOST_DIPOLES:
        raise ArgumentError(
            "dipoles of the rings", _count(sources), f"must be at most {MOST_DIPOLES}"
        )
    winding = _winding_number(scene, sources)
    found: list[CriticalPoint] = []
    for fineness, parts in FINENESS:
        found = _converged(scene, _candidates(scene, sources, fineness, parts), sources)
        index = sum(-1 if point.kind == "saddle" else 1 for point in found)
        if index == winding or len(found) > MANY * _count(sources):
            break
    return sorted(found, key=lambda point: point.energy)


@checked
def minimum(scene: BallScene, time: float = 0.0) -> CriticalPoint:
    """Return the deepest minimum of V_e on the plane.

    Newton's method starts at the center and at the lowest points of a polar grid.

    Parameters
    ----------
    scene : Top or Motor
    time : float
        Time in the script of the ring, in seconds.

    Returns
    -------
    CriticalPoint

    Raises
    ------
    ValueError
        V_e has no minimum within 1.5 ring radii, for example under a very high tilted ring, or on a
        steep floor.
    """
    sources = packed_sources(scene, time)
    starts = [np.zeros(2), *_lows(scene, sources)]
    points = [_stationary(scene, start, sources) for start in starts]
    found = [point for point in points if point is not None]
    if not found:
        sentence = f"V_e has no minimum within {REACH:g} ring radii of the center"
        if any(scene.floor_tilt):
            raise ArgumentError("floor_tilt", scene.floor_tilt, f"must be less steep: {sentence}")
        height = scene.near_ring(time)[1]
        raise ArgumentError("height of the ring", height, f"must be smaller: {sentence}")
    return _classify(scene, min(found, key=lambda p: aligned_energy(scene, p, sources)), sources)


@checked
def saddle(scene: BallScene, time: float = 0.0) -> CriticalPoint:
    """Return the highest saddle of V_e, the barrier on the way around the valley.

    Parameters
    ----------
    scene : Top or Motor
    time : float
        Time in the script of the ring, in seconds.

    Returns
    -------
    CriticalPoint

    Raises
    ------
    ValueError
        V_e has no saddle, because a very high ring leaves a single minimum.
    """
    saddles = [p for p in critical_points(scene, time) if p.kind == "saddle"]
    if not saddles:
        raise InputError(
            f"ring_height = {scene.near_ring(time)[1]}: V_e has no saddle under such a high ring"
        )
    return saddles[-1]


@checked
@lru_cache
def valley_radius(scene: BallScene, azimuth: float = 0.0, time: float = 0.0) -> float:
    """Return the distance from the center, in m, of the minimum of V_e in one direction (radians).

    For a level ring, this is the radius of the circle of minima. The slope changes sign between the
    result and the next larger number, so that it is the same on any machine.
    """
    direction = np.array([math.cos(azimuth), math.sin(azimuth)])
    sources, unit = packed_sources(scene, time), _radius(scene)
    radii = unit * np.linspace(0.0, REACH, 301)
    lowest = int(aligned_energy(scene, radii[:, np.newaxis] * direction, sources).argmin())
    low, high = float(radii[max(0, lowest - 1)]), float(radii[min(300, lowest + 1)])
    while low < 0.5 * (low + high) < high and high > SMALLEST * unit:
        between = np.linspace(low, high, SECTIONS + 1)[1:-1]
        slopes = _gradient(scene, between[:, np.newaxis] * direction, sources)
        rising = np.append(np.sum(slopes * direction, axis=1) > 0, True)
        first = int(rising.argmax())
        ends = np.array([low, *between, high])
        low, high = float(ends[first]), float(ends[first + 1])
    return low


def valley(scene: BallScene, azimuths: ArrayLike) -> Array:
    """Return the minima of V_e in these directions (radians), shapes (A,) -> (A, 2), in m."""
    around = np.asarray(azimuths, dtype=float)
    radius = np.array([valley_radius(scene, azimuth) for azimuth in around.tolist()])
    return radius[:, np.newaxis] * np.stack([np.cos(around), np.sin(around)], axis=1)


def aligned_energy(scene: BallScene, points: ArrayLike, sources: Packed) -> Array:
    """Return the energy -m |B| of a ball whose axis is along the field of these dipoles, in J.

    The ball touches the plane at `points`, shape (..., 2), in m.
    """
    centers = on_plane(scene, points)
    field = total_field(scene, centers, sources)
    return gravitational_energy(scene, centers) - _alignment(scene, field)


def aligned_force(scene: BallScene, points: ArrayLike) -> tuple[Array, Array]:
    """Return the force on a ball whose axis is along the field, and this axis.

    The force is that of magnetism and, on a tilted floor, of the weight along it.

    Parameters
    ----------
    points : array_like, shape (..., 2)
        Contact points on the plane, in m.

    Returns
    -------
    force, axis : ndarray, shape (..., 3)
        Force in N; the axis is a unit vector.
    """
    points = check_array("points", points, ..., 2)
    force, field = _aligned(scene, points, packed_sources(scene))
    return force, attitude(scene, field)[..., 0]


def attitude(scene: BallScene, field: Array) -> Array:
    """Return the axis at rest in a field, and the direction in which the center of mass is off it.

    Parameters
    ----------
    field : ndarray, shape (..., 3)
        In T.

    Returns
    -------
    ndarray, shape (..., 3, 1) or (..., 3, 2)
        Columns of unit length; there is no second one if the center of mass is on the axis.
    """
    if not any(scene.mass_offsets):
        return (field / np.linalg.norm(field, axis=-1, keepdims=True))[..., np.newaxis]
    left, _, right = np.linalg.svd(_pulls(scene, field), full_matrices=False)
    return left @ right


def _pulls(scene: BallScene, field: Array) -> Array:
    """Return the vectors m B + a W and b W as columns, (..., 3, 2), in J."""
    across, along = scene.mass_offsets
    weight = scene.ball_mass * np.array(scene.gravity_vector)
    pulls = scene.moment * field + along * weight
    return np.stack([pulls, np.broadcast_to(across * weight, pulls.shape)], axis=-1)


def _alignment(scene: BallScene, field: Array) -> Array:
    """Return the energy (...) in J that a ball at rest has less than one without torques."""
    if not any(scene.mass_offsets):
        return scene.moment * np.linalg.norm(field, axis=-1)
    return np.linalg.svd(_pulls(scene, field), compute_uv=False).sum(axis=-1)


def total_field(scene: BallScene, centers: Array, sources: Packed) -> Array:
    """Return the field (..., 3) of dipoles and of the background at points (..., 3), in T."""
    return field_of(centers, sources) + scene.background_field


@lru_cache(maxsize=8)
def packed_sources(scene: BallScene, time: float = 0.0) -> Packed:
    """Return the dipoles of the scene's rings at a time (s), which nobody may change."""
    return pack_sources(*scene.ring_sources(time))


def _count(sources: Packed) -> int:
    """Return the number of dipoles, without those that fill the last group of eight."""
    return int((sources[6] != NOBODY).sum())


def _radius(scene: BallScene) -> float:
    return scene.near_ring()[0]


def on_plane(scene: BallScene, points: ArrayLike) -> Array:
    """Return the ball's centers for contact points, shapes (..., 2) -> (..., 3), in m."""
    points = np.asarray(points, dtype=float)
    height = np.full((*points.shape[:-1], 1), scene.ball_radius)
    return np.concatenate([points, height], axis=-1)


def _gradient(scene: BallScene, points: Array, sources: Packed) -> Array:
    """Return the gradient of V_e, minus the force on the aligned dipole; (..., 2) -> (..., 2)."""
    return -_aligned(scene, points, sources)[0][..., :2]


def _aligned(scene: BallScene, points: ArrayLike, sources: Packed) -> tuple[Array, Array]:
    """Return the force on the aligned dipole, and the field."""
    centers = on_plane(scene, points)
    field = total_field(scene, centers, sources)
    moment = scene.moment * field / np.linalg.norm(field, axis=-1, keepdims=True)
    if any(scene.mass_offsets):
        moment = scene.moment * attitude(scene, field)[..., 0]
    return force_of(centers, moment, sources) + scene.downhill_force, field


def _azimuths(sources: Packed, fineness: int) -> Array:
    """Return azimuths around the circle, offset from dipoles and mirror lines; both ends."""
    sectors = fineness * max(160, 8 * _count(sources))
    return 0.1 + 2 * math.pi * np.arange(sectors + 1) / sectors


def _polar(radius: Array, azimuth: Array) -> Array:
    return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth)], axis=-1)


def _candidates(scene: BallScene, sources: Packed, fineness: int, parts: int) -> list[Array]:
    radii = _radius(scene) * np.linspace(0.01, REACH, 150 * fineness)
    around = _azimuths(sources, fineness)
    radius, azimuth = np.meshgrid(radii, around, indexing="ij")
    cells = _changes(_gradient(scene, _polar(radius, azimuth), sources))
    part = np.arange(parts + 1) / parts
    along, across = np.meshgrid(part, part, indexing="ij")
    inner = radius[:-1, :-1][cells][:, None, None] + along * (radii[1] - radii[0])
    turned = azimuth[:-1, :-1][cells][:, None, None] + across * (around[1] - around[0])
    points = _polar(inner, turned)
    return [np.zeros(2), *points[:, :-1, :-1][_changes(_gradient(scene, points, sources))]]


def _changes(gradient: Array) -> NDArray[np.bool_]:
    """Return the cells in which both components change sign: (n, m, 2) -> (n - 1, m - 1)."""
    up = gradient > 0
    ends = slice(None, -1), slice(1, None)
    corners: Any = np.stack([up[..., i, j, :] for i in ends for j in ends])
    return (corners.any(axis=0) & ~corners.all(axis=0)).all(axis=-1)


def _winding_number(scene: BallScene, sources: Packed) -> int:
    """Return the winding number of the gradient on the circle that bounds the search."""
    circle = _polar(np.array(REACH * _radius(scene)), _azimuths(sources, 10))
    x, y = _gradient(scene, circle, sources).T
    return round(float(np.diff(np.unwrap(np.arctan2(y, x))[[0, -1]])[0]) / (2 * math.pi))


def _converged(scene: BallScene, starts: list[Array], sources: Packed) -> list[CriticalPoint]:
    """Return the critical points that Newton's method finds from these starts, each once."""
    found: list[CriticalPoint] = []
    near = 1e-5 * _radius(scene)
    for start in starts:
        point = _stationary(scene, start, sources)
        if point is not None and all(math.dist(point, p.position) > near for p in found):
            found.append(_classify(scene, point, sources))
    return found


def _lows(scene: BallScene, sources: Packed) -> Array:
    """Return the ten deepest local minima on a polar grid."""
    from scipy.ndimage import minimum_filter

    radii = _radius(scene) * np.linspace(0.01, REACH, 100)
    radius, azimuth = np.meshgrid(radii, _azimuths(sources, 1)[:-1], indexing="ij")
    points = _polar(radius, azimuth)
    energy = aligned_energy(scene, points, sources)
    around = minimum_filter(np.pad(energy, ((0, 0), (1, 1)), mode="wrap"), 3)[:, 1:-1]
    low = (energy == around)[1:-1]
    return points[1:-1][low][np.argsort(energy[1:-1][low])[:10]]


def _stationary(scene: BallScene, start: Array, sources: Packed):
    from scipy.optimize import root

    far = 1e6 * _radius(scene)  # the search stays within

    def gradient(point: Array) -> Array:
        return _gradient(scene, np.clip(point, -far, far), sources)

    solution = root(gradient, start, tol=1e-12)
    if np.hypot(*solution.x) > REACH * _radius(scene):
        return None
    scale = scene.coupling / _radius(scene) ** 4
    small = np.linalg.norm(_gradient(scene, solution.x, sources)) < 1e-8 * scale
    return solution.x if small else None


def _classify(scene: BallScene, point: Array, sources: Packed) -> CriticalPoint:
    step = 1e-4 * _radius(scene)
    rows = [
        _gradient(scene, point + step * unit, sources)
        - _gradient(scene, point - step * unit, sources)
        for unit in np.eye(2)
    ]
    negative = int(np.sum(np.linalg.eigvalsh(np.array(rows) / (2 * step)) < 0))
    energy = float(aligned_energy(scene, point, sources))
    return CriticalPoint(
        ("minimum", "saddle", "maximum")[negative], (float(point[0]), float(point[1])), energy
    )
