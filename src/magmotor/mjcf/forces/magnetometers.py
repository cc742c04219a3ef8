"""Magnetometers: the field at a site, along the site's axes, as MuJoCo's sensor data."""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import math

import numpy as np

from magmotor.mjcf import memory
from magmotor.mjcf.errors import UNMEASURED
from magmotor.mjcf.forces.custom import SITE
from magmotor.mjcf.forces.magnetic_state import field_at, read_state
from magmotor.numerics.subroutine import subroutine


@subroutine
def misplaced_sensor(m, offsets, instance):
    """Return the first sensor of an instance that is not at a site or has no data, or -1."""
    count = m[offsets.nsensor // 8]
    owner = memory.integers(m[offsets.sensor_plugin // 8], count)
    kind = memory.integers(m[offsets.sensor_objtype // 8], count)
    site_of = memory.integers(m[offsets.sensor_objid // 8], count)
    place = memory.integers(m[offsets.sensor_adr // 8], count)
    for sensor in range(count):
        is_placed = kind[sensor] == SITE and site_of[sensor] < m[offsets.nsite // 8]
        if owner[sensor] == instance and not (
            is_placed and np.int64(place[sensor]) + 3 <= m[offsets.nsensordata // 8]
        ):
            return sensor
    return -1


@subroutine
def read_magnetometers(m, d, offsets, kinds, instance):
    """Write the data of the sensors of an instance of the plugin; return an error for `report`.

    The data of a sensor whose field is undefined are NaN.
    """
    count = m[offsets.nsensor // 8]
    owner = memory.integers(m[offsets.sensor_plugin // 8], count)
    site_of = memory.integers(m[offsets.sensor_objid // 8], count)
    place = memory.integers(m[offsets.sensor_adr // 8], count)
    result = memory.numbers(d[offsets.sensordata // 8], 1, memory.UNBOUNDED)[0]
    position = memory.numbers(d[offsets.site_xpos // 8], memory.UNBOUNDED, 3)
    frame = memory.numbers(d[offsets.site_xmat // 8], memory.UNBOUNDED, 9)
    memory.mark_stack(d.ctypes.data)
    state = read_state(m, d, offsets, kinds)
    error = state.error
    for sensor in range(count):
        if owner[sensor] == instance:
            site, first = site_of[sensor], place[sensor]
            x, y, z = position[site, 0], position[site, 1], position[site, 2]
            total, why, _ = field_at(state, state.magnets.end, x, y, z, m, offsets)
            b = total[3:6]
            if error[0] < 0 and (why >= 0 or total[6]):
                error = (UNMEASURED, sensor, site)
            for k in range(3):
                r = frame[site]
                along = r[k] * b[0] + r[3 + k] * b[1] + r[6 + k] * b[2]
                result[first + k] = state.scale * along if error[0] < 0 else math.nan
    memory.free_stack(d.ctypes.data)
    return error
