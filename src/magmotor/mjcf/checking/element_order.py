"""Whether joints and degrees of freedom follow one another as their bodies and trees do.

MuJoCo's compiler sorts them so, and its functions and those of `check` rely on it. It does not hold
in a damaged binary, or where a program has assigned to a model.
"""

import mujoco
import numpy as np

from magmotor.common.exceptions import InputError


def require_order(model: mujoco.MjModel) -> None:
    """Raise an error if the parts of a model are not in order."""
    m = model
    for what, count, first, owner in (
        ("body_jntnum, body_jntadr and jnt_bodyid", m.body_jntnum, m.body_jntadr, m.jnt_bodyid),
        ("body_dofnum, body_dofadr and dof_bodyid", m.body_dofnum, m.body_dofadr, m.dof_bodyid),
        ("tree_dofnum, tree_dofadr and dof_treeid", m.tree_dofnum, m.tree_dofadr, m.dof_treeid),
    ):
        valid = (count >= 0).all() and count.sum() == len(owner)
        valid &= (first == np.where(count > 0, np.cumsum(count) - count, -1)).all()
        if not (valid and (owner == np.repeat(np.arange(len(count)), count)).all()):
            raise InputError(f"{what} of the model do not agree")
