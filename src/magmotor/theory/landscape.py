"""The effective potential V_e = -m |B| on the plane: its surface, its valley, its critical points.

V_e is the energy of a ball whose axis is aligned with the field; the paper writes it
-kappa_2 B.B, which is this with kappa_2 = 1/|B|. The motor's inner ring is held level.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import minimum_filter
from scipy.optimize import minimize_scalar, root

from magmotor import dipoles
from magmotor.scenes import Motor, Top

Scene = Top | Motor
Array = NDArray[np.float64]
Sources = tuple[Array, Array]
"""Positions (m) and moments (A m^2) of dipoles, each of shape (N, 3)."""

REACH = 1.5
"""How far from the centre critical points are sought, in ring radii."""


class CriticalPoint(NamedTuple):
    """A point of the plane where V_e is stationary."""

    kind: str
    """minimum, saddle or maximum"""
    position: tuple[float, float]
    energy: float


def effective_potential(scene: Scene, points: ArrayLike, time: float = 0.0) -> Array:
    """V_e = -m |B| at the height of the ball's centre.

    Parameters
    ----------
    points : array_like, shape (..., 2)
        In metres on the plane.
    time : float
        Of a scripted ring, in seconds.

    Returns
    -------
    ndarray, shape (...)
        In joule.
    """
    return _potential(scene, points, scene.ring_sources(time))


def critical_points(scene: Scene, time: float = 0.0) -> list[CriticalPoint]:
    """All critical points of V_e within 1.5 ring radii, deepest first.

    Newton's method starts at the centre and in every cell of a polar grid, of 160 sectors or
    eight to a dipole, in which both components of the gradient change sign.
    """
    found: list[CriticalPoint] = []
    sources = scene.ring_sources(time)
    for start in _candidates(scene, sources):
        point = _stationary(scene, start, sources)
        near = 1e-5 * _radius(scene)
        if point is not None and all(math.dist(point, p.position) > near for p in found):
            found.append(_classify(scene, point, sources))
    return sorted(found, key=lambda point: point.energy)


def minimum(scene: Scene, time: float = 0.0) -> CriticalPoint:
    """The deepest minimum of V_e on the plane.

    Newton's method starts at the centre and at the deepest lows of a polar grid.
    """
    sources = scene.ring_sources(time)
    starts = [np.zeros(2), *_lows(scene, sources)]
    points = [_stationary(scene, start, sources) for start in starts]
    found = [point for point in points if point is not None]
    return _classify(scene, min(found, key=lambda p: _potential(scene, p, sources)), sources)


def saddle(scene: Top, time: float = 0.0) -> CriticalPoint:
    """The highest saddle of V_e: what a ball passes that goes all the way round the valley.

    Raises
    ------
    ValueError
        V_e has no saddle: the ring is so high that it has a single minimum.
    """
    saddles = [p for p in critical_points(scene, time) if p.kind == "saddle"]
    if not saddles:
        raise ValueError(f"ring_height = {scene.ring_pose(time)[0]}: V_e has no saddle so high up")
    return saddles[-1]


@lru_cache
def valley_radius(scene: Scene, azimuth: float = 0.0, time: float = 0.0) -> float:
    """Distance from the centre, in metres, at which V_e is least in one direction (radians).

    For a level ring this is the radius of the ring of minima.
    """
    direction = np.array([math.cos(azimuth), math.sin(azimuth)])
    sources = scene.ring_sources(time)
    result = minimize_scalar(
        lambda radius: float(_potential(scene, radius * direction, sources)),
        bounds=(0.0, 1.5 * _radius(scene)),
        method="bounded",
        options={"xatol": 1e-10 * _radius(scene)},
    )
    return float(result.x)


def _radius(scene: Scene) -> float:
    return scene.inner_radius if isinstance(scene, Motor) else scene.ring_radius


def _lifted(scene: Scene, points: ArrayLike) -> Array:
    points = np.asarray(points, dtype=float)
    height = np.full((*points.shape[:-1], 1), scene.ball_radius)
    return np.concatenate([points, height], axis=-1)


def _potential(scene: Scene, points: ArrayLike, sources: Sources) -> Array:
    field = dipoles.field(_lifted(scene, points), *sources)
    return -scene.moment * np.linalg.norm(field, axis=-1)


def _gradient(scene: Scene, points: Array, sources: Sources) -> Array:
    """Gradient of V_e, minus the force on the aligned dipole; shapes (..., 2) -> (..., 2)."""
    lifted = _lifted(scene, points)
    field = dipoles.field(lifted, *sources)
    aligned = scene.moment * field / np.linalg.norm(field, axis=-1, keepdims=True)
    return -dipoles.force_and_field(lifted, aligned, *sources)[0][..., :2]


def _grid(scene: Scene, sources: Sources, radii: int) -> Array:
    """Points of a polar grid, shape (radii, sectors + 1, 2): the last sector is the first."""
    sectors = max(160, 8 * len(sources[0]))
    around = 2 * math.pi * np.arange(sectors + 1) / sectors
    azimuth, radius = np.meshgrid(around + 0.1, _radius(scene) * np.linspace(0.01, REACH, radii))
    return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth)], axis=-1)


def _candidates(scene: Scene, sources: Sources) -> list[Array]:
    points = _grid(scene, sources, 150)
    positive = _gradient(scene, points, sources) > 0
    corners = np.stack([positive[1:, 1:], positive[1:, :-1], positive[:-1, 1:], positive[:-1, :-1]])
    changes = (corners.any(axis=0) & ~corners.all(axis=0)).all(axis=-1)
    return [np.zeros(2), *points[:-1, :-1][changes]]


def _lows(scene: Scene, sources: Sources) -> Array:
    """The ten deepest points of a grid that are no higher than those around them."""
    points = _grid(scene, sources, 100)[:, :-1]
    energy = _potential(scene, points, sources)
    around = minimum_filter(np.pad(energy, ((0, 0), (1, 1)), mode="wrap"), 3)[:, 1:-1]
    low = (energy == around)[1:-1]
    return points[1:-1][low][np.argsort(energy[1:-1][low])[:10]]


def _stationary(scene: Scene, start: Array, sources: Sources):
    solution = root(lambda point: _gradient(scene, point, sources), start, tol=1e-12)
    if np.hypot(*solution.x) > REACH * _radius(scene):
        return None
    scale = scene.coupling / _radius(scene) ** 4
    small = np.linalg.norm(_gradient(scene, solution.x, sources)) < 1e-8 * scale
    return solution.x if small else None


def _classify(scene: Scene, point: Array, sources: Sources) -> CriticalPoint:
    step = 1e-4 * _radius(scene)
    rows = [
        _gradient(scene, point + step * unit, sources)
        - _gradient(scene, point - step * unit, sources)
        for unit in np.eye(2)
    ]
    negative = int(np.sum(np.linalg.eigvalsh(np.array(rows) / (2 * step)) < 0))
    energy = float(_potential(scene, point, sources))
    return CriticalPoint(
        ("minimum", "saddle", "maximum")[negative], (float(point[0]), float(point[1])), energy
    )
