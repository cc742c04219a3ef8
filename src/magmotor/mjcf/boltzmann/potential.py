"""The potential energy of a model in any position, from the definitions of its forces."""

from collections.abc import Callable
from functools import partial

import mujoco
import numpy as np

from magmotor.common.exceptions import ArgumentError
from magmotor.mjcf.boltzmann.actuators import springs
from magmotor.mjcf.boltzmann.limits import limits
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.declarations.marks import DIPOLES, HYSTERESIS, IRON, POTENTIALS, SHAPES
from magmotor.mjcf.declarations.table import MEMORIES
from magmotor.mjcf.declared import rows
from magmotor.mjcf.field_and_energy import magnetic_energy
from magmotor.mjcf.lookup import disabled, foreign_plugins, label
from magmotor.mjcf.possible_contacts import colliding_geoms

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
    terms: list[Energy] = [each.energy for each in (*springs(model), *limits(model))]
    kinds = acting_forces(model)
    functions = {
        _springs_and_gravity: True,
        _gravity_compensation: model.body_gravcomp.any(),
        magnetic_energy: kinds & (DIPOLES | IRON | SHAPES),
        _joint_potentials: kinds & POTENTIALS and model.nuser_jnt,
    }
    terms += [partial(function, model) for function, acts in functions.items() if acts]
    return lambda data: sum(term(data) for term in terms)


def _springs_and_gravity(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    mujoco.mj_energyPos(model, data)
    return float(data.energy[0])


def _gravity_compensation(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    passive = not (disabled(model, "spring") and disabled(model, "damper"))
    if disabled(model, "gravity") or not passive:
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
        raise ArgumentError("number of flexes", model.nflex, f"must be zero {INSTEAD}")
    if others := foreign_plugins(model):
        sentence = f"must be zero, except for those of magmotor, {INSTEAD}"
        raise ArgumentError("number of plugins", others, sentence)
    for row in rows(model, MEMORIES) if acting_forces(model) & HYSTERESIS else ():
        sentence = f"must be known; leave the word hysteresis out of the mark {INSTEAD}"
        raise ArgumentError(f"{label(model, 'tuple', row.tuple)}: potential", "unknown", sentence)
    contacts = [
        *(label(model, "pair", pair) for pair in range(model.npair)),
        *(
            " and ".join(label(model, "geom", geom) for geom in pair)
            for pair in colliding_geoms(model)
        ),
    ]
    equalities = [label(model, "equality", i) for i in np.flatnonzero(model.eq_active0)]
    for flag, elements in {"contact": contacts, "equality": equalities}.items():
        if elements and not disabled(model, flag):
            sentence = f"must be known; disable the flag {flag} {INSTEAD}"
            raise ArgumentError(f"{elements[0]}: potential", "unknown", sentence)
