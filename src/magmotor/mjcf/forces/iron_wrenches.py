"""Forces and torques on pieces of iron and on what magnetizes them, and the field of iron.

The charges of iron are known. The force on each is that of the field of magnets, other pieces,
applied fields and images at its node, and the reaction acts on the source, at the node.
"""

from magmotor.mjcf.forces.applied_fields import MOVES as OWNER_MOVES
from magmotor.mjcf.forces.applied_fields import OWNER, acts_on
from magmotor.mjcf.forces.charge_pairs import set_fields
from magmotor.mjcf.forces.face_images import add_images, clear_wrenches
from magmotor.mjcf.forces.gap_wrenches import add_gap_wrenches
from magmotor.mjcf.forces.induction import are_far
from magmotor.mjcf.forces.iron_pieces import (
    ANSWER,
    BODY,
    CHARGE,
    MOVES,
    WELD,
    center_of,
    dipole_of_piece,
    nodes_of,
    radius_of_pair,
    reflected_center,
)
from magmotor.mjcf.forces.iron_potentials import (
    acts_as_shape,
    field_along_line,
    lower_charges,
    place_charges,
    set_all_lifts,
    thread,
)
from magmotor.mjcf.forces.lifts import is_lifted, wrench_of_lifted
from magmotor.mjcf.forces.mirror import NO_MIRROR, mirrored, reflected
from magmotor.mjcf.forces.shape_fields import dipole_at_dipole, set_dipole_fields
from magmotor.mjcf.forces.shape_wrenches import (
    add_both,
    charges_at_shape,
    pad_charges,
    wrench_of_charges,
)
from magmotor.mjcf.forces.shaped_magnets import BODY as BODY_OF_SHAPE
from magmotor.mjcf.forces.shaped_magnets import MOVES as SHAPE_MOVES
from magmotor.mjcf.forces.shaped_magnets import THREADED, dipole_of
from magmotor.mjcf.forces.shaped_magnets import WELD as WELD_OF_SHAPE
from magmotor.mjcf.forces.sheets import blend, saturate
from magmotor.mjcf.forces.threaded_iron import INSIDE, WIDE
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY


@subroutine
def add_iron_wrenches(state, m, offsets, center, applied):
    """Add the wrenches on iron, and the reactions to them; return how many pieces act."""
    mirror, pieces = state.mirror, state.pieces
    for i in range(len(pieces)):
        _add_magnets(state, pieces[i], NO_MIRROR, center, applied)
        if mirror[0] != 0.0:
            _add_magnets(state, pieces[i], mirror, center, applied)
        for j in range(i + 1):
            moves = pieces[i, MOVES] + pieces[j, MOVES] > 0.0
            if moves and pieces[i, WELD] != pieces[j, WELD]:
                _add_pair(state, i, j, NO_MIRROR, 1.0, center, applied)
            if moves and mirror[0] != 0.0:
                _add_pair(state, i, j, mirror, 0.5 if i == j else 1.0, center, applied)
        for number in range(len(state.fields)):
            row = state.fields[number]
            if acts_on(row, pieces[i, WELD], pieces[i, MOVES]):
                _add_field(state, pieces[i], row, m, offsets, center, applied)
    add_gap_wrenches(state, m, offsets, center, applied)
    return len(pieces)


@subroutine
def energy_of_faces(state):
    """Return the energy by which images in flat faces, and sheets, differ from nodes."""
    energy, rows, room = 0.0, state.sources, state.room
    for i in range(len(state.pieces)):
        piece = state.pieces[i]
        lifted = set_all_lifts(state, piece)
        images = add_images(piece, rows, 0, room, True) if lifted else 0.0
        energy += images + blend(piece, nodes_of(state.nodes, piece), rows, room, images, True)[2]
    return energy


@subroutine
def _charges(state, piece, mirror, change):
    """Write the charges of a piece to the room, reflected if there is a mirror.

    Those in the field of magnets alone count more by `change`. Returns how many there are, with
    zeros up to a multiple of eight.
    """
    own, room = nodes_of(state.nodes, piece), state.room
    count = place_charges(room, own, mirror)
    for k in range(count):
        room[3, k] = own[CHARGE, k]
    for k in range(count if change != 0.0 else 0):
        room[3, k] += change * own[ANSWER, k]
    return pad_charges(room, count)


@subroutine
def _with_images(wrench, mirror):
    """Return the wrench on charges from that on the reflected ones, which images feel opposite."""
    if mirror[0] == 0.0:
        return (*wrench, 0.0)
    strength = mirror[0]
    force = reflected(mirror, wrench[0], wrench[1], wrench[2])
    torque = reflected(mirror, wrench[3], wrench[4], wrench[5])
    return (
        -strength * force[0], -strength * force[1], -strength * force[2],
        strength * torque[0], strength * torque[1], strength * torque[2], 0.0,
    )  # fmt: skip


