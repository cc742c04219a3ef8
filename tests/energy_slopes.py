"""Derivatives of the magnetic energy by central differences, which judge forces and torques."""

import copy

import mujoco
import numpy as np

import magmotor as mm


def slope_of_energy(model, data, motion, step, energy=mm.magnetic_energy):
    """The derivative of an energy along a motion (nv,), over a step both ways."""
    ends = []
    for sign in (1, -1):
        moved = copy.copy(data)
        mujoco.mj_integratePos(model, moved.qpos, motion, sign * step)
        mujoco.mj_kinematics(model, moved)
        ends.append(energy(model, moved))
    return (ends[0] - ends[1]) / (2 * step)


def forces_by_energy(model, data, steps, energy=mm.magnetic_energy):
    """Forces along all degrees of freedom (nv,); `steps` (nv,) may also be fewer, in turn."""
    steps = np.resize(steps, model.nv)
    motions = np.eye(model.nv)
    return -np.array([
        slope_of_energy(model, data, motion, step, energy)
        for motion, step in zip(motions, steps, strict=True)
    ])  # fmt: skip


def wrenches_by_energy(model, data, bodies, steps=(1e-6,)):
    """Forces and torques (bodies, 2, 3) on the first bodies, all free, about their origins."""
    found = forces_by_energy(model, data, steps).reshape(-1, 2, 3)[:bodies]
    # MuJoCo's torques on free bodies are along their own axes.
    turns = data.xmat[1 : 1 + bodies].reshape(-1, 3, 3)
    found[:, 1] = np.einsum("bij,bj->bi", turns, found[:, 1])
    return found
