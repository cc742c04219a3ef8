"""Which of a model's `user` numbers and tuples are magnetic: the mark that it carries.

A model is marked by a text, `<custom><text name="magmotor" data="dipoles noise"/></custom>`, or by
the configuration of the plugin. Its words name what acts; `all` is all of them. In a model without
a mark only dipole sites act, and only if no body, joint or further number of a site has `user`
numbers, and those of the sites do not just count them (three or more consecutive numbers do).
"""

import math

import numpy as np

from magmotor.mjcf import memory
from magmotor.mjcf.declarations.user_numbers import has_numbers
from magmotor.numerics.deferred import subroutine

(
    DIPOLES, COUPLINGS, NOISE, POTENTIALS, UNMARKED, FIELDS, COILS, IRON, SHAPES, CONDUCTORS,
    HYSTERESIS,
) = (1 << k for k in range(11))  # fmt: skip
"""Bits for what acts, and for a model that does not say so."""

WRONG = -1
"""Stands for a mark without words or with an unknown one, and for two marks that differ."""

UNREADABLE = -2
"""Stands for a model with an invalid index."""

WORDS = {
    "dipoles": DIPOLES,
    "couplings": COUPLINGS,
    "noise": NOISE,
    "potentials": POTENTIALS,
    "fields": FIELDS,
    "coils": COILS,
    "iron": IRON,
    "magnets": SHAPES,
    "conductors": CONDUCTORS,
    "hysteresis": HYSTERESIS,
}
WORDS["all"] = sum(WORDS.values())

NAME = (*b"magmotor", 0)
EIGHT, LAST = np.uint64(8), np.uint64(56)
"""Bits of a character, and of all but the first of eight."""


def _packed(word: str) -> tuple[np.uint64, np.uint64]:
    number = int.from_bytes(word.encode(), "big")
    return np.uint64(number >> 64), np.uint64(number & (2**64 - 1))


_CODED = tuple(_packed(word) for word in WORDS)
_BITS = tuple(WORDS.values())


@subroutine
def marked_kinds(m, offsets):
    """Return the bits of what a model's marks name, `UNMARKED` without one, or `WRONG`."""
    text, config = marks_of(m, offsets)
    if text == 0 and config == 0:
        return UNMARKED
    by_text = _bits_of(text) if text != 0 else 0
    by_config = _bits_of(config) if config != 0 else by_text
    return by_config if by_text == 0 or by_text == by_config else WRONG


@subroutine
def marks_of(m, offsets):
    """Return the addresses of the text and of the plugin's configuration; 0 for a missing one."""
    text = config = 0
    names, first = m[offsets.names // 8], m[offsets.text_data // 8]
    count = m[offsets.ntext // 8]
    name_of = memory.integers(m[offsets.name_textadr // 8], count)
    start = memory.integers(m[offsets.text_adr // 8], count)
    for k in range(count):
        if memory.starts_with(names + name_of[k], NAME):
            text = first + start[k]
    instance = plugin_instance(m, offsets)
    if instance >= 0:
        count = m[offsets.nplugin // 8]
        start = memory.integers(m[offsets.plugin_attradr // 8], count)
        config = m[offsets.plugin_attr // 8] + start[instance]
        if memory.starts_with(config, (0,)):
            config = 0
    return text, config


@subroutine
def has_words_of_mark(text, m, offsets):
    """Whether the words of a text are those of a mark."""
    start = memory.integers(m[offsets.text_adr // 8], m[offsets.ntext // 8])
    return has_words(m[offsets.text_data // 8] + start[text])


@subroutine
def has_words(text):
    """Whether a C string consists of words of a mark."""
    return _bits_of(text) != WRONG


@subroutine
def plugin_instance(m, offsets):
    """Number of the first instance of our plugin in a model; -1 if there is none."""
    count = m[offsets.nplugin // 8]
    slots = memory.integers(m[offsets.plugin // 8], count)
    for k in range(count):
        if slots[k] == memory.plugin_slot():
            return k
    return -1


@subroutine
def _bits_of(text):
    """Bits of the words of a C string; `WRONG` if one is unknown or none is there.

    The characters of a word are packed into two integers, so that one pass suffices.
    """
    characters = memory.bytes_at(text, memory.UNBOUNDED)
    bits = place = length = 0
    first = second = np.uint64(0)
    while True:
        character = characters[place]
        if character == 32 or 9 <= character <= 13 or character == 0:
            if length > 0:
                found = _word(first, second, length)
                if found == 0:
                    return WRONG
                bits |= found
                length, first, second = 0, np.uint64(0), np.uint64(0)
            if character == 0:
                return bits if bits > 0 else WRONG
        else:
            first, second = (first << EIGHT) | (second >> LAST), (second << EIGHT) | character
            length += 1
        place += 1


@subroutine
def _word(first, second, length):
    """Bits of a word of at most 16 characters; 0 if it is unknown."""
    if length > 16:
        return 0
    for k in range(len(_CODED)):
        if first == _CODED[k][0] and second == _CODED[k][1]:
            return _BITS[k]
    return 0


@subroutine
def is_plainly_magnetic(m, offsets):
    """Whether the `user` numbers of an unmarked model can be nothing but moments of sites."""
    nsite, nuser = m[offsets.nsite // 8], m[offsets.nuser_site // 8]
    if nsite == 0 or nuser == 0:
        return False
    moment = memory.numbers(m[offsets.site_user // 8], nsite, nuser)
    counted = nsite > 2
    for site in range(nsite):
        if not math.isfinite(moment[site, 0]) or memory.any_number(moment, site, 1, nuser):
            return False
        counted = counted and moment[site, 0] - moment[0, 0] == site
    return not (
        counted
        or has_numbers(m, offsets.nbody, offsets.nuser_body, offsets.body_user)
        or has_numbers(m, offsets.njnt, offsets.nuser_jnt, offsets.jnt_user)
    )
