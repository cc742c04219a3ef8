"""The temperature of a model's noise: that of the damping which acts on the same velocities."""

from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.mjcf.langevin.friction import friction_matrix, model_friction
from magmotor.mjcf.langevin.lone_model import read_lone_bodies
from magmotor.mjcf.lookup import disabled, foreign_plugins
from magmotor.mjcf.possible_contacts import colliding_geoms

MATCH = 1e-6
"""Relative difference up to which noise has the temperature of the damping."""

CONFIGURATIONS = 8
"""Number of random configurations, besides `qpos0`, in which noise and damping are compared."""


def joined(words: Sequence[str]) -> str:
    """Return words with commas, and `and` before the last one."""
    return " and ".join(filter(None, [", ".join(words[:-1]), *words[-1:]]))


def temperatures(model: mujoco.MjModel) -> tuple[tuple[float, float] | None, float, str]:
    """Return the extreme temperatures kT, and by how much noise and damping differ.

    The difference is the largest one of noise/kT and damping, over the largest damping, with the
    kT that fits best. If the temperatures are unknown, the result is None, 0 and a reason.
    """
    try:
        lone = read_lone_bodies(model)
        pairs = [(lone.damping, lone.noise @ lone.noise.T / 2)]
    except ValueError:
        if others := [*_other_dampers(model)]:
            return None, 0.0, f"{joined(others)} may damp"
        try:
            friction = model_friction(model)
            pairs = [
                (friction_matrix(model, data, friction), drive(model, data, model.body_user))
                for data in configurations(model)
            ]
        except ValueError as error:
            return None, 0.0, f"its friction is not linear ({error})"
    damping, driven = (np.array(matrices) for matrices in zip(*pairs, strict=True))
    if not np.isfinite(damping).all():
        return None, 0.0, "its friction is not a finite number"
    if not driven.any():
        return None, 0.0, "noise drives no joint"
    extremes = np.array([_extremes(*pair) for pair in pairs])
    return (
        (float(extremes[:, 0].min()), float(extremes[:, 1].max())),
        _difference(damping, driven),
        "",
    )


def configurations(model: mujoco.MjModel) -> Iterator[mujoco.MjData]:
    """Yield one `MjData` in `qpos0` and in random configurations, with positions computed."""
    data, generator = mujoco.MjData(model), np.random.default_rng(0)
    for k in range(CONFIGURATIONS + 1):
        mujoco.mj_resetData(model, data)
        mujoco.mj_integratePos(model, data.qpos, generator.normal(size=model.nv), float(k > 0))
        mujoco.mj_fwdPosition(model, data)
        yield data


def drive(model: mujoco.MjModel, data: mujoco.MjData, rows: Array) -> Array:
    """Return J^T w w^T J/2 of Brownian wrenches w, shape (nv, nv); it is kT C in equilibrium.

    `rows` is like `body_user`, whose numbers beyond whole rows of six do not act.
    """
    jacobian = np.empty((6, model.nv))
    channels = []
    for body, row in enumerate(rows[:, : rows.shape[1] // 6 * 6]):
        if row.any():
            mujoco.mj_jacBodyCom(model, data, jacobian[:3], jacobian[3:], body)
            channels.append(row.reshape(-1, 6) @ jacobian)
    noise = np.vstack([np.zeros((0, model.nv)), *channels])
    return noise.T @ noise / 2


def _difference(damping: Array, driven: Array) -> float:
    """Return max|driven/kT - damping|/max|damping| of matrices (n, nv, nv), with the best kT."""
    overlap = float((driven * damping).sum())
    if not overlap:
        return np.inf
    kT = overlap / float((damping**2).sum())
    return float(abs(driven / kT - damping).max() / abs(damping).max())


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
    """Yield what may damp besides the linear friction of `friction_matrix`."""

    def acts(flag: str, *fields: NDArray[Any]) -> bool:
        return not disabled(model, flag) and any(field.any() for field in fields)

    collide = model.npair + model.nflex > 0 or len(colliding_geoms(model)) > 0
    passive = not (disabled(model, "spring") and disabled(model, "damper"))
    present = {
        "friction loss": acts("frictionloss", model.dof_frictionloss, model.tendon_frictionloss),
        "limits": acts("limit", model.jnt_limited, model.tendon_limited),
        "equalities": acts("equality", model.eq_active0),
        "contacts": collide and not disabled(model, "contact"),
        "flexes": passive and model.nflex > 0,
        "plugins": foreign_plugins(model) > 0,
    }
    return (name for name, exists in present.items() if exists)
