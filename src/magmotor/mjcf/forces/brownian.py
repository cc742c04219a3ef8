"""Brownian wrenches on bodies, written into MuJoCo's own memory.

A body's `user` numbers are rows of six, each a wrench w in the world frame, at the center of mass:
force x y z in N sqrt(s), torque x y z in N m sqrt(s). Each row is a channel: a Brownian motion W
of its own drives it, w dW/dt. Its increment is spread evenly over the step, so that the body gets
w xi/sqrt(h) in all stages of a step h. Channels count the rows that are not zero, in the order of
the bodies; MuJoCo pads shorter lists with zeros.

The numbers xi are those of `magmotor.noise`. `mjData.userdata` chooses them, with as many numbers
as the model has: seed, replica, factor, level, first step; missing ones are 0, 0, 1, 0, 0, as is a
factor of 0.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from magmotor.mjcf import memory
from magmotor.noise import COARSEST, FINEST, LARGEST_SEED, BrownianPath, normal

CHOICES = 5
"""Numbers of the user's data that choose the path."""

FACTOR, LEVEL = 2, 3
"""Those of them that are a factor and a level."""

RK4 = 1
"""mjINT_RK4."""


def userdata(path: BrownianPath, first_step: int, replicas: int) -> NDArray[np.float64]:
    """What `mjData.userdata` has to hold in each replica of a run, shape (replicas, 5).

    At time 0 the run takes step number `first_step` of the path.
    """
    chosen = (path.seed, np.arange(replicas), path.factor, path.level, first_step)
    return np.stack(np.broadcast_arrays(*chosen), axis=-1).astype(float)


@njit(forceinline=True)
def clear_driven_bodies(m, d, offsets, applied):
    """Set the wrench of each body with a channel to zero.

    Raises MuJoCo's error when a row is cut short, or the user's data choose no path.
    """
    nuser = m[offsets.nuser_body // 8]
    bodies = m[offsets.nbody // 8]
    rows = memory.numbers(m[offsets.body_user // 8], bodies, nuser)
    whole = nuser - nuser % 6
    driven = False
    for body in range(bodies):
        for start in range(0, whole, 6):
            if memory.any_number(rows, body, start, start + 6):
                applied[body] = 0.0
                driven = True
        for k in range(whole, nuser):
            if rows[body, k] != 0.0:
                starts = memory.integers(m[offsets.name_bodyadr // 8], bodies)
                memory.fatal_wrench(body, m[offsets.names // 8] + starts[body])
    for k in range(min(CHOICES, m[offsets.nuserdata // 8]) if driven else 0):
        value = _given(d, offsets, k)
        if not _chooses(value, k):
            memory.fatal_path(k, value)


@njit(forceinline=True)
def add_brownian_wrenches(model, data, offsets, step, applied):
    """Add to the wrenches of bodies what their channels apply in this step; return how many."""
    m = memory.words(model, memory.UNBOUNDED)
    d = memory.words(data, memory.UNBOUNDED)
    nuser = m[offsets.nuser_body // 8]
    bodies = m[offsets.nbody // 8]
    rows = memory.numbers(m[offsets.body_user // 8], bodies, nuser)
    seed, replica = chosen(d, m, offsets, 0), chosen(d, m, offsets, 1)
    factor, level = max(1, chosen(d, m, offsets, 2)), chosen(d, m, offsets, 3)
    step += chosen(d, m, offsets, 4)
    rate = 1.0 / math.sqrt(memory.numbers(model + offsets.timestep, 1, 1)[0, 0])
    channel = 0
    for body in range(bodies):
        for start in range(0, nuser - 5, 6):
            if memory.any_number(rows, body, start, start + 6):
                force = rate * normal(seed, replica, step, channel, factor, level)
                for k in range(6):
                    applied[body, k] += force * rows[body, start + k]
                channel += 1
    return channel


@njit(forceinline=True)
def step_number(model, data, offsets):
    """Number of the step that begins at the time of `mjData`, or that this is a stage of."""
    timestep = memory.numbers(model + offsets.timestep, 1, 1)[0, 0]
    steps = memory.numbers(data + offsets.time, 1, 1)[0, 0] / timestep
    in_stage = memory.words(data + offsets.pstack, 1)[0] != 0
    if in_stage and memory.integers(model + offsets.integrator, 1)[0] == RK4:
        # n + 1/2 and n + 1 are n, with room for rounding on both sides.
        return math.ceil(steps - 0.25) - 1
    return math.floor(steps + 0.5)


@njit(forceinline=True)
def chosen(d, m, offsets, k):
    """Number k of the user's data as an integer; 0 if there are fewer, or it is none."""
    if k >= m[offsets.nuserdata // 8]:
        return 0
    value = _given(d, offsets, k)
    return int(value) if _chooses(value, k) else 0


@njit(forceinline=True)
def _given(d, offsets, k):
    """Number k of the user's data."""
    return memory.numbers(d[offsets.userdata // 8], 1, memory.UNBOUNDED)[0, k]


@njit
def _chooses(value, k):
    """Whether number k of the user's data may have this value."""
    largest = LARGEST_SEED - 1
    if k == FACTOR:
        largest = COARSEST
    elif k == LEVEL:
        largest = FINEST
    return 0.0 <= value <= largest and value == math.floor(value)
