"""The conservative forces of a model in any position, as MuJoCo applies them to bodies at rest."""

from collections.abc import Callable

import mujoco
import numpy as np

from magmotor.common.arrays import Array
from magmotor.common.exceptions import InputError
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.declarations.marks import NOISE
from magmotor.mjcf.lookup import label

Forces = Callable[[mujoco.MjData], Array]
"""The generalized forces (nv,) of a state at rest whose positions are up to date."""

CONSTRAINT = mujoco.mjtConstraint
EQUALITY, FRICTIONLESS = (
    int(CONSTRAINT.mjCNSTR_EQUALITY),
    int(CONSTRAINT.mjCNSTR_CONTACT_FRICTIONLESS),
)
LIMITS = int(CONSTRAINT.mjCNSTR_LIMIT_JOINT), int(CONSTRAINT.mjCNSTR_LIMIT_TENDON)


def without_noise(model: mujoco.MjModel) -> mujoco.MjModel:
    """Return a copy of a model without Brownian wrenches, in which no body sleeps."""
    copy = mujoco.MjModel.__copy__(model)
    copy.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    if acting_forces(model) & NOISE:
        copy.body_user[:] = 0.0
    return copy


def resting_forces(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Compute the generalized forces (nv,) of a state at rest, inside `magnetism`.

    A limit, an equality or a contact without friction, of residual r, acts by the force -K I r / R
    of MuJoCo's reference acceleration, which depends on r alone.

    Raises
    ------
    ValueError
        A contact has friction; the message names its geoms.
    """
    mujoco.mj_forward(model, data)
    force = data.qfrc_smooth.copy()
    if data.nefc:
        kinds, rows = data.efc_type, data.efc_D * data.efc_aref
        if (kinds > FRICTIONLESS).any():
            contact = data.contact[data.efc_id[kinds > FRICTIONLESS][0]]
            both = " and ".join(label(model, "geom", geom) for geom in contact.geom)
            sentence = "the contact has friction, which has no potential; disable the flag contact"
            raise InputError(f"{both}: {sentence}")
        one_sided = np.isin(kinds, (*LIMITS, FRICTIONLESS))
        rows = np.where(one_sided, np.maximum(rows, 0.0), np.where(kinds == EQUALITY, rows, 0.0))
        constraint = np.empty(model.nv)
        mujoco.mj_mulJacTVec(model, data, constraint, rows)
        force += constraint
    return force
