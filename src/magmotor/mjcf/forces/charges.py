"""The magnetic charges of a magnet, as points on its surface: Gauss quadrature of J.n.

The force on a magnet is that of a field on its charges. The energy is the sum of q phi over the
same points, in the exact potential phi of another magnet, so that the forces are its derivatives
whatever the quadrature.
"""

import numpy as np

from magmotor.mjcf.declarations.iron import BOX, CAPSULE, CYLINDER, SPHERE
from magmotor.mjcf.declarations.meshes import MESH, MOST_FACES
from magmotor.mjcf.forces.disk_points import DISK_STARTS, DISK_WEIGHTS, DISK_X, DISK_Y
from magmotor.mjcf.forces.mesh_charges import set_mesh_charges
from magmotor.mjcf.forces.shaped_magnets import FRAME, KIND, LENGTHS, POLARIZATION, POSITION
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY
from magmotor.numerics.elementary import cosine, sine

ORDERS = (2, 3, 4, 6, 8)
"""Numbers of Gauss points along an edge, the side of a cylinder, or from pole to pole."""

MOST, PLACES, ROWS = MOST_FACES, 9, 12
"""Largest number of charges, a multiple of eight; rows for them: points x y z, charges, the fields
there, two for the field of a mesh, and from `PLACES` on other places; and how many rows there
are."""

_HALVES = (
    (0.5773502691896257, 0.5),
    (0.0, 0.4444444444444444), (0.7745966692414834, 0.2777777777777778),
    (0.33998104358485626, 0.3260725774312731), (0.8611363115940526, 0.17392742256872692),
    (0.23861918608319693, 0.2339569672863455), (0.6612093864662645, 0.1803807865240693),
    (0.932469514203152, 0.08566224618958517),
    (0.1834346424956498, 0.18134189168918097), (0.525532409916329, 0.15685332293894363),
    (0.7966664774136267, 0.11119051722668723), (0.9602898564975362, 0.05061426814518813),
)  # fmt: skip
"""Gauss-Legendre points of these orders that are not negative, and their weights over 2."""


def _rules() -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the points and weights of all orders, one after the other."""
    points: list[float] = []
    weights: list[float] = []
    start = 0
    for order in ORDERS:
        half = _HALVES[start : start + (order + 1) // 2]
        start += (order + 1) // 2
        mirrored = [(-x, w) for x, w in reversed(half) if x > 0.0]
        for x, w in (*mirrored, *half):
            points.append(x)
            weights.append(w)
    return tuple(points), tuple(weights)


_POINTS, _WEIGHTS = (np.array(numbers) for numbers in _rules())

DISTANCE = 1e-3
"""How far the two charges of a dipole are from its center, over the size of what is near."""


@subroutine
def set_charges(room, row, level):
    """Write the charges of a magnet to the rows x, y, z (in m) and q (in T m^2); return how many.

    The order is `ORDERS[level]`. Charges are in the world's frame.
    """
    x, w = gauss_rule(level)
    kind = int(row[KIND])
    if kind == MESH:
        return set_mesh_charges(room, row, level, ORDERS, _POINTS, _WEIGHTS)
    if kind == CAPSULE:
        return _capsule(room, row, x, w)
    if kind == BOX:
        return _box(room, row, x, w)
    return _cylinder(room, row, level, x, w) if kind == CYLINDER else _ellipsoid(room, row, x, w)


@subroutine
def gauss_rule(level):
    """Return the Gauss points between -1 and 1 of an order, and their weights, whose sum is 1."""
    order = ORDERS[level]
    start = 0
    for k in range(level):
        start += ORDERS[k]
    return _POINTS[start : start + order], _WEIGHTS[start : start + order]


@subroutine
def set_dipole(room, target, size):
    """Write a dipole as two opposite charges, near for something of the given size; return 2."""
    x, y, z, mx, my, mz = target
    moment = (mx * mx + my * my + mz * mz) ** 0.5
    shift = DISTANCE * size / moment
    for k in range(2):
        sign = 1.0 - 2.0 * k
        room[0, k], room[1, k] = x + sign * shift * mx, y + sign * shift * my
        room[2, k] = z + sign * shift * mz
        room[3, k] = sign * moment * VACUUM_PERMEABILITY / (2.0 * DISTANCE * size)
    return 2


@subroutine
def _put(room, count, row, x, y, z, charge):
    """Write a charge that is given in a magnet's frame."""
    for k in range(3):
        place = FRAME + 3 * k
        along = row[place] * x + row[place + 1] * y + row[place + 2] * z
        room[k, count] = row[POSITION + k] + along
    room[3, count] = charge
    return count + 1


