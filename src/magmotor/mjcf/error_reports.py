"""Reports of errors, which compiled code finds, with the elements and numbers that they name."""

import math

import numpy as np

from magmotor.mjcf import error_numbers, error_raising, layout, memory, notice_sentences
from magmotor.mjcf.declarations import reader
from magmotor.mjcf.declarations.custom import (
    BODY,
    GEOM,
    JOINT,
    NUMERIC,
    SENSOR,
    SITE,
    TEXT,
    TUPLE,
    element,
    elements_of,
    numbers_of,
)
from magmotor.mjcf.declarations.fields import GRADIENT
from magmotor.mjcf.declarations.marks import has_words, has_words_of_mark, marks_of
from magmotor.mjcf.declarations.reader import table_of
from magmotor.mjcf.declarations.shapes import polarization_of
from magmotor.mjcf.declarations.table import fields
from magmotor.mjcf.declarations.user_numbers import moment_of
from magmotor.mjcf.declarations.valid_indices import invalid_index
from magmotor.mjcf.error_numbers import FORM, KIND
from magmotor.mjcf.forces import drives
from magmotor.mjcf.forces.applied_fields import place_in_field
from magmotor.mjcf.forces.brownian_wrenches import userdata_at
from magmotor.numerics import c_types as types
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.deferred import External, subroutine

DIPOLE, NOTHING = -1, -2
"""Types of elements: sites, or geoms whose number is that of all sites plus their own; and none."""

ELEMENTS = (
    (DIPOLE, DIPOLE),
    (DIPOLE, NUMERIC),
    (DIPOLE, BODY),
    (GEOM, NOTHING),
    (GEOM, NOTHING),
    (NOTHING, NOTHING),
    (SITE, NOTHING),
    (TUPLE, NOTHING),
    (BODY, NOTHING),
    (JOINT, NOTHING),
    (NOTHING, NOTHING),
    (NOTHING, NOTHING),
    (TUPLE, NOTHING),
    (NUMERIC, NOTHING),
    (TUPLE, NOTHING),
    (TUPLE, NOTHING),
    (NUMERIC, NOTHING),
    (GEOM, TUPLE),
    (SENSOR, NOTHING),
    (SENSOR, SITE),
    (NUMERIC, NOTHING),
    (GEOM, NOTHING),
    (BODY, BODY),
    (NOTHING, NOTHING),
    (NUMERIC, NOTHING),
    (GEOM, NOTHING),
    (GEOM, NOTHING),
    (GEOM, TUPLE),
    (GEOM, NOTHING),
    (NOTHING, NOTHING),
    (GEOM, NOTHING),
    (TUPLE, NOTHING),
    (NUMERIC, NOTHING),
    (DIPOLE, GEOM),
    (TUPLE, BODY),
    (GEOM, GEOM),
    (TUPLE, NOTHING),
    (NUMERIC, NOTHING),
    (TUPLE, NOTHING),
    (TUPLE, GEOM),
    (SITE, NOTHING),
)
"""The types of the two elements of each error, by its number."""

_word = types.int64
_REPORT = types.void(_word, _word, _word)
_report = External("magmotor_report", _REPORT)
_name = External("mj_id2name", types.int64(types.int64, types.int32, types.int32))


def bind() -> None:
    """Bind what this module compiles separately, and what that calls, to symbols."""
    error_raising.bind()
    drives.bind()
    reader.bind_others()
    memory.bind_mujoco("mj_id2name")
    memory.bind_compiled("magmotor_report", _compiled_report(layout.current()))


@subroutine(forceinline=True)
def report(error, model, data):
    """Raise an error, or record it; `error` are its words, if the first is not -1.

    The elements of some errors are dipoles: the number of a site, or the number of sites plus that
    of a geom. `model` and `data` are the addresses of mjModel and mjData.
    """
    if error[0] >= 0:
        _report(error.ctypes.data, model, data)


@compiled_once(_REPORT, error_model="numpy")
def _compiled_report(checksum: int, offsets: layout.Layout):
    """Define what `report` calls, for one layout of the structs."""

    def report(error, model, data):
        _ = checksum
        m = memory.words(model, memory.UNBOUNDED)
        d = memory.words(data, memory.UNBOUNDED)
        _report_error(memory.words(error, error_numbers.WORDS), m, d, offsets)

    return report


