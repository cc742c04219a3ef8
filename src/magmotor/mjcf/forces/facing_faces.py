"""What is missing where a face with charges lies on a face of another magnet: a correction.

The field of a face jumps at its outline, and few charges on the other face do not see where that
runs below them. If both faces were parallel, at the same distance of the centers, the true energy
would be an integral over the outline of the second face, see `numerics/shapes/faces.py`. What the
charges miss of it is added, fading out as one face tilts or goes below the other. It is a function
of the state, of which forces and torques are the derivatives.
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
from magmotor.numerics.shapes.faces import disk, disk_flux, rectangle, rectangle_flux

LEVEL = 3
"""Least level of charges with which magnets are near enough."""

STEEPEST, DEEPEST = 0.3, 0.25
"""Sine of the angle between two faces, and depth over the radius of the smaller magnet, at which
the correction has faded out."""

CLOSEST = 1e-9
"""Least distance between the planes, over that radius."""

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
    if axis < 0 or height > charged[RADIUS]:
        return NOTHING
    # From here on, the axes x, y and z are those of the other magnet; z is normal to its face.
    one, two = (own + 1) % 3, (own + 2) % 3
    normal, edge = _column(turn, axis, own), _column(turn, axis, one)
    x, y, z = _cycled(axis, center[0], center[1], center[2])
    steep = (normal[0] * normal[0] + normal[1] * normal[1]) / (STEEPEST * STEEPEST)
    side = math.copysign(1.0, z)
    own_side = -side * math.copysign(1.0, normal[2])
    arm = own_side * _half(charged, own)
    arm_x, arm_y, arm_z = arm * normal[0], arm * normal[1], arm * normal[2]
    x, y = x + arm_x, y + arm_y
    radius = charged[RADIUS]
    deep = max(-height, 0.0) / (DEEPEST * radius)
    charge = side * row[POLARIZATION + axis] * own_side * charged[POLARIZATION + own]
    if deep >= 1.0 or charge == 0.0:
        return NOTHING
    across = edge[0] * edge[0] + edge[1] * edge[1]
    cos, sin = edge[0] / math.sqrt(across), edge[1] / math.sqrt(across)
    other = _column(turn, axis, two)
    hand = math.copysign(1.0, cos * other[1] - sin * other[0])
    place = x, y, max(height, CLOSEST * radius), cos, sin, hand
    u, v, w = _missing(room, charged, own, row, axis, level, place)
    unit = charge / (4.0 * math.pi * VACUUM_PERMEABILITY)
    flat, shallow = 1.0 - steep, 1.0 - deep * deep
    fade = unit * flat * flat * shallow * shallow
    # Below the face, the energy is continued as a linear function of the height.
    energy = u + min(height, 0.0) * v[2]
    if wanted:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, fade * energy
    rise = 4.0 * unit * flat * flat * shallow * deep / (DEEPEST * radius) * energy
    fx, fy, fz = -fade * v[0], -fade * v[1], -side * (fade * v[2] + rise)
    # Of the angle between the edges, and of the cosine between the normals.
    spin = -fade * w
    tilt = -4.0 * unit * flat * shallow * shallow * normal[2] / (STEEPEST * STEEPEST) * energy
    spin_z = spin * edge[2] / across
    tx, ty = tilt * normal[1] - spin_z * edge[0], -tilt * normal[0] - spin_z * edge[1]
    tx, ty, tz = (
        tx + arm_y * fz - arm_z * fy,
        ty + arm_z * fx - arm_x * fz,
        spin + arm_x * fy - arm_y * fx,
    )
    fx, fy, fz = _uncycled(axis, fx, fy, fz)
    tx, ty, tz = _uncycled(axis, tx, ty, tz)
    return (*in_world(row, fx, fy, fz), *in_world(row, tx, ty, tz), 0.0)


@subroutine
def _relative(pose, base):
    """Return the axes of one magnet along those of another, as columns, and its center there."""
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
def _column(turn, axis, own):
    """Return an axis of the magnet along those of the other, of which the last one is `axis`."""
    return _cycled(axis, turn[3 * own], turn[3 * own + 1], turn[3 * own + 2])


@subroutine
def _cycled(axis, x, y, z):
    """Return a vector in an order of the axes that ends with `axis`."""
    return (x, y, z) if axis == 2 else ((y, z, x) if axis == 0 else (z, x, y))


@subroutine
def _uncycled(axis, x, y, z):
    """Undo `_cycled`."""
    return (x, y, z) if axis == 2 else ((z, x, y) if axis == 0 else (y, z, x))


@subroutine
def _half(row, axis):
    """Return half the length of a box or a cylinder along an axis that is normal to faces."""
    return row[LENGTHS + 1] if int(row[KIND]) == CYLINDER else row[LENGTHS + axis]


@subroutine
def _missing(room, charged, own, row, axis, level, place):
    """Return the energy that charges miss, its derivatives along x, y and z, and by the angle.

    The charges 1 per area are on both faces, without the factor 1/(4 pi mu0).
    """
    count = _set_outline(room, charged, own, place)
    _set_flux(room, count, row, axis, place[2])
    e, x, y, z, turn = _sums(room, count, place)
    count = _set_face(room, charged, own, level, place)
    _set_potential(room, count, row, axis, place[2])
    f, u, v, w, spin = _sums(room, count, place)
    return e - f, (x - u, y - v, z - w), turn - spin


@subroutine
def _put(room, k, place, u, v):
    """Write a vector in the plane of a face, from its center, to the rows x and y."""
    x, y, _, cos, sin, hand = place
    room[0, k], room[1, k] = x + cos * u - hand * sin * v, y + sin * u + hand * cos * v


@subroutine
def _set_outline(room, row, axis, place):
    """Write points of the outline of a face to rows 0 and 1, normals times lengths to 2 and 3."""
    x, w = gauss_rule(ALONG)
    _, _, _, cos, sin, hand = place
    box = int(row[KIND]) == BOX
    a, b = row[LENGTHS + (axis + 1) % 3], row[LENGTHS + (axis + 2) % 3]
    count = 4 * len(x) if box else CORNERS
    for k in range(count):
        if box:
            edge, i = k // len(x), k % len(x)
            sign = 1.0 - 2.0 * (edge % 2)
            if edge < 2:
                u, v, nu, nv = sign * a, b * x[i], sign * 2.0 * b * w[i], 0.0
            else:
                u, v, nu, nv = a * x[i], sign * b, 0.0, sign * 2.0 * a * w[i]
        else:
            turns, radius = k / CORNERS, row[LENGTHS]
            u, v = radius * cosine(turns), radius * sine(turns)
            nu, nv = 2.0 * math.pi / CORNERS * u, 2.0 * math.pi / CORNERS * v
        _put(room, k, place, u, v)
        room[2, k], room[3, k] = cos * nu - hand * sin * nv, sin * nu + hand * cos * nv
    return count


@subroutine
def _set_face(room, row, axis, level, place):
    """Write the points of the charges on a face to rows 0 and 1, and their areas to row 2."""
    if int(row[KIND]) == BOX:
        x, w = gauss_rule(level)
        a, b = row[LENGTHS + (axis + 1) % 3], row[LENGTHS + (axis + 2) % 3]
        count = len(x)
        for i in range(count):
            for j in range(count):
                _put(room, count * i + j, place, a * x[i], b * x[j])
                room[2, count * i + j] = 4.0 * a * b * w[i] * w[j]
        return count * count
    first, radius = DISK_STARTS[level], row[LENGTHS]
    count = DISK_STARTS[level + 1] - first
    for k in range(count):
        _put(room, k, place, radius * DISK_X[first + k], radius * DISK_Y[first + k])
        room[2, k] = math.pi * radius * radius * DISK_WEIGHTS[first + k]
    return count


@subroutine
def _set_flux(room, count, row, axis, z):
    """Replace normals by parts of an energy: itself in row 2, its derivatives in 3 to 6."""
    prefer_wide_vectors()
    xs, ys, first, second = room[0], room[1], room[2], room[3]
    gx, gy, gz = room[4], room[5], room[6]
    a, b = row[LENGTHS + (axis + 1) % 3], row[LENGTHS + (axis + 2) % 3]
    if int(row[KIND]) == BOX:
        for k in range(count):
            nx, ny = first[k], second[k]
            ux, uy, xx, xy, yy, xz, yz = rectangle_flux(xs[k], ys[k], z, a, b)
            first[k], second[k] = nx * ux + ny * uy, nx * uy - ny * ux
            gx[k], gy[k], gz[k] = nx * xx + ny * xy, nx * xy + ny * yy, nx * xz + ny * yz
    else:
        radius = row[LENGTHS]
        for k in range(count):
            nx, ny = first[k], second[k]
            ux, uy, xx, xy, yy, xz, yz = disk_flux(xs[k], ys[k], z, radius)
            first[k], second[k] = nx * ux + ny * uy, nx * uy - ny * ux
            gx[k], gy[k], gz[k] = nx * xx + ny * xy, nx * xy + ny * yy, nx * xz + ny * yz


@subroutine
def _set_potential(room, count, row, axis, z):
    """Do the same with areas in row 2."""
    prefer_wide_vectors()
    xs, ys, first, second = room[0], room[1], room[2], room[3]
    gx, gy, gz = room[4], room[5], room[6]
    a, b = row[LENGTHS + (axis + 1) % 3], row[LENGTHS + (axis + 2) % 3]
    if int(row[KIND]) == BOX:
        for k in range(count):
            area = first[k]
            phi, px, py, pz = rectangle(xs[k], ys[k], z, a, b)
            first[k], second[k] = area * phi, 0.0
            gx[k], gy[k], gz[k] = area * px, area * py, area * pz
    else:
        radius = row[LENGTHS]
        for k in range(count):
            area = first[k]
            phi, px, py, pz = disk(xs[k], ys[k], z, radius)
            first[k], second[k] = area * phi, 0.0
            gx[k], gy[k], gz[k] = area * px, area * py, area * pz


@subroutine
def _sums(room, count, place):
    """Return the sums of these parts: the energy, its derivatives along x to z, and by an angle."""
    energy = x = y = z = turn = 0.0
    for k in range(count):
        gx, gy = room[4, k], room[5, k]
        energy, x, y, z = energy + room[2, k], x + gx, y + gy, z + room[6, k]
        turn += room[3, k] + (room[0, k] - place[0]) * gy - (room[1, k] - place[1]) * gx
    return energy, x, y, z, turn
