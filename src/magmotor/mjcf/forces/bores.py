"""Coils by their geom: what is in the bore is in the field B, not in that of a magnet's charges.

A geom that a coil drives stands for a winding on its side. Outside, its field is that of the
charges J.n on its ends, -grad phi; in the bore, it is J - grad phi. For iron and for charges, J is
the gradient of another potential psi, which has one value at a place if what is there does not
close a ring through the bore: with z along J, and ends at z = -l and l,

    psi = -J z in the bore, -J l beyond its upper end, and J l beyond its lower one.

What is convex is in the bore between the ends, or nowhere: a winding is in the way of anything
else. See also `threaded_iron.py`.
"""

import math

from magmotor.mjcf.declarations.iron import BOX, CYLINDER
from magmotor.mjcf.declarations.meshes import MESH
from magmotor.mjcf.forces.charges import ORDERS, set_charges
from magmotor.mjcf.forces.iron_pieces import ellipsoid
from magmotor.mjcf.forces.shape_distances import squared_distance
from magmotor.mjcf.forces.shaped_magnets import COIL, KIND, LENGTHS, POLARIZATION, RADIUS, in_frame
from magmotor.mjcf.forces.shaped_magnets import FRAME as FRAME_OF_SHAPE
from magmotor.mjcf.forces.shaped_magnets import POSITION as POSITION_OF_SHAPE
from magmotor.numerics.deferred import jitable, subroutine
from magmotor.numerics.elementary import prefer_wide_vectors
from magmotor.numerics.shapes.box import box_contains, box_field, box_potential
from magmotor.numerics.shapes.cylinder import (
    cylinder_contains,
    cylinder_field,
    cylinder_potential,
)

END = 7
"""Row of a room: 0 for a point that is in the bore, and 1 or -1 for one that is attached beyond the
upper or the lower end."""

FINEST = len(ORDERS) - 1
"""Level of the charges of a magnet in a bore."""

TIGHT = 1e-6
"""How much wider than the bore what is in it may be, over the width of the bore."""


@jitable
def axis_of(coil):
    """Return the axis of a coil, and half its length."""
    if int(coil[KIND]) == CYLINDER:
        return 2, coil[LENGTHS + 1]
    axis = 2
    for k in range(2):
        if coil[POLARIZATION + k] != 0.0:
            axis = k
    return axis, coil[LENGTHS + axis]


@subroutine
def is_in_bore(coil, x, y, z):
    """Whether a point of the world is in the bore of a coil."""
    u, v, w = in_frame(coil, x, y, z)
    a, b, c = coil[LENGTHS], coil[LENGTHS + 1], coil[LENGTHS + 2]
    if int(coil[KIND]) == CYLINDER:
        return cylinder_contains(u, v, w, a, b)
    return box_contains(u, v, w, a, b, c)


@subroutine
def _crosses(coil, place, arm):
    """Whether the line from `place` - `arm` to `place` + `arm` in the world crosses the bore."""
    x, y, z = in_frame(coil, place[0], place[1], place[2])
    p, q, r = in_frame(coil, place[0] + arm[0], place[1] + arm[1], place[2] + arm[2])
    first, last = -1.0, 1.0
    a, b, c = coil[LENGTHS], coil[LENGTHS + 1], coil[LENGTHS + 2]
    p, q, r = p - x, q - y, r - z
    if int(coil[KIND]) == CYLINDER:
        first, last = _within(first, last, z, r, b)
        square = p * p + q * q
        nearest = -(p * x + q * y) / square if square > 0.0 else first
        t = min(max(nearest, first), last)
        u, v = x + t * p, y + t * q
        return first < last and u * u + v * v < a * a
    first, last = _within(first, last, x, p, a)
    first, last = _within(first, last, y, q, b)
    first, last = _within(first, last, z, r, c)
    return first < last


@subroutine
def _within(first, last, x, step, half):
    """Return the part of an interval of t in which x + t step is between -half and half."""
    if step == 0.0:
        return (first, last) if abs(x) < half else (first, first)
    one, two = (-half - x) / step, (half - x) / step
    return max(first, min(one, two)), min(last, max(one, two))


@subroutine
def passes(coil, place, frame, lengths):
    """Whether a body with a center, axes (row by row), and half lengths along them is in a bore.

    The lines through its center along its axes stand for it.
    """
    found = False
    for k in range(3):
        half = lengths[0] if k == 0 else (lengths[1] if k == 1 else lengths[2])
        arm = half * frame[k], half * frame[3 + k], half * frame[6 + k]
        found = found or _crosses(coil, place, arm)
    return found


