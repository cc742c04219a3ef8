"""Which geoms of magnets may touch, and what says how."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.mjcf.checking.strengths import Magnet
from magmotor.mjcf.declarations.iron import PLANE
from magmotor.mjcf.lookup import disabled
from magmotor.mjcf.possible_contacts import colliding_geoms


def touching_geoms(model: mujoco.MjModel) -> NDArray[np.int64]:
    """Return rows of two geoms that may touch and their contact pair, or -1."""
    if disabled(model, "contact"):
        return np.empty((0, 3), int)
    given = np.column_stack([model.pair_geom1, model.pair_geom2, np.arange(model.npair)])
    others = colliding_geoms(model)
    count = model.ngeom + 1
    keys = [np.sort(rows[:, :2], axis=1) @ [count, 1] for rows in (given, others)]
    others = others[~np.isin(keys[1], keys[0])]
    return np.vstack([given, np.column_stack([others, np.full(len(others), -1)])]).astype(int)


def rows_of_magnets(
    model: mujoco.MjModel, magnets: list[Magnet], geoms: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the rows of geoms that belong to two magnets, and the numbers of these.

    A plane of iron has the contacts of all planes of its body.
    """
    number_of = np.full(model.nbody, -1)
    bodies = np.array([magnet.body for magnet in magnets if not magnet.images], int)
    number_of[bodies] = np.arange(len(bodies))
    welds = model.body_weldid[model.geom_bodyid[geoms[:, :2]]]
    pairs = number_of[welds]
    for k in range(len(bodies), len(magnets)):
        flat = (model.geom_type[geoms[:, :2]] == PLANE) & (welds == magnets[k].body)
        geoms = np.vstack([geoms, geoms[flat.any(axis=1)]])
        pairs = np.vstack([pairs, np.where(flat, k, pairs)[flat.any(axis=1)]])
    pairs = np.sort(pairs, axis=1)
    return geoms[pairs[:, 0] >= 0], pairs[pairs[:, 0] >= 0]


def numbers_of_kinds(
    model: mujoco.MjModel, geoms: NDArray[np.int64], pairs: NDArray[np.int64], count: int
) -> NDArray[np.int64]:
    """Return numbers (count, count), equal for pairs of magnets whose geoms touch alike.

    The number is that of rows of geoms, and negative if contact pairs say how they touch.
    """
    alike = np.zeros((count, count), int)
    np.add.at(alike, (pairs[:, 0], pairs[:, 1]), 1)
    given, kinds = {}, {}
    names = "solref", "solreffriction", "solimp", "margin", "gap", "friction", "dim"
    explicit = geoms[:, 2] >= 0
    for magnets, row in zip(pairs[explicit].tolist(), geoms[explicit].tolist(), strict=True):
        one, other, pair = row
        own = [geom - model.body_geomadr[model.geom_bodyid[geom]] for geom in (one, other)]
        numbers = [getattr(model, f"pair_{name}")[pair] for name in names]
        given.setdefault(tuple(magnets), []).append(np.hstack([own, *numbers]).tobytes())
    for magnets, rows in given.items():
        kind = (int(alike[magnets]), *sorted(rows))
        alike[magnets] = -1 - kinds.setdefault(kind, len(kinds))
    return alike


def geoms_of(model: mujoco.MjModel, magnet: Magnet, touching: NDArray) -> NDArray[np.int64]:
    """Return the geoms of a magnet that may touch another one."""
    both = np.unique(touching[:, :2])
    return both[model.body_weldid[model.geom_bodyid[both]] == magnet.body]


def contact_margin(model: mujoco.MjModel, one: int, other: int, pair: int) -> float:
    """Return the distance of two geoms at which their contact begins to push, in m."""
    if pair >= 0:
        return float(model.pair_margin[pair])
    if model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_OVERRIDE:
        return float(model.opt.o_margin)
    return float(model.geom_margin[[one, other]].sum())


def bounding_radii(model: mujoco.MjModel, geoms: NDArray) -> Array:
    """Return the radii of spheres around geoms, infinite for planes."""
    return np.where(model.geom_rbound[geoms] > 0, model.geom_rbound[geoms], np.inf)