@subroutine
def _add_magnets(state, piece, mirror, center, applied):
    """Add the wrenches between a piece and all magnets, or their images."""
    room, rows = state.room, state.sources
    there = reflected_center(piece, mirror)
    body, moves = int(piece[BODY]), piece[MOVES] > 0.0
    lifted, change = mirror[0] == 0.0 and set_all_lifts(state, piece), 0.0
    if mirror[0] == 0.0:
        clear_wrenches(rows)
        images = add_images(piece, rows, 0, room, False) if lifted else 0.0
        change = saturate(piece, nodes_of(state.nodes, piece), rows, room, images) - 1.0
        lifted = lifted or change != 0.0
    count = _charges(state, piece, mirror, change)
    for k in range(len(rows)):
        row = rows[k]
        on_it = row[SHAPE_MOVES] > 0.0
        if not (moves or on_it) or (row[WELD_OF_SHAPE] == piece[WELD] and mirror[0] == 0.0):
            continue
        shaped = acts_as_shape(row, piece, mirror)
        lowered = lifted and is_lifted(row)
        if lowered:
            lower_charges(room, count, piece, row)
        # If any magnet is lifted, all are in its image, and the wrench is about each of them.
        own = dipole_of(row)
        about = own[:3] if lifted else there
        if shaped:
            threaded = thread(room, count, piece, row, mirror) == INSIDE
            wrench = charges_at_shape(room, count, about, row, threaded, False)[:6]
        else:
            set_dipole_fields(room, count, own)
            wrench = wrench_of_charges(room, count, about)
        if lifted and row[THREADED] == WIDE:
            wrench = wrench_of_lifted(piece, row, wrench)
        target = own if lifted else (*center_of(piece), 0.0, 0.0, 0.0)
        add_both(
            body, moves, int(row[BODY_OF_SHAPE]), on_it,
            target, _with_images(wrench, mirror), mirror, 1.0, center, applied,
        )  # fmt: skip
        if shaped or lowered:
            count = _charges(state, piece, mirror, change)


@subroutine
def _add_pair(state, i, j, mirror, factor, center, applied):
    """Add the wrenches between two pieces, or between one and the other's image."""
    piece, other, room = state.pieces[i], state.pieces[j], state.room
    target, there = (*center_of(piece), 0.0, 0.0, 0.0), reflected_center(piece, mirror)
    if are_far(piece, other, mirror):
        own, source = dipole_of_piece(state.nodes, piece), dipole_of_piece(state.nodes, other)
        if mirror[0] != 0.0:
            own = mirrored(mirror, own)
        wrench = dipole_at_dipole(own, source)[:6]
    else:
        count = _charges(state, piece, mirror, 0.0)
        others = nodes_of(state.nodes, other)
        set_fields(room, count, others, others[CHARGE], radius_of_pair(piece, other))
        wrench = wrench_of_charges(room, count, there)
    change = _with_images(wrench, mirror)
    add_both(
        int(piece[BODY]), piece[MOVES] > 0.0, int(other[BODY]), other[MOVES] > 0.0,
        target, change, mirror, factor, center, applied,
    )  # fmt: skip


@subroutine
def _add_field(state, piece, row, m, offsets, center, applied):
    """Add the wrench of an applied field on a piece, and the reaction on the body of the field."""
    room, own, there = state.room, nodes_of(state.nodes, piece), center_of(piece)
    count = _charges(state, piece, NO_MIRROR, 0.0)
    fx = fy = fz = 0.0
    for k in range(own.shape[1], count):
        room[4, k] = room[5, k] = room[6, k] = 0.0
    for k in range(own.shape[1]):
        f = field_along_line(there, (own[0, k], own[1, k], own[2, k]), row, m, offsets)
        room[4, k], room[5, k], room[6, k] = f[1], f[2], f[3]
        charge = room[3, k] / VACUUM_PERMEABILITY
        fx, fy, fz = fx + charge * f[4], fy + charge * f[5], fz + charge * f[6]
    target = (*there, 0.0, 0.0, 0.0)
    wrench = wrench_of_charges(room, count, target)
    force = wrench[0] + fx, wrench[1] + fy, wrench[2] + fz
    change = (*force, wrench[3], wrench[4], wrench[5], 0.0)
    add_both(
        int(piece[BODY]), piece[MOVES] > 0.0, int(row[OWNER]), row[OWNER_MOVES] > 0.0,
        target, change, NO_MIRROR, 1.0, center, applied,
    )  # fmt: skip
