"""The energy of a sheet of iron that is magnetized to saturation; see `sheets.py`.

It is a sum over the cells of a polar grid in the sheet, below the center of each magnet that is
near. In a cell, the field is by the differences of the magnets' potentials at its corners, so that
all forces are those of fields on charges there, and exact derivatives. Of several grids, each has a
share at a point, with the sum 1.
"""

import math

import numpy as np

from magmotor.mjcf.forces.charges import PLACES
from magmotor.mjcf.forces.faces import AXIS, DEPTH, HEIGHT, cover
from magmotor.mjcf.forces.iron_pieces import POSITION, SATURATION, SUSCEPTIBILITY
from magmotor.mjcf.forces.lifts import center_on_piece, to_piece, to_world
from magmotor.mjcf.forces.shape_distances import is_near
from magmotor.mjcf.forces.shape_fields import (
    set_continued_potentials,
    set_dipole_fields,
    set_dipole_potentials,
)
from magmotor.mjcf.forces.shape_wrenches import charges_at_shape, pad_charges, wrench_of_charges
from magmotor.mjcf.forces.shaped_magnets import (
    FADE,
    KIND,
    NEAR,
    POINT,
    RADIUS,
    SHEET,
    dipole_of,
    in_frame,
)
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY

ANGLES = 12
"""Number of cells around a grid."""

_RADII = np.array([0.0, 0.15, 0.4, 0.7, 0.9, 1.04, 1.3, 2.0, 4.0, 10.0])
"""Radii of the rings of corners, over that of the sphere around the magnet."""

RINGS, LAYER = len(_RADII) - 1, 1 + ANGLES * (len(_RADII) - 1)
"""Number of rings, and of corners at one depth; the first one is the center."""

NODES, APART = 2 * LAYER, 1.0 / math.sqrt(3.0)
"""Number of all corners, and the distance of the two depths, over the thickness."""

_QUARTER = (
    1.0, 0.9659258262890683, 0.8660254037844386, 0.7071067811865476, 0.5, 0.25881904510252074, 0.0,
)  # fmt: skip
"""Cosines of multiples of half the angle of a cell; the last bits of a library's would vary."""


def _cosine(number: int) -> float:
    """Return the cosine of a number of such halves."""
    number = abs((number + ANGLES) % (2 * ANGLES) - ANGLES)
    return _QUARTER[number] if number < len(_QUARTER) else -_QUARTER[ANGLES - number]


def _circle(first: int) -> list[float]:
    """Return the cosines of all angles around a grid, from a number of halves on."""
    return [_cosine(first + 2 * k) for k in range(ANGLES)]


