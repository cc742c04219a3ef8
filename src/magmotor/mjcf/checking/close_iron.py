"""Pieces of iron on different bodies that come nearer than their nodes resolve."""

from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.mjcf import declared
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.checking.strengths import Magnet
from magmotor.mjcf.declarations.iron import PLANE
from magmotor.mjcf.declarations.marks import FIELDS
from magmotor.mjcf.forces.iron_pieces import ellipsoid
from magmotor.mjcf.possible_contacts import are_excluded

WEAK = 1.0
"""Susceptibility below which pieces of iron that touch hardly magnetize each other."""

NEAR = 0.2
"""Gap of two pieces of iron, over the smaller radius, which the usual number of nodes resolves."""


class CloseIron(NamedTuple):
    """Two geoms of iron that come too near each other."""

    one: int
    other: int
    touch: bool
    """Whether joints surely let them touch; else, the bound of their gap is too small."""
    excluded: bool
    """Whether the model excludes their contact, perhaps since they never meet in its runs."""


def strong_iron(model: mujoco.MjModel, magnets: list[Magnet]) -> NDArray[np.bool_]:
    """Return which geoms are pieces of iron that magnetize each other, as something does them."""
    strong = np.zeros(model.ngeom, bool)
    if acting_forces(model) & FIELDS or any(magnet.strengths.any() for magnet in magnets):
        chosen = [geom for geom, value in declared.iron(model).items() if value >= WEAK]
        strong[chosen] = model.geom_type[chosen] != PLANE
    return strong


def close_iron(
    model: mujoco.MjModel,
    magnets: tuple[Magnet, Magnet],
    strong: NDArray[np.bool_],
    reached: Array,
    held: Array,
) -> CloseIron | None:
    """Return two pieces of iron of two magnets that come too near each other, if there are any.

    `reached` and `held` (n, m) are the distances from which joints, and contacts, keep the dipoles
    of the two magnets.
    """
    numbers = [np.flatnonzero(each.responses > 0) for each in magnets]
    geoms = [each.elements[own] - model.nsite for each, own in zip(magnets, numbers, strict=True)]
    chosen = [strong[own] for own in geoms]
    if not all(own.any() for own in chosen):
        return None
    grid = np.ix_(*(own[strong] for own, strong in zip(numbers, chosen, strict=True)))
    first, second = (own[strong] for own, strong in zip(geoms, chosen, strict=True))
    outer = np.add.outer(model.geom_rbound[first], model.geom_rbound[second])
    inner = np.add.outer(_thickness(model, first), _thickness(model, second))
    gaps = np.maximum(reached[grid] - outer, held[grid] - inner)
    gaps /= np.minimum.outer(model.geom_rbound[first], model.geom_rbound[second])
    owners = model.geom_bodyid[first], model.geom_bodyid[second]
    excluded = are_excluded(model, *owners)
    for out in (excluded, ~excluded):
        left = np.where(out, np.inf, gaps)
        i, j = np.unravel_index(left.argmin(), left.shape)
        if left[i, j] < NEAR:
            touch = bool(reached[grid][i, j] <= inner[i, j])
            return CloseIron(int(first[i]), int(second[j]), touch, bool(excluded[i, j]))
    return None


def _thickness(model: mujoco.MjModel, geoms: NDArray) -> Array:
    """Return how deep the centers of pieces of iron are below their own surfaces."""
    kinds, sizes = model.geom_type[geoms].tolist(), model.geom_size[geoms]
    return np.array([min(ellipsoid(*each)[:3]) for each in zip(kinds, *sizes.T, strict=True)])
