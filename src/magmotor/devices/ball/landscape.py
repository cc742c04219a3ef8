"""The effective potential V_e = -m |B| on the plane: its surface, its valley, its critical points.

V_e is the energy of a ball whose axis is aligned with the field; the paper writes it
-kappa_2 B.B, which is this with kappa_2 = 1/|B|. The motor's inner ring is held level.
"""

import math
from functools import lru_cache
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import minimum_filter
from scipy.optimize import root

from magmotor import dipoles
from magmotor.common.arguments import checked
from magmotor.common.checks import reject
from magmotor.common.hints import shaped
from magmotor.devices.ball.scene import BallScene

Array = NDArray[np.float64]
Sources = tuple[Array, Array]
"""Positions (m) and moments (A m^2) of dipoles, each of shape (N, 3)."""

Points = Annotated[ArrayLike, shaped(..., 2)]

REACH = 1.5
"""How far from the center critical points are sought, in ring radii."""

SECTIONS = 128
"""Into so many parts a search cuts an interval: together they cost hardly more than one point."""

SMALLEST = 1e-15
"""Distance from the center, in ring radii, that is none."""

MOST_DIPOLES = 500
"""Of rings whose critical points are looked for, which takes seconds."""

FINENESS = (1, 1), (1, 8), (2, 8), (4, 8)
"""Of the grid in which critical points are sought, and of each cell in which there may be one."""

MANY = 4
"""Critical points a dipole; a level ring has two. A valley that is flat to rounding is all of them,
and no grid is fine enough for it."""


class CriticalPoint(NamedTuple):
    """A point of the plane where V_e is stationary."""

    kind: str
    """minimum, saddle or maximum"""
    position: tuple[float, float]
    """On the plane, in meters."""
    energy: float
    """V_e there, in joule."""


@checked
def effective_potential(scene: BallScene, points: Points, time: float = 0.0) -> Array:
    """V_e = -m |B| at the height of the ball's center.

    Parameters
    ----------
    points : array_like, shape (..., 2)
        In meters on the plane.
    time : float
        Of a scripted ring, in seconds.

    Returns
    -------
    ndarray, shape (...)
        In joule.
    """
    return aligned_energy(scene, points, scene.ring_sources(time))


@checked
def critical_points(scene: BallScene, time: float = 0.0) -> list[CriticalPoint]:
    """All critical points of V_e within 1.5 ring radii, deepest first.

    Newton's method starts at the center and in every cell of a polar grid, of 160 sectors or
    eight to a dipole, in which both components of the gradient change sign. Cells and grid are
    made finer until minima and maxima less saddles are as many as the gradient turns round on the
    circle of 1.5 ring radii (Poincare and Hopf). Then none is missed, unless in pairs; this is so
    for rings that clear the ball and whose valley is not level to rounding.

    Parameters
    ----------
    scene : Top or Motor
    time : float
        Of a scripted ring, in seconds.

    Returns
    -------
    list of CriticalPoint

    Raises
    ------
    ValueError
        The rings have more than 500 dipoles: the grid would grow with their square.
    """
    sources = scene.ring_sources(time)
    if len(sources[0]) > MOST_DIPOLES:
        raise reject("dipoles of the rings", len(sources[0]), f"must be at most {MOST_DIPOLES}")
    turns = _turns(scene, sources)
    found: list[CriticalPoint] = []
    for fineness, parts in FINENESS:
        found = _converged(scene, _candidates(scene, sources, fineness, parts), sources)
        index = sum(-1 if point.kind == "saddle" else 1 for point in found)
        if index == turns or len(found) > MANY * len(sources[0]):
            break
    return sorted(found, key=lambda point: point.energy)


@checked
def minimum(scene: BallScene, time: float = 0.0) -> CriticalPoint:
    """The deepest minimum of V_e on the plane.

    Newton's method starts at the center and at the deepest lows of a polar grid.

    Parameters
    ----------
    scene : Top or Motor
    time : float
        Of a scripted ring, in seconds.

    Returns
    -------
    CriticalPoint

    Raises
    ------
    ValueError
        V_e has no minimum within 1.5 ring radii, as under a tilted ring that is very high.
    """
    sources = scene.ring_sources(time)
    starts = [np.zeros(2), *_lows(scene, sources)]
    points = [_stationary(scene, start, sources) for start in starts]
    found = [point for point in points if point is not None]
    if not found:
        _, height = scene.near_ring(time)
        sentence = f"must be such that V_e has a minimum within {REACH:g} ring radii of the center"
        raise reject("height of the ring", height, sentence)
    return _classify(scene, min(found, key=lambda p: aligned_energy(scene, p, sources)), sources)


@checked
def saddle(scene: BallScene, time: float = 0.0) -> CriticalPoint:
    """The highest saddle of V_e: what a ball passes that goes all the way round the valley.

    Parameters
    ----------
    scene : Top or Motor
    time : float
        Of a scripted ring, in seconds.

    Returns
    -------
    CriticalPoint

    Raises
    ------
    ValueError
        V_e has no saddle: the ring is so high that it has a single minimum.
    """
    saddles = [p for p in critical_points(scene, time) if p.kind == "saddle"]
    if not saddles:
        raise ValueError(f"ring_height = {scene.near_ring(time)[1]}: V_e has no saddle so high up")
    return saddles[-1]


