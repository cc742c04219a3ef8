"""Tuples of one numeric, the numbers of a material, and elements of one type that consist of it."""

import math

from magmotor.mjcf import memory
from magmotor.mjcf.declarations.custom import (
    FEW,
    KIND,
    NUMERIC,
    REPEATED,
    SECOND,
    element,
    elements_of,
    tuple_starts_with,
)
from magmotor.mjcf.declarations.marks import NOISE
from magmotor.mjcf.error_numbers import COLD, set_error
from magmotor.numerics.deferred import subroutine


@subroutine
def material_of(k, m, offsets):
    """Return the numeric that tuple k names, or -1."""
    for i in elements_of(k, m, offsets):
        kind, number, _ = element(i, m, offsets)
        if kind == NUMERIC:
            return number
    return -1


@subroutine
def broken_rule(k, prefix, wanted, m, offsets):
    """Return the first wrong element of tuple k, the rule, and another tuple; or -1, -1, -1.

    There must be one numeric, and elements of the type `wanted`, none of which is named twice in
    the tuples whose names start with `prefix`.
    """
    numerics = others = 0
    for i in elements_of(k, m, offsets):
        kind, number, _ = element(i, m, offsets)
        rule, other = KIND, -1
        if kind == NUMERIC:
            numerics += 1
            rule = SECOND if numerics > 1 else -1
        elif kind == wanted:
            others += 1
            other = _earlier_tuple(i, prefix, wanted, number, m, offsets)
            rule = REPEATED if other >= 0 else -1
        if rule >= 0:
            return i, rule, other
    return -1, FEW if numerics == 0 or others == 0 else -1, -1


@subroutine
def _earlier_tuple(i, prefix, wanted, number, m, offsets):
    """Return the tuple in which an element before i names the same as i, or -1."""
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, prefix, m, offsets):
            for j in elements_of(k, m, offsets):
                kind, other, _ = element(j, m, offsets)
                if kind == wanted and other == number and j < i:
                    return k
    return -1


@subroutine
def are_numbers(numbers, least, most):
    """Whether a numeric has as many numbers, which are finite and not negative."""
    valid = least <= len(numbers) <= most
    for i in range(len(numbers)):
        valid = valid and 0.0 <= numbers[i] < math.inf
    return valid


@subroutine
def check_noise(error, tuples, form, kinds, m, offsets):
    """Find a body that noise keeps at a temperature, where what a tuple declares takes energy."""
    nuser, bodies = m[offsets.nuser_body // 8], m[offsets.nbody // 8]
    rows = memory.numbers(m[offsets.body_user // 8], bodies, nuser)
    for body in range(bodies if kinds & NOISE else 0):
        if memory.any_number(rows, body, 0, nuser):
            set_error(error, COLD, tuples, body, form)
            return
