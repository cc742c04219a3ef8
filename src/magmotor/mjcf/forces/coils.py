"""Coils: dipoles whose moments follow an actuator, such as electromagnets.

A tuple whose name starts with `coil` names an actuator first, then sites or bodies. The moment of
each of these sites, and of all dipole sites of these bodies, is its `user` number times the
actuator's drive u: its last activation if it has any (so that MuJoCo's filters give the coil's rise
time), else its control, within `ctrlrange`. The actuator's `prm` s, if it is not 0, is where the
core saturates: u is then replaced by u/sqrt(1 + (u/s)^2).
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import math

import numpy as np
from numba import njit, types

from magmotor.mjcf import memory
from magmotor.mjcf.forces.custom import (
    ACTUATOR,
    BODY,
    SITE,
    element,
    elements_of,
    tuple_starts_with,
)
from magmotor.numerics.elementary import float_as_bits

COIL = tuple(b"coil")

DISABLE_CLAMP, DISABLE_ACTUATION = 1 << 8, 1 << 11
"""mjDSBL_CLAMPCTRL and mjDSBL_ACTUATION."""

LARGEST = 1e10
"""mjMAXVAL, the largest control that is not bad."""

MULTIPLIER = np.uint64(0x9E3779B97F4A7C15)
"""Odd number that spreads bits: 2^64 over the golden ratio."""

_is_disabled = types.ExternalFunction("mj_actuatorDisabled", types.int32(types.int64, types.int32))


def bind() -> None:
    """Bind the functions of MuJoCo that this module calls."""
    memory.bind_mujoco("mj_actuatorDisabled")


@njit
def drive(actuator, saturation, m, d, offsets):
    """Return an actuator's drive, after saturation; 0 if the actuator is disabled."""
    model = m.ctypes.data
    flags = memory.integers(model + offsets.disableflags, 1)[0]
    if flags & DISABLE_ACTUATION or _is_disabled(model, actuator):
        return 0.0
    activations = memory.integers(m[offsets.actuator_actnum // 8], memory.UNBOUNDED)[actuator]
    if activations > 0:
        first = memory.integers(m[offsets.actuator_actadr // 8], memory.UNBOUNDED)[actuator]
        u = memory.numbers(d[offsets.act // 8], 1, memory.UNBOUNDED)[0, first + activations - 1]
    else:
        u = _control(actuator, flags & DISABLE_CLAMP == 0, m, d, offsets)
    return u if saturation == 0.0 else u / math.sqrt(1.0 + (u / saturation) ** 2)


@njit
def _control(actuator, clamp, m, d, offsets):
    """Return an actuator's control, clamped to its range."""
    i = memory.integers(m[offsets.actuator_ctrladr // 8], memory.UNBOUNDED)[actuator]
    u = memory.numbers(d[offsets.ctrl // 8], 1, memory.UNBOUNDED)[0, i]
    if not abs(u) <= LARGEST:  # MuJoCo, too, takes a bad control for 0
        u = 0.0
    if clamp and memory.bytes_at(m[offsets.actuator_ctrllimited // 8], memory.UNBOUNDED)[i]:
        limits = memory.numbers(m[offsets.actuator_ctrlrange // 8], memory.UNBOUNDED, 2)
        u = min(max(u, limits[i, 0]), limits[i, 1])
    return u


@njit
def is_drive(i, m, offsets):
    """Whether element i of all tuples is an actuator without a delay, and with a valid `prm`."""
    kind, actuator, prm = element(i, m, offsets)
    if kind != ACTUATOR:
        return False
    delay = memory.numbers(m[offsets.actuator_delay // 8], 1, memory.UNBOUNDED)[0, actuator]
    return delay == 0.0 and 0.0 <= prm < math.inf


@njit
def read_drives(drives, m, d, offsets):
    """Write by how much coils scale the moment of each site; 1 without a coil."""
    drives[:] = 1.0
    body_of = memory.integers(m[offsets.site_bodyid // 8], len(drives))
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, COIL, m, offsets):
            u = 1.0
            for i in elements_of(k, m, offsets):
                kind, number, prm = element(i, m, offsets)
                if kind == ACTUATOR:
                    u = drive(number, prm, m, d, offsets)
                elif kind == SITE:
                    drives[number] = u
                else:
                    for site in range(len(drives)):
                        if body_of[site] == number:
                            drives[site] = u


@njit
def invalid_coil(m, offsets):
    """Return the first tuple of a coil with wrong elements, or -1.

    There must be one actuator first, then sites and bodies that no coil names twice.
    """
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, COIL, m, offsets):
            elements = elements_of(k, m, offsets)
            wrong = len(elements) < 2
            for i in elements:
                if i == elements.start:
                    wrong = wrong or not is_drive(i, m, offsets)
                else:
                    kind, _, _ = element(i, m, offsets)
                    wrong = wrong or (kind != SITE and kind != BODY)
                    wrong = wrong or _is_repeated(i, m, offsets)
            if wrong:
                return k
    return -1


@njit
def _is_repeated(i, m, offsets):
    """Whether an earlier element of a coil names the same sites as element i."""
    kind, number, _ = element(i, m, offsets)
    body_of = memory.integers(m[offsets.site_bodyid // 8], memory.UNBOUNDED)
    body = body_of[number] if kind == SITE else number
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, COIL, m, offsets):
            for j in elements_of(k, m, offsets):
                other, same, _ = element(j, m, offsets)
                if j < i and other == kind and same == number:
                    return True
                bodies = other == BODY and same == body
                if j != i and kind == SITE and bodies:
                    return True
    return False


@njit
def drives_checksum(m, d, offsets):
    """Return a positive number of 47 bits that changes with the drives of coils and fields."""
    total = np.uint64(0)
    for k in range(m[offsets.ntuple // 8]):
        for i in elements_of(k, m, offsets):
            kind, number, _ = element(i, m, offsets)
            if kind == ACTUATOR:
                total = (total ^ float_as_bits(drive(number, 0.0, m, d, offsets))) * MULTIPLIER
    return np.int64(total >> np.uint64(17))
