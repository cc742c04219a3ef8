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
    EXCESS,
    EXTRAPOLATED,
    MOVES,
    OTHERS,
    WELD,
    center_of,
    dipole_of_piece,
    nodes_of,
    radius_of_pair,
    reflected_center,
)
from magmotor.mjcf.forces.iron_potentials import (
    FURTHER,
    acts_as_shape,
    field_along_line,
    lower_charges,
    place_charges,
    set_all_lifts,
    thread,
)
from magmotor.mjcf.forces.lifts import is_lifted, to_piece, wrench_of_lifted
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
from magmotor.mjcf.forces.shaped_magnets import PUSH, THREADED, dipole_of
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
        _add_magnets(state, pieces[i], center, applied)
        if mirror[0] != 0.0:
            _add_images(state, pieces[i], center, applied)
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
        if piece[EXTRAPOLATED] != 0.0:
            energy -= piece[EXCESS]
    return energy


@subroutine
def _charges(state, piece, mirror):
    """Write the charges of a piece to the room, reflected if there is a mirror.

    Returns how many there are, with zeros up to a multiple of eight.
    """
    own, room = nodes_of(state.nodes, piece), state.room
    count = place_charges(room, own, mirror)
    for k in range(count):
        room[3, k] = own[CHARGE, k]
    return pad_charges(room, count)


@subroutine
def _separate_charges(state, piece, alone, others):
    """Write the charges of a piece by magnets alone, and by others, which count by two factors.

    If they are not separate, all of them count, and those by magnets alone the more.
    """
    own, room = nodes_of(state.nodes, piece), state.room
    count = place_charges(room, own, NO_MIRROR)
    if piece[EXTRAPOLATED] == 0.0:
        for k in range(count):
            room[3, k] = own[CHARGE, k]
        for k in range(count if alone != 1.0 else 0):
            room[3, k] += (alone - 1.0) * own[ANSWER, k]
    else:
        for k in range(count):
            room[3, k] = alone * own[ANSWER, k] + others * own[OTHERS, k]
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
def _add_magnets(state, piece, center, applied):
    """Add the wrenches between a piece and all magnets."""
    room, rows = state.room, state.sources
    body, moves = int(piece[BODY]), piece[MOVES] > 0.0
    lifted = set_all_lifts(state, piece)
    clear_wrenches(rows)
    images = add_images(piece, rows, 0, room, False) if lifted else 0.0
    kept = saturate(piece, nodes_of(state.nodes, piece), rows, room, images)
    lifted = lifted or kept != 1.0
    for k in range(len(rows)):
        row = rows[k]
        on_it = row[SHAPE_MOVES] > 0.0
        if not (moves or on_it) or row[WELD_OF_SHAPE] == piece[WELD]:
            continue
        # If any magnet is lifted, all are in its image, and the wrench is about each of them.
        target = dipole_of(row) if lifted else (*center_of(piece), 0.0, 0.0, 0.0)
        wrench = _wrench_of_magnet(state, piece, row, kept, target)
        if lifted and row[THREADED] == WIDE:
            wrench = wrench_of_lifted(piece, row, wrench)
        add_both(
            body, moves, int(row[BODY_OF_SHAPE]), on_it,
            target, (*wrench, 0.0), NO_MIRROR, 1.0, center, applied,
        )  # fmt: skip


@subroutine
def _wrench_of_magnet(state, piece, row, kept, target):
    """Return the wrench on the charges of a piece in the field of a magnet, about a target.

    Those by magnets alone count by `kept`. If the magnet is extrapolated, it is in two places.
    """
    if not is_lifted(row):
        count = _separate_charges(state, piece, kept, 1.0)
        return _wrench_in_field(state, piece, row, count, NO_MIRROR, target)
    twice = piece[EXTRAPOLATED] != 0.0
    count = _separate_charges(state, piece, kept, 1.0 + 1.0 / FURTHER if twice else 1.0)
    lower_charges(state.room, count, piece, row, 1.0)
    wrench = _wrench_in_field(state, piece, row, count, NO_MIRROR, target)
    if not twice:
        return wrench
    count = _separate_charges(state, piece, 0.0, -1.0 / FURTHER)
    lower_charges(state.room, count, piece, row, 1.0 + FURTHER)
    more = _wrench_in_field(state, piece, row, count, NO_MIRROR, target)
    # Its place depends more on the lift, the derivative of which is in `wrench_of_lifted`.
    push = to_piece(piece, more[0], more[1], more[2])
    for axis in range(3):
        row[PUSH + axis] -= FURTHER * push[axis]
    return (
        wrench[0] + more[0], wrench[1] + more[1], wrench[2] + more[2],
        wrench[3] + more[3], wrench[4] + more[4], wrench[5] + more[5],
    )  # fmt: skip


@subroutine
def _wrench_in_field(state, piece, row, count, mirror, target):
    """Return the wrench on charges in the room in the field of a magnet, about a target."""
    if not acts_as_shape(row, piece, mirror):
        set_dipole_fields(state.room, count, dipole_of(row))
        return wrench_of_charges(state.room, count, target)
    threaded = thread(state.room, count, piece, row, mirror) == INSIDE
    return charges_at_shape(state.room, count, target[:3], row, threaded, False)[:6]


@subroutine
def _add_images(state, piece, center, applied):
    """Add the wrenches between a piece and the images of all magnets in the plane of iron."""
    rows, mirror = state.sources, state.mirror
    body, moves, there = int(piece[BODY]), piece[MOVES] > 0.0, reflected_center(piece, mirror)
    for k in range(len(rows)):
        row = rows[k]
        on_it = row[SHAPE_MOVES] > 0.0
        if moves or on_it:
            count = _charges(state, piece, mirror)
            about = (*there, 0.0, 0.0, 0.0)
            wrench = _wrench_in_field(state, piece, row, count, mirror, about)
            add_both(
                body, moves, int(row[BODY_OF_SHAPE]), on_it, (*center_of(piece), 0.0, 0.0, 0.0),
                _with_images(wrench, mirror), mirror, 1.0, center, applied,
            )  # fmt: skip


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
        count = _charges(state, piece, mirror)
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
    count = _charges(state, piece, NO_MIRROR)
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
