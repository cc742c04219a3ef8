"""Which magnets of a model can come near each other, and how near."""

from collections.abc import Collection, Iterator
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.dipoles import COINCIDENCE
from magmotor.mjcf.checking.attraction import attraction
from magmotor.mjcf.checking.close_iron import CloseIron, close_iron, strong_iron
from magmotor.mjcf.checking.coil_bores import in_bores
from magmotor.mjcf.checking.contact_rule import Approach
from magmotor.mjcf.checking.dipole_depth import Side
from magmotor.mjcf.checking.frequencies import swinging_response
from magmotor.mjcf.checking.geoms import (
    bounding_radii,
    contact_margin,
    geoms_of,
    numbers_of_kinds,
    rows_of_magnets,
    touching_geoms,
)
from magmotor.mjcf.checking.groups_of_pairs import groups_of_pairs
from magmotor.mjcf.checking.joint_limits import SoftLimit, softest_limit
from magmotor.mjcf.checking.rails import repel_on_rail
from magmotor.mjcf.checking.reach import Reach, common_ancestor, reach
from magmotor.mjcf.checking.stand_off import contacts_that_share, stand, standing_rows
from magmotor.mjcf.checking.strengths import Magnet, magnets_of
from magmotor.mjcf.checking.swept import limited_joints, swept_gaps, swept_joints
from magmotor.mjcf.checking.touch import (
    Spacing,
    closest_approach,
    closest_to_plane,
    coarsest,
)
from magmotor.mjcf.checking.true_pull import duo_of
from magmotor.mjcf.declarations.iron import PLANE, SPHERE
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
    groups, built, strong = np.full_like(touching, -1), {}, strong_iron(model, magnets)
    for k, members in enumerate(groups_of_pairs(model, data, magnets, touching)):
        groups[members[:, 0], members[:, 1]] = k
        one, other = (magnets[i] for i in members[0])
        like = geoms[groups[pairs[:, 0], pairs[:, 1]] == k]
        welds = np.sort(weld_of[like[:, :2]], axis=1)
        own = like[(welds == sorted([one.body, other.body])).all(axis=1)]
        if other.images:
            more = standing_rows(model, data, one, other, rows)
            own, like = np.vstack([own, more]), np.vstack([like, more])
        if found := _meeting(model, data, (one, other), own, strong, built):
            yield found._replace(number=len(members), like=like)


