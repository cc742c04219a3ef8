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
from magmotor.mjcf.checking.coil_bores import in_bores
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
from magmotor.mjcf.checking.stand_off import Stand, contacts_that_share, stand
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


class Known:
    """What depends on shapes and joints only, so that it needs no second computation."""

    def __init__(self) -> None:
        self.sides: dict[tuple, Side] = {}
        self.pulls: dict[tuple, tuple[tuple[float, float], NDArray[np.bool_]]] = {}
        """Forces and their gradients, and what has touched."""


def meetings(
    model: mujoco.MjModel, data: mujoco.MjData, known: Known | None = None
) -> Iterator[Meeting]:
    """Yield the pairs of magnets that can come near each other, like ones together.

    `known` is filled, and is right for other timesteps, contacts and limits of the same model.
    """
    magnets = magnets_of(model, data)
    if len(magnets) < 2:
        return
    scene = _Scene(model, data, magnets, known or Known())
    geoms, pairs = rows_of_magnets(model, magnets, scene.rows)
    weld_of = model.body_weldid[model.geom_bodyid]
    touching = numbers_of_kinds(model, geoms, pairs, len(magnets))
    groups = np.full_like(touching, -1)
    for k, members in enumerate(groups_of_pairs(model, data, magnets, touching)):
        groups[members[:, 0], members[:, 1]] = k
        one, other = (magnets[i] for i in members[0])
        like = geoms[groups[pairs[:, 0], pairs[:, 1]] == k]
        welds = np.sort(weld_of[like[:, :2]], axis=1)
        own = like[(welds == sorted([one.body, other.body])).all(axis=1)]
        if found := _Pair(scene, (one, other), own).meeting():
            alone = len(members) == 1
            yield found._replace(number=len(members), like=found.touching if alone else like)


class _Scene:
    """A model and what is the same for several of its pairs of magnets."""

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, magnets: list[Magnet], known: Known
    ) -> None:
        self.model, self.data, self.known = model, data, known
        self.rows, self.strong = touching_geoms(model), strong_iron(model, magnets)
        self._covers: dict[frozenset[int], Covers] = {}

    def covers(self, soft: frozenset[int]) -> Covers:
        """Return what moves along with magnets; `soft` are slides whose limits are too soft."""
        if soft not in self._covers:
            self._covers[soft] = Covers(self.model, self.data, soft)
        return self._covers[soft]

    def side(self, magnet: Magnet, geoms: NDArray, margin: float, soft: frozenset[int]) -> Side:
        """Return the dipoles of a magnet below the surfaces of these geoms."""
        key = magnet.body, magnet.images, geoms.tobytes(), margin, soft
        sides = self.known.sides
        if key not in sides:
            covers = self.covers(soft)
            sides[key] = Side(self.model, self.data, magnet, geoms, margin, covers)
        return sides[key]


