"""Couplings: tuples of two bodies that scale the interaction of the bodies' magnets.

A tuple whose name starts with `coupling` and whose elements are two bodies scales the interaction
by `prm`, which must be the same for both elements. It applies to the named bodies only, not to
bodies welded to them. The factors of several tuples for one pair multiply.
"""

import math

from magmotor.mjcf.declarations.custom import BODY, element, elements_of, tuple_starts_with
from magmotor.mjcf.declarations.table import COUPLINGS, add_row, couplings, refuse
from magmotor.mjcf.error_numbers import COUPLING, set_error
from magmotor.numerics.deferred import subroutine

PREFIX = tuple(b"coupling")


@subroutine
def read_couplings(table, acts, m, offsets):
    """Write a row for each tuple of two bodies."""
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, PREFIX, m, offsets):
            elements, bodies = elements_of(k, m, offsets), 0
            for i in elements:
                bodies += element(i, m, offsets)[0] == BODY
            if bodies != 2 or len(elements) != 2:
                refuse(table, acts, COUPLING, k)
                continue
            added = add_row(table, COUPLINGS)
            row = couplings(table)[added]
            row.tuple, row.element = k, elements.start
            row.body = element(elements.start, m, offsets)[1]
            row.other = element(elements.start + 1, m, offsets)[1]


@subroutine(forceinline=True)
def check_couplings(error, table, m, offsets):
    """Find an error in couplings whose `prm` are not equal and finite."""
    found = couplings(table)
    for k in range(len(found)):
        first = found[k].element
        factor, other = element(first, m, offsets)[2], element(first + 1, m, offsets)[2]
        if not (factor == other and abs(factor) < math.inf):
            set_error(error, COUPLING, found[k].tuple)
            return