def _meeting(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    magnets: tuple[Magnet, Magnet],
    touching: NDArray,
    strong: NDArray[np.bool_],
    built: dict[tuple, Side],
) -> Meeting | None:
    """Return how two magnets meet; None if nothing of them can. `built` keeps their sides."""
    one, other = magnets
    acts, factor = _factors(model, one, other)
    margin = min((contact_margin(model, *row) for row in touching.tolist()), default=0.0)
    geoms = [geoms_of(model, magnet, touching) for magnet in magnets]

    def side(magnet: Magnet, own: NDArray, push: float) -> Side:
        key = magnet.body, magnet.images, own.tobytes(), push
        if key not in built:
            built[key] = Side(model, data, magnet, own, push)
        return built[key]

    sides = side(one, geoms[0], margin), side(other, geoms[1], 0.0)
    masses = _masses(model, magnets, touching)
    level, standing = max(0.0, float(sides[1].depth[0])) if other.images else 0.0, None
    if other.images:
        geoms[0] = np.setdiff1d(touching[:, :2], geoms[1])
        standing = stand(model, data, one, geoms[0], margin + level)
        deepest = standing.heights.min(axis=0) if standing else [-np.inf] * len(one.strengths)
        apart = np.array(deepest)[:, np.newaxis]
    else:
        apart = sides[0].depth[:, np.newaxis] + sides[1].depth
    walls = limited_joints(model, one.body, other.body)
    gaps, soft = _gaps(model, data, magnets, geoms, level, walls), None
    # No contact keeps these dipoles apart, and neither is in the bore of the other.
    bare = acts & (apart < COINCIDENCE) & ~in_bores(model, one, other)
    repels = not other.images and repel_on_rail(model, data, magnets, apart)
    while walls and not repels and (room := _room(gaps, bare)) > 0:
        found = softest_limit(model, data, magnets, walls, gaps[0], room, np.where(acts, factor, 0))
        if not found:
            break
        # Without others, a limit must do more than its share: the mildest remedy is that for it.
        soft = found if soft is None or found.constant > soft.constant else soft
        walls.remove(found.joint)
        gaps = _gaps(model, data, magnets, geoms, level, walls)
    of_dipoles, of_geoms = gaps
    possible = _possible_rows(touching, geoms, of_geoms, whole=other.images > 0)
    if 0 < len(possible) < len(touching):
        return _meeting(model, data, magnets, possible, strong, built)
    near = bare & (of_dipoles <= COINCIDENCE)
    held = np.where(acts & (apart >= COINCIDENCE), apart, np.inf)
    approach = linked = None
    if not len(possible):
        held = np.full_like(held, np.inf)
    may_touch = (held < np.inf).any()
    duo = duo_of(model, data, magnets) if may_touch else None
    if standing and may_touch:
        approach, k = closest_to_plane(one, other, standing, level, masses, duo)
        approach = approach and approach._replace(
            contacts=contacts_that_share(
                model, data, magnets, standing.directions[k], standing.heights[k], approach.depth,
                touching,
            )
        )  # fmt: skip
    elif may_touch:
        approach = closest_approach(sides, held, factor, masses, duo)
    spacing = coarsest(sides, held) if approach else None
    kept = bare & (of_dipoles > COINCIDENCE) & (of_dipoles < np.inf)
    if kept.any():
        linked = _linked(model, data, magnets, np.where(kept, of_dipoles, np.inf), factor)
    held_iron = np.where(factor > 0, apart if len(touching) else -np.inf, np.inf)
    iron = None if other.images else close_iron(model, magnets, strong, of_dipoles, held_iron)
    if not (approach or linked or near.any() or iron):
        return None
    i, j = np.unravel_index(np.where(acts, apart, np.inf).argmin(), apart.shape)
    exact = _is_exact(model, data, magnets, geoms)
    return Meeting(
        magnets, (int(i), int(j)), 1, touching, touching, approach, linked,
        bool(near.any()), spacing, iron, soft, exact, repels,
    )  # fmt: skip


def _possible_rows(
    touching: NDArray, geoms: list[NDArray], gaps: Array, *, whole: bool
) -> NDArray[np.int64]:
    """Return the rows of two geoms that can touch, by lower bounds of their distances.

    If `whole`, they are all rows, or none.
    """
    if whole:
        return touching if (gaps <= 0).any() else touching[:0]
    swapped = ~np.isin(touching[:, 0], geoms[0])
    first, second = np.where(swapped, touching[:, [1, 0]].T, touching[:, :2].T)
    places = np.searchsorted(geoms[0], first), np.searchsorted(geoms[1], second)
    return touching[gaps[places] <= 0]


def _linked(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    magnets: tuple[Magnet, Magnet],
    apart: Array,
    factor: Array,
) -> Approach | None:
    """Return the closest approach of magnets whose dipoles only joints keep apart."""
    images = magnets[1].images
    force, gradient = attraction(*magnets, apart + apart.T if images else apart, factor)
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


