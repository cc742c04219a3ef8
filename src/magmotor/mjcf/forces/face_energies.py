"""The energy that charges on a face miss in the field of another face, by the outline of theirs.

With the normal n of a face, and the coordinate z along that of the other one,

    int phi dA = 1/n_z int (U x dl)_z - int (n_x V_x + n_y V_y)/n_z dA,

see `numerics/shapes/faces.py`. The first term is over the outline; in the second, which is zero for
parallel faces, V is continuous, so that the points of the charges serve. Less the energy of the
charges, this is what they miss. Below the plane of the other face, phi and U are continued
linearly.

Points and what they contribute are columns of the same rows. Energies are those of charges 1 per
area on both faces, without the factor 1/(4 pi mu0).
"""

import math

from magmotor.mjcf.declarations.iron import BOX
from magmotor.mjcf.forces.charges import gauss_rule
from magmotor.mjcf.forces.disk_points import DISK_STARTS, DISK_WEIGHTS, DISK_X, DISK_Y
from magmotor.mjcf.forces.shaped_magnets import KIND, LENGTHS
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.elementary import cosine, prefer_wide_vectors, sine
from magmotor.numerics.shapes.faces import disk, rectangle

CORNERS, ALONG = 32, 4
"""Number of points on the outline of a disk, and level of those on each edge of a rectangle."""


@subroutine
def missing_energy(room, charged, own, frame, level, lengths, is_box, least):
    """Return the energy, and its derivatives by a displacement and by a rotation about the center.

    `frame` is the center and the two edges of the face with charges, whose normal is the axis `own`
    of its magnet, along the axes of the other face. That has `lengths`, half its edges or its
    radius, and `least` is the height from which on it is continued.
    """
    nx, ny = frame[4] * frame[8] - frame[5] * frame[7], frame[5] * frame[6] - frame[3] * frame[8]
    nz = frame[3] * frame[7] - frame[4] * frame[6]
    tilt = nx / nz, ny / nz, 1.0 / nz
    count = _set_outline(room, charged, own, frame)
    _add_energies(room, count, True, lengths, is_box, frame, tilt, least)
    outline = _sums(room, count)
    count = _set_face(room, charged, own, frame, level)
    _add_energies(room, count, False, lengths, is_box, frame, tilt, least)
    face = _sums(room, count)
    return (
        outline[0] + face[0],
        (outline[1] + face[1], outline[2] + face[2], outline[3] + face[3]),
        (outline[4] + face[4], outline[5] + face[5], outline[6] + face[6]),
    )


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
    `tilt` has n_x/n_z, n_y/n_z and 1/n_z.
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
def _add_energies(room, count, on_outline, lengths, is_box, frame, tilt, least):
    """Replace points, and their elements or areas, by energies and their derivatives.

    The energies are in row 0, the derivatives in rows 1 to 3 and 4 to 6.
    """
    prefer_wide_vectors()
    (x, y, z), (a, b) = frame[:3], lengths
    p, q, r, s, t, u, v = room[0], room[1], room[2], room[3], room[4], room[5], room[6]
    if is_box and on_outline:
        for k in range(count):
            height = max(r[k], least)
            terms = rectangle(p[k], q[k], height, a, b)
            p[k], q[k], r[k], s[k], t[k], u[k], v[k] = _of_outline(
                (p[k] - x, q[k] - y, r[k] - z), (s[k], t[k], u[k]), terms, r[k] - height, tilt
            )
    elif is_box:
        for k in range(count):
            height = max(r[k], least)
            terms = rectangle(p[k], q[k], height, a, b)
            p[k], q[k], r[k], s[k], t[k], u[k], v[k] = _of_charge(
                (p[k] - x, q[k] - y, r[k] - z), s[k], terms, r[k] - height, tilt
            )
    elif on_outline:
        for k in range(count):
            height = max(r[k], least)
            terms = disk(p[k], q[k], height, a)
            p[k], q[k], r[k], s[k], t[k], u[k], v[k] = _of_outline(
                (p[k] - x, q[k] - y, r[k] - z), (s[k], t[k], u[k]), terms, r[k] - height, tilt
            )
    else:
        for k in range(count):
            height = max(r[k], least)
            terms = disk(p[k], q[k], height, a)
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
