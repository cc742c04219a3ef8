"""Whether two magnets on one rail push each other apart wherever they can be on it.

Where all joints between them are parallel slides, magnets keep their orientations and move along
one line, as magnetic springs do. Others can turn or move aside until they attract each other.
"""

import mujoco
import numpy as np

from magmotor.common.arrays import Array
from magmotor.dipoles import COINCIDENCE
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.checking.attraction import pull_of
from magmotor.mjcf.checking.reach import STRAIGHT, joints_between
from magmotor.mjcf.checking.stand_off import frame_of
from magmotor.mjcf.checking.strengths import Magnet
from magmotor.mjcf.declarations.marks import IRON
from magmotor.mjcf.field_and_energy import coupling_factors

STRIDE = 0.2
"""Distance of two places at which forces are compared, over that of the nearest dipoles there."""

STRIDES = 1000
"""Largest number of these places; dipoles that come as near as a nanometer take about 100."""

YIELDING = 0.5
"""Distance of dipoles, over that at touch, to which a soft contact may let them come."""


def repel_on_rail(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    magnets: tuple[Magnet, Magnet],
    at_touch: Array,
) -> bool:
    """Return whether magnets push each other apart on all the way until they touch or coincide.

    It is False for coils, which can reverse, and wherever iron acts.

    Parameters
    ----------
    model : mujoco.MjModel
    data : mujoco.MjData
        The way begins where the magnets are here.
    magnets : tuple of Magnet
    at_touch : ndarray, shape (n, m)
        Distances of their dipoles below which geoms overlap, in m; negative if none do.
    """
    one, other = magnets
    if acting_forces(model) & IRON or not one.coils | other.coils <= {-1}:
        return False
    direction = _rail(model, data, magnets)
    if direction is None:
        return False
    of = coupling_factors(model)
    factor = np.array([[of(int(a), int(b)) for b in other.bodies] for a in one.bodies])
    between = other.positions - one.positions[:, np.newaxis]
    height = between @ direction
    if (height[factor != 0] < 0).all():
        direction, height = -direction, -height
    axis, *sides = frame_of(direction)
    aside = between @ sides[0] + 1j * (between @ sides[1])
    moments = [magnet.strengths[:, np.newaxis] * magnet.axes for magnet in magnets]
    first, second = ((m @ sides[0] + 1j * (m @ sides[1]), m @ axis) for m in moments)
    least = np.where(factor != 0, np.maximum(YIELDING * at_touch, COINCIDENCE), 0)
    stops = height - np.sqrt(np.maximum(least**2 - abs(aside) ** 2, 0))
    way = stops[abs(aside) < least].min(initial=np.inf)
    if not (height[factor != 0] > 0).all() or not 0 < way < np.inf:
        return False
    gone = 0.0
    for _ in range(STRIDES):
        pull, _ = pull_of(first, second, aside, height - gone, factor)
        if not pull < 0:
            return False
        if gone == way:
            return True
        nearest = np.hypot(abs(aside), height - gone)[factor != 0].min()
        gone = min(way, gone + STRIDE * float(nearest))
    return False


def _rail(
    model: mujoco.MjModel, data: mujoco.MjData, magnets: tuple[Magnet, Magnet]
) -> Array | None:
    """Return the direction in which all joints between two magnets slide, if there is one."""
    one, other = magnets
    bodies = np.concatenate([one.bodies, other.bodies])
    joints = joints_between(model, one.body, other.body)
    moved_by_hand = (model.body_mocapid[model.body_rootid[bodies]] >= 0).any()
    if not joints or moved_by_hand or (model.jnt_type[joints] != mujoco.mjtJoint.mjJNT_SLIDE).any():
        return None
    axes = data.xaxis[joints]
    parallel = np.linalg.norm(np.cross(axes, axes[0]), axis=1) <= STRAIGHT
    return axes[0].copy() if parallel.all() else None