_U, _V = (np.tile([0.0, *np.outer(_RADII[1:], _circle(k)).ravel()], 2) for k in (0, -ANGLES // 2))
_W = np.repeat([0.5 * APART, -0.5 * APART], LAYER)
"""Coordinates of corners: along the sheet over that radius, and across it over the thickness."""

_COSINES, _SINES = np.array(_circle(1)), np.array(_circle(1 - ANGLES // 2))
_ALONG, _ACROSS = _cosine(1), _cosine(1 - ANGLES // 2)
"""Cosines and sines of the angles of cells, and those of half the angle of one."""

SOFT = 2e-4
"""Field over mu0 M_s below which the magnetization along it is not quite M_s."""

TOTAL, CORNERS = PLACES, PLACES + 1
"""Rows of a room: the potential of all magnets at the corners, and the charges there."""


@subroutine
def add_grid(piece, face, rows, own, several, room, wanted):
    """Return the energy of the grid below a magnet; add wrenches unless it is `wanted`."""
    for n in range(NODES):
        room[TOTAL, n] = 0.0
    for k in range(len(rows)):
        _place_corners(piece, face, rows[own], room)
        if _is_shaped(rows[own], rows[k]):
            for n in range(NODES):
                x, y, z = in_frame(rows[k], room[0, n], room[1, n], room[2, n])
                room[0, n], room[1, n], room[2, n] = x, y, z
            set_continued_potentials(room, NODES, rows[k])
        else:
            set_dipole_potentials(room, NODES, dipole_of(rows[k]))
        for n in range(NODES):
            room[TOTAL, n] += room[4, n]
    energy = _add_cells(piece, face, rows, own, several, room, wanted)
    if wanted:
        return energy
    one, two = (int(face[0, AXIS]) + 1) % 3, (int(face[0, AXIS]) + 2) % 3
    for k in range(len(rows)):
        _place_corners(piece, face, rows[own], room)
        for n in range(NODES):
            room[3, n] = room[CORNERS, n]
        count, about = pad_charges(room, NODES), dipole_of(rows[k])
        if _is_shaped(rows[own], rows[k]):
            wrench = charges_at_shape(room, count, about, rows[k], False, False)[:6]
        else:
            set_dipole_fields(room, count, about)
            wrench = wrench_of_charges(room, count, about)
        force = to_piece(piece, wrench[0], wrench[1], wrench[2])
        torque = to_piece(piece, wrench[3], wrench[4], wrench[5])
        for i in range(3):
            rows[k, SHEET + i] -= force[i]
            rows[k, SHEET + 3 + i] -= torque[i]
        # The corners are below the center of their magnet.
        rows[own, SHEET + one] += force[one]
        rows[own, SHEET + two] += force[two]
    return energy


@subroutine
def _is_shaped(row, other):
    """Whether another magnet counts by its shape for the grid of one."""
    x, y, z, _, _, _ = dipole_of(row)
    return int(other[KIND]) != POINT and is_near(other, x, y, z, 2.0 * row[RADIUS], 0.0)


@subroutine
def _place_corners(piece, face, row, room):
    """Write the corners of the grid of a magnet in the world to the rows 0 to 2."""
    axis, place, scale = int(face[0, AXIS]), center_on_piece(piece, row), row[RADIUS]
    middle = face[0, HEIGHT] - 0.5 * face[0, DEPTH]
    origin = _to_world(piece, axis, place[(axis + 1) % 3], place[(axis + 2) % 3], middle)
    one, two = _to_world(piece, axis, scale, 0.0, 0.0), _to_world(piece, axis, 0.0, scale, 0.0)
    across = _to_world(piece, axis, 0.0, 0.0, face[0, DEPTH])
    for i in range(3):
        target, start = room[i, :NODES], piece[POSITION + i] + origin[i]
        u, v, w = one[i], two[i], across[i]
        for n in range(NODES):
            target[n] = start + u * _U[n] + v * _V[n] + w * _W[n]


@subroutine
def _to_world(piece, axis, u, v, w):
    """Return a vector of the world that is given along the plane of a sheet and across it."""
    x, y, z = (w, u, v) if axis == 0 else ((v, w, u) if axis == 1 else (u, v, w))
    return to_world(piece, x, y, z)


@subroutine
def _add_cells(piece, face, rows, own, several, room, wanted):
    """Return the energy of all cells of a grid.

    Unless it is `wanted`, write the charges at corners, and add the forces by where the grid is.
    """
    axis, place, scale = int(face[0, AXIS]), center_on_piece(piece, rows[own]), rows[own, RADIUS]
    one, two = (axis + 1) % 3, (axis + 2) % 3
    soft = SOFT * VACUUM_PERMEABILITY * piece[SATURATION]
    total, charge, energy = room[TOTAL], room[CORNERS], 0.0
    fu = fv = 0.0
    for n in range(NODES):
        charge[n] = 0.0
    normal = piece[SUSCEPTIBILITY] / (1.0 + piece[SUSCEPTIBILITY]) / VACUUM_PERMEABILITY
    across = 0.25 / (APART * face[0, DEPTH])
    for ring in range(RINGS):
        inner, outer = scale * _RADII[ring], scale * _RADII[ring + 1]
        middle, width = 0.5 * (inner + outer), outer - inner
        radial, around = 0.25 / (width * _ALONG), 0.125 / (middle * _ACROSS)
        volume = 2.0 * middle * width * _ALONG * _ACROSS * face[0, DEPTH]
        for turn in range(ANGLES):
            u = place[one] + middle * _ALONG * _COSINES[turn]
            v = place[two] + middle * _ALONG * _SINES[turn]
            covered, du, dv = cover(face, u, v, width)
            if covered == 0.0:
                continue
            i, j = 1 + ANGLES * ring + turn, 1 + ANGLES * ring + (turn + 1) % ANGLES
            k, m = (i - ANGLES, j - ANGLES) if ring > 0 else (0, 0)
            a, b, c, d = total[i], total[j], total[k], total[m]
            e, f, g, h = total[i + LAYER], total[j + LAYER], total[k + LAYER], total[m + LAYER]
            p = radial * (a + e + b + f - c - g - d - h)
            q = around * (b + f + d + h - a - e - c - g)
            r = across * (a + b + c + d - e - f - g - h)
            root = math.sqrt(p * p + q * q + soft * soft)
            unit = -volume * (_share(piece, face, rows, own, u, v) if several else 1.0)
            part = unit * (piece[SATURATION] * (root - soft) + 0.5 * normal * r * r)
            energy += covered * part
            if wanted:
                continue
            fu, fv = fu - part * du, fv - part * dv
            if several:
                _add_shares(piece, face, rows, own, u, v, covered * part)
            unit *= covered * VACUUM_PERMEABILITY
            p *= unit * piece[SATURATION] * radial / root
            q *= unit * piece[SATURATION] * around / root
            r *= unit * normal * across
            charge[i], charge[i + LAYER] = charge[i] + p - q + r, charge[i + LAYER] + p - q - r
            charge[j], charge[j + LAYER] = charge[j] + p + q + r, charge[j + LAYER] + p + q - r
            charge[k], charge[k + LAYER] = charge[k] - p - q + r, charge[k + LAYER] - p - q - r
            charge[m], charge[m + LAYER] = charge[m] - p + q + r, charge[m + LAYER] - p + q - r
    rows[own, SHEET + one] += fu
    rows[own, SHEET + two] += fv
    return energy


@subroutine
def _level(piece, face, row, u, v):
    """Return to what the share of a magnet's grid at a point is proportional, and log-slopes."""
    axis, place, size = int(face[0, AXIS]), center_on_piece(piece, row), row[RADIUS]
    u, v = u - place[(axis + 1) % 3], v - place[(axis + 2) % 3]
    inverse = 1.0 / (u * u + v * v + size * size)
    level = size * size * inverse
    return row[NEAR] * level * level, -4.0 * u * inverse, -4.0 * v * inverse


@subroutine
def _total_level(piece, face, rows, u, v):
    """Return the sum of that for all grids at a point."""
    total = 0.0
    for k in range(len(rows)):
        if rows[k, NEAR] > 0.0:
            total += _level(piece, face, rows[k], u, v)[0]
    return total


@subroutine
def _share(piece, face, rows, own, u, v):
    """Return the share of a magnet's grid at a point."""
    return _level(piece, face, rows[own], u, v)[0] / _total_level(piece, face, rows, u, v)


@subroutine
def _add_shares(piece, face, rows, own, u, v, part):
    """Add the forces by which the shares change at a point of a grid that has a part of S."""
    one, two = SHEET + (int(face[0, AXIS]) + 1) % 3, SHEET + (int(face[0, AXIS]) + 2) % 3
    total = _total_level(piece, face, rows, u, v)
    for k in range(len(rows)):
        if k == own or rows[k, NEAR] == 0.0:
            continue
        level, du, dv = _level(piece, face, rows[k], u, v)
        change = part * level / total
        rows[k, one] -= change * du
        rows[k, two] -= change * dv
        rows[own, one] += change * du
        rows[own, two] += change * dv
        rows[k, FADE] -= change / rows[k, NEAR]
        rows[own, FADE] += change / rows[own, NEAR]
