"""Pieces of iron that one dipole each does not describe."""

from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from magmotor.mjcf import declared
from magmotor.mjcf.checking.close_iron import WEAK
from magmotor.mjcf.checking.contact_rule import SUNK
from magmotor.mjcf.checking.failure import Failure
from magmotor.mjcf.checking.field_strengths import bent_fields
from magmotor.mjcf.checking.strengths import magnets_of
from magmotor.mjcf.lookup import label

ROW_OF_SPHERES, ROW = 2, 4
"""Number of pieces of iron in a row from which the force is wrong: spheres, and others, such as
cubes, by 1.3 times."""

ALIKE = 0.2
"""Radius of a piece over that of another one from which it changes the moments of both."""

BENT = 0.3
"""Largest part of the force on a slender piece of weak iron in an applied field that may err."""


def rows_of_iron(model: mujoco.MjModel, state: mujoco.MjData) -> Iterator[Failure]:
    """Yield rigid bodies in which pieces of iron touch in a row."""
    susceptibilities = declared.iron(model)
    for magnet in magnets_of(model, state):
        geoms = magnet.elements[magnet.responses > 0] - model.nsite
        round_ones = model.geom_type[geoms] == mujoco.mjtGeom.mjGEOM_SPHERE
        strong = np.array([susceptibilities[geom] >= WEAK for geom in geoms.tolist()], bool)
        yield from _rows(model, state, geoms[~round_ones], ROW, "strongly")
        yield from _rows(model, state, geoms[round_ones & strong], ROW_OF_SPHERES, "weakly")


def _rows(
    model: mujoco.MjModel, state: mujoco.MjData, pieces: NDArray, least: int, wrongly: str
) -> Iterator[Failure]:
    """Yield rows of at least some number of pieces of iron that touch."""
    if len(pieces) < least:
        return
    geoms = pieces.tolist()
    touching = np.zeros((len(geoms), len(geoms)))
    places, radii = state.geom_xpos[geoms], model.geom_rbound[geoms]
    apart = np.linalg.norm(places[:, np.newaxis] - places, axis=2)
    alike = np.minimum.outer(radii, radii) > ALIKE * np.maximum.outer(radii, radii)
    close = alike & (apart < 1.1 * np.add.outer(radii, radii))
    for i, j in np.argwhere(np.triu(close, 1)).tolist():
        one, other = geoms[i], geoms[j]
        near = float(SUNK * model.geom_rbound[[one, other]].min())
        touching[i, j] = mujoco.mj_geomDistance(model, state, one, other, near, None) < near
    _, rows = connected_components(touching, directed=False)
    for row in np.flatnonzero(np.bincount(rows, minlength=1) >= least):
        own = np.flatnonzero(rows == row)
        others = f"{len(own) - 1} other piece{'s' * (len(own) > 2)}"
        yield Failure(
            label(model, "geom", geoms[own[0]]),
            f"and {others} of iron of its rigid body touch, and magnetize each other too {wrongly};"
            " make them one geom",
        )


def long_pieces(model: mujoco.MjModel, state: mujoco.MjData) -> Iterator[Failure]:
    """Yield pieces of iron over which an applied field varies too unevenly for one dipole."""
    for geom, bend in bent_fields(model, state):
        if bend == np.inf:
            sentence = "reaches beyond the table of an applied field; enlarge the table"
        else:
            sentence = (
                "feels an applied field at its center only, but that field varies far from linearly"
                " along it, so that the force may be several times too strong or too weak"
            )
            if declared.iron(model)[geom] < WEAK:
                sentence += "; a row of spheres follows the field"
        if bend > BENT:
            yield Failure(label(model, "geom", geom), f"of iron {sentence}")
