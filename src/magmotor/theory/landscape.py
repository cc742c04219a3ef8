"""The effective potential V_e = -m |B| on the plane: its surface, its valley, its critical points.

V_e is the energy of a ball whose axis is aligned with the field; the paper writes it
-kappa_2 B.B, which is this with kappa_2 = 1/|B|. The motor's inner ring is held level.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize_scalar, root

from magmotor import dipoles
from magmotor.scenes import Motor, Top

Scene = Top | Motor

REACH = 1.5
"""How far from the centre critical points are sought, in ring radii."""


class CriticalPoint(NamedTuple):
    """A point of the plane where V_e is stationary."""

    kind: str
    """minimum, saddle or maximum"""
    position: tuple[float, float]
    energy: float


def effective_potential(scene: Scene, points: ArrayLike, time: float = 0.0) -> NDArray[np.float64]:
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
    field = dipoles.field(_lifted(scene, points), *scene.ring_sources(time))
    return -scene.moment * np.linalg.norm(field, axis=-1)


def critical_points(scene: Scene, time: float = 0.0) -> list[CriticalPoint]:
    """All critical points of V_e within 1.5 ring radii, deepest first.

    Newton's method starts at the centre and in every cell of a polar grid, of 160 sectors or
    eight to a dipole, in which both components of the gradient change sign.
    """
    found: list[CriticalPoint] = []
    for start in _candidates(scene, time):
        point = _stationary(scene, start, time)
        near = 1e-5 * _radius(scene)
        if point is not None and all(math.dist(point, p.position) > near for p in found):
            found.append(_classify(scene, point, time))
    return sorted(found, key=lambda point: point.energy)


def minimum(scene: Scene, time: float = 0.0) -> CriticalPoint:
    """The deepest minimum of V_e on the plane: the deepest of its critical points."""
    return critical_points(scene, time)[0]


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


def valley_radius(scene: Scene, azimuth: float = 0.0, time: float = 0.0) -> float:
    """Distance from the centre, in metres, at which V_e is least in one direction (radians).

    For a level ring this is the radius of the ring of minima.
    """
    direction = np.array([math.cos(azimuth), math.sin(azimuth)])
    result = minimize_scalar(
        lambda radius: float(effective_potential(scene, radius * direction, time)),
        bounds=(0.0, 1.5 * _radius(scene)),
        method="bounded",
        options={"xatol": 1e-10 * _radius(scene)},
    )
    return float(result.x)


def _radius(scene: Scene) -> float:
    return scene.inner_radius if isinstance(scene, Motor) else scene.ring_radius


def _lifted(scene: Scene, points: ArrayLike) -> NDArray[np.float64]:
    points = np.asarray(points, dtype=float)
    height = np.full((*points.shape[:-1], 1), scene.ball_radius)
    return np.concatenate([points, height], axis=-1)


def _gradient(scene: Scene, points: NDArray[np.float64], time: float) -> NDArray[np.float64]:
    """Gradient of V_e, minus the force on the aligned dipole; shapes (..., 2) -> (..., 2)."""
    sources = scene.ring_sources(time)
    lifted = _lifted(scene, points)
    field = dipoles.field(lifted, *sources)
    aligned = scene.moment * field / np.linalg.norm(field, axis=-1, keepdims=True)
    return -dipoles.wrench(lifted, aligned, *sources)[0][..., :2]


def _candidates(scene: Scene, time: float) -> list[NDArray[np.float64]]:
    sectors = max(160, 8 * len(scene.ring_sources()[0]))
    around = 2 * math.pi * np.arange(sectors + 1) / sectors
    azimuth, radius = np.meshgrid(around + 0.1, _radius(scene) * np.linspace(0.01, REACH, 150))
    points = np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth)], axis=-1)
    positive = _gradient(scene, points, time) > 0
    corners = np.stack([positive[1:, 1:], positive[1:, :-1], positive[:-1, 1:], positive[:-1, :-1]])
    changes = (corners.any(axis=0) & ~corners.all(axis=0)).all(axis=-1)
    return [np.zeros(2), *points[:-1, :-1][changes]]


def _stationary(scene: Scene, start: NDArray[np.float64], time: float):
    solution = root(lambda point: _gradient(scene, point, time), start, tol=1e-12)
    if np.hypot(*solution.x) > REACH * _radius(scene):
        return None
    scale = scene.coupling / _radius(scene) ** 4
    small = np.linalg.norm(_gradient(scene, solution.x, time)) < 1e-8 * scale
    return solution.x if small else None


def _classify(scene: Scene, point: NDArray[np.float64], time: float) -> CriticalPoint:
    step = 1e-4 * _radius(scene)
    rows = [
        (_gradient(scene, point + step * unit, time) - _gradient(scene, point - step * unit, time))
        for unit in np.eye(2)
    ]
    negative = int(np.sum(np.linalg.eigvalsh(np.array(rows) / (2 * step)) < 0))
    energy = float(effective_potential(scene, point, time))
    return CriticalPoint(
        ("minimum", "saddle", "maximum")[negative], (float(point[0]), float(point[1])), energy
    )
