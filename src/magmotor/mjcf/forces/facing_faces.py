"""What is missing where a face with charges lies on a face of another magnet: a correction.

The field of a face jumps at its outline, and few charges on the other face do not see where that
runs below them. Instead of their energy in the potential of the face, there is the integral over
the second face here: with its normal n, and the coordinate z along that of the first face,

    int phi dA = 1/n_z int (U x dl)_z - int (n_x V_x + n_y V_y)/n_z dA,

see `numerics/shapes/faces.py`. The first term is over the outline; in the second, which is zero for
parallel faces, V is continuous, so that the same points serve. Below the plane of the first face,
phi and U are continued linearly. Forces and torques are the derivatives of this energy.
"""

import math

from magmotor.mjcf.declarations.iron import BOX, CYLINDER
from magmotor.mjcf.forces.charges import gauss_rule
from magmotor.mjcf.forces.disk_points import DISK_STARTS, DISK_WEIGHTS, DISK_X, DISK_Y
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
from magmotor.numerics.elementary import cosine, prefer_wide_vectors, sine
from magmotor.numerics.shapes.faces import disk, rectangle

LEVEL = 3
"""Least level of charges with which magnets are near enough."""

STEEPEST, DEEPEST = 0.5, 0.25
"""Sine of the angle between two faces, and depth over the radius of the smaller magnet, at which
the correction has faded out."""

CLOSEST = 1e-9
"""Least height above the other face, over that radius."""

CORNERS, ALONG = 32, 4
"""Number of points on the outline of a disk, and level of those on each edge of a rectangle."""

NOTHING = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@subroutine
def facing_faces(room, pose, charged, row, level, wanted):
    """Return the force and torque that the charges of a magnet miss near another, and the energy.

    `pose` is that of the magnet with the charges, or of its image. The torque is about its center;
    both are along the world's axes, and zero if only the energy is `wanted`.
    """
    kinds = int(charged[KIND]), int(row[KIND])
    if level < LEVEL or not (kinds[0] in (BOX, CYLINDER) and kinds[1] in (BOX, CYLINDER)):
        return NOTHING
    turn, center = _relative(pose, pose_of(row))
    axis, own, height = _facing_axes(turn, center, charged, row, kinds)
    radius = charged[RADIUS]
    deep = max(-height, 0.0) / (DEEPEST * radius)
    if axis < 0 or height > radius or deep >= 1.0:
        return NOTHING
    side = math.copysign(1.0, center[axis])
    # From here on, z is along the normal of the other face, and the axes have its center as origin.
    one, two, three = (
        _axis(turn, own + 1, axis, side),
        _axis(turn, own + 2, axis, side),
        _axis(turn, own, axis, side),
    )
    own_side = -math.copysign(1.0, three[2])
    charge = side * row[POLARIZATION + axis] * own_side * charged[POLARIZATION + own]
    if charge == 0.0:
        return NOTHING
    arm = own_side * _half(charged, own)
    x, y, _ = _cycled(axis, side, center[0], center[1], center[2])
    place = x + arm * three[0], y + arm * three[1], height
    normal = -own_side * three[0], -own_side * three[1], -own_side * three[2]
    frame, least = (*place, *one, *two), CLOSEST * radius
    hand = math.copysign(1.0, one[0] * two[1] - one[1] * two[0])
    tilt = normal[0] / normal[2], normal[1] / normal[2], hand / normal[2]
    count = _set_outline(room, charged, own, frame)
    _energies(room, count, True, row, axis, side, place, tilt, least)
    first = _sums(room, count)
    count = _set_face(room, charged, own, frame, level)
    _energies(room, count, False, row, axis, side, place, tilt, least)
    second = _sums(room, count)
    steep = (normal[0] * normal[0] + normal[1] * normal[1]) / (STEEPEST * STEEPEST)
    flat, shallow = 1.0 - steep, 1.0 - deep * deep
    unit = charge / (4.0 * math.pi * VACUUM_PERMEABILITY)
    fade, energy = unit * flat * flat * shallow * shallow, first[0] + second[0]
    if wanted:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, fade * energy
    rise = 4.0 * unit * flat * flat * shallow * deep / (DEEPEST * radius) * energy
    fall = 4.0 * unit * flat * shallow * shallow / (STEEPEST * STEEPEST) * normal[2] * energy
    fx, fy = -fade * (first[1] + second[1]), -fade * (first[2] + second[2])
    fz = -fade * (first[3] + second[3]) - rise
    tx = -fade * (first[4] + second[4]) - fall * normal[1]
    ty = -fade * (first[5] + second[5]) + fall * normal[0]
    tz = -fade * (first[6] + second[6])
    # The torque about the center of the face becomes that about the center of the magnet.
    ax, ay, az = arm * three[0], arm * three[1], arm * three[2]
    tx, ty, tz = tx + ay * fz - az * fy, ty + az * fx - ax * fz, tz + ax * fy - ay * fx
    force, torque = _uncycled(axis, side, fx, fy, fz), _uncycled(axis, side, tx, ty, tz)
    return (
        *in_world(row, force[0], force[1], force[2]),
        *in_world(row, torque[0], torque[1], torque[2]),
        0.0,
    )


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
            if 1.0 - along * along < STEEPEST * STEEPEST and height > highest:
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
def _put(room, k, frame, u, v):
    """Write a point of a face to column k; `frame` is its center and its two edges."""
    for i in range(3):
        room[i, k] = frame[i] + u * frame[3 + i] + v * frame[6 + i]