class _Pair:
    """Two magnets and what can keep them apart.

    `own` are rows of two geoms of theirs that may touch, and their contact pair or -1; `soft` are
    slides whose limits are too soft to keep in place what covers them.
    """

    def __init__(
        self,
        scene: _Scene,
        magnets: tuple[Magnet, Magnet],
        own: NDArray,
        soft: frozenset[int] = frozenset(),
    ) -> None:
        self._scene, self._magnets, self._own, self._soft = scene, magnets, own, soft
        model, data, (one, other) = scene.model, scene.data, magnets
        self._state = model, data, magnets
        self._covers = covers = scene.covers(soft)
        self._acts, self._factor = _factors(model, one, other)
        self._touching = touching = np.vstack([own, covers.rows(one, other, scene.rows)])
        margin = min((contact_margin(model, *row) for row in touching.tolist()), default=0.0)
        self._geoms = [geoms_of(model, magnet, own) for magnet in magnets]
        around = [covers.around(magnet, touching) for magnet in magnets]
        if other.images:
            around[1] = self._geoms[1]
            self._geoms[0] = np.setdiff1d(touching[:, :2], around[1])
        self._sides = (
            scene.side(one, around[0], margin, soft),
            scene.side(other, around[1], 0, soft),
        )
        joints = limited_joints(model, one.body, other.body)
        self._walls = [joint for joint in joints if joint not in soft]
        self._freedom = Freedom(model, data, magnets, self._walls)
        self._duo = duo_of(model, data, magnets) if self._needs_shapes() else None
        self._level, self._standing, self._clearance = 0.0, None, None
        if other.images:
            self._level = max(0.0, float(self._sides[1].depth[0]))
            self._standing = self._stand(self._geoms[0], margin + self._level)
            heights = (
                self._standing.heights if self._standing else np.full((1, len(one.axes)), -np.inf)
            )
            self._apart = heights.min(axis=0)[:, np.newaxis]
        else:
            self._apart = self._sides[0].depth[:, np.newaxis] + self._sides[1].depth
            if self._duo:
                self._clearance = Clearance(model, data, magnets, touching, covers)
        self._bare = self._acts & (self._apart < COINCIDENCE) & ~in_bores(model, one, other)
        """Which dipoles no contact keeps apart, of which neither is in the bore of the other."""

    def _needs_shapes(self) -> bool:
        """Return whether dipoles and a plane that touch do not tell the force.

        They do not for magnets by their geom; nor for sites near iron, where other geoms than those
        around them, or joints, keep them off it.
        """
        magnets, kept = self._magnets, any(side.covered for side in self._sides)
        near_iron = any(magnet.responses.any() for magnet in magnets) and not magnets[1].images
        kept = near_iron and (kept or not self._freedom.whole)
        return kept or any(magnet.shaped for magnet in magnets)

    def _stand(self, geoms: NDArray, margin: float) -> Stand | None:
        return stand(*self._state, geoms, margin, self._covers, self._freedom)

    def _pull(self, least: float, step: float) -> tuple[float, float]:
        """Return the force of true shapes whose dipoles are so far apart, and its gradient."""
        (one, other), duo = self._magnets, self._duo
        if not duo or not least < np.inf:
            return 0.0, 0.0
        if self._clearance:
            known, bodies = self._scene.known.pulls, (one.body, other.body)
            key = *bodies, self._own.tobytes(), self._soft, *self._walls, least, step
            if key not in known:
                true = TrueApproach(duo, self._sides, self._clearance, self._freedom, self._acts)
                known[key] = true.pull(least, step), self._clearance.touched
            pull, self._clearance.touched = known[key]
            return pull
        solid = one.elements[one.elements >= self._scene.model.nsite] - self._scene.model.nsite
        return pull_above_plane(one, other, self._stand(solid, 0.0), least, duo)

    def _pull_at(self, distance: Array, weight: Array) -> tuple[float, float]:
        """Return the force at distances of dipoles, and its gradient."""
        if self._duo:
            least = float(distance.min())
            return self._pull(least, SUNK * least)
        images = self._magnets[1].images
        return attraction(*self._magnets, distance + distance.T if images else distance, weight)

    def _limited(self, repels: bool) -> tuple[tuple[Array, Array], SoftLimit | None]:
        """Return what joints leave of gaps, and the softest limit that does not count for that."""
        walls, limit = [*self._walls], None
        weight = np.where(self._acts, self._factor, 0)
        gaps = gaps_of(*self._state, self._geoms, self._level, walls)
        while walls and not repels and (room := room_of(gaps, self._bare)) > 0:
            force = self._pull_at(gaps[0], weight)
            found = softest_limit(*self._state, walls, force, room)
            if not found:
                break
            # Without others, a limit must do more than its share: the mildest remedy is for it.
            limit = found if limit is None or found.constant > limit.constant else limit
            walls.remove(found.joint)
            gaps = gaps_of(*self._state, self._geoms, self._level, walls)
        return gaps, limit

    def _approach(self, held: Array) -> Approach | None:
        """Return the closest approach; only what then touches remains in `_touching`.

        `held` are the distances of dipoles that geoms keep apart, and infinite for others.
        """
        if not (held < np.inf).any():
            return None
        model, (one, other) = self._scene.model, self._magnets
        masses = _masses(model, self._magnets, self._touching)
        if stands := self._standing:
            found, k = closest_to_plane(one, other, stands, self._level, masses, self._duo)
            return found and found._replace(
                contacts=contacts_that_share(
                    *self._state, stands.directions[k], stands.heights[k], found.depth,
                    self._touching,
                )
            )  # fmt: skip
        if not self._clearance:
            return closest_approach(self._sides, held, self._factor, masses)
        depth = depth_of_nearest(self._sides, held)
        force, gradient = self._pull(0.0, SUNK * depth)
        if self._clearance.touched.any():
            self._touching = self._touching[self._clearance.touched]
            masses = _masses(model, self._magnets, self._touching)
        return approach_of(force, gradient, masses, depth)

    def _soft_cover(self, approach: Approach) -> SoftLimit | None:
        """Return the softest limit that does not keep in place what covers a magnet."""
        slides = self._covers.slides(self._magnets[0]) | self._covers.slides(self._magnets[1])
        force = approach.force, 4 * approach.force / approach.distance
        return softest_limit(*self._state, [*slides], force, approach.depth) if slides else None

    def meeting(self) -> Meeting | None:
        """Return how they meet; None if nothing of them can."""
        magnets, acts, apart, bare = self._magnets, self._acts, self._apart, self._bare
        model, flat = self._scene.model, magnets[1].images != 0
        repels = not flat and repel_on_rail(*self._state, apart)
        (of_dipoles, of_geoms), limit = self._limited(repels)
        possible = possible_rows(self._own, self._geoms, of_geoms, whole=flat)
        if 0 < len(possible) < len(self._own):
            return _Pair(self._scene, magnets, possible, self._soft).meeting()
        near = bare & (of_dipoles <= COINCIDENCE)
        touches = len(possible) or len(self._own) < len(self._touching)
        held = np.where(acts & (apart >= COINCIDENCE) & bool(touches), apart, np.inf)
        approach = self._approach(held)
        if approach and not limit and (soft := self._soft_cover(approach)):
            again = _Pair(self._scene, magnets, self._own, self._soft | {soft.joint}).meeting()
            return again and again._replace(soft_limit=soft)
        spacing = coarsest(self._sides, held) if approach else None
        kept, linked = bare & (of_dipoles > COINCIDENCE) & (of_dipoles < np.inf), None
        if kept.any():
            force = self._pull_at(np.where(kept, of_dipoles, np.inf), self._factor)
            linked = _linked(*self._state, force)
        outer = np.where(self._factor > 0, apart if len(self._touching) else -np.inf, np.inf)
        strong = self._scene.strong
        iron = None if flat else close_iron(model, magnets, strong, of_dipoles, outer)
        if not (approach or linked or near.any() or iron):
            return None
        i, j = np.unravel_index(np.where(acts, apart, np.inf).argmin(), apart.shape)
        return Meeting(
            magnets, (int(i), int(j)), 1, self._touching, self._touching, approach, linked,
            bool(near.any()), spacing, iron, limit, _is_exact(*self._state, self._geoms), repels,
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
