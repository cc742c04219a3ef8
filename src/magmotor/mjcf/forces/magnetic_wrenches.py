"""Magnetic forces and torques on bodies, written into MuJoCo's memory."""

import math

from magmotor.dipoles import COINCIDENCE_SQUARED
from magmotor.mjcf import memory
from magmotor.mjcf.declarations.custom import numbers_of
from magmotor.mjcf.declarations.fields import UNIFORM
from magmotor.mjcf.declarations.marks import CONDUCTORS
from magmotor.mjcf.declarations.model_numbers import tolerance_of
from magmotor.mjcf.declarations.table import conductors
from magmotor.mjcf.error_numbers import COINCIDENCE, NO_ERROR, OUTSIDE
from magmotor.mjcf.forces.applied_fields import MOVES as OWNER_MOVES
from magmotor.mjcf.forces.applied_fields import NAME, OWNER, acts_on, field_and_gradient
from magmotor.mjcf.forces.coil_columns import hide_coils, is_coil, show_coils
from magmotor.mjcf.forces.coupling_factors import coupling_factor
from magmotor.mjcf.forces.dipole_table import (
    BODY,
    ELEMENT,
    FIRST,
    LABEL,
    MOVES,
    SIZE,
    add_images,
    dipole,
)
from magmotor.mjcf.forces.dipole_wrenches import add_dipole_wrenches, add_wrench
from magmotor.mjcf.forces.eddy_wrenches import add_eddy_wrenches
from magmotor.mjcf.forces.field_points import count_points, dipole_at
from magmotor.mjcf.forces.hysteresis import remember
from magmotor.mjcf.forces.iron_wrenches import add_iron_wrenches
from magmotor.mjcf.forces.magnetic_state import read_dipoles, read_state
from magmotor.mjcf.forces.mirror import NOTHING
from magmotor.mjcf.forces.resolution import unresolved_body
from magmotor.mjcf.forces.shape_wrenches import add_shape_corrections
from magmotor.numerics.deferred import subroutine


