"""The potential energy of a model in any position, from the definitions of its forces."""

from collections.abc import Callable

import mujoco
import numpy as np

import magmotor_plugin
from magmotor.common.checks import reject
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.field_and_energy import magnetic_energy
from magmotor.mjcf.forces.marks import DIPOLES, POTENTIALS
from magmotor.mjcf.langevin.checks import colliding_geoms
from magmotor.mjcf.lookup import disabled, label

Energy = Callable[[mujoco.MjData], float]
"""The energy in J of a state whose positions are up to date."""

INSTEAD = "or pass `potential`"


def potential_energy(model: mujoco.MjModel) -> Energy:
    """Return the function that computes the potential energy of all forces of the position.

    Raises
    ------
    ValueError
        Some force has no known potential. The message names the element.
    """
    _check(model)
    terms = [_springs_and_gravity]
    passive = not (disabled(model, "spring") and disabled(model, "damper"))
    if passive and model.body_gravcomp.any():
        terms.append(_gravity_compensation)
    kinds = acting_forces(model)
    if kinds & DIPOLES and model.nuser_site:
        terms.append(magnetic_energy)
    if kinds & POTENTIALS and model.nuser_jnt:
        terms.append(_joint_potentials)
    return lambda data: sum(term(model, data) for term in terms)


def _springs_and_gravity(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    mujoco.mj_energyPos(model, data)
    return float(data.energy[0])


def _gravity_compensation(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    if disabled(model, "gravity"):
        return 0.0
    lift = model.body_gravcomp * model.body_mass
    return float(lift @ data.xipos @ model.opt.gravity)


def _joint_potentials(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    waves = model.jnt_user[:, : model.nuser_jnt // 2 * 2].reshape(model.njnt, -1, 2)
    phase = np.outer(data.qpos[model.jnt_qposadr], np.arange(1, waves.shape[1] + 1))
    return float(np.sum(waves[..., 0] * np.sin(phase) + waves[..., 1] * np.cos(phase)))


def _check(model: mujoco.MjModel) -> None:
    """Check that no other force of the position acts."""
    if model.nflex:
        raise reject("number of flexes", model.nflex, f"must be zero; remove them {INSTEAD}")
    others = int((model.plugin != magmotor_plugin.register()).sum())
    if others:
        sentence = f"must be zero, except for magmotor.forces; remove them {INSTEAD}"
        raise reject("number of plugins", others, sentence)
    for flag, elements in _refused(model).items():
        if elements and not disabled(model, flag):
            sentence = f"its potential is unknown; disable the flag {flag} {INSTEAD}"
            raise ValueError(f"{elements[0]}: {sentence}")


def _refused(model: mujoco.MjModel) -> dict[str, list[str]]:
    """Return the elements that have no known potential, by the flag that disables them."""

    def labels(kind: str, numbers: np.ndarray) -> list[str]:
        return [label(model, kind, i) for i in numbers]

    contacts = [" and ".join(labels("geom", pair)) for pair in colliding_geoms(model)]
    return {
        "limit": labels("joint", np.flatnonzero(model.jnt_limited))
        + labels("tendon", np.flatnonzero(model.tendon_limited)),
        "equality": labels("equality", np.flatnonzero(model.eq_active0)),
        "contact": labels("pair", np.arange(model.npair)) + contacts,
        "actuation": labels("actuator", np.flatnonzero(model.actuator_biastype)),
    }
