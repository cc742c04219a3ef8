"""The table of a model: which elements declare what, as 64-bit integers.

A table depends on the structure of a model only: names, tuples, and what belongs to what. It says
where the numbers are, such as moments, materials and fields, and these stay in the model, where a
program may change them at any time. A header is followed by sections, whose rows are declarations.
A number is -1 where there is nothing.
"""

from typing import Any

import numpy as np

from magmotor.mjcf import memory
from magmotor.mjcf.error_numbers import WORDS, set_error
from magmotor.numerics.deferred import subroutine


def columns(names: str) -> Any:
    """Return the type of records of 64-bit integers with these names."""
    return np.dtype([(name, np.int64) for name in names.split()])


COUPLING = columns("tuple element body other")
"""A coupling: its tuple, the first of its two elements, and the bodies."""

MAGNET = columns("first_site end_site body weld freedoms separate")
"""A magnet: its sites, one after the other; its body, the rigid body to which that belongs, and how
many degrees of freedom that has; and whether it is evaluated pairwise."""

COIL = columns("tuple element actuator")
"""A coil: its tuple, the element of its actuator, and that."""

SITE = columns("coil")
"""A site of a model with coils: the row of its coil."""

FIELD = columns("numeric body weld freedoms frame_type frame tuple element actuator")
"""An applied field: its numeric; the body to which it is fixed, and the same of that; the type (0
for the world) and the number of its frame; the tuple that says so, the element of its actuator, and
that."""

IRON = columns("geom material body weld freedoms")
"""A piece or plane of iron: its geom, the numeric of its material, its body, and the same of it."""

SHAPE = columns("geom body weld freedoms coil")
"""A geom that is a magnet if it has a polarization: its number, its body, the same of it, and the
row of its coil."""

CONDUCTOR = columns("tuple geom numeric")
"""The upper face of a conducting plate: its tuple, its plane, which MuJoCo lets no joint move, and
the numeric of its conductivity and thickness."""

MEMORY = columns("tuple numeric site")
"""A dipole with hysteresis: its tuple, the numeric of its loop, and its site."""

MAGNETOMETER = columns("sensor instance site address")
"""A sensor of the field: its number, its instance of the plugin, its site (-1 also if it has no
data), and the place of its data."""

(
    COUPLINGS, MAGNETS, COILS, SITES, FIELDS, PIECES, PLANES, SHAPES, CONDUCTORS, MEMORIES,
    MAGNETOMETERS,
) = range(11)  # fmt: skip
SECTIONS = (
    COUPLING, MAGNET, COIL, SITE, FIELD, IRON, IRON, SHAPE, CONDUCTOR, MEMORY, MAGNETOMETER,
)  # fmt: skip
"""The sections and their records. There are sites only if there are coils."""

HEADER = columns(
    "structure words hash next kinds error first second rule other instance tolerance constant"
)
"""The header: the word with which the copy of the structure begins, how many words it has besides
sizes, and its hash (see `structure.py`); the address of another table, or 0; the bits of the mark,
or `WRONG` or `UNREADABLE`; the words of an error (see `magmotor.mjcf.error_numbers`); the
first instance of the plugin, and the numerics of the tolerance and of the magnetic constant. The
first words of the sections follow, and that of what is after the last one."""

STARTS, WORDS_OF_HEADER = len(HEADER), len(HEADER) + len(SECTIONS) + 1
_ERROR = HEADER.names.index("error")
_WIDTHS = tuple(len(kind) for kind in SECTIONS)


@subroutine(forceinline=True)
def header(table):
    """Return the header of a table, whose address is given."""
    return memory.records(table, 1, HEADER)[0]


@subroutine(forceinline=True)
def is_read(table):
    """Whether a table is that of a model, instead of one for what could not be read."""
    return header(table).structure != -1


@subroutine(forceinline=True)
def error_in(table):
    """Return the words of the error in a header."""
    return memory.words(table + 8 * _ERROR, WORDS)


def _rows_of(section: int) -> Any:
    """Return a compiled function that returns the rows of a section of a table."""
    kind, width = SECTIONS[section], _WIDTHS[section]

    @subroutine(forceinline=True)
    def rows(table):
        starts = memory.words(table + 8 * STARTS, len(_WIDTHS) + 1)
        count = (starts[section + 1] - starts[section]) // width
        return memory.records(table + 8 * starts[section], count, kind)

    return rows


(
    couplings, magnets, coils, sites, fields, pieces, planes, shapes, conductors, memories,
    magnetometers,
) = (_rows_of(section) for section in range(len(SECTIONS)))  # fmt: skip


@subroutine(forceinline=True)
def words_of(table):
    """Return all words of a table."""
    return memory.words(table, memory.words(table + 8 * STARTS, len(_WIDTHS) + 1)[len(_WIDTHS)])


@subroutine
def clear(table):
    """Begin a table without declarations."""
    words = memory.words(table, WORDS_OF_HEADER)
    for k in range(WORDS_OF_HEADER):
        words[k] = -1 if k < STARTS else WORDS_OF_HEADER
    header(table).next = 0


@subroutine
def add_row(table, section):
    """Append a row of -1 to a section, after which no section has rows yet; return its number."""
    starts = memory.words(table + 8 * STARTS, len(_WIDTHS) + 1)
    place, width = starts[section + 1], _WIDTHS[section]
    words = memory.words(table + 8 * place, width)
    for k in range(width):
        words[k] = -1
    for k in range(section + 1, len(starts)):
        starts[k] = place + width
    return (place - starts[section]) // width


@subroutine
def refuse(table, acts, number, one, other=-1, rule=-1, further=-1):
    """Write an error to the header, unless one is there, or what is wrong does not act."""
    error = error_in(table)
    if acts and error[0] < 0:
        set_error(error, number, one, other, rule, further)
