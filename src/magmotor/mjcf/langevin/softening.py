"""Soft constraints that the timestep resolves, in the copy of a model that is integrated."""

import copy
import warnings

import mujoco
import numpy as np

from magmotor.common.arrays import Array
from magmotor.common.exceptions import ArgumentError
from magmotor.mjcf.langevin.own_model import SMALLEST_INERTIA
from magmotor.mjcf.lookup import disabled, label
from magmotor.mjcf.possible_contacts import colliding_geoms

FASTEST_CONSTRAINT = 0.5
"""Largest product of the timestep and of a constraint's frequency, with the assumed inertia.

Several limits on one joint, and the slope of the impedance, add up to 2.5 times as much; the
contacts of one body are counted.
"""

FASTEST_POSE = 1.0
"""The same in the sampled pose in which the constraint moves least inertia."""

POSES = 100
"""Number of sampled poses."""

BEYOND = 1e9
"""Range, in rad or m below any position, that makes each limit act in every pose."""


def soften(own: mujoco.MjModel) -> None:
    """Make soft constraints so soft that the timestep resolves their oscillation, and warn of it.

    By the flag refsafe, MuJoCo itself does the same for its own integrators. The frequency of a
    constraint is that of its spring and of the inertia that it assumes, which is that of `qpos0`;
    limits and equalities are also softened to suit poses in which they move less inertia.
    """
    # A weld has a potential only if its impedance does not depend on the residual.
    welds = own.eq_type == int(mujoco.mjtEq.mjEQ_WELD)
    own.eq_solimp[welds, 1] = own.eq_solimp[welds, 0]
    if disabled(own, "refsafe") or disabled(own, "constraint"):
        return
    own.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_REFSAFE)
    rigid = own.tendon_limited * (own.tendon_invweight0 < SMALLEST_INERTIA)
    for tendon in [] if disabled(own, "limit") else np.flatnonzero(rigid):
        sentence = "must be off, since the tendon does not move at qpos0, which makes it rigid"
        raise ArgumentError(f"{label(own, 'tendon', tendon)}: limited", True, sentence)
    contacts = _colliding(own)
    kinds = {
        "joint limits": (own.jnt_solref, own.jnt_solimp, own.jnt_limited, "limit"),
        "tendon limits": (
            own.tendon_solref_lim,
            own.tendon_solimp_lim,
            own.tendon_limited,
            "limit",
        ),
        "equalities": (own.eq_solref, own.eq_solimp, np.ones(own.neq), "equality"),
        "contacts of geoms": (own.geom_solref, own.geom_solimp, contacts, "contact"),
        "contact pairs": (own.pair_solref, own.pair_solimp, np.ones(own.npair), "contact"),
    }
    lightness, softened = _lightness(own), []
    for kind, (solref, solimp, exists, flag) in kinds.items():
        excess = _frequencies(solref, solimp) * own.opt.timestep / FASTEST_CONSTRAINT
        if kind in lightness:
            excess *= np.maximum(1, np.sqrt(lightness[kind]) * FASTEST_CONSTRAINT / FASTEST_POSE)
        if flag == "contact":
            excess *= np.sqrt(_most_contacts(own, contacts))
        stiff = (excess > 1) & (np.asarray(exists) > 0)
        if disabled(own, flag) or not stiff.any():
            continue
        standard = solref[:, 0] > 0
        solref[stiff & standard, 0] *= excess[stiff & standard]
        direct = stiff & ~standard
        solref[direct] /= np.column_stack([excess[direct] ** 2, excess[direct]])
        softened.append(f"{kind} ({stiff.sum()}, up to {excess[stiff].max():.2g} times slower)")
    if softened:
        warnings.warn(
            f"soft constraints are softened to suit the timestep {own.opt.timestep:g}:"
            f" {'; '.join(softened)}; take a shorter timestep, or increase their solref, to keep"
            " them as they are; effective_model has the potential used",
            stacklevel=4,
        )


