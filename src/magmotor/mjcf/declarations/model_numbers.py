"""Two numbers for a whole model: its magnetic constant, and the tolerance of many magnets.

`<numeric name="magnetic_constant">` is mu0 in the units of the model. All forces, torques and
energies stay the same if moments are multiplied, and flux densities divided by sqrt(mu0/mu0_SI),
and mu0 becomes that of SI. So everything between the reading of a model and the output of a field
or a moment has the magnetic constant of SI, whatever the units are.

`<numeric name="magnetic_tolerance">` is the error with which many magnets may act on one another.
"""

import math

from magmotor.mjcf.declarations.custom import numbers_of, numeric_named
from magmotor.mjcf.declarations.table import header
from magmotor.mjcf.error_numbers import CONSTANT, TOLERANCE, set_error
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY

NAME = "magnetic_constant"
"""Name of the numeric that declares mu0."""

_CONSTANT, _TOLERANCE = (*NAME.encode(), 0), (*b"magnetic_tolerance", 0)


def scale_of(constant: float) -> float:
    """Return the factor of moments that makes mu0 that of SI."""
    return math.sqrt(constant / VACUUM_PERMEABILITY)


_scale_of = subroutine(scale_of)


@subroutine
def read_constants(table, m, offsets):
    """Write the numbers of the two numerics to the header of a table, or -1."""
    header(table).constant = numeric_named(_CONSTANT, m, offsets)
    header(table).tolerance = numeric_named(_TOLERANCE, m, offsets)


@subroutine
def moment_scale(table, m, offsets):
    """Return the factor of moments: 1 without a magnetic constant."""
    k = header(table).constant
    return _scale_of(numbers_of(k, m, offsets)[0]) if k >= 0 else 1.0


@subroutine
def tolerance_of(table, m, offsets):
    """Return the tolerance of a model, or 0, which means exact."""
    k = header(table).tolerance
    return numbers_of(k, m, offsets)[0] if k >= 0 else 0.0


@subroutine(forceinline=True)
def check_tolerance(error, table, m, offsets):
    """Find an error unless the tolerance is one number from 0 to 0.1."""
    k = header(table).tolerance
    if k >= 0:
        numbers = numbers_of(k, m, offsets)
        if not (len(numbers) == 1 and 0.0 <= numbers[0] <= 0.1):
            set_error(error, TOLERANCE, k)


@subroutine(forceinline=True)
def check_constant(error, table, m, offsets):
    """Find an error unless the magnetic constant is one positive finite number."""
    k = header(table).constant
    if k >= 0:
        numbers = numbers_of(k, m, offsets)
        if not (len(numbers) == 1 and 0.0 < numbers[0] < math.inf):
            set_error(error, CONSTANT, k)
