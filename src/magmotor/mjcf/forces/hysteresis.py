"""Dipoles with hysteresis: moments that follow the field, and remember it.

The field B of everything else along such a dipole drags a play, as slack in a gear does:

    G = max(B - B_c, min(B + B_c, G')),    m = m_s G/sqrt(G^2 + B_k^2),

where G' is what the dipole remembers, B_c = mu0 H_c is the coercivity, and the remanence r m_s
determines B_k = B_c sqrt(1/r^2 - 1). So m minimizes, for given m', the energy in the field plus

    W(m) + B_c |m - m'|,    W = m_s B_k (1 - sqrt(1 - (m/m_s)^2)),

of which the first is stored, and the second is heat. The force at constant m is the derivative of
this minimum, and no step of any size gains energy. Several such dipoles magnetize each other: their
moments are found in turn, until they do not change. Those of one rigid body do not, since the loop
is that of a whole rod.

The plugin's state has two numbers for each site: G' in T, and G at the beginning of this step,
which `advance` makes the next G'. So `mj_forward` changes nothing that counts.
"""

import math
from typing import Any

import numpy as np

from magmotor.mjcf import layout, memory
from magmotor.mjcf.declarations.custom import numbers_of
from magmotor.mjcf.declarations.hysteresis import PER_SITE, state_of
from magmotor.mjcf.declarations.table import header, memories
from magmotor.mjcf.error_numbers import NO_ERROR, UNLOADED, UNSETTLED
from magmotor.mjcf.forces.applied_fields import COLUMNS as COLUMNS_OF_FIELD
from magmotor.mjcf.forces.applied_fields import acts_on, field_and_gradient
from magmotor.mjcf.forces.coupling_factors import coupling_factor
from magmotor.mjcf.forces.dipole_table import (
    BODY,
    ELEMENT,
    FIRST,
    LABEL,
    MOVES,
    ROWS,
    SIZE,
    dipole,
)
from magmotor.mjcf.forces.shape_fields import flux_of_dipole, shape_flux
from magmotor.mjcf.forces.shaped_magnets import COLUMNS as COLUMNS_OF_SHAPE
from magmotor.mjcf.late_functions import LateFunction, loading_failed
from magmotor.numerics import c_types as types
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY

_word = types.int64
_SET = types.int64(*6 * [_word], types.float64, *8 * [_word])

_late = LateFunction("magmotor_hysteresis_address", _SET, lambda: _set(layout.current()))
bind, _is_ready, _set_moments = _late.bind, _late.is_ready, _late.call

SITE, COLUMN, MAGNET, REMEMBERED, COERCIVITY, KNEE, GIVEN, OWN, PLAY, SATURATION, AXIS, COLUMNS = (
    0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 13
)  # fmt: skip
"""Columns by dipole: its site, its column in the table, and its magnet; G', B_c and B_k in T; the
field of all that has no hysteresis, and the part of its own body; G; m_s; and its direction."""

MOST, SETTLED = 1000, 1e-13
"""Largest number of rounds in which moments are found, and their last change over saturation."""


@subroutine
def set_moments(state, own, m, d, offsets):
    """Write the moments of dipoles with hysteresis, and `state.memories`; return an error.

    The moments in the table are those at saturation before.
    """
    if not _is_ready():
        return (UNLOADED, -1, -1) if loading_failed() else NO_ERROR
    unsettled = _set_moments(
        (
            m.ctypes.data, d.ctypes.data, own, state.table.ctypes.data, state.table.shape[1],
            state.magnets.number, state.scale, state.magnets.shaped, state.shapes.ctypes.data,
            len(state.shapes), state.couplings.ctypes.data, len(state.couplings),
            state.fields.ctypes.data, len(state.fields), state.memories.ctypes.data,
        )
    )  # fmt: skip
    return (UNSETTLED, unsettled, -1) if unsettled >= 0 else NO_ERROR


@compiled_once(_SET, error_model="numpy")
def _set(checksum: int, offsets: layout.Layout) -> Any:
    """Define what `set_moments` calls, for one layout of the structs."""

    def set_moments(
        model, data, own, table, columns, number, scale, shaped, shapes, count, couplings, factors,
        fields, applied, rows,
    ):  # fmt: skip
        _ = checksum
        m, d = memory.words(model, memory.UNBOUNDED), memory.words(data, memory.UNBOUNDED)
        table = memory.numbers(table, ROWS, columns)
        shapes = memory.numbers(shapes, count, COLUMNS_OF_SHAPE)
        couplings = memory.numbers(couplings, factors, 3)
        fields = memory.numbers(fields, applied, COLUMNS_OF_FIELD)
        declared = memories(own)
        rows = memory.numbers(rows, len(declared), COLUMNS)
        for k in range(len(rows)):
            _read(rows[k], declared[k], table, number, scale, own, m, d, offsets)
        for k in range(len(rows)):
            if rows[k, MAGNET] >= 0.0:
                _set_given_field(
                    rows[k], table, number, shaped, shapes, couplings, fields, m, offsets
                )
        unsettled = _settle(rows, table, couplings)
        for k in range(len(rows)):
            if rows[k, MAGNET] >= 0.0:
                moment = _moment(rows[k])
                for axis in range(3):
                    table[3 + axis, int(rows[k, COLUMN])] = moment * rows[k, AXIS + axis]
        return unsettled

    return set_moments


