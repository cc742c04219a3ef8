"""What the compiled loop needs to know of a model, read once."""

import itertools
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array, Integers
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.declarations.marks import NOISE
from magmotor.mjcf.declared import has_plugin
from magmotor.mjcf.lookup import disabled
from magmotor.mjcf.possible_contacts import may_touch


class Tree(NamedTuple):
    """Kinematic trees: what moves, and which kinds of forces of the position there are."""

    parents: Integers
    """Parent of each body, shape (nbody,)."""
    roots: Integers
    """Root body of each body's tree, shape (nbody,)."""
    weights: Array
    """Weight of each body in N, less its compensation, shape (nbody, 3)."""
    last_dofs: Integers
    """Last degree of freedom that moves each body, or -1, shape (nbody,)."""
    bodies: Integers
    """Body of each degree of freedom, shape (nv,)."""
    ancestors: Integers
    """Parent of each degree of freedom, or -1, shape (nv,)."""
    trees: Integers
    """Tree of each degree of freedom, shape (nv,)."""
    rotations: Integers
    """First degree of freedom of the rotation of each ball and free joint."""
    starts: Integers
    """First element of each row of M in MuJoCo's sparse form, and their end, shape (nv + 1,)."""
    columns: Integers
    """Column of each of these elements."""
    friction_starts: Integers
    """The same for friction, whose pattern contains that of M and of its own factorization."""
    friction_columns: Integers
    place: Integers
    """Position of the element (i, j) of the friction, at i nv + j, shape (nv^2,); -1 for none."""
    nested: bool
    """Whether each row of the friction begins with the elements of every row that it couples to."""
    springs: bool
    tendons: bool
    actuators: bool
    constraints: bool
    forces: int
    """Bits of the dipoles and potentials that act; see `magmotor.mjcf.declarations.marks`."""
    own_wrenches: bool
    """Whether their wrenches stay out of `xfrc_applied`, since the model has the plugin."""


class Dampers(NamedTuple):
    """All linear dampers, with their temperatures kT in J and the numbers of their baths."""

    thermal: Array
    """Temperature of the coldest bath times the velocities of each tree, shape (trees,)."""
    defect: float
    """Largest error of a tree's kinetic energy in a piece of free motion, over the smaller one of
    this energy and its thermal energy."""
    damping: Array
    """Of each degree of freedom, shape (nv,)."""
    kT: Array
    baths: Integers
    tendons: Integers
    """Damped tendons."""
    tendon_starts: Integers
    tendon_counts: Integers
    tendon_columns: Integers
    tendon_damping: Array
    tendon_kT: Array
    tendon_baths: Integers
    actuators: Integers
    """Outputs of damped actuators."""
    actuator_damping: Array
    actuator_kT: Array
    actuator_baths: Integers
    rows: Array
    """Rows a_k of a friction matrix sum_k a_k a_k^T, shape (rows, nv)."""
    drag: Array
    """Translational and rotational Stokes drag, shape (n, 2)."""
    drag_bodies: Integers
    drag_geoms: Integers
    """Geom at whose center each drag acts; -1 for the body's center of mass."""
    drag_kT: Array
    drag_baths: Integers
    rate: float
    """Rate of the friction rate M, in 1/s."""
    constraint_kT: float
    """Temperature of constraints, rows and rate."""
    has_rows: bool
    """Whether tendons or actuators damp."""


