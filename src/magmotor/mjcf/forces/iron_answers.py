"""What a piece of iron answers to magnets alone, and what it answers to everything else.

A magnet near a flat face is lifted for the nodes of a piece, and the images in the face make up for
that in the energy of the magnets alone. What everything else draws from the magnet -- other pieces,
fluxes through gaps, applied fields -- would still miss what the lift takes away: a small piece
passes only half of the flux. For these, the potential of a magnet is extrapolated to its place,

    phi = phi_1 + (phi_1 - phi_2)/f,

from the potentials phi_1 of the lifted magnet and phi_2 of one that is lifted 1 + f times as far.
With the energy W of a piece in a potential, and phi_o of everything else, the energy is

    W(phi + phi_o) - W(phi) + W(phi_1),

so that a piece in the field of magnets alone is as without this.
"""

from magmotor.mjcf import memory
from magmotor.mjcf.forces.induction import set_charges
from magmotor.mjcf.forces.iron_pieces import (
    ALONE,
    ANSWER,
    ANSWERED,
    CHARGE,
    ENERGY,
    EXCESS,
    EXTRAPOLATED,
    INNER,
    MAGNETS,
    NEARER,
    NET,
    OTHERS,
    PASSING,
    POTENTIAL,
    RELUCTIVITY,
    ROWS,
    STIFFENING,
    nodes_of,
)
from magmotor.numerics.deferred import subroutine


@subroutine
def separate_answers(state):
    """Separate the charges of pieces for which magnets are extrapolated."""
    for i in range(len(state.pieces)):
        piece = state.pieces[i]
        if piece[EXTRAPOLATED] == 0.0:
            continue
        own = nodes_of(state.nodes, piece)
        piece[EXCESS] = _answer(piece, own, state.room, 1.0)
        for k in range(own.shape[1]):
            own[OTHERS, k] = own[CHARGE, k] - own[ANSWER, k]
        piece[ALONE] = _answer(piece, own, state.room, 0.0)
        piece[EXCESS] -= piece[ALONE]


@subroutine
def answer_magnets(piece, own, room):
    """Write the charges of a piece in the field of magnets alone; return its energy."""
    if piece[EXTRAPOLATED] != 0.0:
        return piece[ALONE]
    alone = True
    for k in range(own.shape[1]):
        alone = alone and own[MAGNETS, k] == own[POTENTIAL, k]
        own[ANSWER, k] = own[CHARGE, k]
    return piece[ENERGY] if alone else _answer(piece, own, room, 0.0)


@subroutine
def _answer(piece, own, room, nearer):
    """Write the charges in the field of magnets alone, which may be nearer; return the energy."""
    nodes = memory.numbers(room.ctypes.data, ROWS, own.shape[1])
    for k in range(own.shape[1]):
        nodes[POTENTIAL, k] = own[MAGNETS, k] + nearer * own[NEARER, k]
        nodes[CHARGE, k] = nodes[INNER, k] = nodes[ANSWERED, k] = 0.0
    energy, net, passing = piece[ENERGY], piece[NET], piece[PASSING]
    nu, stiffening = piece[RELUCTIVITY], piece[STIFFENING]
    piece[NET] = piece[PASSING] = 0.0
    set_charges(piece, nodes)
    piece[NET], piece[PASSING] = net, passing
    piece[RELUCTIVITY], piece[STIFFENING] = nu, stiffening
    for k in range(own.shape[1]):
        own[ANSWER, k] = nodes[CHARGE, k]
    found, piece[ENERGY] = piece[ENERGY], energy
    return found
