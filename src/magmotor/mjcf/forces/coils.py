"""Coils: dipoles whose moments follow an actuator, such as electromagnets.

A tuple whose name starts with `coil` names an actuator first, then sites or bodies. The moment of
each of these sites, and of all dipole sites of these bodies, is its `user` number times the
actuator's drive u: its last activation if it has any (so that MuJoCo's filters give the coil's rise
time), else its control, within `ctrlrange`. As in MuJoCo, a control that is bad even so, such as
NaN, makes all controls 0. The actuator's `prm` s, if it is not 0, is where the core saturates: u is
then replaced by u/sqrt(1 + (u/s)^2).
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import math

import numpy as np
from numba import types

from magmotor.mjcf import memory
from magmotor.mjcf.forces.custom import (
    ACTUATOR,
    BODY,
    CONTAINED,
    DELAY,
    FEW,
    FIRST,
    KIND,
    PRM,
    REPEATED,
    SITE,
    VALID,
    element,
    elements_of,
    tuple_starts_with,
)
from magmotor.numerics.elementary import float_as_bits
from magmotor.numerics.subroutine import subroutine

COIL = tuple(b"coil")

DISABLE_CLAMP, DISABLE_ACTUATION = 1 << 8, 1 << 11
"""mjDSBL_CLAMPCTRL and mjDSBL_ACTUATION."""

LARGEST = 1e10
"""mjMAXVAL, the largest control that is not bad, as NaN is."""

_is_disabled = types.ExternalFunction("mj_actuatorDisabled", types.int32(types.int64, types.int32))


def bind() -> None:
    """Bind the functions of MuJoCo that this module calls."""
    memory.bind_mujoco("mj_actuatorDisabled")


@subroutine
def drive(actuator, saturation, controlled, m, d, offsets):
    """Return an actuator's drive, after saturation; 0 if the actuator is disabled.

    `controlled` is whether controls act, as `are_controls_good` returns it.
    """
    model = m.ctypes.data
    flags = memory.integers(model + offsets.disableflags, 1)[0]
    if flags & DISABLE_ACTUATION or _is_disabled(model, actuator):
        return 0.0
    activations = memory.integers(m[offsets.actuator_actnum // 8], memory.UNBOUNDED)[actuator]
    if activations > 0:
        first = memory.integers(m[offsets.actuator_actadr // 8], memory.UNBOUNDED)[actuator]
        u = memory.numbers(d[offsets.act // 8], 1, memory.UNBOUNDED)[0, first + activations - 1]
    elif controlled:
        i = memory.integers(m[offsets.actuator_ctrladr // 8], memory.UNBOUNDED)[actuator]
        u = _control(i, flags & DISABLE_CLAMP == 0, m, d, offsets)
    else:
        u = 0.0
    return u if saturation == 0.0 else u / math.sqrt(1.0 + (u / saturation) ** 2)


@subroutine(forceinline=True)
def _control(i, clamp, m, d, offsets):
    """Return a control, clamped to its range."""
    u = memory.numbers(d[offsets.ctrl // 8], 1, memory.UNBOUNDED)[0, i]
    if clamp and memory.bytes_at(m[offsets.actuator_ctrllimited // 8], memory.UNBOUNDED)[i]:
        limits = memory.numbers(m[offsets.actuator_ctrlrange // 8], memory.UNBOUNDED, 2)
        if u < limits[i, 0]:
            u = limits[i, 0]
        elif u > limits[i, 1]:
            u = limits[i, 1]
    return u


@subroutine
def are_controls_good(m, d, offsets):
    """Whether MuJoCo lets controls act: once clamped, none may be NaN or too large."""
    clamp = memory.integers(m.ctypes.data + offsets.disableflags, 1)[0] & DISABLE_CLAMP == 0
    actuators = m[offsets.nactuator // 8]
    first = memory.integers(m[offsets.actuator_ctrladr // 8], actuators)
    count = memory.integers(m[offsets.actuator_ctrlnum // 8], actuators)
    for k in range(actuators):
        for i in range(np.int64(first[k]), np.int64(first[k]) + np.int64(count[k])):
            if not abs(_control(i, clamp, m, d, offsets)) <= LARGEST:  # as with NaN
                return False
    return True


@subroutine
def wrong_drive(i, m, offsets):
    """Return the rule that the actuator in element i of all tuples breaks, or -1."""
    _, actuator, prm = element(i, m, offsets)
    delay = memory.numbers(m[offsets.actuator_delay // 8], 1, memory.UNBOUNDED)[0, actuator]
    if delay != 0.0:
        return DELAY
    return -1 if 0.0 <= prm < math.inf else PRM


@subroutine
def read_drives(drives, m, d, offsets):
    """Write by how much coils scale the moment of each site, into row 0; 1 without a coil.

    Row 1 receives which sites have a coil. Returns the first tuple that breaks a rule of
    `invalid_coil`, or -1.
    """
    for site in range(drives.shape[1]):
        drives[0, site], drives[1, site] = 1.0, 0.0
    body_of = memory.integers(m[offsets.site_bodyid // 8], drives.shape[1])
    are_sorted = are_known = False
    controlled = are_controls_good(m, d, offsets)
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, COIL, m, offsets):
            elements = elements_of(k, m, offsets)
            if len(elements) < 2 or element(elements.start, m, offsets)[0] != ACTUATOR:
                return k
            u = 1.0
            for i in elements:
                kind, number, prm = element(i, m, offsets)
                first, last = number, number + 1
                if i == elements.start:
                    if wrong_drive(i, m, offsets) >= 0:
                        return k
                    u = drive(number, prm, controlled, m, d, offsets)
                    continue
                if kind == BODY:
                    first, last = 0, drives.shape[1]
                    are_sorted = are_sorted if are_known else _are_sorted(body_of)
                    are_known = True
                    if are_sorted:
                        first = _sites_before(number, m, offsets)
                        last = _sites_before(number + 1, m, offsets)
                elif kind != SITE:
                    return k
                for site in range(first, last):
                    if kind == BODY and body_of[site] != number:
                        continue
                    if drives[1, site] != 0.0:
                        return k
                    drives[0, site], drives[1, site] = u, 1.0
    return -1


@subroutine
def _are_sorted(body_of):
    """Whether sites are sorted by bodies, as in all compiled models."""
    found = True
    for site in range(1, len(body_of)):
        found = found and body_of[site - 1] <= body_of[site]
    return found


@subroutine
def _sites_before(body, m, offsets):
    """Return the number of sites of all bodies before this one, if sites are sorted by bodies."""
    body_of = memory.integers(m[offsets.site_bodyid // 8], memory.UNBOUNDED)
    low, high = 0, m[offsets.nsite // 8]
    while low < high:
        middle = (low + high) // 2
        if body_of[middle] < body:
            low = middle + 1
        else:
            high = middle
    return low


@subroutine
def invalid_coil(m, offsets) -> tuple[int, int, int, int]:
    """Return the first tuple of a coil with a wrong element, as `VALID` describes it.

    There must be one actuator first, then sites and bodies that no coil names twice.
    """
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, COIL, m, offsets):
            elements = elements_of(k, m, offsets)
            for i in elements:
                kind, _, _ = element(i, m, offsets)
                rule = other = -1
                if i == elements.start:
                    rule = wrong_drive(i, m, offsets) if kind == ACTUATOR else FIRST
                elif kind in (SITE, BODY):
                    rule, other = _repeated(i, m, offsets)
                else:
                    rule = KIND
                if rule >= 0:
                    return k, i, rule, other
            if len(elements) < 2:
                return k, -1, FEW, -1
    return VALID


@subroutine
def _repeated(i, m, offsets):
    """Return how element i names the same sites as another element, and the tuple; or -1, -1."""
    kind, number, _ = element(i, m, offsets)
    body_of = memory.integers(m[offsets.site_bodyid // 8], memory.UNBOUNDED)
    body = body_of[number] if kind == SITE else number
    for k in range(m[offsets.ntuple // 8]):
        if tuple_starts_with(k, COIL, m, offsets):
            for j in elements_of(k, m, offsets):
                other, same, _ = element(j, m, offsets)
                if j < i and other == kind and same == number:
                    return REPEATED, k
                if kind == SITE and other == BODY and same == body:
                    return CONTAINED, k
    return -1, -1


@subroutine
def drives_checksum(m, d, offsets):
    """Return a positive number of 47 bits that changes with the drives of coils and fields."""
    total, controlled = np.uint64(0), are_controls_good(m, d, offsets)
    for k in range(m[offsets.ntuple // 8]):
        for i in elements_of(k, m, offsets):
            kind, number, _ = element(i, m, offsets)
            if kind == ACTUATOR:
                total = (
                    total ^ float_as_bits(drive(number, 0.0, controlled, m, d, offsets))
                ) * memory.MULTIPLIER
    return np.int64(total >> np.uint64(17))
