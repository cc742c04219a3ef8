"""The structure of a model: all that its table depends on.

These are sizes, what belongs to what, the characters of marks, and the names and elements of
tuples. A table is followed by a copy of them, with which each step compares the model, so that the
table is right for what is in memory now, whatever a program has assigned, and whichever model was
at the same address before.

The copy consists of all sizes, and of the words that contain the arrays: the place of each, its
value, and a mask of what belongs to the array. Places are relative to an array of the model, since
MuJoCo keeps all arrays in one block, ordered by the sizes. Words need no loop for each array, and
most arrays of small models have one or two.
"""

import numpy as np

from magmotor.mjcf import memory
from magmotor.mjcf.declarations.table import columns, header
from magmotor.numerics.deferred import subroutine

WORD = columns("place value mask")
"""A word of the structure: its address, relative to `body_weldid`, its value, and which of its bits
count."""

_WIDTH = len(WORD)


@subroutine(forceinline=True)
def has_structure(m, offsets, table):
    """Whether a model, whose words are given, has the structure of a table."""
    sizes, words = _copy(table, offsets)
    different = np.int64(0)
    for k in range(len(sizes)):
        different |= sizes[k] ^ m[k]
    if different != 0:  # then the places are not those of this model
        return False
    start = m[offsets.body_weldid // 8]
    for k in range(len(words)):
        value = memory.words(start + words[k].place, 1)[0]
        different |= (words[k].value ^ value) & words[k].mask
    return different == 0


@subroutine
def copy_structure(m, offsets, table):
    """Write the structure of a model to the end of its table, where `words_of_structure` fit."""
    sizes, words = _copy(table, offsets)
    for k in range(len(sizes)):
        sizes[k] = m[k]
    arrays, start, row = _arrays(m, offsets), m[offsets.body_weldid // 8], 0
    for k in range(len(arrays)):
        for number in range(_words_in(arrays[k])):
            place, mask = _word(arrays[k], number)
            words[row].place, words[row].mask = place - start, mask
            words[row].value = memory.words(place, 1)[0]
            row += 1


@subroutine
def words_of_structure(m, offsets):
    """Return how many words there are besides sizes, and how many a copy of all needs."""
    arrays, count = _arrays(m, offsets), 0
    for k in range(len(arrays)):
        count += _words_in(arrays[k])
    return count, offsets.nbuffer // 8 + 1 + _WIDTH * count


@subroutine
def hash_of_structure(m, offsets):
    """Return a number that differs for most structures: 64 bits."""
    total = np.uint64(0)
    for k in range(offsets.nbuffer // 8 + 1):
        total = (total + np.uint64(m[k])) * memory.MULTIPLIER
    arrays = _arrays(m, offsets)
    for k in range(len(arrays)):
        for number in range(_words_in(arrays[k])):
            place, mask = _word(arrays[k], number)
            total = (total + np.uint64(memory.words(place, 1)[0] & mask)) * memory.MULTIPLIER
    return np.int64(total)


@subroutine(forceinline=True)
def _copy(table, offsets):
    """Return the copies of sizes and of other words in a table."""
    place, sizes = table + 8 * header(table).structure, offsets.nbuffer // 8 + 1
    return (
        memory.words(place, sizes),
        memory.records(place + 8 * sizes, header(table).words, WORD),
    )


@subroutine
def _words_in(array):
    """Return how many aligned words contain an array, of which the address and bytes are given."""
    address, size = array
    return (address + size + 7) // 8 - address // 8 if size > 0 else 0


@subroutine
def _word(array, number):
    """Return the address of one of these words, and a mask of the array's bytes.

    Other bytes may be names that nobody reads, or what is between two arrays, which may change when
    a model is copied onto another one.
    """
    address, size = array
    place = (address // 8 + number) * 8
    first, end = max(address - place, 0), min(address + size - place, 8)
    mask = np.uint64(0xFFFFFFFFFFFFFFFF) >> np.uint64(64 - 8 * (end - first))
    return place, np.int64(mask << np.uint64(8 * first))


@subroutine
def _arrays(m, offsets):
    """Return the addresses of the arrays that count, and how many bytes of each."""
    nbody, nsite, ngeom = m[offsets.nbody // 8], m[offsets.nsite // 8], m[offsets.ngeom // 8]
    ntext, nnumeric, ntuple = (
        m[offsets.ntext // 8], m[offsets.nnumeric // 8], m[offsets.ntuple // 8]
    )  # fmt: skip
    nplugin = m[offsets.nplugin // 8]
    nsensor = m[offsets.nsensor // 8] if nplugin > 0 else 0
    ngeom = ngeom if ntuple + m[offsets.nuser_geom // 8] > 0 else 0
    nshape = ngeom if m[offsets.nuser_geom // 8] >= 3 and m[offsets.nmesh // 8] > 0 else 0
    nactuator = m[offsets.nactuator // 8] if ntuple > 0 else 0
    nelement = m[offsets.ntupledata // 8]
    # The names of texts, numerics and tuples follow those of all other elements that are read.
    names, length = m[offsets.names // 8], m[offsets.nnames // 8]
    first = _least(m[offsets.name_textadr // 8], ntext, length)
    first = _least(m[offsets.name_numericadr // 8], nnumeric, first)
    first = _least(m[offsets.name_tupleadr // 8], ntuple, first)
    return (
        (m[offsets.site_bodyid // 8], 4 * nsite),
        (m[offsets.body_weldid // 8], 4 * nbody),
        (m[offsets.body_dofnum // 8], 4 * nbody),
        (m[offsets.plugin // 8], 4 * nplugin),
        (m[offsets.plugin_attradr // 8], 4 * nplugin),
        (m[offsets.plugin_attr // 8], m[offsets.npluginattr // 8]),
        (m[offsets.sensor_plugin // 8], 4 * nsensor),
        (m[offsets.sensor_objtype // 8], 4 * nsensor),
        (m[offsets.sensor_objid // 8], 4 * nsensor),
        (m[offsets.sensor_adr // 8], 4 * nsensor),
        (m[offsets.name_textadr // 8], 4 * ntext),
        (m[offsets.text_adr // 8], 4 * ntext),
        (m[offsets.text_data // 8], m[offsets.ntextdata // 8]),
        (m[offsets.name_numericadr // 8], 4 * nnumeric),
        (m[offsets.numeric_adr // 8], 4 * nnumeric),
        (m[offsets.numeric_size // 8], 4 * nnumeric),
        (m[offsets.name_tupleadr // 8], 4 * ntuple),
        (m[offsets.tuple_adr // 8], 4 * ntuple),
        (m[offsets.tuple_size // 8], 4 * ntuple),
        (m[offsets.tuple_objtype // 8], 4 * nelement),
        (m[offsets.tuple_objid // 8], 4 * nelement),
        (m[offsets.geom_type // 8], 4 * ngeom),
        (m[offsets.geom_bodyid // 8], 4 * ngeom),
        (m[offsets.geom_dataid // 8], 4 * nshape),
        (m[offsets.actuator_ctrladr // 8], 4 * nactuator),
        (m[offsets.actuator_ctrlnum // 8], 4 * nactuator),
        (m[offsets.actuator_actadr // 8], 4 * nactuator),
        (m[offsets.actuator_actnum // 8], 4 * nactuator),
        (names + first, length - first),
    )


@subroutine
def _least(place, count, bound):
    """Return the least of some C ints, or a bound if that is less."""
    numbers, least = memory.integers(place, count), bound
    for k in range(count):
        least = min(least, np.int64(numbers[k]))
    return least
