"""Magnetometers: sensors of the plugin at sites."""

import numpy as np

from magmotor.mjcf import memory
from magmotor.mjcf.declarations.custom import SITE
from magmotor.mjcf.declarations.table import MAGNETOMETERS, add_row, magnetometers
from magmotor.mjcf.error_numbers import NO_SITE, set_error
from magmotor.numerics.deferred import subroutine


@subroutine
def read_magnetometers(table, m, offsets):
    """Write a row for each sensor of the plugin; its site is -1 without one, or without data."""
    count, instances = m[offsets.nsensor // 8], m[offsets.nplugin // 8]
    slots = memory.integers(m[offsets.plugin // 8], instances)
    owner = memory.integers(m[offsets.sensor_plugin // 8], count)
    kind = memory.integers(m[offsets.sensor_objtype // 8], count)
    site_of = memory.integers(m[offsets.sensor_objid // 8], count)
    place = memory.integers(m[offsets.sensor_adr // 8], count)
    for sensor in range(count):
        # A C int of -1 is a large number here.
        if owner[sensor] < instances and slots[owner[sensor]] == memory.magnetometer_slot():
            placed = kind[sensor] == SITE and site_of[sensor] < m[offsets.nsite // 8]
            placed = placed and np.int64(place[sensor]) + 3 <= m[offsets.nsensordata // 8]
            added = add_row(table, MAGNETOMETERS)
            row = magnetometers(table)[added]
            row.sensor, row.instance, row.address = sensor, owner[sensor], place[sensor]
            if placed:
                row.site = site_of[sensor]


@subroutine
def check_magnetometers(error, table, instance):
    """Find an error in a magnetometer of an instance that is not at a site, or has no data."""
    for row in magnetometers(table):
        if row.instance == instance and row.site < 0:
            set_error(error, NO_SITE, row.sensor)
            return
