"""Which magnets of a model can come near each other, and how near."""

from collections.abc import Iterator
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.dipoles import COINCIDENCE
from magmotor.mjcf.checking.attraction import attraction
from magmotor.mjcf.checking.clearance import Clearance
from magmotor.mjcf.checking.close_iron import CloseIron, close_iron, strong_iron
from magmotor.mjcf.checking.contact_rule import SUNK, Approach
from magmotor.mjcf.checking.covers import Covers
from magmotor.mjcf.checking.dipole_depth import Side
from magmotor.mjcf.checking.frequencies import swinging_response
from magmotor.mjcf.checking.geoms import (
    contact_margin,
    geoms_of,
    numbers_of_kinds,
    rows_of_magnets,
    touching_geoms,
)
from magmotor.mjcf.checking.groups_of_pairs import groups_of_pairs
from magmotor.mjcf.checking.joint_gaps import gaps_of, possible_rows, room_of
from magmotor.mjcf.checking.joint_limits import SoftLimit, softest_limit
from magmotor.mjcf.checking.poses import Freedom
from magmotor.mjcf.checking.rails import repel_on_rail
from magmotor.mjcf.checking.stand_off import contacts_that_share, stand
from magmotor.mjcf.checking.strengths import Magnet, magnets_of
from magmotor.mjcf.checking.swept import limited_joints
from magmotor.mjcf.checking.touch import (
    Spacing,
    approach_of,
    closest_approach,
    closest_to_plane,
    coarsest,
    depth_of_nearest,
    pull_above_plane,
)
from magmotor.mjcf.checking.true_approach import TrueApproach
from magmotor.mjcf.checking.true_pull import duo_of
from magmotor.mjcf.declarations.iron import SPHERE
from magmotor.mjcf.field_and_energy import coupling_factors


class Meeting(NamedTuple):
    """Two magnets that can come near each other, and what keeps their dipoles apart."""

    magnets: tuple[Magnet, Magnet]
    """Only the second one may be a plane."""
    nearest: tuple[int, int]
    """The dipoles that come nearest to each other."""
    number: int
    """Number of pairs like this one."""
    touching: NDArray[np.int64]
    """Rows of two geoms that may touch, and their contact pair or -1."""
    like: NDArray[np.int64]
    """The same of all pairs like this one."""
    approach: Approach | None
    """None if the contact keeps no dipoles apart that act on each other."""
    linked: Approach | None
    """The same if joints keep some dipoles apart, and no contact does."""
    exposed: bool
    """Whether dipoles can coincide, or one can be below the plane."""
    spacing: Spacing | None
    """The coarsest spacing of dipoles where they touch."""
    close_iron: CloseIron | None
    """Two geoms of iron that come too near each other for their nodes."""
    soft_limit: SoftLimit | None
    """A limit that is too soft to keep them apart."""
    exact: bool
    """Whether they reach the force of the approach."""
    repels: bool
    """Whether they push each other apart wherever they can be, so that no contact must hold them.
    A long timestep can still take them through each other."""


