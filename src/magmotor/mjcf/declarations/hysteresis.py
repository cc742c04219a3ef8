"""Dipoles with hysteresis, such as soft rods that stop the spin of a satellite.

A tuple whose name starts with `hysteresis` names one numeric and sites. The numeric is the loop:
the coercivity H_c in A/m, and the remanence over the saturation. The `user` number of such a site
is its moment at saturation. The state is that of the plugin `magmotor.forces`: two numbers for each
site of the model (see `magmotor.mjcf.forces.hysteresis`).
"""

from magmotor.mjcf import memory
from magmotor.mjcf.declarations.custom import (
    CONTAINED,
    SITE,
    element,
    elements_of,
    numbers_of,
    tuple_starts_with,
)
from magmotor.mjcf.declarations.marks import COILS, IRON
from magmotor.mjcf.declarations.marks import HYSTERESIS as HYSTERESIS_ACTS
from magmotor.mjcf.declarations.materials import (
    are_numbers,
    broken_rule,
    check_noise,
    material_of,
)
from magmotor.mjcf.declarations.table import (
    MEMORIES,
    add_row,
    coils,
    header,
    memories,
    pieces,
    planes,
    refuse,
    sites,
)
from magmotor.mjcf.declarations.user_numbers import moment_of
from magmotor.mjcf.error_numbers import (
    AT_SATURATION,
    HYSTERESIS,
    IRON_NEARBY,
    LOOP,
    MOMENT,
    NO_PLUGIN,
    OLD_BINARY,
    TAKES_ENERGY,
    UNSTORED,
    set_error,
)
from magmotor.numerics.deferred import subroutine

PREFIX = tuple(b"hysteresis")

PER_SITE = 2
"""Numbers of the state for each site."""


@subroutine
def read_hysteresis(table, kinds, m, offsets):
    """Write a row for each site of valid tuples; a coil that acts must not drive it."""
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, PREFIX, m, offsets):
            i, rule, other = broken_rule(k, PREFIX, SITE, m, offsets)
            if rule < 0 and kinds & COILS:
                i, rule, other = _driven(k, table, m, offsets)
            if rule >= 0:
                refuse(table, kinds & HYSTERESIS_ACTS != 0, HYSTERESIS, k, i, rule, other)
                continue
            for i in elements_of(k, m, offsets):
                kind, number, _ = element(i, m, offsets)
                if kind == SITE:
                    added = add_row(table, MEMORIES)
                    row = memories(table)[added]
                    row.tuple, row.site, row.numeric = k, number, material_of(k, m, offsets)


@subroutine
def _driven(k, table, m, offsets):
    """Return the first element of tuple k that a coil drives, the rule, and the coil; or -1s."""
    for i in elements_of(k, m, offsets):
        kind, number, _ = element(i, m, offsets)
        if kind == SITE and len(coils(table)) > 0 and sites(table)[number].coil >= 0:
            return i, CONTAINED, coils(table)[sites(table)[number].coil].tuple
    return -1, -1, -1


@subroutine
def numbers_in_state(m, offsets):
    """Return how many numbers the state of the plugin needs while a model is compiled.

    MuJoCo has copied the names of tuples then, but not yet their elements.
    """
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, PREFIX, m, offsets):
            return PER_SITE * m[offsets.nsite // 8]
    return 0


@subroutine
def state_of(instance, m, d, offsets):
    """Return the state of an instance of the plugin."""
    first = memory.integers(m[offsets.plugin_stateadr // 8], memory.UNBOUNDED)[instance]
    count = memory.integers(m[offsets.plugin_statenum // 8], memory.UNBOUNDED)[instance]
    return memory.numbers(d[offsets.plugin_state // 8] + 8 * first, 1, count)[0]


@subroutine(forceinline=True)
def check_hysteresis(error, table, kinds, m, offsets):
    """Find an error in loops, in where their state is, or in what else acts."""
    instance = header(table).instance
    for row in memories(table):
        numbers = numbers_of(row.numeric, m, offsets)
        if not are_numbers(numbers, 2, 2) or not (numbers[0] > 0.0 and 0.0 < numbers[1] < 1.0):
            set_error(error, LOOP, row.numeric)
        elif moment_of(row.site, m, offsets) < 0.0:
            set_error(error, MOMENT, row.site, -1, AT_SATURATION)
        elif instance < 0:
            set_error(error, UNSTORED, row.tuple, -1, NO_PLUGIN)
        elif _room(instance, m, offsets) < PER_SITE * m[offsets.nsite // 8]:
            set_error(error, UNSTORED, row.tuple, -1, OLD_BINARY)
        elif kinds & IRON and len(pieces(table)) > 0:
            set_error(error, IRON_NEARBY, row.tuple, pieces(table)[0].geom)
        elif kinds & IRON and len(planes(table)) > 0:
            set_error(error, IRON_NEARBY, row.tuple, planes(table)[0].geom)
        else:
            check_noise(error, row.tuple, TAKES_ENERGY, kinds, m, offsets)
        if error[0] >= 0:
            return


@subroutine
def _room(instance, m, offsets):
    """Return how many numbers the state of an instance has."""
    return memory.integers(m[offsets.plugin_statenum // 8], memory.UNBOUNDED)[instance]