def _lightness(model: mujoco.MjModel) -> dict[str, Array]:
    """Return the inertia that limits and equalities assume, over the least one they move.

    For a constraint with the Jacobian row J, the inverse of the inertia is J M^-1 J^T. The poses
    are random and always the same.
    """
    probe = copy.copy(model)
    probe.jnt_range[:] = probe.tendon_range[:] = -2 * BEYOND, -BEYOND
    probe.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    probe.opt.enableflags = 0
    probe.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    data = mujoco.MjData(probe)
    data.eq_active[:] = 1
    kinds = mujoco.mjtConstraint
    found = {
        "joint limits": (kinds.mjCNSTR_LIMIT_JOINT, np.zeros(model.njnt)),
        "tendon limits": (kinds.mjCNSTR_LIMIT_TENDON, np.zeros(model.ntendon)),
        "equalities": (kinds.mjCNSTR_EQUALITY, np.zeros(model.neq)),
    }
    for pose in _poses(model):
        data.qpos[:] = pose
        mujoco.mj_fwdPosition(probe, data)
        if data.nefc == 0:
            break
        rows = data.efc_J.reshape(data.nefc, model.nv)
        accelerations = np.empty_like(rows)
        mujoco.mj_solveM(probe, data, accelerations, rows)
        impedances = data.efc_KBIP.reshape(-1, 4)[:, 2]
        assumed = data.efc_R * impedances / (1 - impedances)
        ratios = (rows * accelerations).sum(axis=1) / assumed
        for kind, largest in found.values():
            chosen = data.efc_type == int(kind)
            np.maximum.at(largest, data.efc_id[chosen], ratios[chosen])
    return {name: largest for name, (_, largest) in found.items()}


def _poses(model: mujoco.MjModel) -> Array:
    """Return random positions, shape (POSES, nq), with free joints as in `qpos0`.

    Joints are uniform within their limits, and without any, on the circle or over the extent of
    the model.
    """
    rng = np.random.default_rng(0)
    poses = np.tile(model.qpos0, (POSES, 1))
    for joint, first in enumerate(model.jnt_qposadr):
        kind = mujoco.mjtJoint(model.jnt_type[joint])
        if kind == mujoco.mjtJoint.mjJNT_BALL:
            poses[:, first : first + 4] = rng.standard_normal((POSES, 4))
        elif kind != mujoco.mjtJoint.mjJNT_FREE:
            half = np.pi if kind == mujoco.mjtJoint.mjJNT_HINGE else model.stat.extent
            within = model.jnt_range[joint] if model.jnt_limited[joint] else (-half, half)
            poses[:, first] = rng.uniform(*within, size=POSES)
    return poses


def _colliding(model: mujoco.MjModel) -> Array:
    """Return which geoms may have contacts, shape (ngeom,)."""
    found = np.zeros(model.ngeom)
    found[colliding_geoms(model).ravel()] = 1
    return found


def _most_contacts(model: mujoco.MjModel, colliding: Array) -> float:
    """Return how many contacts one body may have with a plane; each adds to the stiffness."""
    of_type = {int(mujoco.mjtGeom.mjGEOM_SPHERE): 1, int(mujoco.mjtGeom.mjGEOM_CAPSULE): 2}
    points = np.array([of_type.get(int(kind), 4) for kind in model.geom_type])
    moving = model.body_dofnum[model.body_weldid[model.geom_bodyid]] > 0
    contacts = np.bincount(model.geom_bodyid, points * (colliding > 0) * moving, model.nbody)
    return max(1.0, float(contacts.max(initial=1.0)))


def _frequencies(solref: Array, solimp: Array) -> Array:
    """Return the angular frequency of each constraint in rad/s; see MuJoCo's manual, Modeling."""
    width = np.clip(solimp[:, 1], 1e-4, 1 - 1e-4)
    constant, ratio = solref.T
    standard = 1 / np.maximum(width * constant * ratio, 1e-15) ** 2
    stiffness = np.where(constant > 0, standard, -constant / width**2)
    return width * np.sqrt(stiffness / (1 - width))
