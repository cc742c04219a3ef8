"""A number that tells the structure of one model from that of another.

It is a sum of mixed 64-bit words of all that a table depends on: sizes, what belongs to what, the
characters of marks, and the names and elements of tuples. It is computed in each step, so that a
table is right for what is in memory now, whatever a program has assigned, and whichever model was
at the same address before. Two structures have the same fingerprint with a chance of 2^-64.
"""

import numpy as np

from magmotor.mjcf import memory
from magmotor.numerics.deferred import subroutine

_FIRST, _SECOND = np.uint64(0xD6E8FEB86659FD93), np.uint64(0xA0761D6478BD642F)
"""Odd numbers with random bits."""


@subroutine(forceinline=True)
def fingerprint_of(m, offsets):
    """Return the fingerprint of a model, whose words are given."""
    nbody, nsite, ngeom = m[offsets.nbody // 8], m[offsets.nsite // 8], m[offsets.ngeom // 8]
    ntext, nnumeric, ntuple = (
        m[offsets.ntext // 8], m[offsets.nnumeric // 8], m[offsets.ntuple // 8]
    )  # fmt: skip
    nplugin, nsensor = m[offsets.nplugin // 8], m[offsets.nsensor // 8]
    sizes = (
        nbody, nsite, ngeom, ntext, nnumeric, ntuple, nplugin, nsensor, m[offsets.nactuator // 8],
        m[offsets.nuser_site // 8], m[offsets.ntupledata // 8], m[offsets.nsensordata // 8],
    )  # fmt: skip
    total = np.uint64(0)
    for k in range(len(sizes)):
        total = total * _FIRST + np.uint64(sizes[k])
    total = _mixed(total, 0) + _integers(m[offsets.site_bodyid // 8], nsite, 1)
    total += _integers(m[offsets.body_weldid // 8], nbody, 2)
    total += _integers(m[offsets.body_dofnum // 8], nbody, 3)
    if nplugin > 0:
        total += _integers(m[offsets.plugin // 8], nplugin, 4)
        total += _integers(m[offsets.plugin_attradr // 8], nplugin, 5)
        total += _characters(m[offsets.plugin_attr // 8], m[offsets.npluginattr // 8], 6)
        total += _integers(m[offsets.sensor_plugin // 8], nsensor, 7)
        total += _integers(m[offsets.sensor_objtype // 8], nsensor, 8)
        total += _integers(m[offsets.sensor_objid // 8], nsensor, 9)
        total += _integers(m[offsets.sensor_adr // 8], nsensor, 10)
    if ntext > 0:
        total += _integers(m[offsets.name_textadr // 8], ntext, 11)
        total += _integers(m[offsets.text_adr // 8], ntext, 12)
        total += _characters(m[offsets.text_data // 8], m[offsets.ntextdata // 8], 13)
    if nnumeric > 0:
        total += _integers(m[offsets.name_numericadr // 8], nnumeric, 14)
        total += _integers(m[offsets.numeric_adr // 8], nnumeric, 23)
        total += _integers(m[offsets.numeric_size // 8], nnumeric, 24)
    if ntuple > 0:
        total += _integers(m[offsets.name_tupleadr // 8], ntuple, 15)
        total += _integers(m[offsets.tuple_adr // 8], ntuple, 16)
        total += _integers(m[offsets.tuple_size // 8], ntuple, 17)
        total += _integers(m[offsets.tuple_objtype // 8], m[offsets.ntupledata // 8], 18)
        total += _integers(m[offsets.tuple_objid // 8], m[offsets.ntupledata // 8], 19)
        total += _integers(m[offsets.geom_type // 8], ngeom, 20)
        total += _integers(m[offsets.geom_bodyid // 8], ngeom, 21)
        nactuator = m[offsets.nactuator // 8]
        total += _integers(m[offsets.actuator_ctrladr // 8], nactuator, 25)
        total += _integers(m[offsets.actuator_ctrlnum // 8], nactuator, 26)
        total += _integers(m[offsets.actuator_actadr // 8], nactuator, 27)
        total += _integers(m[offsets.actuator_actnum // 8], nactuator, 28)
    # The names of texts, numerics and tuples follow those of all other elements that are read.
    length = m[offsets.nnames // 8]
    first = _least(m[offsets.name_textadr // 8], ntext, length)
    first = _least(m[offsets.name_numericadr // 8], nnumeric, first)
    first = _least(m[offsets.name_tupleadr // 8], ntuple, first)
    return total + _characters(m[offsets.names // 8] + first, length - first, 22)


@subroutine(forceinline=True)
def _least(place, count, bound):
    """Return the least of some C ints, or a bound if that is less."""
    numbers, least = memory.integers(place, count), bound
    for k in range(count):
        least = min(least, np.int64(numbers[k]))
    return least


@subroutine(forceinline=True)
def _integers(place, count, number):
    """Return the sum of some C ints, mixed; `number` is that of the array."""
    total = _words(place, count // 2, number)
    if count % 2 == 1:
        total += _mixed(memory.integers(place, count)[count - 1], number << 40 | count)
    return total


@subroutine(forceinline=True)
def _characters(place, count, number):
    """Return the same of characters."""
    rest, last = memory.bytes_at(place, count), np.int64(0)
    for k in range(count // 8 * 8, count):
        last = last << 8 | np.int64(rest[k])
    return _words(place, count // 8, number) + _mixed(last, number << 40 | count)


@subroutine(forceinline=True)
def _words(place, count, number):
    """Return the same of 64-bit words."""
    words, total = memory.words(place, count), np.uint64(0)
    for k in range(count):
        total += _mixed(words[k], number << 40 | k)
    return total


@subroutine(forceinline=True)
def _mixed(word, place):
    """Let each bit of a word and of its place change about half of the bits of the result.

    These are the steps of MurmurHash3's finalizer. The first one moves high bits down, which a
    product alone would leave where they are.
    """
    bits = np.uint64(word) + np.uint64(place) * memory.MULTIPLIER
    bits = (bits ^ (bits >> np.uint64(32))) * _FIRST
    bits = (bits ^ (bits >> np.uint64(29))) * _SECOND
    return bits ^ (bits >> np.uint64(32))
