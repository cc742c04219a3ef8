"""Magnets: the sites of one body, each of which is a dipole if its `user` number is not 0.

The site's z axis is the dipole's direction, and the number is the moment in A m^2. Magnets of one
rigid body (bodies without a joint between them) do not act on each other.
"""

from magmotor.mjcf import memory
from magmotor.mjcf.declarations.table import MAGNETS, add_row, couplings, magnets
from magmotor.numerics.deferred import subroutine

LARGE = 16
"""Number of sites that makes a body's magnet large."""


@subroutine
def read_magnets(table, coupled, m, offsets):
    """Write a row for each body with sites, unless no site has numbers.

    Magnets that are large, or, if couplings act, coupled, are evaluated pairwise.
    """
    nsite = m[offsets.nsite // 8] if m[offsets.nuser_site // 8] > 0 else 0
    body_of = memory.integers(m[offsets.site_bodyid // 8], nsite)
    weld_of = memory.integers(m[offsets.body_weldid // 8], memory.UNBOUNDED)
    freedoms = memory.integers(m[offsets.body_dofnum // 8], memory.UNBOUNDED)
    start = 0
    while start < nsite:
        last = start + 1
        while last < nsite and body_of[last] == body_of[start]:  # in no order, if Python set them
            last += 1
        added = add_row(table, MAGNETS)
        row = magnets(table)[added]
        row.first_site, row.end_site, row.body = start, last, body_of[start]
        row.weld = weld_of[row.body]
        row.freedoms = freedoms[row.weld]
        row.separate = last - start >= LARGE or (coupled and _is_coupled(row.body, table))
        start = last


@subroutine
def _is_coupled(body, table):
    """Whether any coupling names the body."""
    found = False
    for row in couplings(table):
        found = found or body in (row.body, row.other)
    return found
