"""The reader: the only place that knows how a model declares its magnets, fields, iron and noise.

A table is made when a structure is first seen, and kept until the process ends: then kernels can
read it without a lock, and models that are copied, pickled or created anew share it.
"""

import ctypes
from typing import Any

import numpy as np

from magmotor.mjcf import error_numbers, layout, memory
from magmotor.mjcf.declarations import all_elements, valid_indices
from magmotor.mjcf.declarations.all_elements import (
    check_elements,
    elements_are_checkable,
    elements_are_readable,
    read_elements,
)
from magmotor.mjcf.declarations.magnets import read_magnets
from magmotor.mjcf.declarations.marks import (
    DIPOLES,
    NOISE,
    POTENTIALS,
    UNMARKED,
    UNREADABLE,
    WRONG,
    is_plainly_magnetic,
    marked_kinds,
    plugin_instance,
)
from magmotor.mjcf.declarations.structure import (
    copy_structure,
    has_structure,
    hash_of_structure,
    words_of_structure,
)
from magmotor.mjcf.declarations.table import (
    HEADER,
    SECTIONS,
    STARTS,
    WORDS_OF_HEADER,
    clear,
    error_in,
    header,
    refuse,
    words_of,
)
from magmotor.mjcf.declarations.user_numbers import (
    invalid_moment,
    invalid_potential,
    invalid_row,
)
from magmotor.mjcf.declarations.valid_indices import invalid_index
from magmotor.mjcf.late_functions import loading_failed
from magmotor.numerics import c_types as types
from magmotor.numerics.arrays import copy
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.deferred import External, subroutine

_word, _flag, _int = types.int64, types.boolean, types.int32
_FIND = types.int64(_word, _flag)
_CHECK = types.void(_word, _word, _word, _int, _word)

BITS = 10
"""Tables are kept in 2^10 lists, by their hashes."""

_lists = (ctypes.c_int64 * (1 << BITS))()
_lists_address = memory.variable("magmotor_tables_address")

_last = (ctypes.c_int64 * (2 << BITS))()
_last_address = memory.variable("magmotor_last_tables_address")
"""Pairs of the last table that was found for some addresses of models, and a word that combines the
model with this table once its indices have been checked."""


def _without_rows(kinds: int) -> Any:
    """Return a table of a model on which nothing acts."""
    names = {"next": 0, "kinds": kinds}
    words = [names.get(name, -1) for name in HEADER.names]
    words += [WORDS_OF_HEADER] * (WORDS_OF_HEADER - STARTS)
    return (ctypes.c_int64 * WORDS_OF_HEADER)(*words)


_empty, _unreadable = _without_rows(0), _without_rows(UNREADABLE)
_empty_address = memory.variable("magmotor_empty_table_address")
_unreadable_address = memory.variable("magmotor_unreadable_table_address")

_WIDTHS = tuple(len(kind) for kind in SECTIONS)

_allocate = External("mju_malloc", _word(types.uint64))
_free = External("mju_free", types.void(_word))

_address = ctypes.c_int64()
_table_of = memory.function_at("magmotor_reader_address", _FIND)

find_error = External("magmotor_find_error", _CHECK)
"""Find an error in what a model declares: by its table, or in the numbers of what acts.

The arguments are the addresses of mjModel and its table; the bits of what acts; how much is
read, `error_numbers.IN_STEP`, `AT_START` or `THOROUGH`; and the address of the words of an error.
"""


def bind_others() -> None:
    """Bind what the reader calls, and the variable through which others will call the reader."""
    valid_indices.bind()
    memory.bind_mujoco("mju_malloc", "mju_free")
    memory.bind_storage("magmotor_tables_address", _lists)
    memory.bind_storage("magmotor_last_tables_address", _last)
    memory.bind_storage("magmotor_empty_table_address", _empty)
    memory.bind_storage("magmotor_unreadable_table_address", _unreadable)
    memory.bind_variable("magmotor_reader_address", _address)
    all_elements.bind()


def bind_check() -> None:
    """Bind `find_error` to its symbol."""
    memory.bind_compiled("magmotor_find_error", _find_error(layout.current()))


def bind() -> None:
    """Load the reader, after what it calls; until then, nothing may call it."""
    _address.value = compiled(layout.current()).address


def is_cached() -> bool:
    """Whether the reader has been compiled before."""
    return compiled.is_cached(layout.current())


def compile_alone() -> None:
    """Compile the reader into Numba's cache, in a process that does nothing else."""
    memory.bind_unused(
        "magmotor_empty_table_address",
        "magmotor_invalid_index",
        "magmotor_last_tables_address",
        "magmotor_load",
        "magmotor_loading_failed",
        "magmotor_read_elements_address",
        "magmotor_tables_address",
        "magmotor_unreadable_table_address",
        "mju_free",
        "mju_malloc",
    )
    compiled(layout.current())


@subroutine
def table_of(model, again):
    """Return the address of the table of a model, whose address is given.

    Its kinds are `UNREADABLE` if an index leads nowhere. All of them are checked where a model is
    first seen at an address, and `again` if asked for, as at the start of a run.
    """
    return _table_of((model, again))


@compiled_once(_FIND, error_model="numpy")
def compiled(checksum: int, offsets: layout.Layout):
    """Define `table_of` for one layout of the structs."""

    def table_of(model, again):
        _ = checksum
        m = memory.words(model, memory.UNBOUNDED)
        place = _last_address() + 16 * memory.spread(model, BITS)
        table, checked = memory.load_shared(place), memory.words(place + 8, 1)
        # By what it declares, not by its address, which a new model can inherit.
        if table == 0 or not has_structure(m, offsets, table):
            table = _find(m, offsets)
        if again or table == 0 or checked[0] != _combined(model, table):
            if invalid_index(model, memory.details_on_stack()) >= 0:
                checked[0] = 0
                return _unreadable_address()
            if table == 0:
                table = _read(m, offsets)
            if table == 0:
                header(_empty_address()).error = error_numbers.UNLOADED if loading_failed() else -1
                return _empty_address()
            # Models that share a place are checked again, which is safe.
            memory.store_shared(place, table)
            checked[0] = _combined(model, table)
        return table

    return table_of