@subroutine(forceinline=True)
def _report_error(error, m, d, offsets):
    """Look up the names and numbers that the sentence of an error has, and raise it."""
    model, number, first, second = m.ctypes.data, error[0], error[1], error[2]
    place = memory.details_on_stack()
    details = memory.numbers(place, 1, error_numbers.DETAILS)[0]
    if number == error_numbers.MARK:
        text, config = marks_of(m, offsets)
        details[FORM] = error_numbers.OF_BOTH
        if _has_other_words(text):
            details[FORM] = 0.0
        elif _has_other_words(config):
            details[FORM] = error_numbers.OF_CONFIG
        error_raising.fail(number, 0, text, 0, config, place)
    elif number in (
        error_numbers.COIL, error_numbers.FIELD_TUPLE, error_numbers.IRON, error_numbers.CONDUCTOR,
        error_numbers.HYSTERESIS,
    ):  # fmt: skip
        _report_tuple(error, m, offsets, details, place)
    elif number >= 0:
        _find_details(error, m, d, offsets, details)
        one, other = ELEMENTS[number]
        nsite = m[offsets.nsite // 8]
        if one == DIPOLE:
            one = SITE
            if first >= nsite:
                one, first, details[FORM] = GEOM, first - nsite, details[FORM] + 1.0
        if other == DIPOLE:
            other = SITE
            if second >= nsite:
                other, second, details[FORM] = GEOM, second - nsite, details[FORM] + 2.0
        names = _name(model, one, first), _name(model, other, second)
        error_raising.fail(number, first, names[0], second, names[1], place)


@subroutine
def _has_other_words(mark):
    """Whether the text of a mark, if it has one, is no list of words."""
    return mark != 0 and not memory.starts_with(mark, (0,)) and not has_words(mark)


@subroutine(forceinline=True)
def _find_details(error, m, d, offsets, details):
    """Write the numbers that the sentence of an error has, besides those of its elements."""
    number, first = error[0], error[1]
    if number == error_numbers.TIME:
        details[0] = memory.numbers(d.ctypes.data + offsets.time, 1, 1)[0, 0]
    elif number == error_numbers.PATH:
        details[0] = userdata_at(d, offsets, first)
    elif number == error_numbers.INDEX:
        place = memory.details_on_stack()
        invalid_index(m.ctypes.data, place)
        found = memory.words(place, 4)
        details[0], details[1] = np.int32(found[1]), np.int32(found[2])
        details[2], details[FORM] = found[3], first
    elif number in (error_numbers.MATERIAL, error_numbers.CONDUCTIVITY, error_numbers.LOOP):
        numbers = numbers_of(first, m, offsets)
        details[FORM] = min(len(numbers), 4)
        for k in range(min(len(numbers), 3)):
            details[1 + k] = numbers[k]
    elif number == error_numbers.POLARIZATION:
        x, y, z = polarization_of(first, m, offsets)
        details[0], details[1], details[2] = x, y, z
        details[FORM] = 0.0 if math.isfinite(x + y + z) else error_numbers.INFINITE
    elif number == error_numbers.MOMENT:
        details[0], details[FORM] = moment_of(first, m, offsets), error[3]
    elif number in (error_numbers.POLYHEDRON, error_numbers.COLD, error_numbers.UNSTORED):
        details[FORM] = error[3]
    elif number == error_numbers.OUTSIDE:
        _locate(first, error[2], m, d, offsets, details)


@subroutine
def warn_of_motion(body, other, model):
    """Report a body that jumped, or sank into another one, and no others of this run."""
    which, other_name = notice_sentences.UNRESOLVED, 0
    if other >= 0:
        which, other_name = notice_sentences.SUNKEN, _name(model, BODY, other)
    name = _name(model, BODY, body)
    error_raising.notice(which, body, name, notice_sentences.OF_RUNS, other, other_name)


@subroutine
def warn_of_overwritten(body, model):
    """Report a body whose `xfrc_applied` the user set, once per `magnetism` block."""
    which = notice_sentences.OVERWRITTEN
    error_raising.notice(which, body, _name(model, BODY, body), 1 << which)


@subroutine
def warn_of_misnamed(m, offsets):
    """Report the first text with the words and nearly the name of a mark, once per block."""
    which = notice_sentences.NOT_A_MARK
    for text in range(m[offsets.ntext // 8]):
        if has_words_of_mark(text, m, offsets):
            error_raising.notice(which, text, _name(m.ctypes.data, TEXT, text), 1 << which)


@subroutine
def _report_tuple(error, m, offsets, details, place):
    """Report which element of a tuple breaks a rule; -1 stands for the tuple itself."""
    k, i, name = error[1], error[2], 0
    details[FORM], details[0] = error[3], error[4]
    if i >= 0:
        kind, named, prm = element(i, m, offsets)
        details[1], details[KIND] = prm, kind
        name = _name(m.ctypes.data, kind, named)
    position = i - elements_of(k, m, offsets).start
    error_raising.fail(error[0], k, _name(m.ctypes.data, TUPLE, k), position, name, place)


@subroutine
def _locate(dipole, numeric, m, d, offsets, details):
    """Write where a dipole is in the frame of a table, and where the table begins and ends.

    It is outside, or at a node that is not finite; or the field has no table.
    """
    numbers = numbers_of(numeric, m, offsets)
    if len(numbers) <= GRADIENT:
        details[FORM] = error_numbers.IN_GRADIENT
        return
    nsite = m[offsets.nsite // 8]
    places, i = (
        (offsets.site_xpos, dipole) if dipole < nsite else (offsets.geom_xpos, dipole - nsite)
    )
    at = memory.numbers(d[places // 8], memory.UNBOUNDED, 3)[i]
    for row in fields(table_of(m.ctypes.data, False)):
        if row.numeric == numeric:
            place = place_in_field(row, at[0], at[1], at[2], m, d, offsets)
            details[0], details[1], details[2] = place
    inside = True
    for k in range(3):
        count, start, step = numbers[k], numbers[3 + k], numbers[6 + k]
        details[3 + k], details[6 + k] = start, start + (count - 1) * step
        inside = inside and 0.0 <= (details[k] - start) * (1.0 / step) <= count - 1
    if inside:
        details[FORM] = error_numbers.AT_NODE
