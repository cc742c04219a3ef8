"""Braking of magnets by the eddy currents that their motion induces in conducting plates.

At low speed, a plate of conductivity s between the depths 0 and d is a stack of sheets, whose
currents follow from the flux through each, as Maxwell found: the field of a sheet is that of images
that recede. With charges q_i at heights z_i and horizontal distances rho, the force on charge j is

    F_j = mu0^2 s/(16 pi) q_j sum_i q_i grad_j (v_i . grad_i) (K(rho, Z + 2 d) - K(rho, Z)),

where Z = z_i + z_j, r^2 = rho^2 + Z^2 and K = Z log(r + Z) - r. All magnets are charges here: those
by their geom as in `charges.py`, and dipoles as two opposite charges. So the forces are a linear
function of the velocities, which is symmetric and never drives, whatever the quadrature.
"""

import math
from typing import Any

from magmotor.mjcf import layout, memory
from magmotor.mjcf.declarations.custom import numbers_of
from magmotor.mjcf.declarations.iron import BOX, CYLINDER, SPHERE
from magmotor.mjcf.declarations.table import conductors
from magmotor.mjcf.error_numbers import BELOW, NO_ERROR, UNLOADED
from magmotor.mjcf.forces.charges import MOST, set_charges, set_dipole
from magmotor.mjcf.forces.dipole_table import (
    BODY,
    ELEMENT,
    FIRST,
    MOVES,
    ROWS,
    SIZE,
    dipole,
    padded,
)
from magmotor.mjcf.forces.shape_wrenches import add_wrench_about
from magmotor.mjcf.forces.shaped_magnets import (
    COLUMNS,
    FRAME,
    KIND,
    LENGTHS,
    POLARIZATION,
    POSITION,
    RADIUS,
)
from magmotor.mjcf.late_functions import LateFunction, loading_failed
from magmotor.numerics import c_types as types
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.constants import COUNT
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.simd import broadcast, load, square_root, total

_word = types.int64
_ADD = types.int64(*9 * [_word], types.float64, _word, _word)

_late = LateFunction("magmotor_eddy_address", _ADD, lambda: _add(layout.current()))
bind, _is_ready, _add_wrenches = _late.bind, _late.is_ready, _late.call

X, Y, Z, CHARGE, BODIES, ALONG, DRIVE, ROWS_OF_CHARGES = 0, 1, 2, 3, 4, 5, 8, 11
"""Rows by charge: its place, its charge in T m^2, and its body; its place in the frame of the
plane, where the third coordinate is the height; and its velocity there, times its charge."""

ENDLESS = 1e100
"""Twice the depth of a half-space, whose square does not overflow."""

APART = 0.1
"""Distance of the charges of a dipole over its height, in thousandths."""

LEAST = 0.2
"""Smallest height of a charge over the width of the part of the surface for which it stands."""

COARSE, MIDDLE, FINE = 1, 2, 4
"""Orders of charges, see `charges.ORDERS`: of magnets far above a plate, and of nearer ones."""

NEAR, FAR = 0.6, 2.0
"""Heights of the lowest charge over the radius around a part of a magnet, and around the whole,
below which the order is higher."""

MOST_PARTS, OF_PART = 8, 384
"""Largest number of parts of a magnet, and of charges of a part."""


@subroutine
def add_eddy_wrenches(state, own, m, d, offsets, applied):
    """Add the wrenches by eddy currents; return how many plates act, and an error.

    The arguments are those of `set_magnetic_wrenches`, which has marked the stack of `mjData`.
    """
    if not _is_ready():
        return 0, (UNLOADED, -1, -1) if loading_failed() else NO_ERROR
    place, shapes = memory.pair_on_stack(), state.shapes
    acting = _add_wrenches(
        (
            m.ctypes.data, d.ctypes.data, own, state.table.ctypes.data, state.table.shape[1],
            state.magnets.sources, state.magnets.shaped, shapes.ctypes.data,
            len(shapes), state.scale, applied.ctypes.data, place,
        )
    )  # fmt: skip
    found = memory.words(place, 2)
    return acting, (BELOW, found[0], found[1]) if acting < 0 else NO_ERROR


