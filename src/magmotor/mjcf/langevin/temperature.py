"""The temperature of a model's noise: that of the damping which acts on the same velocities."""

from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

import magmotor_plugin
from magmotor.common.arrays import Array
from magmotor.mjcf.langevin.checks import colliding_geoms
from magmotor.mjcf.langevin.model import joint_damping, langevin_model
from magmotor.mjcf.lookup import disabled

MATCH = 1e-6
"""Relative difference up to which noise has the temperature of the damping."""


def joined(words: Sequence[str]) -> str:
    """Return words with commas, and `and` before the last one."""
    return " and ".join(filter(None, [", ".join(words[:-1]), *words[-1:]]))


def temperatures(model: mujoco.MjModel) -> tuple[tuple[float, float] | None, str]:
    """Return the extreme temperatures kT; None and a reason if they are unknown."""
    try:
        langevin = langevin_model(model)
        damping, noise = langevin.damping, langevin.noise
    except ValueError:
        if others := [*_other_dampers(model)]:
            return None, f"{joined(others)} may damp"
        damping, noise = joint_damping(model), _noise(model)
    if not noise.any():
        return None, "noise drives no joint"
    return _extremes(damping, noise @ noise.T / 2), ""


def _noise(model: mujoco.MjModel) -> Array:
    """Return the generalized forces (nv, rows) of all Brownian wrenches at `qpos0`."""
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    jacobian = np.empty((6, model.nv))
    channels = []
    for body, row in enumerate(model.body_user[:, : model.nuser_body // 6 * 6]):
        mujoco.mj_jacBodyCom(model, data, jacobian[:3], jacobian[3:], body)
        channels.append(row.reshape(-1, 6) @ jacobian)
    return np.vstack(channels).T


def _extremes(damping: Array, drive: Array) -> tuple[float, float]:
    """Return the extreme temperatures kT of all directions of velocity, damped or driven."""
    scale = np.sqrt(np.maximum(np.diag(damping), 0))
    damped = scale > 0
    if np.diag(drive)[~damped].any():
        return 0.0, np.inf
    scaled = damping[np.ix_(damped, damped)] / np.outer(scale[damped], scale[damped])
    driven = drive[np.ix_(damped, damped)] / np.outer(scale[damped], scale[damped])
    rates, directions = np.linalg.eigh(scaled)
    free = rates < MATCH
    if (directions[:, free].T @ driven @ directions[:, free] > MATCH * driven.max()).any():
        return 0.0, np.inf
    whitened = directions[:, ~free] / np.sqrt(rates[~free])
    temperatures = np.linalg.eigvalsh(whitened.T @ driven @ whitened)
    return max(0.0, float(temperatures[0])), float(temperatures[-1])


def _other_dampers(model: mujoco.MjModel) -> Iterator[str]:
    """Yield what may damp besides the linear damping of joints and fixed tendons."""

    def acts(flag: str, *fields: NDArray[Any]) -> bool:
        return not disabled(model, flag) and any(field.any() for field in fields)

    fixed = model.wrap_type[model.tendon_adr] == int(mujoco.mjtWrap.mjWRAP_JOINT)
    collide = model.npair + model.nflex > 0 or len(colliding_geoms(model)) > 0
    passive = not (disabled(model, "spring") and disabled(model, "damper"))
    present = {
        "actuators": acts("actuation", _velocity_dependent_actuators(model))
        or acts("damper", model.actuator_damping, model.actuator_dampingpoly),
        "polynomial damping": acts("damper", model.dof_dampingpoly, model.tendon_dampingpoly),
        "spatial tendons": acts("damper", model.tendon_damping[~fixed]),
        "friction loss": acts("frictionloss", model.dof_frictionloss, model.tendon_frictionloss),
        "limits": acts("limit", model.jnt_limited, model.tendon_limited),
        "equalities": acts("equality", model.eq_active0),
        "contacts": collide and not disabled(model, "contact"),
        "flexes": passive and model.nflex > 0,
        "a fluid": passive and (model.opt.density > 0 or model.opt.viscosity > 0),
        "plugins": bool((model.plugin != magmotor_plugin.register()).any()),
    }
    return (name for name, exists in present.items() if exists)


def _velocity_dependent_actuators(model: mujoco.MjModel) -> NDArray[np.bool_]:
    """Whether the force of each actuator may depend on velocities, shape (nactuator,)."""
    affine = int(mujoco.mjtGain.mjGAIN_AFFINE)  # like mjBIAS_AFFINE; only constants are below it
    other = (model.actuator_gaintype > affine) | (model.actuator_biastype > affine)
    return other | (model.actuator_gainprm[:, 2] != 0) | (model.actuator_biasprm[:, 2] != 0)
