"""Coils: magnets whose moments follow an actuator, such as electromagnets.

A tuple whose name starts with `coil` names an actuator first, then geoms, sites or bodies. The
moment of each of these sites, and of all dipole sites of these bodies, is its `user` number times
the actuator's drive (see `magmotor.mjcf.forces.drives`), and so is the polarization of each of
these geoms, around which a solenoid is wound. The actuator's `prm`, if it is not 0, is the drive at
which the core saturates.
"""

import math

from magmotor.mjcf import memory
from magmotor.mjcf.declarations.custom import (
    ACTUATOR,
    ASLANT,
    BODY,
    CONTAINED,
    DELAY,
    FEW,
    FIRST,
    GEOM,
    KIND,
    PRM,
    REPEATED,
    SITE,
    UNPOLARIZED,
    element,
    elements_of,
    tuple_starts_with,
)
from magmotor.mjcf.declarations.iron import BOX, CYLINDER
from magmotor.mjcf.declarations.marks import SHAPES
from magmotor.mjcf.declarations.shapes import polarization_of
from magmotor.mjcf.declarations.table import COILS, SITES, add_row, coils, refuse, sites
from magmotor.mjcf.error_numbers import COIL, set_error
from magmotor.numerics.deferred import subroutine

PREFIX = tuple(b"coil")


@subroutine
def read_coils(table, acts, m, offsets):
    """Write a row for each valid coil, and then, if there are any, the coil of each site, or -1."""
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, PREFIX, m, offsets):
            i, rule, other = _broken_rule(k, m, offsets)
            if rule >= 0:
                refuse(table, acts, COIL, k, i, rule, other)
                continue
            added = add_row(table, COILS)
            row = coils(table)[added]
            row.tuple, row.element = k, elements_of(k, m, offsets).start
            row.actuator = element(row.element, m, offsets)[1]
    found, nsite = coils(table), m[offsets.nsite // 8]
    for _ in range(nsite if len(found) > 0 else 0):
        add_row(table, SITES)
    body_of = memory.integers(m[offsets.site_bodyid // 8], nsite)
    for k in range(len(found)):
        for i in elements_of(found[k].tuple, m, offsets):
            kind, number, _ = element(i, m, offsets)
            if kind == SITE:
                sites(table)[number].coil = k
            for site in range(nsite if kind == BODY else 0):
                if body_of[site] == number:
                    sites(table)[site].coil = k


@subroutine
def _broken_rule(k, m, offsets):
    """Return the first wrong element of tuple k, the rule, and another tuple; or -1, -1, -1.

    There must be one actuator first, then geoms, sites and bodies that no coil names twice.
    """
    elements = elements_of(k, m, offsets)
    for i in elements:
        kind, _, _ = element(i, m, offsets)
        rule = other = -1
        if i == elements.start:
            rule = -1 if kind == ACTUATOR else FIRST
        elif kind in (GEOM, SITE, BODY):
            rule, other = _repeated(i, m, offsets)
        else:
            rule = KIND
        if rule >= 0:
            return i, rule, other
    return -1, FEW if len(elements) < 2 else -1, -1


@subroutine
def _repeated(i, m, offsets):
    """Return how element i names the same magnets as another element, and the tuple; or -1, -1."""
    kind, number, _ = element(i, m, offsets)
    body_of = memory.integers(m[offsets.site_bodyid // 8], memory.UNBOUNDED)
    body = body_of[number] if kind == SITE else number
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, PREFIX, m, offsets):
            for j in elements_of(k, m, offsets):
                other, same, _ = element(j, m, offsets)
                if j < i and other == kind and same == number:
                    return REPEATED, k
                if kind == SITE and other == BODY and same == body:
                    return CONTAINED, k
    return -1, -1


@subroutine(forceinline=True)
def check_coils(error, table, kinds, m, offsets):
    """Find an error in the numbers of the actuators of coils, and of their geoms if these act."""
    found = coils(table)
    for k in range(len(found)):
        rule, elements = wrong_drive(found[k], m, offsets), elements_of(found[k].tuple, m, offsets)
        if rule >= 0:
            set_error(error, COIL, found[k].tuple, found[k].element, rule)
            return
        for i in range(elements.start, elements.stop if kinds & SHAPES else elements.start):
            kind, geom, _ = element(i, m, offsets)
            rule = _wrong_winding(geom, m, offsets) if kind == GEOM else -1
            if rule >= 0:
                set_error(error, COIL, found[k].tuple, i, rule)
                return


@subroutine
def _wrong_winding(geom, m, offsets):
    """Return the rule that a geom with a winding on its side breaks by its numbers, or -1."""
    if m[offsets.nuser_geom // 8] < 3:
        return UNPOLARIZED
    x, y, z = polarization_of(geom, m, offsets)
    if x == 0.0 and y == 0.0 and z == 0.0:
        return UNPOLARIZED
    shape = memory.integers(m[offsets.geom_type // 8], memory.UNBOUNDED)[geom]
    across = (x != 0.0) + (y != 0.0)
    if (shape == CYLINDER and across == 0) or (shape == BOX and across + (z != 0.0) == 1):
        return -1
    return ASLANT


@subroutine(forceinline=True)
def wrong_drive(row, m, offsets):
    """Return the rule that the actuator of a coil or a field breaks by its numbers, or -1."""
    delay = memory.numbers(m[offsets.actuator_delay // 8], 1, memory.UNBOUNDED)[0, row.actuator]
    if delay != 0.0:
        return DELAY
    return -1 if 0.0 <= element(row.element, m, offsets)[2] < math.inf else PRM