@compiled_once(_ADD, error_model="numpy")
def _add(checksum: int, offsets: layout.Layout) -> Any:
    """Define what `add_eddy_wrenches` calls, for one layout of the structs."""

    def add_wrenches(
        model, data, own, table, columns, number, shaped, shapes, count, scale, applied, place
    ):  # fmt: skip
        _ = checksum
        m, d = memory.words(model, memory.UNBOUNDED), memory.words(data, memory.UNBOUNDED)
        dipoles = memory.numbers(table, ROWS, columns)
        rows, found = memory.numbers(shapes, count, COLUMNS), memory.words(place, 2)
        wrenches = memory.numbers(applied, memory.UNBOUNDED, 6)
        room, acting = COUNT, 0
        for k in range(number):
            room += 2 * int(dipoles[SIZE, k])
        for k in range(count):
            room += max(MOST, OF_PART * _parts(rows[k])[2])
        room = padded(room)
        charges = memory.numbers(
            memory.allocate(data, 8 * ROWS_OF_CHARGES * room, 64), ROWS_OF_CHARGES, room
        )
        for plate in conductors(own):
            numbers = numbers_of(plate.numeric, m, offsets)
            if numbers[0] == 0.0:
                continue
            plane = _plane(plate.geom, d, offsets)
            filled, low = _fill(charges, plane, dipoles, number, shaped, rows)
            if low >= 0:
                found[0], found[1] = int(dipoles[ELEMENT, low]), plate.geom
                return -1
            _set_drives(charges, filled, plane, m, d, offsets)
            thick = 2.0 * numbers[1] if len(numbers) > 1 and numbers[1] > 0.0 else ENDLESS
            factor = scale * scale * numbers[0] / (16.0 * math.pi)
            _add_forces(charges, filled, factor, thick, plane, d, offsets, wrenches)
            acting += filled > 0
        return acting

    return add_wrenches


