"""A: the motion of a kinematic tree without forces, and the inertia that all parts share.

Heun's rule, of second order, is enough for most steps: it needs the inertia only where O and B need
it, too. Its error, which the change of the kinetic energy shows, would add up where little friction
acts, and a fast draw of the velocities would explode. So a motion is repeated by the classical
Runge-Kutta rule, in pieces, where its kinetic energy would change by more than a small part of the
thermal energy, `Dampers.defect`; the first acceleration mostly tells. After each piece, the
velocities of each tree are scaled to the kinetic energy with which the motion began.
"""

import math

from magmotor.mjcf import memory
from magmotor.mjcf.langevin.position_forces import compute_forces
from magmotor.numerics import c_types as types
from magmotor.numerics.arrays import copy
from magmotor.numerics.deferred import External, subroutine

HEUN, RUNGE_KUTTA = 20.0, 300.0
"""Powers 3 and 5 of h |a| / |v| up to which these rules are tried, over the allowed error."""

COLDEST = 1e-6
"""Least thermal energy that counts, in kinetic energies of the tree."""

MOST_PIECES = 1024
"""Largest number of pieces, with those repeated; beyond that, the state is given up."""

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

(
    update_kinematics,
    _update_axes,
    _update_inertia,
    _factorize_inertia,
    _update_velocities,
    _compute_bias,
    _solve_inertia,
    _integrate_positions,
) = (External(name, signature) for name, signature in FUNCTIONS.items())


@subroutine
def update_position(model, data):
    """Compute the frames, the axes of the joints, and the inertia at the current position."""
    update_kinematics(model, data)
    _update_axes(model, data)
    _update_inertia(model, data)
    _factorize_inertia(model, data)


@subroutine
def solve_inertia(model, data, acceleration, force):
    """Compute the accelerations M^-1 f of forces."""
    _solve_inertia(model, data, acceleration.ctypes.data, force.ctypes.data, 1)


@subroutine
def _compute_acceleration(model, data, force, room):
    """Compute the acceleration by a force and the Coriolis, centrifugal and gyroscopic terms."""
    _update_velocities(model, data)
    _compute_bias(model, data, 0, room.bias.ctypes.data)
    for i in range(len(room.bias)):
        room.bias[i] = force[i] - room.bias[i]
    solve_inertia(model, data, room.acceleration, room.bias)


@subroutine
def move(model, qpos, velocity, time):
    """Advance positions at constant velocities."""
    _integrate_positions(model, qpos.ctypes.data, velocity.ctypes.data, time)


@subroutine(forceinline=True)
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


@subroutine
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


