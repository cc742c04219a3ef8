"""How near the magnets of a model can come to each other, and what pulls them there.

A magnet is a rigid body with dipoles. Two magnets touch with those points of their surfaces that
are nearest to one dipole of each. In this pose the distance of any two of their dipoles is at least
that of their depths below the common tangent plane, and of their distances from its normal.
"""

from collections.abc import Iterator
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.dipoles import COINCIDENCE, PERMEABILITY_OVER_4PI
from magmotor.mjcf.checking.contact_rule import Approach
from magmotor.mjcf.checking.depth import NEVER, depth_and_normal
from magmotor.mjcf.checking.reach import Reach, common_ancestor, reach
from magmotor.mjcf.checking.strengths import Magnet, magnets_of
from magmotor.mjcf.declared import tuples
from magmotor.mjcf.field_and_energy import coupling_factors
from magmotor.mjcf.langevin.contacts import colliding_geoms
from magmotor.mjcf.lookup import disabled

SURFACE = 0.02
"""Depth, over the distance at touch, at which a dipole counts as one at the surface."""


class Meeting(NamedTuple):
    """Two magnets that can come near each other, and what keeps their dipoles apart."""

    magnets: tuple[Magnet, Magnet]
    number: int
    """Number of pairs like this one."""
    touching: NDArray[np.int64]
    """Rows of two geoms that may touch, and their contact pair or -1."""
    like: NDArray[np.int64]
    """The same of all pairs like this one."""
    approach: Approach | None
    """None if the contact keeps no dipoles apart that act on each other."""
    exposed: bool
    """Whether dipoles can coincide."""


