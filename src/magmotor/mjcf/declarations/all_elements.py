"""What tuples, numerics and sensors declare; models without any do not compile this."""

from magmotor.mjcf import error_numbers, layout, memory
from magmotor.mjcf.declarations.coils import check_coils, read_coils
from magmotor.mjcf.declarations.conductors import check_conductors, read_conductors
from magmotor.mjcf.declarations.couplings import check_couplings, read_couplings
from magmotor.mjcf.declarations.fields import check_fields, read_fields
from magmotor.mjcf.declarations.hysteresis import check_hysteresis, read_hysteresis
from magmotor.mjcf.declarations.iron import check_iron, read_iron
from magmotor.mjcf.declarations.magnetometers import read_magnetometers
from magmotor.mjcf.declarations.magnets import read_magnets
from magmotor.mjcf.declarations.marks import (
    COILS,
    CONDUCTORS,
    COUPLINGS,
    DIPOLES,
    FIELDS,
    HYSTERESIS,
    IRON,
    SHAPES,
)
from magmotor.mjcf.declarations.model_numbers import check_constant, check_tolerance, read_constants
from magmotor.mjcf.declarations.shapes import check_shapes, read_shapes
from magmotor.mjcf.late_functions import LateFunction
from magmotor.numerics import c_types as types
from magmotor.numerics.compiled_once import compiled_once

_word = types.int64
_READ = types.void(_word, _word, _word)
_CHECK = types.void(_word, _word, _word, types.int32, _word)

_read_late = LateFunction("magmotor_read_elements_address", _READ, lambda: _read(layout.current()))
elements_are_readable, read_elements = _read_late.is_ready, _read_late.call
"""Read the elements of a model into its table.

The arguments are the addresses of mjModel and the table, and the bits of what acts.
"""

_check_late = LateFunction(
    "magmotor_check_elements_address", _CHECK, lambda: _check(layout.current())
)
elements_are_checkable, check_elements = _check_late.is_ready, _check_late.call
"""Find the first error in the numbers of elements; the arguments are those of `find_error`."""


def bind() -> None:
    """Bind the two functions to their symbols."""
    _read_late.bind()
    _check_late.bind()


@compiled_once(_READ, error_model="numpy")
def _read(checksum: int, offsets: layout.Layout):
    """Define `read_elements` for one layout of the structs."""

    def read_elements(model, table, kinds):
        _ = checksum
        m, coupled = memory.words(model, memory.UNBOUNDED), kinds & COUPLINGS != 0
        read_constants(table, m, offsets)
        read_couplings(table, coupled, m, offsets)
        read_magnets(table, coupled, m, offsets)
        read_coils(table, kinds & COILS != 0, m, offsets)
        read_fields(table, kinds & FIELDS != 0, m, offsets)
        read_iron(table, kinds & IRON != 0, coupled, m, offsets)
        read_shapes(table, kinds, m, offsets)
        read_conductors(table, kinds & CONDUCTORS != 0, m, offsets)
        read_hysteresis(table, kinds, m, offsets)
        read_magnetometers(table, m, offsets)

    return read_elements


@compiled_once(_CHECK, error_model="numpy")
def _check(checksum: int, offsets: layout.Layout):
    """Define `check_elements` for one layout of the structs."""

    def check_elements(model, table, kinds, extent, place):
        _ = checksum
        m, error = memory.words(model, memory.UNBOUNDED), memory.words(place, error_numbers.WORDS)
        if kinds & DIPOLES:
            check_tolerance(error, table, m, offsets)
        if error[0] < 0:
            check_constant(error, table, m, offsets)
        if error[0] < 0 and kinds & COUPLINGS:
            check_couplings(error, table, m, offsets)
        if error[0] < 0 and kinds & COILS:
            check_coils(error, table, kinds, m, offsets)
        if error[0] < 0 and kinds & FIELDS:
            check_fields(error, table, extent == error_numbers.THOROUGH, m, offsets)
        if error[0] < 0 and kinds & IRON:
            check_iron(error, table, m, offsets)
        if error[0] < 0 and kinds & SHAPES:
            check_shapes(error, table, kinds, extent != error_numbers.IN_STEP, m, offsets)
        if error[0] < 0 and kinds & CONDUCTORS:
            check_conductors(error, table, kinds, m, offsets)
        if error[0] < 0 and kinds & HYSTERESIS:
            check_hysteresis(error, table, kinds, m, offsets)

    return check_elements
