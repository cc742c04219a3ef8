"""Given fields alone, at dipoles and over pieces of iron."""

import copy
from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.mjcf import declared
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.field_and_energy import field
from magmotor.mjcf.forces.fields import GRADIENT, HEADER
from magmotor.mjcf.forces.iron import PLANE, ellipsoid
from magmotor.mjcf.forces.marks import FIELDS, IRON

STEP = 0.01
"""Step of finite differences over the semi-axis of a piece."""


def given_field(model: mujoco.MjModel, data: mujoco.MjData, points: Array, welds: NDArray) -> Array:
    """Return the flux densities (n, 3) of given fields, and of iron in them, without dipoles.

    The points belong to rigid bodies (n,), on which fields that are fixed to them do not act.
    """
    if not acting_forces(model) & FIELDS:
        return np.zeros_like(points)
    without = copy.copy(model)
    without.site_user[:] = 0
    found = field(without, data, points)
    owners = declared.field_owners(model)
    for weld in {*owners.values()} & {*welds.tolist()}:
        others = copy.copy(without)
        for numeric in (k for k, owner in owners.items() if owner == weld):
            first, size = int(model.numeric_adr[numeric]), int(model.numeric_size[numeric])
            others.numeric_data[first + (HEADER if size > GRADIENT else 0) : first + size] = 0
        found[welds == weld] = field(others, data, points[welds == weld])
    return found


def bent_fields(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[tuple[int, float]]:
    """Yield pieces of iron, and how far the given field at their ends is from linear.

    It is in units of the largest field at the center or an end. Pieces that reach beyond a table
    are left out.
    """
    kinds = acting_forces(model)
    if not (kinds & FIELDS and kinds & IRON):
        return
    without = copy.copy(model)
    for _, elements in declared.tuples(model, "iron"):
        for kind, number, _ in elements:
            if kind == declared.NUMERIC:
                without.numeric_data[model.numeric_adr[number]] = 0
    for geom, susceptibility in declared.iron(model).items():
        if not susceptibility or model.geom_type[geom] == PLANE:
            continue
        *axes, _ = ellipsoid(int(model.geom_type[geom]), *model.geom_size[geom])
        ends = np.array(axes)[:, np.newaxis] * data.geom_xmat[geom].reshape(3, 3).T
        offsets = np.vstack([0 * ends[:1], ends, -ends, STEP * ends, -STEP * ends])
        welds = np.full(len(offsets), model.body_weldid[model.geom_bodyid[geom]])
        try:
            found = given_field(without, data, data.geom_xpos[geom] + offsets, welds)
        except ValueError:
            continue
        center, over, under, *near = np.split(found, [1, 4, 7, 10])
        change = (near[0] - near[1]) / (2 * STEP)
        largest = np.linalg.norm(np.vstack([center, over, under]), axis=1).max()
        bend = np.vstack([over - center - change, under - center + change])
        if largest > 0:
            yield geom, float(np.linalg.norm(bend, axis=1).max() / largest)
