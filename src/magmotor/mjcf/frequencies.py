"""How fast magnets turn and swing in one another's field.

A magnet of the moment m turns in the field B against the stiffness m B, and another magnet that
follows its turns stiffens it. It swings against the gradient of the force, at most 4 F/r of each
partner, twice that if the partner swings, too.
"""

import math
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.dipoles import COINCIDENCE, PERMEABILITY_OVER_4PI
from magmotor.mjcf.closest_approach import Magnet
from magmotor.mjcf.contact_rule import Approach
from magmotor.mjcf.field_and_energy import coupling_factors, dipole_sites


class Stiffness(NamedTuple):
    """What holds the dipoles of a model in place, shape (n,), worst case."""

    turning: Array
    """In N m."""
    swinging: Array
    """In N/m."""


def frequencies(model: mujoco.MjModel, data: mujoco.MjData) -> dict[int, float]:
    """Return the frequency in rad/s of each rigid body with dipoles that can move."""
    positions, moments, bodies = dipole_sites(model, data)
    sites = np.flatnonzero(model.site_user[:, 0]) if len(bodies) else np.empty(0, int)
    welds = model.body_weldid[bodies]
    stiffness = _stiffness(model, positions, moments, bodies)
    found = {}
    for weld in np.unique(welds):
        own = np.flatnonzero(welds == weld)
        if _moves(model, int(weld)):
            rows = [
                np.vstack([np.sqrt(stiffness.swinging[i]) * linear,
                           np.sqrt(stiffness.turning[i]) * turning])
                for i in own
                for linear, turning in [_jacobians(model, data, int(sites[i]), moments[i])]
            ]  # fmt: skip
            found[int(weld)] = _frequency(model, data, np.vstack(rows))
    return found


def frequency_at_touch(
    model: mujoco.MjModel, data: mujoco.MjData, pair: tuple[Magnet, Magnet], approach: Approach
) -> float:
    """Return the largest frequency in rad/s of two magnets that touch.

    The stiffness against a turn of dipoles is F d/3 and, if both can turn, F d/2 (both head to tail
    and side by side, where they turn in opposite directions).
    """
    responses = [_turning_response(model, data, magnet.body) for magnet in pair]
    stiffness = approach.force * approach.distance / (2 if all(responses) else 3)
    return max(2 / approach.time, math.sqrt(stiffness * max(responses)))


def _turning_response(model: mujoco.MjModel, data: mujoco.MjData, weld: int) -> float:
    """Return the largest inverse inertia, in 1/(kg m^2), against which a torque turns a dipole."""
    if not _moves(model, weld):
        return 0.0
    _, moments, bodies = dipole_sites(model, data)
    sites = np.flatnonzero(model.site_user[:, 0])
    return max(
        _frequency(model, data, _jacobians(model, data, int(sites[i]), moments[i])[1]) ** 2
        for i in np.flatnonzero(model.body_weldid[bodies] == weld)
    )


def _moves(model: mujoco.MjModel, weld: int) -> bool:
    return bool(model.body_dofnum[weld])


def _stiffness(
    model: mujoco.MjModel, positions: Array, moments: Array, bodies: NDArray[np.int64]
) -> Stiffness:
    factor, follows = coupling_factors(model), model.body_dofnum[model.body_weldid[bodies]] > 0
    factors = {
        one: np.array([factor(one, int(other)) for other in bodies])
        for one in np.unique(bodies).tolist()
    }
    strengths, turning, swinging = np.linalg.norm(moments, axis=1), [], []
    for i, body in enumerate(bodies.tolist()):
        scale = PERMEABILITY_OVER_4PI * factors[body]
        apart = positions[i] - positions
        distance = np.maximum(np.linalg.norm(apart, axis=1), COINCIDENCE)
        along = (apart * moments).sum(axis=1) / distance**2
        field = scale @ ((3 * along[:, np.newaxis] * apart - moments) / distance[:, None] ** 3)
        of_each = abs(scale) * strengths / distance**3
        turning.append(strengths[i] * (np.linalg.norm(field) + of_each @ follows))
        swinging.append(24 * strengths[i] * (of_each / distance**2) @ (1 + follows))
    return Stiffness(np.array(turning), np.array(swinging))


def _jacobians(
    model: mujoco.MjModel, data: mujoco.MjData, site: int, moment: Array
) -> tuple[Array, Array]:
    """Return the Jacobians of a dipole's place, and of its turns that a torque can cause."""
    linear, turning = np.zeros((2, 3, model.nv))
    mujoco.mj_jacSite(model, data, linear, turning, site)
    axis = moment / np.linalg.norm(moment)
    return linear, turning - np.outer(axis, axis @ turning)


def _frequency(model: mujoco.MjModel, data: mujoco.MjData, rows: Array) -> float:
    """Return the root of the largest eigenvalue of R M^-1 R^T."""
    response = np.empty_like(rows)
    mujoco.mj_solveM(model, data, response, np.ascontiguousarray(rows))
    return float(np.sqrt(max(0.0, np.linalg.eigvalsh(rows @ response.T)[-1])))