@subroutine(forceinline=True)
def _combined(model, table):
    """Return a word that tells a model with its table from others."""
    return model ^ np.int64(np.uint64(table) * memory.MULTIPLIER)


@subroutine
def _find(m, offsets):
    """Return the address of the table of a model, or 0 if it is new."""
    number = hash_of_structure(m, offsets)
    table = memory.load_shared(_list_of(number))
    while table != 0 and not (header(table).hash == number and has_structure(m, offsets, table)):
        table = header(table).next
    return table


@subroutine
def _list_of(number):
    """Return the address of the word with the first table of those that share a list."""
    return _lists_address() + 8 * memory.spread(number, BITS)


@subroutine
def _read(m, offsets):
    """Return the address of a new table, or 0 if Ctrl-C ended the compilation of what reads it."""
    room = _allocate(8 * _most_words(m, offsets))
    table, kept = room, np.int64(0)
    clear(table)
    kinds = marked_kinds(m, offsets)
    header(table).kinds, header(table).instance = kinds, plugin_instance(m, offsets)
    if kinds == WRONG:
        refuse(table, True, error_numbers.MARK, -1)
        kinds = 0
    complete = True
    # Most models declare sites only: what reads tuples is compiled when one has some.
    if not _has_elements(m, offsets):
        read_magnets(table, False, m, offsets)
    elif elements_are_readable():
        read_elements((m.ctypes.data, table, kinds))
    else:
        complete = False
    if complete:  # it is kept for ever, in no more memory than it needs
        kept = _kept(words_of(table), m, offsets)
    _free(room)
    return kept


@subroutine
def _kept(words, m, offsets):
    """Return the address of a copy of a table that other threads find."""
    others, room = words_of_structure(m, offsets)
    table = _allocate(8 * (len(words) + room))
    copy(memory.words(table, len(words)), words)
    header(table).structure, header(table).words = len(words), others
    header(table).hash = hash_of_structure(m, offsets)
    copy_structure(m, offsets, table)
    first = _list_of(header(table).hash)
    # Should another thread do the same now, one of the tables is not found again.
    header(table).next = memory.load_shared(first)
    # Last, so that other threads see a complete table or none.
    memory.store_shared(first, table)
    return table


@subroutine
def _has_elements(m, offsets):
    """Whether a model has elements, or numbers of geoms, that may declare anything."""
    elements = m[offsets.ntuple // 8] + m[offsets.nnumeric // 8] + m[offsets.nsensor // 8]
    return elements + m[offsets.nuser_geom // 8] > 0


@subroutine
def _most_words(m, offsets):
    """Return the largest number of words that a table of a model can have."""
    counts = (
        m[offsets.ntuple // 8], m[offsets.nsite // 8], m[offsets.ntuple // 8],
        m[offsets.nsite // 8], m[offsets.nnumeric // 8], m[offsets.ntupledata // 8],
        m[offsets.ntupledata // 8], m[offsets.ngeom // 8], m[offsets.ntupledata // 8],
        m[offsets.ntupledata // 8], m[offsets.nsensor // 8],
    )  # fmt: skip
    total = WORDS_OF_HEADER
    for k in range(len(counts)):
        total += _WIDTHS[k] * counts[k]
    return total


@subroutine
def acting_kinds(table, m, offsets):
    """Return the bits of what acts on a model now; `WRONG` or `UNREADABLE` if nothing can."""
    kinds = header(table).kinds
    if kinds == UNMARKED and is_plainly_magnetic(m, offsets):
        kinds |= DIPOLES
    return kinds


@compiled_once(_CHECK, error_model="numpy")
def _find_error(checksum: int, offsets: layout.Layout):
    """Define `find_error` for one layout of the structs."""

    def find_error(model, table, kinds, extent, place):
        _ = checksum
        m, error = memory.words(model, memory.UNBOUNDED), memory.words(place, error_numbers.WORDS)
        found = error_in(table)
        for k in range(error_numbers.WORDS):
            error[k] = found[k]
        if header(table).kinds == UNREADABLE:
            room = memory.details_on_stack()
            field = invalid_index(model, room)
            error_numbers.set_error(error, error_numbers.INDEX, field, memory.words(room, 1)[0])
        elif error[0] < 0 and kinds >= 0:
            _check_numbers(error, table, m, offsets, kinds, extent)

    return find_error


@subroutine
def _check_numbers(error, table, m, offsets, kinds, extent):
    """Find the first error in the numbers of what acts."""
    if kinds & DIPOLES:
        site = invalid_moment(m, offsets)
        if site >= 0:
            error_numbers.set_error(error, error_numbers.MOMENT, site)
    if error[0] < 0 and kinds & NOISE:
        body = invalid_row(m, offsets)
        if body >= 0:
            error_numbers.set_error(error, error_numbers.WRENCH, body)
    if error[0] < 0 and kinds & POTENTIALS:
        joint = invalid_potential(m, offsets)
        if joint >= 0:
            error_numbers.set_error(error, error_numbers.POTENTIAL, joint)
    if error[0] < 0 and _has_elements(m, offsets) and elements_are_checkable():
        check_elements((m.ctypes.data, table, kinds, extent, error.ctypes.data))