@subroutine
def _set_outline(room, row, axis, frame):
    """Write points of the outline of a face to rows 0 to 2, and elements of it to rows 3 to 5."""
    box = int(row[KIND]) == BOX
    a, b, radius = row[LENGTHS + (axis + 1) % 3], row[LENGTHS + (axis + 2) % 3], row[LENGTHS]
    x, w = gauss_rule(ALONG)
    count = 4 * len(x) if box else CORNERS
    for k in range(count):
        if box:
            edge, i = k // len(x), k % len(x)
            sign = 1.0 - 2.0 * (edge % 2)
            u, v = (sign * a, b * x[i]) if edge < 2 else (a * x[i], sign * b)
            du, dv = (0.0, sign * 2.0 * b * w[i]) if edge < 2 else (-sign * 2.0 * a * w[i], 0.0)
        else:
            u, v = radius * cosine(k / CORNERS), radius * sine(k / CORNERS)
            du, dv = -2.0 * math.pi / CORNERS * v, 2.0 * math.pi / CORNERS * u
        _put(room, k, frame, u, v)
        for i in range(3):
            room[3 + i, k] = du * frame[3 + i] + dv * frame[6 + i]
    return count


@subroutine
def _set_face(room, row, axis, frame, level):
    """Write the points of the charges on a face to rows 0 to 2, and their areas to row 3."""
    if int(row[KIND]) == BOX:
        x, w = gauss_rule(level)
        a, b = row[LENGTHS + (axis + 1) % 3], row[LENGTHS + (axis + 2) % 3]
        count = len(x)
        for i in range(count):
            for j in range(count):
                _put(room, count * i + j, frame, a * x[i], b * x[j])
                room[3, count * i + j] = 4.0 * a * b * w[i] * w[j]
        return count * count
    first, radius = DISK_STARTS[level], row[LENGTHS]
    count = DISK_STARTS[level + 1] - first
    for k in range(count):
        _put(room, k, frame, radius * DISK_X[first + k], radius * DISK_Y[first + k])
        room[3, k] = math.pi * radius * radius * DISK_WEIGHTS[first + k]
    return count