def read_tree(
    model: mujoco.MjModel, rows: list[list[int]], *, full: bool, mujoco_steps: bool
) -> Tree:
    """Read the trees of a model.

    Parameters
    ----------
    model : mujoco.MjModel
    rows : list of list of int
        Degrees of freedom that each damper couples, besides those of a body and its ancestors.
    full : bool
        Whether dampers may couple any degrees of freedom.
    mujoco_steps : bool
        Whether MuJoCo itself takes care of constraints.
    """
    starts = np.append(model.M_rowadr, model.nC).astype(np.int64)
    last = np.full(model.nbody, -1)
    for body in range(1, model.nbody):
        own = model.body_dofnum[body]
        dof, parent = model.body_dofadr[body] + own - 1, last[model.body_parentid[body]]
        last[body] = dof if own else parent
    friction_starts, friction_columns = _pattern(model, rows, full=full)
    place = np.full((model.nv, model.nv), -1)
    for row in range(model.nv):
        span = slice(friction_starts[row], friction_starts[row + 1])
        place[row, friction_columns[span]] = np.arange(span.start, span.stop)
    lifted = not (disabled(model, "spring") and disabled(model, "damper"))
    carried = model.body_mass * (1 - lifted * model.body_gravcomp)
    gravity = np.zeros(3) if disabled(model, "gravity") else model.opt.gravity
    springs = (model.jnt_stiffness, model.jnt_stiffnesspoly)
    tendon_springs = (model.tendon_stiffness, model.tendon_stiffnesspoly)
    actuators = model.nu > 0 and not disabled(model, "actuation")
    limits = model.jnt_limited.any() and not disabled(model, "limit")
    constraints = bool(limits or coupling_constraints(model)) and not mujoco_steps
    return Tree(
        parents=_integers(model.body_parentid),
        roots=_integers(model.body_rootid),
        weights=np.outer(carried, gravity),
        last_dofs=_integers(last),
        bodies=_integers(model.dof_bodyid),
        ancestors=_integers(model.dof_parentid),
        trees=_integers(model.dof_treeid),
        rotations=_integers(_rotations(model)),
        starts=starts,
        columns=_integers(model.M_colind),
        friction_starts=friction_starts,
        friction_columns=friction_columns,
        place=place.ravel(),
        nested=full or _nested(friction_starts, friction_columns),
        springs=not disabled(model, "spring") and any(a.any() for a in (*springs, *tendon_springs)),
        tendons=model.ntendon > 0,
        actuators=actuators,
        constraints=constraints,
        forces=acting_forces(model) & ~NOISE,
        own_wrenches=has_plugin(model),
    )


def coupling_constraints(model: mujoco.MjModel) -> bool:
    """Return whether constraints may couple velocities, as all but limits of single joints do."""
    turns = model.jnt_type == int(mujoco.mjtJoint.mjJNT_BALL)
    limits = model.tendon_limited.any() or (model.jnt_limited * turns).any()
    return bool(
        (limits and not disabled(model, "limit"))
        or (model.neq and not disabled(model, "equality"))
        or may_touch(model)
    )


def _rotations(model: mujoco.MjModel) -> NDArray[np.int32]:
    free = model.jnt_type == int(mujoco.mjtJoint.mjJNT_FREE)
    turns = free | (model.jnt_type == int(mujoco.mjtJoint.mjJNT_BALL))
    return (model.jnt_dofadr + 3 * free)[turns]


def _integers(values: NDArray[Any]) -> Integers:
    return np.ascontiguousarray(values, dtype=np.int64)


def _pattern(
    model: mujoco.MjModel, rows: list[list[int]], *, full: bool
) -> tuple[Integers, Integers]:
    """Return where the friction, M and their factor L^T D L may have elements, row by row."""
    columns = [{i} for i in range(model.nv)]
    for i, found in enumerate(columns):
        ancestor = model.dof_parentid[i]
        while ancestor >= 0:
            found.add(int(ancestor))
            ancestor = model.dof_parentid[ancestor]
        if full:
            found.update(range(i))
    for row in [] if full else rows:
        for i in row:
            columns[i].update(j for j in row if j < i)
    for found in [] if full else reversed(columns):  # elimination of a row couples its columns
        for i in sorted(found)[:-1]:
            columns[i].update(j for j in found if j < i)
    starts = np.cumsum([0, *map(len, columns)])
    return starts, np.array([j for found in columns for j in sorted(found)], dtype=np.int64)


def _nested(starts: Integers, columns: Integers) -> bool:
    """Return whether each row begins with the columns of every row whose number it contains."""
    rows = [columns[a:b].tolist() for a, b in itertools.pairwise(starts)]
    return all(row[: len(rows[j])] == rows[j] for row in rows for j in row)


class Room(NamedTuple):
    """Scratch memory of one thread."""

    qpos: Array
    position: Array
    qvel: Array
    start: Array
    rate: Array
    change: Array
    middle: Array
    velocity_sum: Array
    acceleration_sum: Array
    applied: Array
    bias: Array
    acceleration: Array
    first: Array
    force: Array
    kick: Array
    zero: Array
    row: Array
    before: Array
    after: Array
    wrenches: Array
    drag: Array
    twist: Array
    wrench: Array
    matrix: Array
    factor: Array
    exchanged: Array


def room_for(model: mujoco.MjModel, tree: Tree, baths: int) -> Room:
    """Return scratch memory for one thread."""
    n, trees = model.nv, int(model.dof_treeid.max(initial=-1)) + 1
    sizes = {
        "qpos": model.nq,
        "position": model.nq,
        "before": trees,
        "after": trees,
        "wrenches": (model.nbody, 6),
        "drag": (model.nbody, 10),
        "twist": 6,
        "wrench": 6,
        "matrix": len(tree.friction_columns),
        "factor": len(tree.friction_columns),
        "exchanged": baths + 1,
    }
    return Room(**{name: np.zeros(sizes.get(name, n)) for name in Room._fields})
