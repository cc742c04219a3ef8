"""The units of a model: those that its magnetic constant declares, and doubts that they are SI."""

import math
from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.mjcf.declarations.iron import BOX, SPHERE
from magmotor.mjcf.declarations.model_numbers import NAME, scale_of
from magmotor.mjcf.declared import coil_of_sites, header
from magmotor.mjcf.forces.iron_pieces import ellipsoid
from magmotor.mjcf.lookup import label
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY

OF_NEODYMIUM = 140.0
"""Moment in A m^2 of 1 kg of neodymium magnets."""

STRONGEST = 20.0
"""Moment of a magnet over that of neodymium with its mass from which one of them is not in SI."""

WEAKEST = 1e-8
"""The same from which all are not in SI; sizes in mm make masses a billion times too large."""

OTHERS = f"(other units need a numeric {NAME})"

AIR, OSMIUM = 1.0, 1e6
"""Densities in kg/m^3 of a little less than air, and of many times osmium."""


def magnetic_constant(model: mujoco.MjModel) -> float:
    """Return mu0 in the units of a model: its numeric `magnetic_constant`, or that of SI."""
    k = header(model).constant
    return float(model.numeric_data[model.numeric_adr[k]]) if k >= 0 else VACUUM_PERMEABILITY


def declares_units(model: mujoco.MjModel) -> bool:
    """Whether a model declares its magnetic constant; if not, its units count as those of SI.

    The number of mu0 in SI is that in other systems, too, such as um, ng, ms and uA.
    """
    return bool(header(model).constant >= 0)


def moment_scale(model: mujoco.MjModel) -> float:
    """Return the factor of moments that makes mu0 that of SI; see `declarations/constants.py`."""
    return scale_of(magnetic_constant(model))


def own_units(model: mujoco.MjModel) -> tuple[str, ...]:
    """Return a sentence about the units of a model, if it declares any."""
    if not declares_units(model):
        return ()
    sentence = (
        f"units: the model's own, in which mu0 = {magnetic_constant(model):g}; here, m, kg, s, N,"
        " J, T and A m^2 stand for them"
    )
    return (sentence,)


def doubts(model: mujoco.MjModel, moments: Array, magnetic: set[int]) -> Iterator[str]:
    """Yield why the numbers of a model that declares no other units cannot be in SI units.

    `moments` are those of all sites, and `magnetic` are the bodies that have dipoles or iron.
    """
    weld = model.body_weldid
    mass = np.bincount(weld, model.body_mass, model.nbody).astype(float)
    moving = np.flatnonzero((model.body_dofnum > 0) & (mass > 0))
    own = np.where(coil_of_sites(model) >= 0, 0.0, np.abs(moments))
    carried = np.bincount(weld[model.site_bodyid], own, model.nbody).astype(float)
    carried /= OF_NEODYMIUM
    strong = moving[carried[moving] > STRONGEST * mass[moving]]
    if len(strong):
        yield _weighed(model, strong, carried, mass)
    volume = _volumes(model)[moving]
    if {*weld[[*magnetic]].tolist()} & {*moving.tolist()} and np.isfinite(volume).all():
        density = mass[moving] / volume
        for wrong, k, what in (
            ((density < AIR).all(), density.argmax(), "lighter than air"),
            ((density > OSMIUM).all(), density.argmin(), "many times heavier than osmium"),
        ):
            if wrong:
                yield (
                    f"all bodies are {what}, such as {label(model, 'body', moving[k])} with"
                    f" {density[k]:.2g} kg/m^3: are lengths in m, and masses in kg? {OTHERS}"
                )
                return
    magnets = moving[carried[moving] > 0]
    if len(magnets) and (carried[magnets] < WEAKEST * mass[magnets]).all():
        yield _weighed(model, magnets, carried, mass)


def _weighed(model: mujoco.MjModel, bodies: NDArray, carried: Array, mass: Array) -> str:
    """Say which body has the largest moment for its mass."""
    body = int(bodies[np.argmax(carried[bodies] / mass[bodies])])
    return (
        f"{label(model, 'body', body)} has the moment of {carried[body]:.2g} kg of neodymium"
        f" magnets, and a mass of {mass[body]:.2g} kg: are these numbers in A m^2 and kg, and"
        f" lengths in m? {OTHERS}"
    )


def _volumes(model: mujoco.MjModel) -> Array:
    """Return the volume of each rigid body's geoms; infinite without any, or with a mesh."""
    volumes = np.zeros(model.nbody)
    for geom, kind in enumerate(model.geom_type.tolist()):
        body = model.body_weldid[model.geom_bodyid[geom]]
        solid = SPHERE <= kind <= BOX
        volumes[body] += ellipsoid(kind, *model.geom_size[geom])[3] if solid else math.inf
    return np.where(volumes > 0, volumes, math.inf)
