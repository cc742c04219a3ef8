"""The force by which the dipoles of two magnets attract each other, and its gradient."""

import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.dipoles import COINCIDENCE, PERMEABILITY_OVER_4PI
from magmotor.mjcf.checking.stand_off import Stand, frame_of
from magmotor.mjcf.checking.strengths import Magnet


def attraction(one: Magnet, other: Magnet, distance: Array, factor: Array) -> tuple[float, float]:
    """Return the force of two magnets with aligned moments, in N, and its gradient, in N/m.

    Iron attracts the other side's dipoles as a plane of iron would that is as near, or as a dipole
    with its saturation moment, whichever is weaker. Above a plane, `distance` is that of dipoles
    from images, and `factor` has one column. Magnets by their geom attract as dipoles do, but with
    no more than two faces can that lie on each other.
    """
    partner = one if other.images else other
    distance = np.maximum(distance, nearest_of_dipoles(one.extents, partner.extents))
    if other.images:
        pull, slope = _pull_of_dipoles(one, other, distance, factor * (factor.T > 0))
        return pull, 2 * slope
    found = [_pull_of_dipoles(one, other, distance, factor)]
    found.append(_pull_of_iron(one, other, distance, factor))
    found.append(_pull_of_iron(other, one, distance.T, factor.T))
    return sum(pull for pull, _ in found), sum(slope for _, slope in found)


def nearest_of_dipoles(one: Array, other: Array) -> Array:
    """Return the distances (n, m) in m below which dipoles count as if they were as far apart.

    The arguments are the extents of `Magnet`, (n,) and (m,).
    """
    mean = np.where(np.multiply.outer(one, other) > 0, np.add.outer(one, other) / 2, 0.0)
    return np.maximum(mean, COINCIDENCE)


def _pull_of_dipoles(
    one: Magnet, other: Magnet, distance: Array, weight: Array
) -> tuple[float, float]:
    """Return the force of aligned dipoles, and of iron on other iron or on a plane."""
    k, moments, images = PERMEABILITY_OVER_4PI, [], other.images or 1.0
    partner = one if other.images else other
    for magnet, source, away in ((one, partner, distance), (partner, one, distance.T)):
        if not magnet.responses.any():
            moments.append((magnet.strengths, np.zeros(len(magnet.strengths), bool)))
            continue
        strong = magnet.strengths > 0
        within = np.linalg.norm(magnet.positions[:, None] - magnet.positions[strong], axis=2)
        within[within == 0] = np.inf
        near = (images * source.strengths / away**3).sum(axis=1)
        near += (magnet.strengths[strong] / within**3).sum(axis=1)
        induced = 2 * k * magnet.responses * near
        free = (induced < magnet.saturations) & (magnet.responses > 0)
        moments.append((magnet.strengths + np.minimum(induced, magnet.saturations), free))
    (first, soft), (second, yielding) = moments
    if not other.images:  # that between dipoles and iron is computed otherwise
        weight = weight * (np.not_equal.outer(one.responses > 0, other.responses == 0))
    pull = 6 * k * weight * np.multiply.outer(first, second) / distance**4
    power = 4 + 3 * np.logical_or.outer(soft, yielding)  # of 1/d
    return float(pull.sum()), float((power * pull / distance).sum())


def _pull_of_iron(
    magnet: Magnet, iron: Magnet, distance: Array, factor: Array
) -> tuple[float, float]:
    """Return the force of the piece of iron that attracts dipoles most, and its gradient."""
    best = 0.0, 0.0
    for j in np.flatnonzero(iron.responses):
        own = (magnet.strengths > 0) & (distance[:, j] < np.inf) & (factor[:, j] > 0)
        moments, places = magnet.strengths[own], magnet.positions[own]
        least = np.maximum(magnet.extents[own] / 2, COINCIDENCE)
        height = np.maximum(distance[own, j] - iron.depths[j], least)
        square = np.sum((places[:, np.newaxis] - places) ** 2, axis=2)
        aside = np.maximum(square - np.subtract.outer(height, height) ** 2, 0.0)
        apart = np.sqrt(np.add.outer(height, height) ** 2 + aside)
        pull = 6 * PERMEABILITY_OVER_4PI * np.multiply.outer(moments, moments) / apart**4
        found = float(pull.sum()), float(8 * (pull / apart).sum())
        away = distance[own, j]
        weak = 6 * PERMEABILITY_OVER_4PI * moments * min(iron.saturations[j], 1e30) / away**4
        best = max(best, min(found, (float(weak.sum()), float(4 * (weak / away).sum()))))
    return best


def attraction_of_images(magnet: Magnet, images: float, found: Stand) -> tuple[Array, Array]:
    """Return the force in N, and its gradient in N/m, of a magnet on a plane of iron, each (k,).

    They are those of the model, in each of the orientations, if the magnet has no iron, and all its
    moments change alike; otherwise, all pairs of moments count as aligned.
    """
    moments = magnet.strengths[:, np.newaxis] * magnet.axes
    aligned = bool(magnet.responses.any()) or len(magnet.coils) > 1
    forces, gradients = np.zeros((2, len(found.directions)))
    for k, (direction, height) in enumerate(zip(found.directions, found.heights, strict=True)):
        apart = height[:, np.newaxis] + height
        if (apart < COINCIDENCE).any():
            continue
        _, *sides = frame_of(direction)
        place, across = (vectors @ sides[0] + 1j * (vectors @ sides[1])
                         for vectors in (magnet.positions, moments))  # fmt: skip
        aside, along = place - place[:, np.newaxis], -moments @ direction
        if aligned:
            weight, plane = np.full((len(apart), 1), images), magnet._replace(images=images)
            forces[k], gradients[k] = attraction(magnet, plane, np.hypot(apart, abs(aside)), weight)
        else:
            forces[k], slope = pull_of((-across, along), (across, along), aside, apart, images)
            gradients[k] = 2 * slope
    return forces, gradients


def pull_of(
    one: tuple[NDArray[np.complex128], Array],
    other: tuple[NDArray[np.complex128], Array],
    aside: NDArray[np.complex128],
    height: Array,
    weight: Array | float,
) -> tuple[float, float]:
    """Return the force in N by which moments attract others above them, and its gradient in N/m.

    Moments are their parts across and along the vertical axis, (n,) and (m,); the others are so far
    `aside` and above, (n, m).
    """
    (across, along), (tangent, normal) = (one[0][:, np.newaxis], one[1][:, np.newaxis]), other
    square = 1 / (height**2 + aside.real**2 + aside.imag**2)
    fifth = square**2 * np.sqrt(square)
    a = (across.conj() * aside).real + along * height
    b = (tangent.conj() * aside).real + normal * height
    both = along * normal
    c = (across.conj() * tangent).real + both
    v = a * normal + b * along + c * height
    pull = fifth * (5 * a * b * height * square - v)
    slope = 2 * both + c - 5 * square * ((2 * v - c * height) * height + a * b)
    slope = fifth * (slope + 35 * a * b * (height * square) ** 2)
    scale = 3 * PERMEABILITY_OVER_4PI * weight
    return float((scale * pull).sum()), float((scale * slope).sum())
