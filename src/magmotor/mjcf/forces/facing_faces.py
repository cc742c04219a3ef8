"""Where a face with charges lies on a face of another magnet: what the charges miss is added.

The field of a face jumps at its outline, and few charges on the other face do not see where that
runs below them; see `face_energies.py`. What is missing fades out as a face tilts, or goes below
the other one. Forces and torques are the derivatives of this energy.
"""

import math

from magmotor.mjcf.declarations.iron import BOX, CYLINDER
from magmotor.mjcf.forces.face_energies import missing_energy
from magmotor.mjcf.forces.shape_distances import level_of_gap
from magmotor.mjcf.forces.shaped_magnets import (
    KIND,
    LENGTHS,
    POLARIZATION,
    RADIUS,
    along_axes,
    in_pose,
    in_world,
    pose_of,
)
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY

LEVEL = 3
"""Least level of charges with which magnets are near enough."""

STEEP, STEEPEST = 0.1, 0.25
"""Squared sines of the angle between two faces between which the correction fades out."""

DEEPEST = 0.25
"""Depth over the radius of the smaller magnet at which the correction has faded out."""

FLAT, SHALLOW, FEWEST = 0.01, 0.2, 2
"""Squared sine of the angle, and part of that depth, up to which fewer charges are enough, and the
least level of these."""

CLOSEST = 1e-9
"""Least height above the other face, over the same radius."""

NOTHING = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@subroutine
def facing_faces(room, pose, charged, row, level, wanted):
    """Return the level of charges that a magnet needs near another, and what these miss.

    That is a force, a torque and the energy. `pose` is that of the magnet with the charges, or of
    its image. The torque is about its center; both are along the world's axes, and zero if only the
    energy is `wanted`.
    """
    kinds = int(charged[KIND]), int(row[KIND])
    if level < LEVEL or not (kinds[0] in (BOX, CYLINDER) and kinds[1] in (BOX, CYLINDER)):
        return level, NOTHING
    turn, center = _relative(pose, pose_of(row))
    axis, own, height = _facing_axes(turn, center, charged, row, kinds)
    radius = charged[RADIUS]
    deep = max(-height, 0.0) / (DEEPEST * radius)
    if axis < 0 or height > radius or deep >= 1.0:
        return level, NOTHING
    side = math.copysign(1.0, center[axis])
    # From here on, z is along the normal of the other face, and the axes have its center as origin.
    normal = _axis(turn, own, axis, side)
    one, two = _axis(turn, own + 1, axis, side), _axis(turn, own + 2, axis, side)
    own_side = -math.copysign(1.0, normal[2])
    charge = side * row[POLARIZATION + axis] * own_side * charged[POLARIZATION + own]
    if charge == 0.0:
        return level, NOTHING
    arm, (x, y, _) = own_side * _half(charged, own), _cycled(axis, side, *center)
    ax, ay, az = arm * normal[0], arm * normal[1], arm * normal[2]
    square = normal[0] * normal[0] + normal[1] * normal[1]
    steep = max(square - STEEP, 0.0) / (STEEPEST - STEEP)
    flat, shallow = 1.0 - steep * steep, 1.0 - deep * deep
    fade = flat * flat * shallow * shallow
    if square < FLAT and deep < SHALLOW and _is_along(charged, own) and _is_along(row, axis):
        # The other faces are farther away.
        gap = max(height, 0.0) + 2.0 * min(_half(charged, own), _half(row, axis))
        level = min(level, max(level_of_gap(gap, radius), FEWEST))
    energy, slope, turned = missing_energy(
        room, charged, own, (x + ax, y + ay, height, *one, *two), level,
        _lengths(row, axis, side), kinds[1] == BOX, CLOSEST * radius,
    )  # fmt: skip
    unit = charge / (4.0 * math.pi * VACUUM_PERMEABILITY)
    if wanted:
        return level, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, unit * fade * energy)
    rise = 4.0 * unit * flat * flat * shallow * deep / (DEEPEST * radius) * energy
    fall = 8.0 * unit * shallow * shallow * flat * steep / (STEEPEST - STEEP) * normal[2] * energy
    unit *= fade
    fx, fy, fz = -unit * slope[0], -unit * slope[1], -unit * slope[2] - rise
    tx = -unit * turned[0] - fall * normal[1]
    ty = -unit * turned[1] + fall * normal[0]
    # The torque about the center of the face becomes that about the center of the magnet.
    tx, ty = tx + ay * fz - az * fy, ty + az * fx - ax * fz
    tz = -unit * turned[2] + ax * fy - ay * fx
    force, torque = _uncycled(axis, side, fx, fy, fz), _uncycled(axis, side, tx, ty, tz)
    return level, (*in_world(row, *force), *in_world(row, *torque), 0.0)


@subroutine
def _relative(pose, base):
    """Return the axes of one magnet along those of another, and its center there."""
    first = along_axes(base, pose[3], pose[6], pose[9])
    second = along_axes(base, pose[4], pose[7], pose[10])
    third = along_axes(base, pose[5], pose[8], pose[11])
    return (*first, *second, *third), in_pose(base, pose[0], pose[1], pose[2])


@subroutine
def _facing_axes(turn, center, charged, row, kinds):
    """Return the axes, of the other magnet and of its own, whose faces are opposite, or -1; height.

    The height is that of the center of its face above the other one, the greatest of all that are
    parallel enough. A cylinder has only faces across its third axis.
    """
    axis, own, highest = -1, -1, -math.inf
    for i in range(2 if kinds[1] == CYLINDER else 0, 3):
        for j in range(2 if kinds[0] == CYLINDER else 0, 3):
            along = abs(turn[3 * j + i])
            height = abs(center[i]) - along * _half(charged, j) - _half(row, i)
            if 1.0 - along * along < STEEPEST and height > highest:
                axis, own, highest = i, j, height
    return axis, own, highest


@subroutine
def _axis(turn, own, axis, side):
    """Return an axis of the magnet in the other's frame, of which z is `axis` or opposite."""
    start = 3 * (own % 3)
    return _cycled(axis, side, turn[start], turn[start + 1], turn[start + 2])


@subroutine
def _cycled(axis, side, x, y, z):
    """Return a vector in a right-handed order of the axes that ends with `axis`, times `side`."""
    x, y, z = (x, y, z) if axis == 2 else ((y, z, x) if axis == 0 else (z, x, y))
    return (x, y, z) if side > 0.0 else (y, x, -z)


@subroutine
def _uncycled(axis, side, x, y, z):
    """Undo `_cycled`."""
    x, y, z = (x, y, z) if side > 0.0 else (y, x, -z)
    return (x, y, z) if axis == 2 else ((z, x, y) if axis == 0 else (y, z, x))


@subroutine
def _half(row, axis):
    """Return half the length of a box or a cylinder along an axis that is normal to faces."""
    return row[LENGTHS + 1] if int(row[KIND]) == CYLINDER else row[LENGTHS + axis]


@subroutine
def _lengths(row, axis, side):
    """Return half the edges of a face of a box along x and y, or the radius of a cylinder twice."""
    if int(row[KIND]) == CYLINDER:
        return row[LENGTHS], row[LENGTHS]
    a, b = row[LENGTHS + (axis + 1) % 3], row[LENGTHS + (axis + 2) % 3]
    return (a, b) if side > 0.0 else (b, a)


@subroutine
def _is_along(row, axis):
    """Whether the polarization of a magnet is along an axis."""
    one, two = row[POLARIZATION + (axis + 1) % 3], row[POLARIZATION + (axis + 2) % 3]
    return one == 0.0 and two == 0.0
