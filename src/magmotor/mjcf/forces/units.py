"""The units of a model, by the magnetic constant that it declares.

All forces, torques and energies stay the same if moments are multiplied, and flux densities divided
by sqrt(mu0/mu0_SI), and mu0 becomes that of SI. So everything between the reading of a model and
the output of a field or a moment has the magnetic constant of SI, whatever the units are.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import math
import sys

from magmotor.mjcf.forces.custom import invalid_number, numbers_of, numeric_named
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY
from magmotor.numerics.subroutine import subroutine

NAME = "magnetic_constant"
"""Name of the numeric that declares mu0."""

LEAST, LARGEST = math.ulp(0.0), sys.float_info.max
"""The positive finite numbers are those from one to the other."""

_CHARACTERS = (*NAME.encode(), 0)


def scale_of(constant: float) -> float:
    """Return the factor of moments that makes mu0 that of SI."""
    return math.sqrt(constant / VACUUM_PERMEABILITY)


_scale_of = subroutine(scale_of)


@subroutine
def moment_scale(m, offsets):
    """Return the factor of moments: 1 without a magnetic constant."""
    k = numeric_named(_CHARACTERS, m, offsets)
    return _scale_of(numbers_of(k, m, offsets)[0]) if k >= 0 else 1.0


@subroutine
def invalid_constant(m, offsets):
    """Return the number of that numeric if it is not one positive finite number, or -1."""
    return invalid_number(numeric_named(_CHARACTERS, m, offsets), LEAST, LARGEST, m, offsets)
