"""The tolerance that a model declares for the forces of many magnets on one another."""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

from magmotor.mjcf.forces.custom import invalid_number, numbers_of, numeric_named
from magmotor.numerics.subroutine import subroutine

NAME = (*b"magnetic_tolerance", 0)


@subroutine
def tolerance_of(m, offsets):
    """Return the number of `<numeric name="magnetic_tolerance">`, or 0, which means exact."""
    k = numeric_named(NAME, m, offsets)
    return numbers_of(k, m, offsets)[0] if k >= 0 else 0.0


@subroutine
def invalid_tolerance(m, offsets):
    """Return the number of the tolerance's numeric if it is not one number from 0 to 0.1, or -1."""
    return invalid_number(numeric_named(NAME, m, offsets), 0.0, 0.1, m, offsets)
