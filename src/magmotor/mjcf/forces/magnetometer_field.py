"""Magnetometers: the field at a site, along the site's axes, as MuJoCo's sensor data."""

import math

from magmotor.mjcf import memory
from magmotor.mjcf.declarations.table import magnetometers
from magmotor.mjcf.error_numbers import UNMEASURED
from magmotor.mjcf.forces.magnetic_state import field_at, read_state
from magmotor.numerics.deferred import subroutine


@subroutine
def measure(m, d, offsets, own, kinds, instance):
    """Write the data of the sensors of an instance of the plugin; return an error.

    `own` is the table of the model. The data of a sensor whose field is undefined are NaN.
    """
    result = memory.numbers(d[offsets.sensordata // 8], 1, memory.UNBOUNDED)[0]
    position = memory.numbers(d[offsets.site_xpos // 8], memory.UNBOUNDED, 3)
    frame = memory.numbers(d[offsets.site_xmat // 8], memory.UNBOUNDED, 9)
    memory.mark_stack(d.ctypes.data)
    state = read_state(m, d, offsets, own, kinds)
    error = state.error
    for sensor in magnetometers(own):
        if sensor.instance == instance:
            site = sensor.site
            x, y, z = position[site, 0], position[site, 1], position[site, 2]
            total, why, _ = field_at(state, state.magnets.shaped, x, y, z, m, offsets)
            b = total[3:6]
            if error[0] < 0 and (why >= 0 or total[6]):
                error = (UNMEASURED, sensor.sensor, site)
            for axis in range(3):
                r = frame[site]
                along = r[axis] * b[0] + r[3 + axis] * b[1] + r[6 + axis] * b[2]
                result[sensor.address + axis] = state.scale * along if error[0] < 0 else math.nan
    memory.free_stack(d.ctypes.data)
    return error