@subroutine
def _plane(geom, d, offsets):
    """Return a point of a plane, and its frame, row by row."""
    p = memory.numbers(d[offsets.geom_xpos // 8], memory.UNBOUNDED, 3)[geom]
    f = memory.numbers(d[offsets.geom_xmat // 8], memory.UNBOUNDED, 9)[geom]
    return p[0], p[1], p[2], f[0], f[1], f[2], f[3], f[4], f[5], f[6], f[7], f[8]


@subroutine
def _in_plane(plane, x, y, z):
    """Return a vector of the world along the axes of a plane."""
    return (
        plane[3] * x + plane[6] * y + plane[9] * z,
        plane[4] * x + plane[7] * y + plane[10] * z,
        plane[5] * x + plane[8] * y + plane[11] * z,
    )


@subroutine
def _height(plane, x, y, z):
    """Return the height of a point above a plane."""
    return _in_plane(plane, x - plane[0], y - plane[1], z - plane[2])[2]


@subroutine
def _fill(charges, plane, dipoles, number, shaped, rows):
    """Write the charges of all magnets that can move.

    Returns their number, and the column of a magnet that is below the plane, or -1.
    """
    end = 0
    for k in range(number):
        first = int(dipoles[FIRST, k])
        for i in range(first, first + int(dipoles[SIZE, k]) if dipoles[MOVES, k] > 0.0 else first):
            target = dipole(dipoles, i)
            if target[3] == 0.0 and target[4] == 0.0 and target[5] == 0.0:
                continue
            height = _height(plane, target[0], target[1], target[2])
            if not height > 0.0:
                return end, i
            room = memory.from_column(charges, end)
            # The field of a sphere is that of a dipole.
            if shaped <= i < shaped + len(rows) and int(rows[i - shaped, KIND]) != SPHERE:
                count = _set_shape(room, rows[i - shaped], plane)
            else:
                count = set_dipole(room, target, APART * height)
                _set_places(room, count, plane, math.inf)
            for j in range(count):
                room[BODIES, j] = dipoles[BODY, k]
            end += count
    return end, -1


@subroutine
def _set_shape(room, row, plane):
    """Write the charges of a magnet by its geom, more of them near the plane; return how many."""
    count, radius = set_charges(room, row, COARSE), row[RADIUS]
    least = math.inf
    for k in range(count):
        least = min(least, _height(plane, room[X, k], room[Y, k], room[Z, k]))
    if least < FAR * radius:
        parts = _parts(row)[2]
        count = _set_parts(room, row, FINE if least * parts < NEAR * radius else MIDDLE)
    x, y, z = row[POLARIZATION], row[POLARIZATION + 1], row[POLARIZATION + 2]
    _set_places(room, count, plane, math.sqrt(x * x + y * y + z * z))
    return count


@subroutine
def _parts(row):
    """Return the longest axis of a magnet, the column of its length, and how many parts are cut.

    Boxes and cylinders are cut across this axis, so that charges are not far apart along it. Those
    of two faces in a cut cancel.
    """
    kind, a, b, c = int(row[KIND]), row[LENGTHS], row[LENGTHS + 1], row[LENGTHS + 2]
    axis = length = 2
    ratio = 1.0
    if kind == CYLINDER:
        length, ratio = 1, b / a
    elif kind == BOX:
        longest = max(a, b, c)
        axis = length = 0 if a == longest else (1 if b == longest else 2)
        ratio = longest / (a + b + c - longest - min(a, b, c))
    return axis, LENGTHS + length, int(min(max(ratio + 0.5, 1.0), MOST_PARTS))


@subroutine
def _set_parts(room, row, level):
    """Write the charges of all parts of a magnet; return how many."""
    axis, length, parts = _parts(row)
    count, whole = 0, row[length]
    x, y, z = row[POSITION], row[POSITION + 1], row[POSITION + 2]
    row[length] = whole / parts
    for part in range(parts):
        shift = whole * ((2 * part + 1) / parts - 1.0)
        row[POSITION] = x + shift * row[FRAME + axis]
        row[POSITION + 1] = y + shift * row[FRAME + 3 + axis]
        row[POSITION + 2] = z + shift * row[FRAME + 6 + axis]
        count += set_charges(memory.from_column(room, count), row, level)
    row[length], row[POSITION], row[POSITION + 1], row[POSITION + 2] = whole, x, y, z
    return count


@subroutine
def _set_places(room, count, plane, polarization):
    """Write where charges are in the frame of a plane; those of a surface are not too near it."""
    for k in range(count):
        x, y, z = room[X, k] - plane[0], room[Y, k] - plane[1], room[Z, k] - plane[2]
        room[ALONG, k], room[ALONG + 1, k], height = _in_plane(plane, x, y, z)
        width = math.sqrt(abs(room[CHARGE, k]) / polarization)
        room[ALONG + 2, k] = max(height, LEAST * width)


@subroutine
def _set_drives(charges, count, plane, m, d, offsets):
    """Write the velocities of charges, times these, and charges of 0 after the last one."""
    for k in range(count):
        x, y, z, q = charges[X, k], charges[Y, k], charges[Z, k], charges[CHARGE, k]
        u, v, w = _velocity(int(charges[BODIES, k]), x, y, z, m, d, offsets)
        u, v, w = _in_plane(plane, u, v, w)
        charges[DRIVE, k], charges[DRIVE + 1, k], charges[DRIVE + 2, k] = q * u, q * v, q * w
    for k in range(count, padded(count)):
        for row in range(ROWS_OF_CHARGES):
            charges[row, k] = charges[row, 0] if row < CHARGE or ALONG <= row < DRIVE else 0.0


@subroutine
def _velocity(body, x, y, z, m, d, offsets):
    """Return the velocity of a point of a body; MuJoCo has it at the center of the whole tree."""
    root = memory.integers(m[offsets.body_rootid // 8], memory.UNBOUNDED)[body]
    center = memory.numbers(d[offsets.subtree_com // 8], memory.UNBOUNDED, 3)[root]
    rate = memory.numbers(d[offsets.cvel // 8], memory.UNBOUNDED, 6)[body]
    x, y, z = x - center[0], y - center[1], z - center[2]
    return (
        rate[3] + rate[1] * z - rate[2] * y,
        rate[4] + rate[2] * x - rate[0] * z,
        rate[5] + rate[0] * y - rate[1] * x,
    )


@subroutine
def _add_forces(charges, count, factor, thick, plane, d, offsets, applied):
    """Add the forces on all charges to the wrenches of their bodies."""
    center = memory.numbers(d[offsets.xipos // 8], memory.UNBOUNDED, 3)
    end = padded(count)
    for k in range(count):
        u, v, w = _drag(charges, end, k, thick)
        per = factor * charges[CHARGE, k]
        u, v, w = per * u, per * v, per * w
        fx = plane[3] * u + plane[4] * v + plane[5] * w
        fy = plane[6] * u + plane[7] * v + plane[8] * w
        fz = plane[9] * u + plane[10] * v + plane[11] * w
        place, body = (charges[X, k], charges[Y, k], charges[Z, k]), int(charges[BODIES, k])
        wrench = (fx, fy, fz, 0.0, 0.0, 0.0)
        add_wrench_about(body, 1.0, wrench, place, center, applied)


@subroutine
def _drag(charges, end, target, thick):
    """Return the sum over i of all in the formula above but the factor, for one charge j.

    In the frame of the plane, where the images of velocities point down if these point up. The
    derivatives of K are -1/(r + Z) and those of it, and 1/r.
    """
    one, twice = broadcast(1.0), broadcast(thick)
    x, y, z = (
        broadcast(charges[ALONG, target]), broadcast(charges[ALONG + 1, target]),
        broadcast(charges[ALONG + 2, target]),
    )  # fmt: skip
    fx = fy = fz = broadcast(0.0)
    for k in range(0, end, COUNT):
        dx, dy = x - load(charges, ALONG, k), y - load(charges, ALONG + 1, k)
        u, v, w = (
            load(charges, DRIVE, k), load(charges, DRIVE + 1, k), load(charges, DRIVE + 2, k)
        )  # fmt: skip
        square = dx * dx + dy * dy
        upper = z + load(charges, ALONG + 2, k)
        lower = upper + twice
        distance, farther = (
            square_root(square + upper * upper), square_root(square + lower * lower)
        )  # fmt: skip
        a, b = one / distance, one / farther
        g, h = one / (distance + upper), one / (farther + lower)
        mixed = g * a - h * b
        along = (g * g * a - h * h * b) * (dx * u + dy * v) - mixed * w
        fx = fx + (dx * along - (g - h) * u)
        fy = fy + (dy * along - (g - h) * v)
        fz = fz + (mixed * (dx * u + dy * v) - (a - b) * w)
    return total(fx), total(fy), total(fz)
