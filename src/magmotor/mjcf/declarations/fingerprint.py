"""A number that tells the structure of one model from that of another.

It is a sum of mixed 64-bit words of all that a table depends on: sizes, indices, and the characters
of marks and names. It is computed in each step, so that a table is right for what is in memory now,
whatever a program has assigned, and whichever model was at the same address before. Two structures
have the same fingerprint with a chance of 2^-64.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import numpy as np

from magmotor.mjcf import memory
from magmotor.mjcf.declarations.valid_indices import INDICES, NAMED
from magmotor.numerics.subroutine import subroutine

SIZES = (
    "nq", "nv", "nu", "na", "nactuator", "nbody", "njnt", "ngeom", "nsite", "nsensor",
    "nsensordata", "nplugin", "nnumeric", "nnumericdata", "ntext", "ntextdata", "ntuple",
    "ntupledata", "nnames", "npluginattr", "nuser_body", "nuser_jnt", "nuser_site",
)  # fmt: skip
"""Numbers of mjModel."""

INTEGERS = tuple(dict.fromkeys([
    *((array, count) for array, count, _, _, _ in INDICES),
    *((sizes, count) for _, count, _, sizes, _ in INDICES if sizes),
    *((array, count) for array, count, _ in NAMED),
    *((kinds, count) for _, count, kinds in NAMED),
    ("body_dofnum", "nbody"), ("geom_type", "ngeom"), ("plugin", "nplugin"),
    ("sensor_plugin", "nsensor"),
]))  # fmt: skip
"""Arrays of C ints, and their lengths."""

CHARACTERS = (("text_data", "ntextdata"), ("plugin_attr", "npluginattr"))
"""Arrays of characters, and their lengths; of the names, those count that are read."""

READ = (
    ("name_textadr", "ntext"), ("name_numericadr", "nnumeric"), ("name_tupleadr", "ntuple")
)  # fmt: skip
"""Where the names of texts, numerics and tuples begin, and how many there are."""

_FIRST, _SECOND = np.uint64(0xD6E8FEB86659FD93), np.uint64(0xA0761D6478BD642F)
"""Odd numbers with random bits."""


@subroutine
def fingerprint_of(m, sizes, arrays, names):
    """Return the fingerprint of a model, by words of mjModel.

    `sizes` (n,) are those of numbers, `arrays` (n, 3) those of arrays and their lengths, with bytes
    per element, and `names` (4, 2) those of `READ`, and then of the names and their length.
    """
    total = np.uint64(0)
    for k in range(len(sizes)):
        total += _mixed(m[sizes[k]], k)
    for k in range(len(arrays)):
        total += _sum(m[arrays[k, 0]], m[arrays[k, 1]] * arrays[k, 2], k)
    last = len(names) - 1
    length = m[names[last, 1]]
    first = max(length - 1, 0)
    for k in range(last):
        start = memory.integers(m[names[k, 0]], m[names[k, 1]])
        for i in range(len(start)):
            first = min(first, np.int64(start[i]))
    return total + _sum(m[names[last, 0]] + first, length - first, len(arrays))


@subroutine(forceinline=True)
def _sum(place, size, number):
    """Return the sum of the mixed words of `size` bytes; `number` is that of the array."""
    words, total = memory.words(place, size // 8), np.uint64(0)
    seed = number << 40
    for k in range(len(words)):
        total += _mixed(words[k], seed + k)
    rest, left = memory.bytes_at(place + 8 * len(words), size % 8), np.int64(0)
    for k in range(len(rest)):
        left = left << 8 | np.int64(rest[k])
    return total + _mixed(left, seed - 1) if len(rest) > 0 else total


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
