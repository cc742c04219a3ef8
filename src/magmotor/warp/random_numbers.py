"""The random numbers of `magmotor.noise`: the same integers, and the same normal numbers to 1e-15.

All of them are computed in double precision, as there.
"""

import math

import warp as wp

from magmotor.noise import _PARITY as THREEFRY_PARITY
from magmotor.noise import HELD as LEVEL_OF_HELD

wp.set_module_options({"enable_backward": False})

HELD = wp.constant(wp.int64(LEVEL_OF_HELD))
PARITY = wp.constant(wp.uint64(int(THREEFRY_PARITY)))
UNIT = wp.constant(wp.float64(2.0**-52))
TURN = wp.constant(wp.float64(2.0 * math.pi))
SQRT_HALF = wp.constant(wp.float64(math.sqrt(0.5)))


@wp.func
def _mix(x: wp.uint64, y: wp.uint64, rotation: int):
    x += y
    y = (y << wp.uint64(rotation)) | (y >> wp.uint64(64 - rotation))
    return x, y ^ x


@wp.func
def threefry(x: wp.uint64, y: wp.uint64, key0: wp.uint64, key1: wp.uint64):
    """Encrypt the counter (x, y) with 13 rounds of Threefry-2x64."""
    key2 = PARITY ^ key0 ^ key1
    x, y = _mix(x + key0, y + key1, 16)
    x, y = _mix(x, y, 42)
    x, y = _mix(x, y, 12)
    x, y = _mix(x, y, 31)
    x, y = _mix(x + key1, y + key2 + wp.uint64(1), 16)
    x, y = _mix(x, y, 32)
    x, y = _mix(x, y, 24)
    x, y = _mix(x, y, 21)
    x, y = _mix(x + key2, y + key0 + wp.uint64(2), 16)
    x, y = _mix(x, y, 42)
    x, y = _mix(x, y, 12)
    x, y = _mix(x, y, 31)
    x, y = _mix(x + key0, y + key1 + wp.uint64(3), 16)
    return x, y


@wp.func
def _normal_of_step(seed: wp.int64, replica: wp.int64, step: wp.int64, channel: wp.int64):
    """Return the normal number of a step of a path's own; two steps share a block."""
    x, y = threefry(
        wp.uint64(step >> wp.int64(1)), wp.uint64(channel), wp.uint64(seed), wp.uint64(replica)
    )
    uniform = wp.float64(1.0) - wp.float64(x >> wp.uint64(12)) * UNIT
    radius = wp.sqrt(wp.float64(-2.0) * wp.log(uniform))
    half = wp.float64(0.5)
    angle = half * (wp.float64(y >> wp.uint64(12)) * UNIT - half)
    # The last bit turns the angle's half circle into a whole one.
    value = radius * wp.cos(TURN * angle)
    if (y & wp.uint64(1)) == wp.uint64(1):
        value = -value
    if (step & wp.int64(1)) == wp.int64(1):
        value = radius * wp.sin(TURN * angle)
    return value


@wp.func
def normal(
    seed: wp.int64,
    replica: wp.int64,
    step: wp.int64,
    channel: wp.int64,
    factor: wp.int64,
    level: wp.int64,
):
    """Return the normal number of a step of a coarsened, refined or held path."""
    root = wp.sqrt(wp.float64(factor))
    value = wp.float64(0.0)
    if level == wp.int64(0):
        for i in range(int(factor)):
            value += _normal_of_step(seed, replica, step * factor + wp.int64(i), channel)
        return value / root
    if level >= HELD:
        sample = step // factor
        window = level - HELD
        value = _normal_of_step(seed, replica, sample + window, channel)
        if window > wp.int64(0):
            value = SQRT_HALF * (value - _normal_of_step(seed, replica, sample, channel))
        return value / root
    # In units of the root of its length, each half is (parent +- bridge)/sqrt 2.
    value = _normal_of_step(seed, replica, step >> level, channel)
    for i in range(1, int(level) + 1):
        k = wp.int64(i)
        parent = step >> (level - k + wp.int64(1))
        bridge = _normal_of_step(seed, replica, parent, channel + (k << wp.int64(32)))
        if ((step >> (level - k)) & wp.int64(1)) == wp.int64(1):
            bridge = -bridge
        value = SQRT_HALF * (value + bridge)
    return value
