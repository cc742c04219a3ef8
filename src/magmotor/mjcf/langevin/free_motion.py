"""A: the motion of a kinematic tree without forces, and the inertia that all parts share.

The explicit midpoint rule, of second order, conserves neither the kinetic energy nor, at a fast
draw of the velocities, the state. So the velocities of each tree are scaled to the kinetic energy
with which the motion began, and the motion is repeated in shorter pieces where the scale differs
much from 1. Both leave the order of the rule as it is.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false, reportGeneralTypeIssues=false

import math

from numba import njit, types

from magmotor.numerics.numba_cache import copy

LARGEST_DEFECT = 0.01
"""Largest relative error of a tree's kinetic energy in one piece of the motion."""

MOST_PIECES = 256
"""Largest number of pieces; if these are not enough, the state is given up."""

_word, _int, _number = types.int64, types.int32, types.float64
FUNCTIONS = {
    "mj_kinematics": types.void(_word, _word),
    "mj_comPos": types.void(_word, _word),
    "mj_makeM": types.void(_word, _word),
    "mj_factorM": types.void(_word, _word),
    "mj_comVel": types.void(_word, _word),
    "mj_rne": types.void(_word, _word, _int, _word),
    "mj_solveM": types.void(_word, _word, _word, _word, _int),
    "mj_integratePos": types.void(_word, _word, _word, _number),
}
"""Functions of MuJoCo that this module calls."""

_update_kinematics = types.ExternalFunction("mj_kinematics", FUNCTIONS["mj_kinematics"])
_update_axes = types.ExternalFunction("mj_comPos", FUNCTIONS["mj_comPos"])
_update_inertia = types.ExternalFunction("mj_makeM", FUNCTIONS["mj_makeM"])
_factorize_inertia = types.ExternalFunction("mj_factorM", FUNCTIONS["mj_factorM"])
_update_velocities = types.ExternalFunction("mj_comVel", FUNCTIONS["mj_comVel"])
_compute_bias = types.ExternalFunction("mj_rne", FUNCTIONS["mj_rne"])
_solve_inertia = types.ExternalFunction("mj_solveM", FUNCTIONS["mj_solveM"])
_integrate_positions = types.ExternalFunction("mj_integratePos", FUNCTIONS["mj_integratePos"])


@njit
def update_position(model, data):
    """Compute the frames, the axes of the joints, and the inertia at the current position."""
    _update_kinematics(model, data)
    _update_axes(model, data)
    _update_inertia(model, data)
    _factorize_inertia(model, data)


@njit
def solve_inertia(model, data, acceleration, force):
    """Compute the accelerations M^-1 f of forces."""
    _solve_inertia(model, data, acceleration.ctypes.data, force.ctypes.data, 1)


@njit
def bias_acceleration(model, data, bias, acceleration):
    """Compute M^-1 c, where c are the Coriolis, centrifugal and gyroscopic terms."""
    _update_velocities(model, data)
    _compute_bias(model, data, 0, bias.ctypes.data)
    solve_inertia(model, data, acceleration, bias)


@njit
def move(model, qpos, velocity, time):
    """Advance positions at constant velocities."""
    _integrate_positions(model, qpos.ctypes.data, velocity.ctypes.data, time)


@njit(forceinline=True)
def multiply_inertia(tree, inertia, result, velocity):
    """Compute M v, where `inertia` has the elements of M in MuJoCo's sparse form."""
    for i in range(len(velocity)):
        result[i] = 0.0
    for i in range(len(velocity)):
        for k in range(tree.starts[i], tree.starts[i + 1]):
            j = tree.columns[k]
            result[i] += inertia[k] * velocity[j]
            if j != i:
                result[j] += inertia[k] * velocity[i]


@njit(forceinline=True)
def _kinetic_energies(tree, inertia, velocity, energies):
    """Compute twice the kinetic energy of each tree."""
    for k in range(len(energies)):
        energies[k] = 0.0
    for i in range(len(velocity)):
        last = tree.starts[i + 1] - 1
        total = 0.5 * inertia[last] * velocity[i]
        for k in range(tree.starts[i], last):
            total += inertia[k] * velocity[tree.columns[k]]
        energies[tree.trees[i]] += 2.0 * velocity[i] * total


@njit(error_model="numpy")
def move_freely(model, bare, data, tree, inertia, qpos, qvel, time, room):
    """Move without forces for a time; return whether the motion is accurate enough.

    The inertia must be that of the position, and is so again afterwards. `bare` is the model
    without geoms and sites, whose frames on the way are of no use.
    """
    copy(room.qpos, qpos)
    copy(room.qvel, qvel)
    _kinetic_energies(tree, inertia, qvel, room.before)
    pieces = 1
    while True:
        good = True
        for _ in range(pieces):
            good = good and _move_a_piece(
                model, bare, data, tree, inertia, qpos, qvel, time / pieces, room
            )
        if good or pieces == MOST_PIECES:
            return good
        pieces *= 2
        copy(qpos[: len(room.qpos)], room.qpos)
        copy(qvel, room.qvel)
        update_position(model, data)


@njit(forceinline=True)
def _move_a_piece(model, bare, data, tree, inertia, qpos, qvel, time, room):
    """Move by one step of the midpoint rule; return whether its defect is small."""
    start, middle = room.start, room.middle
    copy(start, qvel)
    bias_acceleration(model, data, room.bias, room.acceleration)
    copy(room.position, qpos)
    move(model, qpos, qvel, 0.5 * time)
    for i in range(len(qvel)):
        qvel[i] -= 0.5 * time * room.acceleration[i]
    update_position(bare, data)
    bias_acceleration(model, data, room.bias, room.acceleration)
    copy(middle, qvel)
    copy(qpos[: len(room.position)], room.position)
    move(model, qpos, middle, time)
    for i in range(len(qvel)):
        qvel[i] = start[i] - time * room.acceleration[i]
    update_position(model, data)
    return _conserve_energy(tree, inertia, qvel, room)


@njit(forceinline=True)
def _conserve_energy(tree, inertia, qvel, room):
    """Scale the velocities to the kinetic energy of each tree; return whether that is little."""
    _kinetic_energies(tree, inertia, qvel, room.after)
    good = True
    for k in range(len(room.after)):
        before, after = room.before[k], room.after[k]
        defect = abs(after - before)
        good = good and defect <= LARGEST_DEFECT * before
        room.after[k] = math.sqrt(before / after) if after > 0.0 else 1.0
    for i in range(len(qvel)):
        qvel[i] *= room.after[tree.trees[i]]
    return good
