"""What pulls two magnets in the pose in which they touch.

Two magnets touch with those points of their surfaces that are nearest to one dipole of each, or
with the sides of their geoms, so that one dipole of each is on a common normal, and with the axes
of their geoms along each other. A plane of iron is touched by one magnet in the orientations that
its geoms allow; the images are as far below it as the dipoles are above it.
"""

import itertools
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.dipoles import COINCIDENCE
from magmotor.mjcf.checking.attraction import attraction, attraction_of_images, pull_of
from magmotor.mjcf.checking.contact_rule import SUNK, Approach
from magmotor.mjcf.checking.dipole_depth import Side
from magmotor.mjcf.checking.stand_off import Stand, frame_of
from magmotor.mjcf.checking.strengths import Magnet
from magmotor.mjcf.checking.true_pull import Duo

SURFACE = 0.02
"""Depth, over the distance at touch, at which a dipole counts as one at the surface."""

POSES = 200
"""Largest number of poses, of those whose two dipoles come nearest to each other."""


class Spacing(NamedTuple):
    """How near dipoles of two magnets come to each other, and to others of their own magnet."""

    apart: float
    """In m."""
    within: float
    """In m; 0 for dipoles that are alone."""


def closest_approach(
    sides: tuple[Side, Side],
    apart: Array,
    factor: Array,
    masses: tuple[float, float],
) -> Approach | None:
    """Return the closest approach of two magnets of dipoles; None if nothing attracts them.

    Parameters
    ----------
    sides : tuple of Side
    apart : ndarray, shape (n, m)
        Least distances of dipoles of one from those of the other; infinite for those that do not
        act or that nothing keeps apart.
    factor : ndarray, shape (n, m)
        How strongly they act on one another.
    masses : tuple of float
        The reduced mass that MuJoCo assumes, and that of the bodies alone, in kg.
    """
    one, other = (side.magnet for side in sides)
    depth = depth_of_nearest(sides, apart)
    weight = np.where(apart < np.inf, factor, 0)
    poses = np.stack(np.meshgrid(*(side.distinct for side in sides)), axis=-1).reshape(-1, 2)
    near = apart[tuple(side.dipole[k] for side, k in zip(sides, poses.T, strict=True))]
    poses = poses[np.argsort(near, kind="stable")[: min(POSES, (near < np.inf).sum())]]
    force = gradient = pull = 0.0
    coiled = any(magnet.coils - {-1} for magnet in (one, other))
    aligned = any(m.responses.any() or len(m.coils) > 1 for m in (one, other))
    for i, j in poses.tolist() if weight.any() else ():
        for aside, height, turn, mirrored in _poses(sides, i, j, aligned):
            found = attraction(one, other, np.hypot(height, abs(aside)), weight)
            force, gradient = max((force, gradient), found)
            if not aligned:
                (across, along), (tangent, normal) = sides[0].moments(i), sides[1].moments(j)
                tangent = turn * (tangent if mirrored else tangent.conj())
                moments = (across, along), (tangent, -normal)
                true, _ = pull_of(*moments, aside, np.maximum(height, COINCIDENCE), weight)
                pull = max(pull, abs(true) if coiled or mirrored else true)
    return approach_of(force, gradient, masses, depth, pull)


def approach_of(
    force: float, gradient: float, masses: tuple[float, float], depth: float, pull: float = 0.0
) -> Approach | None:
    """Return an approach with these numbers; None if nothing attracts or moves the magnets."""
    if not (0 < force < np.inf and 0 < gradient < np.inf and masses[0] < np.inf):
        return None  # as for a needle that only turns about its center
    return Approach(4 * force / gradient, force, *masses, depth, pull=pull or force)


def depth_of_nearest(sides: tuple[Side, Side], apart: Array) -> float:
    """Return the smaller depth of the dipoles that come nearest, unless it is at the surface."""
    nearest = np.unravel_index(apart.argmin(), apart.shape)
    depths = np.array([side.depth[n] for side, n in zip(sides, nearest, strict=True)])
    return float(depths[depths >= SURFACE * depths.sum()].min())