def _gaps(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    magnets: tuple[Magnet, Magnet],
    geoms: list[NDArray],
    level: float,
    walls: Collection[int],
) -> tuple[Array, Array]:
    """Return how near dipoles, and geoms, of two magnets come to each other at least.

    The columns are those of the other magnet; a plane has one, at the height `level` above it.
    `walls` are the joints that stop at their limits.
    """
    one, other = magnets
    ancestor = common_ancestor(model, one.body, other.body)
    bodies = one.body, other.body
    found, swept = [], swept_joints(model, *bodies, walls)
    for places in ([m.positions for m in magnets], [data.geom_xpos[own] for own in geoms]):
        reaches = [
            reach(model, data, magnet.body, ancestor, points, walls)
            for magnet, points in zip(magnets, places, strict=True)
        ]
        sizes = [bounding_radii(model, own) if found else np.zeros(1) for own in geoms]

        if other.images and ancestor != other.body:
            found.append(np.zeros((len(places[0]), 1)))
        elif other.images:
            plane = int(other.elements[0]) - model.nsite
            lowest = _lowest(model, data, reaches[0], places[0], plane, swept, walls, bodies)
            found.append((lowest - sizes[0] - level)[:, np.newaxis])
        else:
            least = reaches[0].gaps(reaches[1])
            if swept and least.size:
                within = swept_gaps(model, data, swept, walls, bodies, places)
                least = np.maximum(least, within)
            least = least - np.add.outer(*sizes)
            found.append(least)
    if not other.images:
        of_geoms = found[1]
        for side, rows in ((0, of_geoms), (1, of_geoms.T)):
            planes = [k for k in range(len(rows)) if model.geom_type[geoms[side][k]] == PLANE]
            ways = bodies[1 - side], bodies[side]
            for k in planes if bodies[side] == ancestor else ():
                lowest = _lowest(
                    model, data, reaches[1 - side], places[1 - side], geoms[side][k], swept, walls,
                    ways,
                )  # fmt: skip
                rows[k] = lowest - sizes[1 - side]
    return found[0], found[1]


def _lowest(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    own: Reach,
    points: Array,
    plane: int,
    joints: list[int],
    walls: Collection[int],
    bodies: tuple[int, int],
) -> Array:
    """Return how high the points of the first body stay at least above a plane of the second."""
    point, normal = data.geom_xpos[[plane]], data.geom_xmat[plane, 2::3]
    lowest = own.lowest(point[0], normal)
    if joints and lowest.size:
        within = swept_gaps(model, data, joints, walls, bodies, [points, point], normal)
        lowest = np.maximum(lowest, within[:, 0])
    return lowest


def _room(gaps: tuple[Array, Array], bare: NDArray[np.bool_]) -> float:
    """Return the distance that limits keep: of bare dipoles, or of geoms; 0 if they keep none."""
    of_dipoles, of_geoms = gaps
    geoms = of_geoms.min(initial=np.inf)
    room = min(of_dipoles.min(), geoms) if geoms > 0 else of_dipoles[bare].min(initial=np.inf)
    return float(room) if np.isfinite(room) else 0.0


def _masses(
    model: mujoco.MjModel, magnets: tuple[Magnet, Magnet], touching: NDArray
) -> tuple[float, float]:
    """Return the reduced mass that MuJoCo assumes in contacts, and that of the bodies alone."""
    bodies = np.array([magnet.body for magnet in magnets])
    if len(touching):
        assumed = model.body_invweight0[model.geom_bodyid[touching[:, :2]], 0].sum(axis=1).max()
    else:
        assumed = model.body_invweight0[bodies, 0].sum()
    moving = bodies[model.body_dofnum[bodies] > 0]
    alone = sum(1 / model.body_mass[model.body_weldid == body].sum() for body in moving)
    return (1 / assumed if assumed else np.inf, float(1 / alone))


def _factors(model: mujoco.MjModel, one: Magnet, other: Magnet) -> tuple[NDArray[np.bool_], Array]:
    """Return which dipoles act on which of another magnet, and how strongly they attract."""
    if other.images:
        acts = np.full((len(one.bodies), 1), bool(one.strengths.any()))
        return acts, np.full(acts.shape, max(0.0, other.images))
    of = coupling_factors(model)
    factor = np.array([[of(int(a), int(b)) for b in other.bodies] for a in one.bodies])
    permanent = (one.strengths[:, np.newaxis] > 0) | (other.strengths > 0)
    return (factor != 0) & permanent, np.abs(factor, dtype=float)
