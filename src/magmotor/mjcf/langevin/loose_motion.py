"""Warnings of motions that never reach equilibrium: undamped ones, and those that fall forever."""

from collections.abc import Iterator

import mujoco
import numpy as np

from magmotor.common.arrays import Array, Integers
from magmotor.mjcf.boltzmann.forces import resting_forces
from magmotor.mjcf.langevin.friction import Friction, friction_matrix
from magmotor.mjcf.lookup import disabled, label

REACH = 10.0
"""How far a tree is moved, in sizes of the model, to see whether anything but gravity acts."""

SMALL = 1e-6
"""Relative difference of two forces that are the same but for rounding."""

FULL = mujoco.mjtWarning.mjWARN_CONTACTFULL, mujoco.mjtWarning.mjWARN_CNSTRFULL
"""Warnings of MuJoCo after which forces are missing."""

SLIDE, FREE = int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_FREE)


def loose_motions(
    model: mujoco.MjModel, friction: Friction, *, mujoco_steps: bool
) -> Iterator[str]:
    """Yield warnings of trees that nothing damps, or damps as a whole, or that fall forever.

    Parameters
    ----------
    model : mujoco.MjModel
    friction : Friction
    mujoco_steps : bool
        Whether MuJoCo's own steps solve the constraints, which may have any friction then.
    """
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    damped = friction_matrix(model, data, friction).diagonal()
    for tree in range(model.ntree):
        dofs = np.flatnonzero(model.dof_treeid == tree)
        name = label(model, "joint", model.dof_jntid[dofs[0]])
        first, translations = _of_the_whole(model, dofs)
        loose = [dof for dof in first if damped[dof] == 0 and _unforced(model, dof, mujoco_steps)]
        if not damped[dofs].any() or loose:
            whole = "the motion of its tree as a whole" if damped[dofs].any() else "its tree"
            yield (
                f"{name}: nothing damps {whole}, which never reaches kT unless forces couple it to"
                " what is damped; give a rate such as friction=1.0, or viscosity"
            )
        if not mujoco_steps and any(_falls(model, dof) for dof in translations):
            yield (
                f"{name}: nothing holds its tree, which falls forever and has no equilibrium:"
                " disable gravity, too, or keep the contact with a floor, without friction"
            )


def _of_the_whole(model: mujoco.MjModel, dofs: Integers) -> tuple[list[int], list[int]]:
    """Return the degrees of freedom that move a tree as a whole, and those that do not turn it."""
    mass = model.body_subtreemass[model.dof_bodyid[dofs]]
    first = dofs[mass == mass[0]].tolist()
    kinds = model.jnt_type[model.dof_jntid[first]]
    if kinds[0] == FREE:
        return first, first[:3]
    return first, first[: int(np.argmax(np.append(kinds, FREE) != SLIDE))]


def _unforced(model: mujoco.MjModel, dof: int, mujoco_steps: bool) -> bool:
    """Return whether no force but a constant one acts on a motion, so far as MuJoCo knows."""
    return (
        mujoco_steps or np.ptp(_forces_on(model, dof, spread=1.0)) < SMALL * model.body_mass.sum()
    )


def _falls(model: mujoco.MjModel, dof: int) -> bool:
    """Return whether the same weight acts on a tree wherever it is moved.

    Forces that MuJoCo does not know, by numbers of sites and joints, may hold it.
    """
    if disabled(model, "gravity") or model.site_user.any() or model.jnt_user.any():
        return False
    forces = _forces_on(model, dof, spread=0.0)
    return np.ptp(forces) < SMALL * abs(forces).max() > SMALL**2 * model.body_mass.sum()


def _forces_on(model: mujoco.MjModel, dof: int, spread: float) -> Array:
    """Return the force on a motion at `qpos0` and far from there, where all joints are moved."""
    joint = model.dof_jntid[dof]
    slides = model.jnt_type[joint] == SLIDE or dof - model.jnt_dofadr[joint] < 3
    data, random = mujoco.MjData(model), np.random.default_rng(0)
    reach = REACH * (1.0 + model.stat.extent) if slides else 1.0
    forces = []
    for move in (0.0, reach, -reach):
        mujoco.mj_resetData(model, data)
        step = spread * random.standard_normal(model.nv)
        step[dof] += move
        mujoco.mj_integratePos(model, data.qpos, step, 1.0)
        force = resting_forces(model, data)[dof]
        full = any(data.warning[kind].number for kind in FULL)
        forces.append(np.nan if full else force)
    return np.array(forces)