def meetings(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[Meeting]:
    """Yield the pairs of magnets that can come near each other, like ones together."""
    magnets = magnets_of(model, data)
    if len(magnets) < 2:
        return
    rows = touching_geoms(model)
    geoms, pairs = rows_of_magnets(model, magnets, rows)
    weld_of = model.body_weldid[model.geom_bodyid]
    touching = numbers_of_kinds(model, geoms, pairs, len(magnets))
    scene = _Scene(model, data, rows, strong_iron(model, magnets))
    groups = np.full_like(touching, -1)
    for k, members in enumerate(groups_of_pairs(model, data, magnets, touching)):
        groups[members[:, 0], members[:, 1]] = k
        one, other = (magnets[i] for i in members[0])
        like = geoms[groups[pairs[:, 0], pairs[:, 1]] == k]
        welds = np.sort(weld_of[like[:, :2]], axis=1)
        own = like[(welds == sorted([one.body, other.body])).all(axis=1)]
        if found := scene.meeting((one, other), own, frozenset()):
            alone = len(members) == 1
            yield found._replace(number=len(members), like=found.touching if alone else like)


class _Scene:
    """A model and what is the same for all of its pairs of magnets."""

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        rows: NDArray[np.int64],
        strong: NDArray[np.bool_],
    ) -> None:
        self._model, self._data, self._rows, self._strong = model, data, rows, strong
        self._sides: dict[tuple, Side] = {}
        self._covers = {frozenset[int](): Covers(model, data)}

    def _side(self, magnet: Magnet, geoms: NDArray, margin: float, soft: frozenset[int]) -> Side:
        key = magnet.body, magnet.images, geoms.tobytes(), margin, soft
        if key not in self._sides:
            covers = self._covers[soft]
            self._sides[key] = Side(self._model, self._data, magnet, geoms, margin, covers)
        return self._sides[key]

    def meeting(
        self, magnets: tuple[Magnet, Magnet], own: NDArray, soft: frozenset[int]
    ) -> Meeting | None:
        """Return how two magnets meet; None if nothing of them can.

        `own` are rows of two geoms of theirs that may touch, and their contact pair or -1; `soft`
        are slides whose limits are too soft to keep in place what covers them.
        """
        model, data, (one, other) = self._model, self._data, magnets
        covers = self._covers.setdefault(soft, Covers(model, data, soft))
        acts, factor = _factors(model, one, other)
        touching = np.vstack([own, covers.rows(one, other, self._rows)])
        margin = min((contact_margin(model, *row) for row in touching.tolist()), default=0.0)
        geoms = [geoms_of(model, magnet, own) for magnet in magnets]
        around = [covers.around(magnet, touching) for magnet in magnets]
        if other.images:
            around[1] = geoms[1]
            geoms[0] = np.setdiff1d(touching[:, :2], geoms[1])
        sides = self._side(one, around[0], margin, soft), self._side(other, around[1], 0.0, soft)
        walls = [j for j in limited_joints(model, one.body, other.body) if j not in soft]
        freedom = Freedom(model, data, magnets, walls)
        level, standing = max(0.0, float(sides[1].depth[0])) if other.images else 0.0, None
        if other.images:
            standing = stand(model, data, magnets, geoms[0], margin + level, covers, freedom)
            deepest = standing.heights.min(axis=0) if standing else [-np.inf] * len(one.strengths)
            apart = np.array(deepest)[:, np.newaxis]
        else:
            apart = sides[0].depth[:, np.newaxis] + sides[1].depth
        duo = duo_of(model, data, magnets)
        true = None
        if duo and not other.images:
            clearance = Clearance(model, data, magnets, touching, covers)
            true = TrueApproach(duo, sides, clearance, freedom, np.where(acts, 0.0, np.inf))

        def pull(distance: Array, weight: Array) -> tuple[float, float]:
            """Return the force at distances of dipoles, and its gradient."""
            nearest = float(distance.min())
            if duo and 0 < nearest < np.inf:
                if true:
                    return true.pull(nearest, SUNK * nearest)
                solid = one.elements[one.elements >= model.nsite] - model.nsite
                found = stand(model, data, magnets, solid, 0.0, covers, freedom)
                return pull_above_plane(one, other, found, nearest, duo)
            return attraction(one, other, distance + distance.T * (other.images > 0), weight)

        gaps, limit = gaps_of(model, data, magnets, geoms, level, walls), None
        bare = acts & (apart < COINCIDENCE)  # no contact keeps these dipoles apart
        repels = not other.images and repel_on_rail(model, data, magnets, apart)
        while walls and not repels and (room := room_of(gaps, bare)) > 0:
            force = pull(gaps[0], np.where(acts, factor, 0))
            found = softest_limit(model, data, magnets, walls, force, room)
            if not found:
                break
            # Without others, a limit must do more than its share: the mildest remedy is for it.
            limit = found if limit is None or found.constant > limit.constant else limit
            walls.remove(found.joint)
            gaps = gaps_of(model, data, magnets, geoms, level, walls)
        of_dipoles, of_geoms = gaps
        possible = possible_rows(own, geoms, of_geoms, whole=other.images > 0)
        if 0 < len(possible) < len(own):
            return self.meeting(magnets, possible, soft)
        near = bare & (of_dipoles <= COINCIDENCE)
        held = np.where(acts & (apart >= COINCIDENCE), apart, np.inf)
        approach = linked = None
        if not len(possible) and len(own) == len(touching):
            held = np.full_like(held, np.inf)
        may_touch = (held < np.inf).any()
        masses = _masses(model, magnets, touching)
        if standing and may_touch:
            approach, k = closest_to_plane(one, other, standing, level, masses, duo)
            approach = approach and approach._replace(
                contacts=contacts_that_share(
                    model, data, magnets, standing.directions[k], standing.heights[k],
                    approach.depth, touching,
                )
            )  # fmt: skip
        elif true and may_touch:
            depth = depth_of_nearest(sides, held)
            force = true.pull(0.0, SUNK * depth)
            if clearance.touched.any():
                touching = touching[clearance.touched]
            approach = approach_of(*force, _masses(model, magnets, touching), depth)
        elif may_touch:
            approach = closest_approach(sides, held, factor, masses)
        slides = covers.slides(one) | covers.slides(other) if approach and not limit else set()
        if approach and slides:
            force = approach.force, 4 * approach.force / approach.distance
            if found := softest_limit(model, data, magnets, [*slides], force, approach.depth):
                again = self.meeting(magnets, own, soft | {found.joint})
                return again and again._replace(soft_limit=found)
        spacing = coarsest(sides, held) if approach else None
        kept = bare & (of_dipoles > COINCIDENCE) & (of_dipoles < np.inf)
        if kept.any():
            force = pull(np.where(kept, of_dipoles, np.inf), factor)
            linked = _linked(model, data, magnets, force)
        held_iron = np.where(factor > 0, apart if len(touching) else -np.inf, np.inf)
        iron = None
        if not other.images:
            iron = close_iron(model, magnets, self._strong, of_dipoles, held_iron)
        if not (approach or linked or near.any() or iron):
            return None
        i, j = np.unravel_index(np.where(acts, apart, np.inf).argmin(), apart.shape)
        exact = _is_exact(model, data, magnets, geoms)
        return Meeting(
            magnets, (int(i), int(j)), 1, touching, touching, approach, linked,
            bool(near.any()), spacing, iron, limit, exact, repels,
        )  # fmt: skip


