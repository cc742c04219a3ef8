"""Couplings: factors by which the magnets of two bodies act on each other."""

from magmotor.mjcf.declarations.custom import element
from magmotor.mjcf.declarations.table import couplings
from magmotor.numerics.deferred import subroutine


@subroutine(forceinline=True)
def read_couplings(rows, table, m, offsets):
    """Write one row for each coupling: two bodies and a factor."""
    declared = couplings(table)
    for k in range(len(rows)):
        rows[k, 0], rows[k, 1] = declared[k].body, declared[k].other
        rows[k, 2] = element(declared[k].element, m, offsets)[2]


@subroutine
def coupling_factor(body, other, rows):
    """Return the factor by which couplings scale the interaction of two bodies."""
    factor = 1.0
    for k in range(len(rows)):
        a, b = rows[k, 0], rows[k, 1]
        if (a == body and b == other) or (a == other and b == body):
            factor *= rows[k, 2]
    return factor
