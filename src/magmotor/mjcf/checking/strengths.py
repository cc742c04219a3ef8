"""The magnets of a model, rigid bodies with dipoles or iron, and how strong they can become."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.declared import ACTUATOR, GEOM, NUMERIC, SITE, tuples
from magmotor.mjcf.forces.iron import PLANE, ellipsoid
from magmotor.mjcf.forces.marks import COILS, DIPOLES, IRON
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY, demagnetizing_factors


class Magnet(NamedTuple):
    """The dipoles and the pieces of iron of one rigid body, in this order."""

    body: int
    positions: Array
    """In m, shape (n, 3)."""
    axes: Array
    """Directions of the dipoles; zero for iron."""
    strengths: Array
    """Largest moments in A m^2 that actuators can give; zero for iron."""
    bodies: NDArray[np.int64]
    responses: Array
    """Largest moment of iron per flux density, in A m^2/T; zero for dipoles."""
    saturations: Array
    """Largest moment of iron in A m^2."""


def magnets_of(model: mujoco.MjModel, data: mujoco.MjData) -> list[Magnet]:
    """Return the magnets of a model, whose positions in `data` are up to date."""
    kinds = acting_forces(model)
    strengths = np.zeros(model.nsite)
    if kinds & DIPOLES and model.nuser_site:
        strengths = abs(model.site_user[:, 0]) * _drives(model, kinds)
    sites = np.flatnonzero(strengths)
    pieces = [*_pieces(model)] if kinds & IRON else []
    geoms = np.array([geom for geom, _, _ in pieces], int)
    iron = np.array([numbers for _, *numbers in pieces]).reshape(-1, 2)
    none, others = np.zeros(len(geoms)), np.zeros(len(sites))
    bodies = np.concatenate([model.site_bodyid[sites], model.geom_bodyid[geoms]]).astype(int)
    positions = np.vstack([data.site_xpos[sites], data.geom_xpos[geoms]])
    axes = np.vstack([data.site_xmat[sites, 2::3], np.zeros((len(geoms), 3))])
    strengths = np.concatenate([strengths[sites], none])
    responses, saturations = (np.concatenate([others, column]) for column in iron.T)
    welds = model.body_weldid[bodies]
    return [
        Magnet(
            int(weld), positions[own], axes[own], strengths[own], bodies[own], responses[own],
            saturations[own],
        )
        for weld in np.unique(welds)
        for own in [welds == weld]
    ]  # fmt: skip


def _drives(model: mujoco.MjModel, kinds: int) -> Array:
    """Return the largest drives of the coils of all sites.

    It is 1 where neither a limit nor saturation bounds it.
    """
    drives = np.ones(model.nsite)
    for _, elements in tuples(model, "coil") if kinds & COILS else ():
        largest = 1.0
        for kind, number, prm in elements:
            if kind == ACTUATOR:
                largest = _largest_drive(model, number, prm)
            elif kind == SITE:
                drives[number] = largest
            else:
                drives[model.site_bodyid == number] = largest
    return drives


def _largest_drive(model: mujoco.MjModel, actuator: int, saturation: float) -> float:
    largest = math.inf
    for limited, limits in (("ctrllimited", "ctrlrange"), ("actlimited", "actrange")):
        if getattr(model, f"actuator_{limited}")[actuator]:
            largest = min(largest, abs(getattr(model, f"actuator_{limits}")[actuator]).max())
    if saturation > 0:
        return saturation / math.hypot(1, saturation / largest)
    return float(largest) if largest < math.inf else 1.0


def _pieces(model: mujoco.MjModel) -> Iterator[tuple[int, float, float]]:
    """Yield the geoms of iron, with their largest response and saturation moment."""
    for _, elements in tuples(model, "iron"):
        numeric = next(number for kind, number, _ in elements if kind == NUMERIC)
        material = model.numeric(numeric).data
        chi, magnetization = material[0], material[1] if len(material) > 1 else 0.0
        for kind, geom, _ in elements:
            if kind == GEOM and model.geom_type[geom] != PLANE:
                *axes, volume = ellipsoid(int(model.geom_type[geom]), *model.geom_size[geom])
                factor = min(demagnetizing_factors(*axes))
                response = abs(volume * chi / (1 + factor * chi)) / VACUUM_PERMEABILITY
                yield geom, response, volume * magnetization or math.inf