@jitable
def fits(coil, kind, lengths):
    """Whether a body of a type, with half lengths along its axes, fits in the bore of a coil."""
    a, b, c = lengths
    small, large = min(a, b, c), max(a, b, c)
    middle = a + b + c - small - large
    axis, _ = axis_of(coil)
    if int(coil[KIND]) == CYLINDER:
        across = math.sqrt(small * small + middle * middle) if kind == BOX else middle
        return across <= (1.0 + TIGHT) * coil[LENGTHS]
    one, two = coil[LENGTHS + (axis + 1) % 3], coil[LENGTHS + (axis + 2) % 3]
    wide, narrow = (1.0 + TIGHT) * max(one, two), (1.0 + TIGHT) * min(one, two)
    return small <= narrow and middle <= wide


@subroutine
def magnet_fits(row, coil):
    """Whether a magnet fits in the bore of the other one, which is a coil then."""
    if coil[COIL] == 0.0 or int(row[KIND]) == MESH:
        return coil[COIL] > 0.0 and row[RADIUS] <= coil[RADIUS]
    return fits(coil, int(row[KIND]), _lengths_of_shape(row))


@subroutine
def _lengths_of_shape(row):
    """Return half the lengths of a magnet along its axes; 0 for a mesh."""
    if int(row[KIND]) == MESH:
        return 0.0, 0.0, 0.0
    sizes = row[LENGTHS], row[LENGTHS + 1], row[LENGTHS + 2]
    a, b, c, _ = ellipsoid(int(row[KIND]), sizes[0], sizes[1], sizes[2])
    return a, b, c


@subroutine
def thread_charges(room, row, coil):
    """Whether a magnet that fits is in the bore of a coil; if so, its charges are written.

    Returns how many there are, or 0.
    """
    reach = row[RADIUS] + coil[RADIUS]
    p, f = POSITION_OF_SHAPE, FRAME_OF_SHAPE
    x, y, z = row[p], row[p + 1], row[p + 2]
    if squared_distance(coil, x, y, z) > reach * reach:
        return 0
    inside = passes(coil, (x, y, z), row[f:], _lengths_of_shape(row))
    count = set_charges(room, row, FINEST)
    for k in range(count):
        inside = inside or is_in_bore(coil, room[0, k], room[1, k], room[2, k])
        room[END, k] = 0.0
    return count if inside else 0


@subroutine
def set_potentials_of_coil(room, count, coil):
    """Write the potential in T m to row 4, at points in rows 0 to 2 in the frame of the coil."""
    prefer_wide_vectors()
    a, b, c = coil[LENGTHS], coil[LENGTHS + 1], coil[LENGTHS + 2]
    jx, jy, jz = coil[POLARIZATION], coil[POLARIZATION + 1], coil[POLARIZATION + 2]
    x, y, z, phi = room[0], room[1], room[2], room[4]
    if int(coil[KIND]) == CYLINDER:
        for k in range(count):
            phi[k] = cylinder_potential(x[k], y[k], z[k], a, b, 0.0, 0.0, jz)
    else:
        for k in range(count):
            phi[k] = box_potential(x[k], y[k], z[k], a, b, c, jx, jy, jz)
    axis, half = axis_of(coil)
    height, end = room[axis], room[END]
    for k in range(count):
        inside = min(max(height[k], -half), half)
        phi[k] -= coil[POLARIZATION + axis] * (inside if end[k] == 0.0 else half * end[k])


@subroutine
def set_fields_of_coil(room, count, coil):
    """Write the negative gradient of that potential in T to the rows 4 to 6."""
    prefer_wide_vectors()
    a, b, c = coil[LENGTHS], coil[LENGTHS + 1], coil[LENGTHS + 2]
    jx, jy, jz = coil[POLARIZATION], coil[POLARIZATION + 1], coil[POLARIZATION + 2]
    x, y, z, hx, hy, hz = room[0], room[1], room[2], room[4], room[5], room[6]
    if int(coil[KIND]) == CYLINDER:
        for k in range(count):
            hx[k], hy[k], hz[k] = cylinder_field(x[k], y[k], z[k], a, b, 0.0, 0.0, jz)
    else:
        for k in range(count):
            hx[k], hy[k], hz[k] = box_field(x[k], y[k], z[k], a, b, c, jx, jy, jz)
    axis, half = axis_of(coil)
    height, end, along = room[axis], room[END], room[4 + axis]
    for k in range(count):
        if end[k] == 0.0 and abs(height[k]) < half:
            along[k] += coil[POLARIZATION + axis]
