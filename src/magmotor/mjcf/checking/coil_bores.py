"""Coils by their geom, into which what is narrow enough may go."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.mjcf.checking.strengths import Magnet
from magmotor.mjcf.declarations.iron import PLANE
from magmotor.mjcf.declarations.meshes import MESH
from magmotor.mjcf.declared import coil_of_geoms
from magmotor.mjcf.forces.bores import fits
from magmotor.mjcf.forces.iron_pieces import ellipsoid
from magmotor.mjcf.forces.shaped_magnets import COLUMNS, KIND, LENGTHS, POLARIZATION


def goes_into(model: mujoco.MjModel, geom: int, coil: int) -> bool:
    """Whether a geom fits in the bore of another one, which is a coil."""
    kind = int(model.geom_type[geom])
    if coil_of_geoms(model)[coil] < 0 or kind in (PLANE, MESH):
        return False
    row = np.zeros(COLUMNS)
    row[KIND], row[LENGTHS : LENGTHS + 3] = model.geom_type[coil], model.geom_size[coil]
    row[POLARIZATION : POLARIZATION + 3] = model.geom_user[coil, :3]
    return bool(fits(row, kind, ellipsoid(kind, *model.geom_size[geom])[:3]))


def in_bores(model: mujoco.MjModel, one: Magnet, other: Magnet) -> NDArray[np.bool_]:
    """Return which dipoles of two magnets may coincide, since one of the two is a coil, (n, m)."""
    found = np.zeros((len(one.elements), len(other.elements)), bool)
    coiled = np.append(np.zeros(model.nsite, bool), coil_of_geoms(model) >= 0)
    for magnet, whole, turned in ((one, other, False), (other, one, True)):
        for i in np.flatnonzero(coiled[magnet.elements]).tolist():
            coil = int(magnet.elements[i]) - model.nsite
            for j, element in enumerate(whole.elements.tolist()):
                within = element < model.nsite or goes_into(model, element - model.nsite, coil)
                found[(j, i) if turned else (i, j)] |= within
    return found