@subroutine
def _read(row, declared, table, number, scale, own, m, d, offsets):
    """Write the row of a dipole, and take its moment from the table."""
    numbers, state = numbers_of(declared.numeric, m, offsets), _state(own, m, d, offsets)
    row[:] = 0.0
    row[SITE], row[MAGNET] = declared.site, -1.0
    row[REMEMBERED] = row[PLAY] = state[PER_SITE * declared.site] / scale
    row[COERCIVITY] = VACUUM_PERMEABILITY * scale * numbers[0]
    row[KNEE] = row[COERCIVITY] * math.sqrt(1.0 / (numbers[1] * numbers[1]) - 1.0)
    for k in range(number):
        first = int(table[FIRST, k])
        for i in range(first, first + int(table[SIZE, k])):
            if table[ELEMENT, i] == declared.site:
                row[MAGNET], row[COLUMN] = k, i
                x, y, z = table[3, i], table[4, i], table[5, i]
                row[SATURATION] = math.sqrt(x * x + y * y + z * z)
                for axis in range(3):
                    row[AXIS + axis] = table[3 + axis, i] / row[SATURATION]
                    table[3 + axis, i] = 0.0


@subroutine
def _state(own, m, d, offsets):
    """Return the state of the plugin."""
    return state_of(header(own).instance, m, d, offsets)


@subroutine
def _set_given_field(row, table, number, shaped, shapes, couplings, fields, m, offsets):
    """Write the field along a dipole, while those with hysteresis have no moments.

    Its own rigid body and what is fixed to that act, too, which the energy of pairs leaves out.
    """
    i, k = int(row[COLUMN]), int(row[MAGNET])
    x, y, z, label = table[0, i], table[1, i], table[2, i], table[LABEL, i]
    for other in range(number):
        first = int(table[FIRST, other])
        own = table[LABEL, first] == label
        factor = 1.0 if own else coupling_factor(table[BODY, k], table[BODY, other], couplings)
        for j in range(first, first + int(table[SIZE, other])):
            if shaped <= j < shaped + len(shapes):
                flux = shape_flux(shapes[j - shaped], x, y, z)
            else:
                flux = _flux(dipole(table, j), x, y, z)
            _add_given(row, factor, own, flux)
    for other in range(len(fields)):
        field = field_and_gradient(fields[other], x, y, z, m, offsets)
        _add_given(row, 1.0, not acts_on(fields[other], label, table[MOVES, k]), field[:3])


@subroutine
def _add_given(row, factor, own, flux):
    """Add a field times a factor to that along a dipole, and, if it is its own, to that part."""
    along = factor * (flux[0] * row[AXIS] + flux[1] * row[AXIS + 1] + flux[2] * row[AXIS + 2])
    row[GIVEN] += along
    row[OWN] += along if own else 0.0


@subroutine
def _flux(source, x, y, z):
    """Return the field of a dipole, or 0 where it is, which is an error elsewhere."""
    if source[0] == x and source[1] == y and source[2] == z:
        return 0.0, 0.0, 0.0
    return flux_of_dipole(source, x, y, z)


@subroutine
def _settle(rows, table, couplings):
    """Find the moments of all rods together; return the site of one that does not settle, or -1."""
    site = np.int64(-1)
    for _ in range(MOST):
        site = np.int64(-1)
        for k in range(len(rows)):
            if rows[k, MAGNET] < 0.0:
                continue
            row, before = rows[k], _moment(rows[k])
            along = row[GIVEN]
            for j in range(len(rows)):
                if j != k and rows[j, MAGNET] >= 0.0:
                    along += _field_along(row, rows[j], table, couplings)
            low, high = along - row[COERCIVITY], along + row[COERCIVITY]
            if math.isfinite(along):  # a point outside of a table is an error elsewhere
                row[PLAY] = max(low, min(high, row[REMEMBERED]))
            if abs(_moment(row) - before) > SETTLED * row[SATURATION]:
                site = np.int64(row[SITE])
        if site < 0:
            return site
    return site


@subroutine
def _field_along(row, other, table, couplings):
    """Return the field along a dipole of another one, both with hysteresis, on another body."""
    i, j = int(row[COLUMN]), int(other[COLUMN])
    if table[LABEL, i] == table[LABEL, j]:
        return 0.0
    bodies = table[BODY, int(row[MAGNET])], table[BODY, int(other[MAGNET])]
    moment = coupling_factor(*bodies, couplings) * _moment(other)
    source = (
        table[0, j], table[1, j], table[2, j],
        moment * other[AXIS], moment * other[AXIS + 1], moment * other[AXIS + 2],
    )  # fmt: skip
    bx, by, bz = _flux(source, table[0, i], table[1, i], table[2, i])
    return bx * row[AXIS] + by * row[AXIS + 1] + bz * row[AXIS + 2]


@subroutine
def _moment(row):
    """Return the moment of a dipole along its axis."""
    return row[SATURATION] * row[PLAY] / math.sqrt(row[PLAY] ** 2 + row[KNEE] ** 2)


@subroutine
def stored_energy(rows):
    """Return the energy that the dipoles store, and that in the field of their own bodies."""
    energy = 0.0
    for k in range(len(rows)):
        row = rows[k]
        if row[MAGNET] >= 0.0:
            whole = math.sqrt(row[PLAY] ** 2 + row[KNEE] ** 2)
            energy += row[SATURATION] * row[KNEE] * (1.0 - row[KNEE] / whole)
            energy -= _moment(row) * row[OWN]
    return energy


@subroutine
def remember(rows, scale, own, m, d, offsets):
    """Write G of each dipole to the state, where `advance` finds it at the end of the step."""
    for k in range(len(rows)):
        if rows[k, MAGNET] >= 0.0:
            state = _state(own, m, d, offsets)
            state[PER_SITE * int(rows[k, SITE]) + 1] = scale * rows[k, PLAY]