@subroutine
def _box(room, row, x, w):
    """Write the charges of the faces of a box."""
    count = 0
    for axis in range(3):
        polarization = row[POLARIZATION + axis]
        if polarization == 0.0:
            continue
        one, two = (axis + 1) % 3, (axis + 2) % 3
        a, b, c = row[LENGTHS + one], row[LENGTHS + two], row[LENGTHS + axis]
        for k in range(2):
            height = c - 2.0 * k * c
            total = (polarization - 2.0 * k * polarization) * 4.0 * a * b
            for i in range(len(x)):
                for j in range(len(x)):
                    u, v = a * x[i], b * x[j]
                    px = height if axis == 0 else (u if one == 0 else v)
                    py = height if axis == 1 else (u if one == 1 else v)
                    pz = height if axis == 2 else (u if one == 2 else v)
                    count = _put(room, count, row, px, py, pz, total * w[i] * w[j])
    return count


@subroutine
def _cylinder(room, row, level, x, w):
    """Write the charges of the faces and of the side of a cylinder."""
    radius, half = row[LENGTHS], row[LENGTHS + 1]
    jx, jy, jz = row[POLARIZATION], row[POLARIZATION + 1], row[POLARIZATION + 2]
    count = _disks(room, row, DISK_STARTS[level], DISK_STARTS[level + 1]) if jz != 0.0 else 0
    corners = 2 * len(x) if jx != 0.0 or jy != 0.0 else 0
    for k in range(corners):
        turns = (k + 0.5) / corners
        nx, ny = cosine(turns), sine(turns)
        side = 4.0 * np.pi * radius * half / corners * (jx * nx + jy * ny)
        for i in range(len(x)):
            u, v, charge = radius * nx, radius * ny, side * w[i]
            count = _put(room, count, row, u, v, half * x[i], charge)
    return count


@subroutine
def _disks(room, row, first, end):
    """Write the charges of the faces of a cylinder; the loop is vectorized."""
    radius, half = row[LENGTHS], row[LENGTHS + 1]
    total, count = np.pi * radius * radius * row[POLARIZATION + 2], end - first
    unit_x, unit_y, weights = DISK_X[first:end], DISK_Y[first:end], DISK_WEIGHTS[first:end]
    for axis in range(3):
        upper, lower = room[axis, :count], room[axis, count : 2 * count]
        place = FRAME + 3 * axis
        along_x, along_y, up = radius * row[place], radius * row[place + 1], half * row[place + 2]
        center = row[POSITION + axis]
        for k in range(count):
            across = center + (along_x * unit_x[k] + along_y * unit_y[k])
            upper[k], lower[k] = across + up, across - up
    upper, lower = room[3, :count], room[3, count : 2 * count]
    for k in range(count):
        upper[k], lower[k] = total * weights[k], -total * weights[k]
    return 2 * count


@subroutine
def _capsule(room, row, x, w):
    """Write the charges of the caps and of the side of a capsule."""
    radius, half = row[LENGTHS], row[LENGTHS + 1]
    jx, jy, jz = row[POLARIZATION], row[POLARIZATION + 1], row[POLARIZATION + 2]
    count, corners = 0, 2 * len(x)
    cap, side = 2.0 * np.pi * radius * radius / corners, 4.0 * np.pi * radius * half / corners
    for k in range(corners):
        turns = (k + 0.5) / corners
        nx, ny = cosine(turns), sine(turns)
        across = jx * nx + jy * ny
        for i in range(len(x)):
            if across != 0.0:
                u, v, charge = radius * nx, radius * ny, side * w[i] * across
                count = _put(room, count, row, u, v, half * x[i], charge)
            nz = 0.5 + 0.5 * x[i]
            level = (1.0 - nz * nz) ** 0.5
            u, v, height = radius * level * nx, radius * level * ny, half + radius * nz
            charge = cap * w[i] * (level * across + nz * jz)
            count = _put(room, count, row, u, v, height, charge)
            charge = cap * w[i] * (level * across - nz * jz)
            count = _put(room, count, row, u, v, -height, charge)
    return count


@subroutine
def _ellipsoid(room, row, x, w):
    """Write the charges of an ellipsoid, or of a sphere.

    The force on a sphere is the same for charges on any concentric sphere. On a smaller one, fewer
    are enough.
    """
    a, b, c = row[LENGTHS], row[LENGTHS + 1], row[LENGTHS + 2]
    jx, jy, jz = row[POLARIZATION], row[POLARIZATION + 1], row[POLARIZATION + 2]
    shrink = 0.5 if int(row[KIND]) == SPHERE else 1.0
    count, corners = 0, 2 * len(x)
    whole = 4.0 * np.pi * a * b * c / (shrink * corners)
    for i in range(len(x)):
        level = (1.0 - x[i] * x[i]) ** 0.5
        for k in range(corners):
            turns = (k + 0.5) / corners
            u, v = level * cosine(turns), level * sine(turns)
            charge = whole * w[i] * (jx * u / a + jy * v / b + jz * x[i] / c)
            count = _put(
                room, count, row, shrink * a * u, shrink * b * v, shrink * c * x[i], charge
            )
    return count