def meetings(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[Meeting]:
    """Yield the pairs of magnets that can come near each other, like ones together."""
    magnets = magnets_of(model, data)
    if len(magnets) < 2:
        return
    number_of = np.full(model.nbody, -1)
    number_of[[magnet.body for magnet in magnets]] = np.arange(len(magnets))
    geoms, weld_of = _touching(model), model.body_weldid[model.geom_bodyid]
    pairs = np.sort(number_of[weld_of[geoms[:, :2]]], axis=1)
    geoms, pairs = geoms[pairs[:, 0] >= 0], pairs[pairs[:, 0] >= 0]
    touching = np.zeros((len(magnets), len(magnets)), int)
    np.add.at(touching, (pairs[:, 0], pairs[:, 1]), 1)
    groups = np.full_like(touching, -1)
    for k, members in enumerate(_groups(model, data, magnets, touching)):
        groups[members[:, 0], members[:, 1]] = k
        one, other = (magnets[i] for i in members[0])
        like = geoms[groups[pairs[:, 0], pairs[:, 1]] == k]
        own = like[(np.sort(weld_of[like[:, :2]], axis=1) == [one.body, other.body]).all(axis=1)]
        approach, exposed = _approach(model, data, one, other, own)
        if approach or exposed:
            yield Meeting((one, other), len(members), own, like, approach, exposed)


def _touching(model: mujoco.MjModel) -> NDArray[np.int64]:
    """Return rows of two geoms that may touch and their contact pair, or -1."""
    if disabled(model, "contact"):
        return np.empty((0, 3), int)
    given = np.column_stack([model.pair_geom1, model.pair_geom2, np.arange(model.npair)])
    others = colliding_geoms(model)
    count = model.ngeom + 1
    keys = [np.sort(rows[:, :2], axis=1) @ [count, 1] for rows in (given, others)]
    others = others[~np.isin(keys[1], keys[0])]
    return np.vstack([given, np.column_stack([others, np.full(len(others), -1)])]).astype(int)


def _groups(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    magnets: list[Magnet],
    touching: NDArray[np.int64],
) -> Iterator[NDArray[np.int64]]:
    """Yield the pairs of magnets that can come near each other, shape (n, 2), like ones together.

    Only pairs of free bodies are put together, since other pairs differ in what they can reach.
    """
    kinds = {}
    coupled = {body for _, elements in tuples(model, "coupling") for _, body, _ in elements}
    kind = np.array(
        [kinds.setdefault(_kind(model, data, magnet, coupled), len(kinds)) for magnet in magnets]
    )
    moves = np.array([model.body_dofnum[magnet.body] > 0 for magnet in magnets])
    bounds = [_bound(model, data, magnet) for magnet in magnets]
    near = Reach(*(np.concatenate(parts) for parts in zip(*bounds, strict=True)))
    first, second = np.nonzero(np.triu(np.logical_or.outer(moves, moves) * near.meets(near), 1))
    if not len(first):
        return
    low, high = np.minimum(kind[first], kind[second]), np.maximum(kind[first], kind[second])
    keys = np.column_stack([low, high, touching[first, second]])
    _, group = np.unique(keys, axis=0, return_inverse=True)
    order = np.argsort(group, kind="stable")
    ends = np.flatnonzero(np.diff(group[order])) + 1
    yield from np.split(np.column_stack([first, second])[order], ends)


def _bound(model: mujoco.MjModel, data: mujoco.MjData, magnet: Magnet) -> Reach:
    """Return where a magnet can be, as one point with a radius."""
    geoms = np.flatnonzero(model.body_weldid[model.geom_bodyid] == magnet.body)
    origin = data.xpos[[magnet.body]]
    found = reach(model, data, magnet.body, 0, origin)
    size = np.linalg.norm(magnet.positions - origin, axis=1).max()
    if len(geoms):
        bounds = np.linalg.norm(data.geom_xpos[geoms] - origin, axis=1) + _radii(model, geoms)
        size = max(size, bounds.max())
    return found._replace(radii=found.radii + size)


def _radii(model: mujoco.MjModel, geoms: NDArray) -> Array:
    """Return the radii of spheres around geoms, infinite for planes."""
    return np.where(model.geom_rbound[geoms] > 0, model.geom_rbound[geoms], np.inf)


def _kind(model: mujoco.MjModel, data: mujoco.MjData, magnet: Magnet, coupled: set[int]) -> tuple:
    """Return what two free bodies have in common that behave alike; else, what is unique."""
    body, joint = magnet.body, model.body_jntadr[magnet.body]
    parts = np.flatnonzero(model.body_weldid == body)
    free = joint >= 0 and model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE
    if not free or len(parts) > 1 or coupled & {*magnet.bodies.tolist()}:
        return (body,)
    geoms = np.flatnonzero(model.geom_bodyid == body)
    frame = data.xmat[body].reshape(3, 3)
    places = (magnet.positions - data.xpos[body]) @ frame
    fields = [model.body_invweight0[body], *magnet[3:4], *magnet[5:], places, magnet.axes @ frame]
    fields += [getattr(model, f"geom_{name}")[geoms] for name in (
        "type", "size", "pos", "quat", "dataid", "contype", "conaffinity", "priority", "solmix",
        "solref", "solimp", "friction", "condim")]  # fmt: skip
    return (-1, *((np.round(field, 12) + 0.0).tobytes() for field in fields))


def _approach(
    model: mujoco.MjModel, data: mujoco.MjData, one: Magnet, other: Magnet, geoms: NDArray
) -> tuple[Approach | None, bool]:
    """Return the closest approach of two magnets, and whether some dipoles can coincide."""
    ancestor = common_ancestor(model, one.body, other.body)
    factors = coupling_factors(model)
    factor = np.array([[factors(int(a), int(b)) for b in other.bodies] for a in one.bodies])
    places = [reach(model, data, each.body, ancestor, each.positions) for each in (one, other)]
    dipoles = [each.strengths > 0 for each in (one, other)]
    acts = (factor != 0) & np.logical_or.outer(*dipoles)
    sides = [_Side(model, data, magnet, _geoms_of(model, magnet, geoms)) for magnet in (one, other)]
    apart = sides[0].depth[:, np.newaxis] + sides[1].depth
    exposed = bool((acts & (apart < COINCIDENCE) & places[0].meets(places[1])).any())
    held = acts & (apart >= COINCIDENCE)
    if not held.any() or not _can_touch(model, data, one, other, geoms, ancestor):
        return None, exposed
    worst = 0.0, 0.0
    for i, j in np.argwhere(held):
        distance = np.hypot(
            sides[0].along(i)[:, np.newaxis] + sides[1].along(j),
            sides[0].aside(i)[:, np.newaxis] - sides[1].aside(j),
        )
        distance = np.maximum(distance, COINCIDENCE)
        pull, steepness = _pull(one, other, distance, abs(factor) * held)
        worst = max(worst, (float(pull.sum()), float((steepness * pull / distance).sum())))
    force, gradient = worst
    inverse_mass = model.body_invweight0[[one.body, other.body], 0].sum()
    nearest = np.unravel_index(np.where(held, apart, np.inf).argmin(), apart.shape)
    depths = np.array([side.depth[n] for side, n in zip(sides, nearest, strict=True)])
    radius = depths[depths > SURFACE * depths.sum()].min()
    return Approach(4 * force / gradient, force, 1 / inverse_mass, float(radius)), exposed


def _pull(one: Magnet, other: Magnet, distance: Array, factor: Array) -> tuple[Array, Array]:
    """Return the forces with aligned moments of all pairs of dipoles, and their powers of 1/d.

    The power is 4, or 7 for iron that the dipoles of the other side magnetize and do not saturate.
    """
    k, sides = PERMEABILITY_OVER_4PI, []
    for magnet, partner, away in ((one, other, distance), (other, one, distance.T)):
        induced = magnet.responses * (2 * k * partner.strengths / away**3).sum(axis=1)
        free = (induced < magnet.saturations) & (magnet.responses > 0)
        sides.append((magnet.strengths + np.minimum(induced, magnet.saturations), free))
    (first, soft), (second, yielding) = sides
    power = 4 + 3 * np.logical_or.outer(soft, yielding)
    return 6 * k * factor * np.multiply.outer(first, second) / distance**4, power


class _Side:
    """The dipoles of a magnet below the surfaces of its geoms."""

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, magnet: Magnet, geoms: NDArray
    ) -> None:
        self._positions = magnet.positions
        self.depth = np.full(len(magnet.positions), NEVER)
        self._normal = np.tile([0.0, 0, 1], (len(magnet.positions), 1))
        for geom in geoms.tolist():
            depth, normal = depth_and_normal(model, data, geom, magnet.positions)
            deeper = depth > self.depth
            self.depth[deeper], self._normal[deeper] = depth[deeper], normal[deeper]

    def along(self, i: int) -> Array:
        """Return the depths of all dipoles below the tangent plane that is nearest to dipole i."""
        below = self.depth[i] + (self._positions[i] - self._positions) @ self._normal[i]
        return np.maximum(below, self.depth)

    def aside(self, i: int) -> Array:
        """Return the distances of all dipoles from that plane's normal through dipole i."""
        offset = self._positions - self._positions[i]
        return np.linalg.norm(np.cross(offset, self._normal[i]), axis=1)


def _geoms_of(model: mujoco.MjModel, magnet: Magnet, geoms: NDArray) -> NDArray[np.int64]:
    both = np.unique(geoms[:, :2])
    return both[model.body_weldid[model.geom_bodyid[both]] == magnet.body]


def _can_touch(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    one: Magnet,
    other: Magnet,
    geoms: NDArray,
    ancestor: int,
) -> bool:
    """Whether the geoms of two magnets can reach each other."""
    places = []
    for magnet in (one, other):
        own = _geoms_of(model, magnet, geoms)
        found = reach(model, data, magnet.body, ancestor, data.geom_xpos[own])
        places.append(found._replace(radii=found.radii + _radii(model, own)))
    return bool(len(geoms)) and bool(places[0].meets(places[1]).any())
