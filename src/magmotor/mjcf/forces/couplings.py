"""Couplings: tuples of two bodies that scale the interaction of the bodies' magnets.

A tuple whose name starts with `coupling` and whose elements are two bodies scales the interaction
by `prm`, which must be the same for both elements. It applies to the named bodies only, not to
bodies welded to them. The factors of several tuples for one pair multiply.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import numpy as np

from magmotor.mjcf.forces.custom import BODY, element, elements_of, tuple_starts_with
from magmotor.numerics.subroutine import subroutine

COUPLING = tuple(b"coupling")


@subroutine
def read_couplings(couplings, m, offsets):
    """Write one row for each coupling, two bodies and a factor; return their number."""
    count = 0
    for k in range(len(couplings)):
        if tuple_starts_with(k, COUPLING, m, offsets):
            first = elements_of(k, m, offsets).start
            _, couplings[count, 0], couplings[count, 2] = element(first, m, offsets)
            _, couplings[count, 1], _ = element(first + 1, m, offsets)
            count += 1
    return count


@subroutine
def is_coupled(body, couplings):
    """Whether any coupling names the body."""
    coupled = False
    for k in range(len(couplings)):
        coupled = coupled or couplings[k, 0] == body or couplings[k, 1] == body
    return coupled


@subroutine
def coupling_factor(body, other, couplings):
    """Return the factor by which couplings scale the interaction of two bodies."""
    factor = 1.0
    for k in range(len(couplings)):
        a, b = couplings[k, 0], couplings[k, 1]
        if (a == body and b == other) or (a == other and b == body):
            factor *= couplings[k, 2]
    return factor


@subroutine
def invalid_coupling(m, offsets):
    """Return the first coupling that is not of two bodies with equal and finite `prm`, or -1."""
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, COUPLING, m, offsets):
            elements = elements_of(k, m, offsets)
            valid = len(elements) == 2
            if valid:
                kind, _, factor = element(elements.start, m, offsets)
                other_kind, _, other = element(elements.start + 1, m, offsets)
                valid = kind == BODY and other_kind == BODY
                valid = valid and factor == other and abs(factor) < np.inf
            if not valid:
                return k
    return -1


@subroutine
def coupling_of(body, m, offsets):
    """Return the first valid coupling that names a body, or -1."""
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, COUPLING, m, offsets):
            for i in elements_of(k, m, offsets):
                if element(i, m, offsets)[1] == body:
                    return k
    return -1