def _linked(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    magnets: tuple[Magnet, Magnet],
    pull: tuple[float, float],
) -> Approach | None:
    """Return the closest approach of magnets whose dipoles only joints keep apart."""
    force, gradient = pull
    response = sum(swinging_response(model, data, magnet) for magnet in magnets)
    if not (0 < force < np.inf and 0 < gradient < np.inf):
        return None
    mass = 1 / response if response else np.inf
    return Approach(4 * force / gradient, force, mass, mass, 0.0)


def _is_exact(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    magnets: tuple[Magnet, Magnet],
    geoms: list[NDArray],
) -> bool:
    """Return whether two magnets reach the force at touch: balls of one dipole each that can turn.

    Others may not reach it, have a somewhat larger one in other poses, or more contacts.
    """
    for magnet, own in zip(magnets, geoms, strict=True):
        joint = model.body_jntadr[magnet.body]
        free = joint < 0 or model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE
        if magnet.images and model.body_dofnum[magnet.body] == 0:
            continue
        balls = own[model.geom_type[own] == SPHERE]
        off = np.linalg.norm(data.geom_xpos[balls] - magnet.positions[0], axis=1)
        centered = (off <= 1e-6 * model.geom_rbound[balls]).any()
        if not (free and centered and len(magnet.positions) == 1 and magnet.coils <= {-1}):
            return False
    return True


def _masses(
    model: mujoco.MjModel, magnets: tuple[Magnet, Magnet], touching: NDArray
) -> tuple[float, float]:
    """Return the reduced mass that MuJoCo assumes in contacts, and that of the bodies alone.

    A magnet that others cover counts with the mass of what touches, which stops it, if it is more.
    """
    bodies = np.array([magnet.body for magnet in magnets])
    if len(touching):
        assumed = model.body_invweight0[model.geom_bodyid[touching[:, :2]], 0].sum(axis=1).max()
    else:
        assumed = model.body_invweight0[bodies, 0].sum()
    touched = np.setdiff1d(model.body_weldid[model.geom_bodyid[touching[:, :2]]], bodies)
    roots, alone = model.body_rootid, 0.0
    for body in bodies[model.body_dofnum[bodies] > 0].tolist():
        others = touched[roots[touched] == roots[body]].tolist()
        if body not in model.body_weldid[model.geom_bodyid[touching[:, :2]]] and others:
            own = max(_mass(model, body), min(_mass(model, other) for other in others))
        else:
            own = _mass(model, body)
        alone += 1 / own
    return (1 / assumed if assumed else np.inf, float(1 / alone))


def _mass(model: mujoco.MjModel, body: int) -> float:
    return float(model.body_mass[model.body_weldid == body].sum())


def _factors(model: mujoco.MjModel, one: Magnet, other: Magnet) -> tuple[NDArray[np.bool_], Array]:
    """Return which dipoles act on which of another magnet, and how strongly they attract."""
    if other.images:
        acts = np.full((len(one.bodies), 1), bool(one.strengths.any()))
        return acts, np.full(acts.shape, max(0.0, other.images))
    of = coupling_factors(model)
    factor = np.array([[of(int(a), int(b)) for b in other.bodies] for a in one.bodies])
    permanent = (one.strengths[:, np.newaxis] > 0) | (other.strengths > 0)
    return (factor != 0) & permanent, np.abs(factor, dtype=float)