@subroutine(forceinline=True)
def move_freely(model, data, offsets, tree, dampers, qpos, qvel, time, room):
    """Move without forces for a time; return whether the motion is accurate enough.

    The inertia must be that of the position, and is so again afterwards.
    """
    d = memory.words(data, memory.UNBOUNDED)
    inertia = memory.numbers(d[offsets.M // 8], 1, tree.starts[len(qvel)])[0]
    _kinetic_energies(tree, inertia, qvel, room.before)
    left, good, pieces = time, True, 0
    while good and left > 0.0:
        copy(room.qpos, qpos)
        copy(room.qvel, qvel)
        _compute_acceleration(model, data, room.zero, room)
        copy(room.first, room.acceleration)
        by_heun, by_runge_kutta = _expected_errors(tree, dampers, room)
        piece, good = left, False
        if by_heun * piece**6 <= HEUN**2:
            _heun(model, data, qpos, qvel, piece, room)
            good = _conserve_energy(tree, dampers, inertia, qvel, room)
        while by_runge_kutta * piece**10 > RUNGE_KUTTA**2 and piece > time / MOST_PIECES:
            piece *= 0.5
        while not good and pieces < MOST_PIECES:
            copy(qpos[: len(room.qpos)], room.qpos)
            copy(qvel, room.qvel)
            copy(room.acceleration, room.first)
            runge_kutta(model, data, offsets, tree, qpos, qvel, piece, False, True, room)
            good = _conserve_energy(tree, dampers, inertia, qvel, room)
            piece = piece if good else 0.5 * piece
            pieces += 1
        left -= piece
    return good


@subroutine(forceinline=True)
def _expected_errors(tree, dampers, room):
    """Return the largest squares of (|a|/|v|)^3 and (|a|/|v|)^5 of a tree over its allowed error.

    |a| and |v| are in the norm of the inertia; `room.bias` must be M a, as after
    `_compute_acceleration`.
    """
    room.after[:] = 0.0
    for i in range(len(room.bias)):
        room.after[tree.trees[i]] += room.acceleration[i] * room.bias[i]
    by_heun, by_runge_kutta = 0.0, 0.0
    for k in range(len(room.after)):
        turn = room.after[k] / room.before[k]
        error = turn**3 * (room.before[k] / _allowed_defect(dampers, room.before[k], k)) ** 2
        by_heun = max(by_heun, error)
        by_runge_kutta = max(by_runge_kutta, error * turn**2)
    return by_heun, by_runge_kutta


@subroutine(forceinline=True)
def _allowed_defect(dampers, before, k):
    """Return by how much twice the kinetic energy of a tree may change in a piece."""
    thermal = max(dampers.thermal[k], COLDEST * before)
    return dampers.defect * (min(before, thermal) if dampers.thermal[k] > 0.0 else before)


@subroutine(forceinline=True)
def _heun(model, data, qpos, qvel, time, room):
    """Move by the explicit trapezoidal rule; `room.acceleration` must be that of the start."""
    for i in range(len(qvel)):
        room.start[i] = qvel[i] + 0.5 * time * room.acceleration[i]
        qvel[i] += time * room.acceleration[i]
    move(model, qpos, room.start, time)
    update_position(model, data)
    _compute_acceleration(model, data, room.zero, room)
    for i in range(len(qvel)):
        qvel[i] = room.start[i] + 0.5 * time * room.acceleration[i]


@subroutine
def runge_kutta(model, data, offsets, tree, qpos, qvel, time, forced, begun, room):
    """Move by the classical Runge-Kutta rule of fourth order, on rotations by that of Munthe-Kaas.

    Without or, if `forced`, with the forces of the position. What depends on the position must be
    current, or, if the motion has `begun`, `room.acceleration` must be that of the start. It is
    current afterwards.

    References
    ----------
    H. Munthe-Kaas, *Runge-Kutta methods on Lie groups*, BIT Numerical Mathematics 38, 92 (1998).
    """
    copy(room.position, qpos)
    copy(room.start, qvel)
    copy(room.rate, qvel)
    room.velocity_sum[:] = 0.0
    room.acceleration_sum[:] = 0.0
    for stage in range(4):
        if stage > 0:
            part = time if stage == 3 else 0.5 * time
            copy(qpos[: len(room.position)], room.position)
            for i in range(len(qvel)):
                room.change[i] = part * room.rate[i]
                qvel[i] = room.start[i] + part * room.acceleration[i]
            move(model, qpos, room.change, 1.0)
            update_position(model, data)
            copy(room.rate, qvel)
            for first in tree.rotations:
                _correct_rate(room.rate[first : first + 3], room.change[first : first + 3])
        if forced:
            compute_forces(model, data, offsets, tree, room.wrenches, room.force)
        if stage > 0 or not begun:
            _compute_acceleration(model, data, room.force if forced else room.zero, room)
        weight = time / 3.0 if stage == 1 or stage == 2 else time / 6.0
        for i in range(len(qvel)):
            room.velocity_sum[i] += weight * room.rate[i]
            room.acceleration_sum[i] += weight * room.acceleration[i]
    copy(qpos[: len(room.position)], room.position)
    move(model, qpos, room.velocity_sum, 1.0)
    for i in range(len(qvel)):
        qvel[i] = room.start[i] + room.acceleration_sum[i]
    update_position(model, data)


@subroutine(forceinline=True)
def _correct_rate(rate, turn):
    """Replace an angular velocity by the rate of the rotation vector, up to third order."""
    x = turn[1] * rate[2] - turn[2] * rate[1]
    y = turn[2] * rate[0] - turn[0] * rate[2]
    z = turn[0] * rate[1] - turn[1] * rate[0]
    rate[0] += 0.5 * x + (turn[1] * z - turn[2] * y) / 12.0
    rate[1] += 0.5 * y + (turn[2] * x - turn[0] * z) / 12.0
    rate[2] += 0.5 * z + (turn[0] * y - turn[1] * x) / 12.0


@subroutine
def _conserve_energy(tree, dampers, inertia, qvel, room):
    """Scale the velocities to the kinetic energy of each tree; return whether that is little."""
    _kinetic_energies(tree, inertia, qvel, room.after)
    good = True
    for k in range(len(room.after)):
        before, after = room.before[k], room.after[k]
        good = good and abs(after - before) <= _allowed_defect(dampers, before, k)
        room.after[k] = math.sqrt(before / after) if after > 0.0 else 1.0
    for i in range(len(qvel)):
        qvel[i] *= room.after[tree.trees[i]]
    return good