def closest_to_plane(
    magnet: Magnet,
    plane: Magnet,
    found: Stand,
    level: float,
    masses: tuple[float, float],
    duo: Duo | None,
) -> tuple[Approach | None, int]:
    """Return the closest approach of a magnet to a plane of iron, and its number in `found`.

    `level` is the height of what it touches above the plane; see `closest_approach` for the others.
    """
    depths = np.array([found.heights.min() - level, level])
    depth = float(depths[depths >= SURFACE * depths.sum()].min())
    if duo:
        forces, gradients = _true_pulls_of_plane(duo, magnet, plane, found, depth)
    else:
        forces, gradients = attraction_of_images(magnet, plane.images, found)
    k = int(forces.argmax())
    force, gradient = float(forces[k]), float(gradients[k])
    return approach_of(force, gradient, masses, depth), k


def pull_above_plane(
    magnet: Magnet, plane: Magnet, found: Stand | None, least: float, duo: Duo
) -> tuple[float, float]:
    """Return the force of true shapes whose dipoles are `least` or more above a plane of iron.

    Its gradient is the second number. `found` is how they would be on it.
    """
    if found is None:
        return 0.0, 0.0
    rise = np.maximum(least - found.heights.min(axis=1), 0.0)
    higher = found._replace(heights=found.heights + rise[:, np.newaxis])
    forces, gradients = _true_pulls_of_plane(duo, magnet, plane, higher, least)
    k = int(forces.argmax())
    return float(forces[k]), float(gradients[k])


def coarsest(sides: tuple[Side, Side], apart: Array) -> Spacing:
    """Return the coarsest spacing where two magnets touch; `apart` as for `closest_approach`.

    Above a plane, `apart` are heights.
    """
    held = (apart < np.inf).nonzero()
    within = [np.zeros(length) for length in apart.shape]
    for side, found, dipoles in zip(sides, within, held, strict=True):
        for i in np.unique(dipoles).tolist():
            found[i] = side.spacing(i)
    spacing = np.maximum.outer(*within)
    distance = apart * (2 if sides[1].magnet.images else 1)
    worst = np.unravel_index((spacing / distance).argmax(), distance.shape)
    return Spacing(float(distance[worst]), float(spacing[worst]))


def _poses(
    sides: tuple[Side, Side], i: int, j: int, aligned: bool
) -> Iterator[tuple[NDArray[np.complex128], Array, complex, bool]]:
    """Yield how far all dipoles are aside and above others, where planes i and j touch.

    One magnet is turned in quarters of a turn about the normal, and mirrored: what is yielded last.
    """
    one, other = sides
    first, second = one.aside(i)[:, np.newaxis], other.aside(j)
    height = one.along(i)[:, np.newaxis] + other.along(j)
    alone = aligned and not (abs(second).any() and abs(first).any())
    for mirrored, turn in itertools.product((False, True), (1, 1j, -1, -1j)):
        yield turn * (second if mirrored else second.conj()) - first, height, turn, mirrored
        if alone:
            return


def _true_pulls_of_plane(
    duo: Duo, magnet: Magnet, plane: Magnet, found: Stand, depth: float
) -> tuple[Array, Array]:
    """Return the forces and gradients of `attraction_of_images` for magnets by their geom."""
    pulls = np.zeros((2, len(found.directions)))
    first, point, step = magnet.positions[0], plane.positions[0], SUNK * max(depth, COINCIDENCE)
    for k, (direction, heights) in enumerate(zip(found.directions, found.heights, strict=True)):
        if heights.min() < COINCIDENCE:
            continue
        for n, gap in enumerate((0.0, step)):
            rotation = frame_of(-direction).T @ frame_of(duo.normal)
            place = first + (heights[0] + gap) * direction
            force = duo.force(rotation, place - rotation @ point)
            pulls[n, k] = np.nan_to_num(force @ direction)
    return pulls[0], (pulls[0] - pulls[1]) / step