@subroutine(forceinline=True)
def _of_outline(point, element, terms, z, tilt):
    """Return the energy of an element of the outline, and its derivatives.

    These are by a displacement, and by a rotation about the origin of `point`, the center of the
    face. `terms` are those of the other face, at a height of which `z` is what is missing; and
    `tilt` has n_x/n_z and n_y/n_z, and 1/n_z or, of the other hand, -1/n_z.
    """
    (x, y, h), (dx, dy, dz), (_, v, u) = point, element, terms
    ux, uy = u[0] - z * v[0], u[1] - z * v[1]
    uxx, uxy, uyy = u[2] - z * v[2], u[3] - z * v[3], u[4] - z * v[4]
    sign = tilt[2]
    energy = sign * (ux * dy - uy * dx)
    gx, gy = sign * (uxx * dy - uxy * dx), sign * (uxy * dy - uyy * dx)
    gz = sign * (v[1] * dx - v[0] * dy)
    return (
        energy, gx, gy, gz,
        y * gz - h * gy - sign * ux * dz - tilt[1] * energy,
        h * gx - x * gz - sign * uy * dz + tilt[0] * energy,
        x * gy - y * gx + sign * (ux * dx + uy * dy),
    )  # fmt: skip


@subroutine(forceinline=True)
def _of_charge(point, area, terms, z, tilt):
    """Return the same of an element of the face, less the energy of the charge there."""
    (x, y, h), (phi, v, _), (tx, ty, _) = point, terms, tilt
    gx = -area * (tx * v[2] + ty * v[3] + phi[1])
    gy = -area * (tx * v[3] + ty * v[4] + phi[2])
    below = 1.0 if z == 0.0 else 0.0
    gz = -area * (below * (tx * phi[1] + ty * phi[2]) + phi[3])
    vx, vy = area * v[0], area * v[1]
    return (
        -tx * vx - ty * vy - area * (phi[0] + z * phi[3]), gx, gy, gz,
        y * gz - h * gy + tx * ty * vx + (1.0 + ty * ty) * vy,
        h * gx - x * gz - (1.0 + tx * tx) * vx - tx * ty * vy,
        x * gy - y * gx + ty * vx - tx * vy,
    )  # fmt: skip


@subroutine
def _energies(room, count, on_outline, row, axis, side, place, tilt, least):
    """Replace points, and their elements or areas, by energies and their derivatives.

    The energies are in row 0, the derivatives in rows 1 to 3 and 4 to 6.
    """
    prefer_wide_vectors()
    x, y, z = place
    a, b = row[LENGTHS + (axis + 1) % 3], row[LENGTHS + (axis + 2) % 3]
    a, b = (a, b) if side > 0.0 else (b, a)
    p, q, r, s, t, u, v = room[0], room[1], room[2], room[3], room[4], room[5], room[6]
    if int(row[KIND]) == BOX and on_outline:
        for k in range(count):
            height = max(r[k], least)
            terms = rectangle(p[k], q[k], height, a, b)
            p[k], q[k], r[k], s[k], t[k], u[k], v[k] = _of_outline(
                (p[k] - x, q[k] - y, r[k] - z), (s[k], t[k], u[k]), terms, r[k] - height, tilt
            )
    elif int(row[KIND]) == BOX:
        for k in range(count):
            height = max(r[k], least)
            terms = rectangle(p[k], q[k], height, a, b)
            p[k], q[k], r[k], s[k], t[k], u[k], v[k] = _of_charge(
                (p[k] - x, q[k] - y, r[k] - z), s[k], terms, r[k] - height, tilt
            )
    elif on_outline:
        for k in range(count):
            height = max(r[k], least)
            terms = disk(p[k], q[k], height, row[LENGTHS])
            p[k], q[k], r[k], s[k], t[k], u[k], v[k] = _of_outline(
                (p[k] - x, q[k] - y, r[k] - z), (s[k], t[k], u[k]), terms, r[k] - height, tilt
            )
    else:
        for k in range(count):
            height = max(r[k], least)
            terms = disk(p[k], q[k], height, row[LENGTHS])
            p[k], q[k], r[k], s[k], t[k], u[k], v[k] = _of_charge(
                (p[k] - x, q[k] - y, r[k] - z), s[k], terms, r[k] - height, tilt
            )


@subroutine
def _sums(room, count):
    """Return the sums of the seven rows."""
    a = b = c = d = e = f = g = 0.0
    for k in range(count):
        a, b, c, d = a + room[0, k], b + room[1, k], c + room[2, k], d + room[3, k]
        e, f, g = e + room[4, k], f + room[5, k], g + room[6, k]
    return a, b, c, d, e, f, g