@checked
@lru_cache
def valley_radius(scene: BallScene, azimuth: float = 0.0, time: float = 0.0) -> float:
    """Distance from the center, in meters, at which V_e is least in one direction (radians).

    For a level ring this is the radius of the ring of minima. The slope changes its sign between it
    and the next larger number, the same on any machine.
    """
    direction = np.array([math.cos(azimuth), math.sin(azimuth)])
    sources, unit = scene.ring_sources(time), _radius(scene)
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
    """Where V_e is least in these directions (radians), shape (A,) -> (A, 2), in m."""
    around = np.asarray(azimuths, dtype=float)
    radius = np.array([valley_radius(scene, azimuth) for azimuth in around.tolist()])
    return radius[:, np.newaxis] * np.stack([np.cos(around), np.sin(around)], axis=1)


def aligned_energy(scene: BallScene, points: ArrayLike, sources: Sources) -> Array:
    """Energy -m |B| of a ball whose axis points along the field of these dipoles, in J.

    The ball touches the plane at `points`, shape (..., 2), in m.
    """
    field = dipoles.field(on_plane(scene, points), *sources)
    return -scene.moment * np.linalg.norm(field, axis=-1)


def aligned_force(scene: BallScene, points: ArrayLike) -> tuple[Array, Array]:
    """Magnetic force on a ball whose axis points along the field, and its axis.

    Parameters
    ----------
    points : array_like, shape (..., 2)
        Where the ball touches the plane, in m.

    Returns
    -------
    force, axis : ndarray, shape (..., 3)
        In N; the axis is a unit vector.
    """
    force, field = _aligned(scene, points, scene.ring_sources())
    return force, field / np.linalg.norm(field, axis=-1, keepdims=True)


def _radius(scene: BallScene) -> float:
    return scene.near_ring()[0]


def on_plane(scene: BallScene, points: ArrayLike) -> Array:
    """Centers of a ball that touches the plane there, shape (..., 2) -> (..., 3), in m."""
    points = np.asarray(points, dtype=float)
    height = np.full((*points.shape[:-1], 1), scene.ball_radius)
    return np.concatenate([points, height], axis=-1)


def _gradient(scene: BallScene, points: Array, sources: Sources) -> Array:
    """Gradient of V_e, minus the force on the aligned dipole; shapes (..., 2) -> (..., 2)."""
    return -_aligned(scene, points, sources)[0][..., :2]


def _aligned(scene: BallScene, points: ArrayLike, sources: Sources) -> tuple[Array, Array]:
    """Force on the aligned dipole, and the field."""
    centers = on_plane(scene, points)
    field = dipoles.field(centers, *sources)
    moment = scene.moment * field / np.linalg.norm(field, axis=-1, keepdims=True)
    return dipoles.force_and_field(centers, moment, *sources)[0], field


def _azimuths(sources: Sources, fineness: int) -> Array:
    """Once round, both ends; the offset keeps dipoles and mirror lines off the grid."""
    sectors = fineness * max(160, 8 * len(sources[0]))
    return 0.1 + 2 * math.pi * np.arange(sectors + 1) / sectors


def _polar(radius: Array, azimuth: Array) -> Array:
    return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth)], axis=-1)


def _candidates(scene: BallScene, sources: Sources, fineness: int, parts: int) -> list[Array]:
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
    """Cells in which both components change sign, shape (..., n, m, 2) -> (..., n - 1, m - 1)."""
    up = gradient > 0
    ends = slice(None, -1), slice(1, None)
    corners: Any = np.stack([up[..., i, j, :] for i in ends for j in ends])
    return (corners.any(axis=0) & ~corners.all(axis=0)).all(axis=-1)


def _turns(scene: BallScene, sources: Sources) -> int:
    """How often the gradient turns round on the circle that bounds the search."""
    circle = _polar(np.array(REACH * _radius(scene)), _azimuths(sources, 10))
    x, y = _gradient(scene, circle, sources).T
    return round(float(np.diff(np.unwrap(np.arctan2(y, x))[[0, -1]])[0]) / (2 * math.pi))


def _converged(scene: BallScene, starts: list[Array], sources: Sources) -> list[CriticalPoint]:
    """What Newton's method finds from these starts, each point once."""
    found: list[CriticalPoint] = []
    near = 1e-5 * _radius(scene)
    for start in starts:
        point = _stationary(scene, start, sources)
        if point is not None and all(math.dist(point, p.position) > near for p in found):
            found.append(_classify(scene, point, sources))
    return found


def _lows(scene: BallScene, sources: Sources) -> Array:
    """The ten deepest points of a polar grid that are no higher than those around them."""
    radii = _radius(scene) * np.linspace(0.01, REACH, 100)
    radius, azimuth = np.meshgrid(radii, _azimuths(sources, 1)[:-1], indexing="ij")
    points = _polar(radius, azimuth)
    energy = aligned_energy(scene, points, sources)
    around = minimum_filter(np.pad(energy, ((0, 0), (1, 1)), mode="wrap"), 3)[:, 1:-1]
    low = (energy == around)[1:-1]
    return points[1:-1][low][np.argsort(energy[1:-1][low])[:10]]


def _stationary(scene: BallScene, start: Array, sources: Sources):
    far = 1e6 * _radius(scene)  # beyond which it looks for nothing

    def gradient(point: Array) -> Array:
        return _gradient(scene, np.clip(point, -far, far), sources)

    solution = root(gradient, start, tol=1e-12)
    if np.hypot(*solution.x) > REACH * _radius(scene):
        return None
    scale = scene.coupling / _radius(scene) ** 4
    small = np.linalg.norm(_gradient(scene, solution.x, sources)) < 1e-8 * scale
    return solution.x if small else None


def _classify(scene: BallScene, point: Array, sources: Sources) -> CriticalPoint:
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
