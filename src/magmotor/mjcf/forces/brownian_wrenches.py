"""Brownian wrenches on bodies, written into MuJoCo's memory.

A body's `user` numbers are rows of six, each a wrench w in the world frame at the center of mass:
force x y z in N sqrt(s), torque x y z in N m sqrt(s). Each row is a channel with an independent
Brownian motion W, which applies w dW/dt. The increment is spread evenly over the step: in all
stages of a step h, the body's wrench is w xi/sqrt(h). The channels are the nonzero rows, numbered
in the order of the bodies; MuJoCo pads shorter lists with zeros.

The standard normal numbers xi come from `magmotor.noise`. `mjData.userdata` selects the path by
seed, replica, factor, level and first step, of which `BrownianPath.view` gives factor and level.
Numbers beyond the model's `nuserdata` default to 0, 0, 1, 0, 0, and a factor of 0 means 1.
"""

import math

import numpy as np
from numpy.typing import NDArray

from magmotor.mjcf import layout, memory
from magmotor.mjcf.late_functions import LateFunction
from magmotor.noise import COARSEST, HELD, LARGEST_SEED, LARGEST_STEP, BrownianPath, normal
from magmotor.numerics import c_types as types
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.deferred import subroutine

_word = types.int64
_ADD = types.int64(_word, _word, _word, _word)

_late = LateFunction("magmotor_brownian_address", _ADD, lambda: _add(layout.current()))
bind, noise_is_ready, add_brownian_wrenches = _late.bind, _late.is_ready, _late.call
"""Add the Brownian wrenches of a step to those of the bodies; return the number of channels.

The arguments are the addresses of mjModel and mjData, the number of the step, and the address of
the wrenches.
"""

PATH_NUMBERS = 5
"""Number of elements of `userdata` that select the path."""

FACTOR, LEVEL = 2, 3
"""Indices of the factor and the level."""

RK4 = 1
"""mjINT_RK4."""


def userdata(path: BrownianPath, first_step: int, replicas: int) -> NDArray[np.float64]:
    """Return `mjData.userdata` for each replica of a run, shape (replicas, 5).

    At time 0, the run takes step `first_step` of the path.
    """
    selection = (path.seed, np.arange(replicas), *path.view, first_step)
    return np.stack(np.broadcast_arrays(*selection), axis=-1).astype(float)


@subroutine(forceinline=True)
def clear_driven_bodies(m, d, offsets, applied):
    """Set the wrench of each body that has a Brownian channel to zero.

    Returns the first invalid element of `userdata`, or -1.
    """
    nuser, bodies = m[offsets.nuser_body // 8], m[offsets.nbody // 8]
    rows = memory.numbers(m[offsets.body_user // 8], bodies, nuser)
    driven = False
    for body in range(bodies):
        if memory.any_number(rows, body, 0, nuser):
            applied[body] = 0.0
            driven = True
    for k in range(min(PATH_NUMBERS, m[offsets.nuserdata // 8]) if driven else 0):
        if not _is_valid(userdata_at(d, offsets, k), k):
            return k
    return -1


@compiled_once(_ADD, error_model="numpy")
def _add(checksum: int, offsets: layout.Layout):
    """Define `add_brownian_wrenches` for one layout of the structs."""

    def add_brownian_wrenches(model, data, step, applied):
        _ = checksum
        wrenches = memory.numbers(applied, memory.UNBOUNDED, 6)
        return _add_wrenches(model, data, offsets, step, wrenches)

    return add_brownian_wrenches


@subroutine
def _add_wrenches(model, data, offsets, step, applied):
    """Add the Brownian wrenches of this step to the bodies; return the number of channels."""
    m = memory.words(model, memory.UNBOUNDED)
    d = memory.words(data, memory.UNBOUNDED)
    nuser = m[offsets.nuser_body // 8]
    bodies = m[offsets.nbody // 8]
    rows = memory.numbers(m[offsets.body_user // 8], bodies, nuser)
    seed, replica = chosen(d, m, offsets, 0), chosen(d, m, offsets, 1)
    factor, level = max(1, chosen(d, m, offsets, 2)), chosen(d, m, offsets, 3)
    step += chosen(d, m, offsets, 4)
    rate = 1.0 / math.sqrt(memory.numbers(model + offsets.timestep, 1, 1)[0, 0])
    channel = np.int64(0)  # a literal 0 would be compiled separately
    for body in range(bodies):
        for start in range(0, nuser - 5, 6):
            if memory.any_number(rows, body, start, start + 6):
                force = rate * normal(seed, replica, step, channel, factor, level)
                for k in range(6):
                    applied[body, k] += force * rows[body, start + k]
                channel += 1
    return channel


@subroutine(forceinline=True)
def step_number(model, data, offsets):
    """Return the number of the step that starts at the time of `mjData`, or contains this stage."""
    timestep = memory.numbers(model + offsets.timestep, 1, 1)[0, 0]
    steps = memory.numbers(data + offsets.time, 1, 1)[0, 0] / timestep
    if in_later_stage(model, data, offsets):
        # Times of n + 1/2 and n + 1 steps belong to step n; 1/4 leaves room for rounding.
        return math.ceil(steps - 0.25) - 1
    return math.floor(steps + 0.5)


@subroutine
def has_step_number(model, data, offsets):
    """Whether the time of `mjData` is finite and less than 2^53 timesteps."""
    timestep = memory.numbers(model + offsets.timestep, 1, 1)[0, 0]
    return abs(memory.numbers(data + offsets.time, 1, 1)[0, 0] / timestep) < LARGEST_STEP


@subroutine(forceinline=True)
def in_later_stage(model, data, offsets):
    """Whether MuJoCo is in one of the later stages of RK4, where it uses the stack of `mjData`."""
    uses_stack = memory.words(data + offsets.pstack, 1)[0] != 0
    return uses_stack and memory.integers(model + offsets.integrator, 1)[0] == RK4


@subroutine(forceinline=True)
def chosen(d, m, offsets, k):
    """Return element k of `userdata` as an integer; 0 if it is missing or invalid."""
    if k >= m[offsets.nuserdata // 8]:
        return 0
    value = userdata_at(d, offsets, k)
    return int(value) if _is_valid(value, k) else 0


@subroutine(forceinline=True)
def userdata_at(d, offsets, k):
    """Return element k of `userdata`."""
    return memory.numbers(d[offsets.userdata // 8], 1, memory.UNBOUNDED)[0, k]


@subroutine
def _is_valid(value, k):
    """Whether element k of `userdata` may have this value."""
    largest = LARGEST_SEED - 1
    if k == FACTOR:
        largest = COARSEST
    elif k == LEVEL:
        largest = HELD + COARSEST
    return 0.0 <= value <= largest and value == math.floor(value)
