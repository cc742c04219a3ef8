"""The field of iron at a point, also near its flat faces, where nodes do not resolve it.

A probe at the point is a dipole, which is lifted for the nodes as magnets are, and is in the images
of all of them; see `face_images.py`. Its energy is -m.B in the field B of the iron.
"""

from magmotor.mjcf import memory
from magmotor.mjcf.forces.charge_pairs import set_fields
from magmotor.mjcf.forces.face_images import add_images
from magmotor.mjcf.forces.iron_pieces import (
    ANSWER,
    CHARGE,
    EXTRAPOLATED,
    OTHERS,
    RADIUS,
    nodes_of,
)
from magmotor.mjcf.forces.iron_potentials import FURTHER, set_all_lifts
from magmotor.mjcf.forces.lifts import is_lifted, set_lifts, to_world
from magmotor.mjcf.forces.mirror import mirrored, reflected
from magmotor.mjcf.forces.shaped_magnets import (
    COIL,
    COLUMNS,
    GEOM,
    KIND,
    LIFT,
    MOMENT,
    POINT,
    POSITION,
    SPREAD,
    THREADED,
)
from magmotor.mjcf.forces.shaped_magnets import RADIUS as RADIUS_OF_SHAPE
from magmotor.mjcf.forces.threaded_iron import WIDE
from magmotor.numerics.deferred import subroutine


@subroutine
def flux_of_iron(state, x, y, z):
    """Return the flux density of all pieces, and of their images, at a point outside of them."""
    bx = by = bz = 0.0
    mirror = state.mirror
    for i in range(len(state.pieces)):
        ux, uy, uz = _flux_near_piece(state, i, x, y, z)
        bx, by, bz = bx + ux, by + uy, bz + uz
        if mirror[0] != 0.0:
            there = mirrored(mirror, (x, y, z, 0.0, 0.0, 0.0))
            flux = _flux_of_nodes(state, i, CHARGE, there[0], there[1], there[2])
            ux, uy, uz = reflected(mirror, flux[0], flux[1], flux[2])
            bx, by, bz = bx - mirror[0] * ux, by - mirror[0] * uy, bz - mirror[0] * uz
    return bx, by, bz


@subroutine
def _flux_near_piece(state, i, x, y, z):
    """Return the field of the charges of a piece, and of images in its faces, at a point."""
    piece, number = state.pieces[i], len(state.sources)
    rows = memory.numbers(state.sources.ctypes.data, number + 1, COLUMNS)
    probe = rows[number]
    probe[GEOM] = probe[KIND] = POINT
    probe[RADIUS_OF_SHAPE] = probe[SPREAD] = probe[COIL] = 0.0
    probe[THREADED] = WIDE
    probe[POSITION], probe[POSITION + 1], probe[POSITION + 2] = x, y, z
    lifted = set_all_lifts(state, piece)
    lifted = set_lifts(piece, rows[number:]) or lifted
    bx, by, bz = _flux_at_probe(state, i, x, y, z, probe)
    if not lifted or number == 0:
        return bx, by, bz
    for axis in range(3):
        for k in range(3):
            probe[MOMENT + k] = 1.0 if k == axis else 0.0
        flux = -add_images(piece, rows, number, state.room, True)
        bx, by, bz = (
            bx + (flux if axis == 0 else 0.0), by + (flux if axis == 1 else 0.0),
            bz + (flux if axis == 2 else 0.0),
        )  # fmt: skip
    return bx, by, bz


@subroutine
def _flux_at_probe(state, i, x, y, z, probe):
    """Return the field of the charges of a piece at a probe, which is lifted.

    That of the charges by others than magnets is extrapolated; see `iron_answers.py`.
    """
    dx, dy, dz = to_world(state.pieces[i], probe[LIFT], probe[LIFT + 1], probe[LIFT + 2])
    u, v, w = x + dx, y + dy, z + dz
    if state.pieces[i, EXTRAPOLATED] == 0.0:
        return _flux_of_nodes(state, i, CHARGE, u, v, w)
    bx, by, bz = _flux_of_nodes(state, i, ANSWER, u, v, w)
    px, py, pz = _flux_of_nodes(state, i, OTHERS, u, v, w)
    if not is_lifted(probe):
        return bx + px, by + py, bz + pz
    u, v, w = u + FURTHER * dx, v + FURTHER * dy, w + FURTHER * dz
    qx, qy, qz = _flux_of_nodes(state, i, OTHERS, u, v, w)
    px, py, pz = px + (px - qx) / FURTHER, py + (py - qy) / FURTHER, pz + (pz - qz) / FURTHER
    return bx + px, by + py, bz + pz


@subroutine
def _flux_of_nodes(state, i, charges, x, y, z):
    """Return the field of charges at the nodes of a piece, which are in a row, at a point."""
    room, piece = state.room, state.pieces[i]
    source = nodes_of(state.nodes, piece)
    room[0, 0], room[1, 0], room[2, 0] = x, y, z
    set_fields(room, 1, source, source[charges], piece[RADIUS])
    return room[4, 0], room[5, 0], room[6, 0]