@subroutine(forceinline=True)
def set_magnetic_wrenches(m, d, offsets, own, kinds, applied, later):
    """Overwrite the wrench of each body that can move and on which magnetism acts.

    `m` and `d` are the words of mjModel and mjData, `offsets` is their layout, `own` is the table
    of the model, `kinds` are the bits of what acts, `applied` (nbody, 6) receives the wrenches, and
    `later` is whether this is a later stage of RK4. Returns the number of interactions, and an
    error; without one, its other numbers are those of `unresolved_body`.
    """
    memory.mark_stack(d.ctypes.data)
    state = read_state(m, d, offsets, own, kinds)
    acting, error = 0, state.error
    if error[0] < 0 and state.magnets.number > 0:
        center = memory.numbers(d[offsets.xipos // 8], memory.UNBOUNDED, 3)
        for i in range(len(state.fields)):
            if state.fields[i, OWNER_MOVES] > 0.0:
                applied[int(state.fields[i, OWNER])] = 0.0
        acting, error = _set_mutual_wrenches(state, own, m, d, offsets, center, applied)
        if error[0] < 0:
            more, error = _add_field_wrenches(state, m, offsets, center, applied)
            acting += more
        if error[0] < 0 and state.mirror[0] != 0.0:
            acting += _add_image_wrenches(state, center, applied)
        if error[0] < 0 and len(state.shapes) > 0:
            add_shape_corrections(state, center, applied, False)
        if error[0] < 0 and len(state.memories) > 0 and not later:
            remember(state.memories, state.scale, own, m, d, offsets)
        if error[0] < 0 and len(state.pieces) > 0:
            acting += add_iron_wrenches(state, m, offsets, center, applied)
        if error[0] < 0 and kinds & CONDUCTORS and len(conductors(own)) > 0:
            more, error = add_eddy_wrenches(state, own, m, d, offsets, applied)
            acting += more
        if error[0] < 0:
            error = unresolved_body(state.table, state.magnets, m, d, offsets, applied, later)
    memory.free_stack(d.ctypes.data)
    return acting, error


@subroutine(forceinline=True)
def set_dipole_wrenches(m, d, offsets, own, kinds, applied, later):
    """Do the same where no fields, coils or iron act."""
    memory.mark_stack(d.ctypes.data)
    state = read_dipoles(m, d, offsets, own, kinds)
    acting, error = 0, NO_ERROR
    if state.magnets.number > 0:
        center = memory.numbers(d[offsets.xipos // 8], memory.UNBOUNDED, 3)
        acting, error = _set_mutual_wrenches(state, own, m, d, offsets, center, applied)
        if error[0] < 0:
            error = unresolved_body(state.table, state.magnets, m, d, offsets, applied, later)
    memory.free_stack(d.ctypes.data)
    return acting, error


@subroutine(forceinline=True)
def _set_mutual_wrenches(state, own, m, d, offsets, center, applied):
    """Overwrite the wrenches of all magnets that can move by those of the others."""
    table, magnets = state.table, state.magnets
    for k in range(magnets.number):
        # `xfrc_applied` persists, and still has the wrenches of the last step.
        if table[MOVES, k] > 0.0:
            applied[int(table[BODY, k])] = 0.0
    hide_coils(state)
    acting, coincident = add_dipole_wrenches(
        m.ctypes.data, d.ctypes.data, tolerance_of(own, m, offsets), table, magnets,
        state.couplings, center, applied,
    )  # fmt: skip
    show_coils(state)
    return acting, find_coincidence(state) if coincident > 0 else NO_ERROR


@subroutine
def _add_field_wrenches(state, m, offsets, center, applied):
    """Add the wrenches of applied fields on all dipoles, and the reactions on their bodies."""
    table = state.table
    acting = 0
    for number in range(len(state.fields)):
        row = state.fields[number]
        owner = int(row[OWNER])
        reacts = row[OWNER_MOVES] > 0.0
        # It exerts no force, and nothing takes its reaction: one field serves all dipoles.
        if not reacts and len(numbers_of(int(row[NAME]), m, offsets)) == UNIFORM:
            field = field_and_gradient(row, 0.0, 0.0, 0.0, m, offsets)
            acting += _add_turns(table, state.magnets.number, field, applied)
            continue
        for k in range(state.magnets.number):
            body, first = int(table[BODY, k]), int(table[FIRST, k])
            moves = table[MOVES, k] > 0.0
            if not acts_on(row, table[LABEL, first], table[MOVES, k]):
                continue
            acting += 1
            for i in range(first, first + int(table[SIZE, k])):
                count = count_points(state, i, row, m, offsets)
                for point in range(count):
                    target = dipole_at(state, i, point, count)
                    total = _in_field(row, target, m, offsets)
                    fx, fy, fz, bx, by, bz, _ = total
                    if not math.isfinite(fx + fy + fz + bx + by + bz):
                        return acting, (OUTSIDE, int(table[ELEMENT, i]), int(row[NAME]))
                    if moves:
                        add_wrench(body, 1.0, target, total, center, applied)
                    # The field is that of magnets on its owner, which the dipole pushes back.
                    if reacts:
                        add_wrench(owner, -1.0, target, total, center, applied)
    return acting, NO_ERROR


@subroutine
def _in_field(row, target, m, offsets):
    """Return the force on a dipole and the field there, or NaN outside of a table."""
    x, y, z, mx, my, mz = target
    f = field_and_gradient(row, x, y, z, m, offsets)
    # F_j = m_i dB_i/dx_j, also where the table's interpolation has a small curl.
    return (
        mx * f[3] + my * f[6] + mz * f[9], mx * f[4] + my * f[7] + mz * f[10],
        mx * f[5] + my * f[8] + mz * f[11], f[0], f[1], f[2], False,
    )  # fmt: skip


@subroutine
def _add_turns(table, number, field, applied):
    """Add the torques of a uniform field on all magnets that can move; return how many these are.

    The field is fixed to what cannot move, and so to none of them.
    """
    acting = 0
    for k in range(number):
        if table[MOVES, k] > 0.0:
            body, first = int(table[BODY, k]), int(table[FIRST, k])
            for i in range(first, first + int(table[SIZE, k])):
                x, y, z = table[3, i], table[4, i], table[5, i]
                applied[body, 3] += y * field[2] - z * field[1]
                applied[body, 4] += z * field[0] - x * field[2]
                applied[body, 5] += x * field[1] - y * field[0]
            acting += 1
    return acting


@subroutine
def _add_image_wrenches(state, center, applied):
    """Add the wrenches of the images of all dipoles on dipoles that can move."""
    table, magnets, mirror = state.table, state.magnets, state.mirror
    acting = 0
    for k in range(magnets.sources):
        if table[MOVES, k] > 0.0:
            first = int(table[FIRST, k])
            for i in range(first, first + int(table[SIZE, k])):
                target = dipole(table, i)
                total = add_images(NOTHING, target, table, magnets.end, magnets, mirror)
                add_wrench(int(table[BODY, k]), 1.0, target, total, center, applied)
            acting += 1
    return acting


@subroutine
def find_coincidence(state):
    """Find two dipoles that coincide and act on each other, as an error."""
    table, magnets = state.table, state.magnets
    for k in range(magnets.sources):
        for other in range(k):
            moves = table[MOVES, k] + table[MOVES, other] > 0.0
            first, start = int(table[FIRST, k]), int(table[FIRST, other])
            factor = coupling_factor(table[BODY, k], table[BODY, other], state.couplings)
            if not moves or factor == 0.0 or table[LABEL, first] == table[LABEL, start]:
                continue
            if is_coil(state, first) or is_coil(state, start):
                continue
            for i in range(first, first + int(table[SIZE, k])):
                for j in range(start, start + int(table[SIZE, other])):
                    square = 0.0
                    for axis in range(3):
                        square += (table[axis, i] - table[axis, j]) ** 2
                    if square < COINCIDENCE_SQUARED:
                        return COINCIDENCE, int(table[ELEMENT, i]), int(table[ELEMENT, j])
    return NO_ERROR
