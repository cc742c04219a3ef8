"""Drives: by how much actuators scale the moments of coils, and applied fields.

The drive u of an actuator is its last activation if it has any (so that MuJoCo's filters give a
coil's rise time), else its control, within `ctrlrange`. As in MuJoCo, a control that is bad even
so, such as NaN, makes all controls 0. If the `prm` s of the actuator in its tuple is not 0, the
core saturates there: u is then replaced by u/sqrt(1 + (u/s)^2).
"""

import math

import numpy as np

from magmotor.mjcf import memory
from magmotor.mjcf.declarations.custom import element
from magmotor.mjcf.declarations.table import coils, fields
from magmotor.numerics import c_types as types
from magmotor.numerics.deferred import External, subroutine
from magmotor.numerics.elementary import float_as_bits

DISABLE_CLAMP, DISABLE_ACTUATION = 1 << 8, 1 << 11
"""mjDSBL_CLAMPCTRL and mjDSBL_ACTUATION."""

LARGEST = 1e10
"""mjMAXVAL, the largest control that is not bad, as NaN is."""

_is_disabled = External("mj_actuatorDisabled", types.int32(types.int64, types.int32))


def bind() -> None:
    """Bind the functions of MuJoCo that this module calls."""
    memory.bind_mujoco("mj_actuatorDisabled")


@subroutine(forceinline=True)
def _drive(actuator, saturation, controlled, m, d, offsets):
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
    elif controlled and _has_control(actuator, m, offsets):
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


@subroutine(forceinline=True)
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


@subroutine(forceinline=True)
def read_drives(drives, table, m, d, offsets):
    """Write the drive of each coil."""
    found, controlled = coils(table), are_controls_good(m, d, offsets)
    for k in range(len(drives)):
        drives[k] = drive_of(found[k], controlled, m, d, offsets)


@subroutine(forceinline=True)
def drive_of(row, controlled, m, d, offsets):
    """Return the drive of a coil or a field, by a row of the table of the model."""
    saturation = element(row.element, m, offsets)[2]
    return _drive(row.actuator, saturation, controlled, m, d, offsets)


@subroutine
def drives_checksum(table, m, d, offsets):
    """Return a positive number of 47 bits that changes with the drives of coils and fields."""
    total, controlled = np.uint64(0), are_controls_good(m, d, offsets)
    driven, applied = coils(table), fields(table)
    for k in range(len(driven)):
        u = _drive(driven[k].actuator, 0.0, controlled, m, d, offsets)
        total = (total ^ float_as_bits(u)) * memory.MULTIPLIER
    for k in range(len(applied)):
        if applied[k].actuator >= 0:
            u = _drive(applied[k].actuator, 0.0, controlled, m, d, offsets)
            total = (total ^ float_as_bits(u)) * memory.MULTIPLIER
    return np.int64(total >> np.uint64(17))


@subroutine(forceinline=True)
def _has_control(actuator, m, offsets):
    """Whether the number of an actuator's first control is one."""
    return memory.integers(m[offsets.actuator_ctrlnum // 8], memory.UNBOUNDED)[actuator] > 0
