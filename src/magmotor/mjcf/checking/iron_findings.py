"""Pieces of iron that one dipole each does not describe."""

from collections.abc import Iterator

import mujoco
import numpy as np
from scipy.sparse.csgraph import connected_components

from magmotor.mjcf import declared
from magmotor.mjcf.checking.applied_fields import bent_fields
from magmotor.mjcf.checking.contact_rule import (
    SUNK,
)
from magmotor.mjcf.checking.failure import Failure
from magmotor.mjcf.checking.geoms import contact_margin, touching_geoms
from magmotor.mjcf.checking.strengths import magnets_of
from magmotor.mjcf.describe import Description
from magmotor.mjcf.lookup import label

WEAK = 1.0
"""Susceptibility below which pieces of iron that touch hardly magnetize each other."""

ROW = 4
"""Number of pieces of iron in a row from which the force is wrong: cubes, by 1.3 times."""

NEAR = 0.5
"""Gap of two pieces of iron, over the smaller radius, from which one dipole describes each."""

BENT = 0.3
"""Largest part of the force on a slender piece of weak iron in an applied field that may err."""


def rows_of_iron(model: mujoco.MjModel, state: mujoco.MjData) -> Iterator[Failure]:
    """Yield rigid bodies in which pieces of iron touch in a row."""
    for magnet in magnets_of(model, state):
        geoms = magnet.elements[magnet.responses > 0] - model.nsite
        geoms = geoms[model.geom_type[geoms] != mujoco.mjtGeom.mjGEOM_SPHERE].tolist()
        touching = np.zeros((len(geoms), len(geoms)))
        places, radii = state.geom_xpos[geoms], model.geom_rbound[geoms]
        apart = np.linalg.norm(places[:, np.newaxis] - places, axis=2)
        for i, j in np.argwhere(np.triu(apart < 1.1 * np.add.outer(radii, radii), 1)).tolist():
            one, other = geoms[i], geoms[j]
            near = float(SUNK * model.geom_rbound[[one, other]].min())
            touching[i, j] = mujoco.mj_geomDistance(model, state, one, other, near, None) < near
        _, rows = connected_components(touching, directed=False)
        for row in np.flatnonzero(np.bincount(rows, minlength=1) >= ROW):
            own = np.flatnonzero(rows == row)
            yield Failure(
                label(model, "geom", geoms[own[0]]),
                f"and {len(own) - 1} other pieces of iron of its body touch, and magnetize each"
                " other too strongly; make them one geom",
            )


def iron_that_touches(
    model: mujoco.MjModel, state: mujoco.MjData, found: Description
) -> Iterator[Failure]:
    """Yield at most one failure: of pieces of iron on different bodies that may touch."""
    if "iron" not in found.acting:
        return
    strong = np.zeros(model.ngeom, bool)
    chosen = [geom for geom, value in declared.iron(model).items() if value >= WEAK]
    strong[chosen] = model.geom_type[chosen] != mujoco.mjtGeom.mjGEOM_PLANE
    rows = touching_geoms(model)
    rows = rows[strong[rows[:, :2]].all(axis=1)]
    ends = rows[:, :2]
    joints = model.body_jntadr[model.body_weldid[model.geom_bodyid[ends]]]
    free = (joints >= 0) & (model.jnt_type[joints] == mujoco.mjtJoint.mjJNT_FREE)
    radii = model.geom_rbound[ends]
    places = state.geom_xpos[ends]
    gaps = np.linalg.norm(places[:, 0] - places[:, 1], axis=1) - radii.sum(axis=1)
    near = NEAR * radii.min(axis=1)
    rows = rows[free.any(axis=1) | (gaps < near)]
    margins = np.array([contact_margin(model, *row) for row in rows.tolist()])
    rows = rows[margins < NEAR * model.geom_rbound[rows[:, :2]].min(axis=1)]
    if len(rows):
        spheres = (model.geom_type[rows[0, :2]] == mujoco.mjtGeom.mjGEOM_SPHERE).all()
        of_spheres = (
            ": at 2.1 radii, the true force of two equal spheres is 2.8 times that of the model"
            " along the field, and 0.75 times across it; with a margin of a quarter of the radius"
            " for each, 1.25 and 0.89 times"
            if spheres
            else ""
        )
        yield Failure(
            " and ".join(label(model, "geom", geom) for geom in rows[0, :2]),
            "are pieces of iron that can touch, where one dipole each does not describe them; a"
            f" margin keeps them apart{of_spheres}",
            len(rows),
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
