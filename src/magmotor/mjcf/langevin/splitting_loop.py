"""The compiled loop of any splitting; see `magmotor.mjcf.langevin.langevin`.

It is compiled for kinematic trees, and for lone bodies, without what only trees need.
"""

from functools import cache

from magmotor.mjcf import layout, memory
from magmotor.mjcf.forces.brownian_wrenches import chosen
from magmotor.mjcf.langevin import free_motion, position_forces
from magmotor.mjcf.langevin.free_motion import (
    move_freely,
    multiply_inertia,
    runge_kutta,
    solve_inertia,
    update_position,
)
from magmotor.mjcf.langevin.friction_and_noise import damp_and_drive
from magmotor.mjcf.langevin.lone_motion import (
    compute_lone_forces,
    damp_and_drive_lone_bodies,
    kick_lone_bodies,
    move_lone_bodies,
)
from magmotor.mjcf.langevin.loop_calls import LOST
from magmotor.mjcf.langevin.position_forces import (
    add_own_forces,
    compute_forces,
    constraint_count,
)
from magmotor.mjcf.wrench_owners import note_others
from magmotor.numerics import c_types as types
from magmotor.numerics.arrays import copy
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.deferred import External, subroutine

A, B, O, K, R, S = range(6)
"""Codes of the parts; see `magmotor.numerics.splittings`."""

STEPS_BETWEEN_CHECKS = 64
"""Steps between two checks of the stiffness of constraints, besides those where some are new."""

POWERS = 20
"""Powers of a matrix that show its largest eigenvalue, to a few percent."""

_word = types.int64
_FUNCTIONS = {
    **free_motion.FUNCTIONS,
    "mj_step": types.void(_word, _word),
}
_take_step = External("mj_step", _FUNCTIONS["mj_step"])


@cache
def compiled(*, lone: bool):
    """Return the loop for lone bodies or for trees, compiled at most once per process."""
    memory.bind_mujoco(*_FUNCTIONS)
    position_forces.bind()
    return _advance(layout.current(), lone)


@compiled_once(nogil=True, error_model="numpy")
def _advance(checksum: int, offsets: layout.Layout, lone: bool):
    """Define the loop for one layout of the structs, and for lone bodies or trees.

    Numba removes the branches of the other ones before it compiles.
    """
    trees = not lone

    def advance(model, data, tree, dampers, parts, path, replica, first, count, every, room, out):
        """Take steps, and return how many were taken: fewer than `count` if one failed.

        Parameters
        ----------
        model, data : int
            Addresses of the mjModel and the mjData.
        tree : Tree or LoneBodies
        dampers : Dampers or tuple ()
        parts : ndarray, shape (parts, 4)
            Code of each part, its time in s, for kicks whether they must compute the force, and
            for O and K, 0, 1 or -1 for the whole increment of the noise or one of its halves.
        path : ndarray, shape (3,)
            Seed, factor and level of the Brownian path. For lone bodies, `userdata` has them
            instead, and what is added to the next two.
        replica : int
            Number of the replica.
        first, count : int
            Number of the first step on the Brownian path, and number of steps.
        every : int
            Steps between two records.
        room : Room or LoneRoom
            Scratch memory; its `exchanged` contains the sums before these steps.
        out : ndarray, shape (records, nq + nv + baths + 1) or (count, 2 nq + 3 nv)
            Receives `qpos`, `qvel`, the heat from each bath and the work of all forces, after every
            `every` steps, if it has rows; rows of nq + nv end before the heat. In the wide form,
            for lone bodies only, it receives `qpos` and `qvel` after each step, `qpos` at part O,
            and `qvel` before and after it.
        """
        _ = checksum
        tree, dampers, parts, path, room, out = memory.borrowed(
            (tree, dampers, parts, path, room, out)
        )
        m = memory.words(model, memory.UNBOUNDED)
        d = memory.words(data, memory.UNBOUNDED)
        n, nq = len(tree.bodies), int(m[offsets.nq // 8])
        # Steps by MuJoCo leave wrenches of magnets and noise in `xfrc_applied`, which are not ours.
        note_others(m, d, offsets)
        qvel = memory.numbers(d[offsets.qvel // 8], 1, n)[0]
        qpos = memory.numbers(d[offsets.qpos // 8], 1, nq)[0]
        time = memory.numbers(data + offsets.time, 1, 1)[0]
        timestep = memory.numbers(model + offsets.timestep, 1, 1)[0, 0]
        seed, factor, level = path[0], path[1], path[2]
        wide = lone and out.shape[1] > nq + n + len(room.exchanged)
        stale, active = True, 0
        if lone:
            seed, replica = chosen(d, m, offsets, 0), replica + chosen(d, m, offsets, 1)
            factor, level = max(1, chosen(d, m, offsets, 2)), chosen(d, m, offsets, 3)
            first += chosen(d, m, offsets, 4)
        else:
            room.force[:] = 0.0
            update_position(model, data)
            if parts[0, 2] >= 0.0:
                compute_forces(model, data, offsets, tree, room.wrenches, room.force)
            active = constraint_count(data, offsets)
        for done in range(count):
            good, start = True, time[0]
            for part in range(len(parts)):
                code, span, half = int(parts[part, 0]), parts[part, 1], int(parts[part, 3])
                draw = seed, replica, first + done, factor, level, half
                if lone:
                    if code == A:
                        move_lone_bodies(model, qpos, qvel, tree, span)
                    elif code == B:
                        if stale or parts[part, 2] > 0.0:
                            compute_lone_forces(model, data, offsets, tree, room, not stale)
                            stale = False
                        kick_lone_bodies(qvel, tree, span, room.force, room.exchanged)
                    else:
                        if wide:
                            copy(out[done, nq + n : 2 * nq + n], qpos)
                            copy(out[done, 2 * nq + n : 2 * (nq + n)], qvel)
                        damp_and_drive_lone_bodies(qpos, qvel, tree, draw, room)
                        if wide:
                            copy(out[done, 2 * (nq + n) :], qvel)
                    continue
                if code == A:
                    good = good and move_freely(
                        model, data, offsets, tree, dampers, qpos, qvel, span, room
                    )
                elif code == R:
                    _flow(model, data, offsets, tree, qpos, qvel, span, room)
                elif code == S:
                    _mujoco_step(model, data, offsets, tree, qvel, room)
                elif parts[part, 2] > 0.0:
                    compute_forces(model, data, offsets, tree, room.wrenches, room.force)
                    stale = True
                if code == B:
                    if stale:
                        solve_inertia(model, data, room.kick, room.force)
                        stale = False
                    _kick(qvel, span, room)
                elif code in (O, K):
                    force = room.force if code == K else room.zero
                    damp_and_drive(model, data, offsets, tree, dampers, qvel, force, span, draw,
                                   room, room.exchanged)  # fmt: skip
            time[0] = start + timestep
            if trees:
                before, active = active, constraint_count(data, offsets)
                if tree.constraints and (
                    active > before or (first + done) % STEPS_BETWEEN_CHECKS == 0
                ):
                    good = good and not _too_stiff(model, data, offsets, tree, qvel, timestep, room)
            for i in range(n):
                good = good and abs(qvel[i]) < LOST
            if not good:
                return done
            if len(out) > 0 and (done + 1) % every == 0:
                record = out[(done + 1) // every - 1]
                copy(record[:nq], qpos)
                copy(record[nq : nq + n], qvel)
                if not wide:
                    copy(record[nq + n :], room.exchanged)
        return count

    return advance


@subroutine(forceinline=True)
def _kick(qvel, time, room):
    """B: apply the force for a time, and book its work."""
    work = 0.0
    for i in range(len(qvel)):
        change = time * room.kick[i]
        work += time * room.force[i] * (qvel[i] + 0.5 * change)
        qvel[i] += change
    room.exchanged[-1] += work


@subroutine
def _too_stiff(model, data, offsets, tree, qvel, timestep, room):
    """Return whether active constraints oscillate too fast for the timestep.

    The powers of h^2 M^-1 J^T k J, which begin with the current velocity, show the fastest motion.
    """
    d = memory.words(data, memory.UNBOUNDED)
    n, count = len(qvel), constraint_count(data, offsets)
    inertia = memory.numbers(d[offsets.M // 8], 1, tree.starts[n])[0]
    rows = memory.numbers(d[offsets.efc_J // 8], count, n)
    numbers = memory.numbers(d[offsets.efc_KBIP // 8], count, 4)
    weight = memory.numbers(d[offsets.efc_D // 8], 1, count)[0]
    motion, force = room.velocity_sum, room.acceleration_sum
    copy(motion, qvel)
    for _ in range(POWERS if count > 0 else 0):
        mass = 2.0 * _kinetic_energy(tree, inertia, motion, room)
        stiffness = 0.0
        force[:] = 0.0
        for row in range(count):
            rate = 0.0
            for i in range(n):
                rate += rows[row, i] * motion[i]
            push = timestep**2 * weight[row] * numbers[row, 0] * numbers[row, 2] * rate
            stiffness += push * rate
            for i in range(n):
                force[i] += push * rows[row, i]
        if not stiffness <= 4.0 * mass:
            return True
        solve_inertia(model, data, motion, force)
    return False


@subroutine
def _flow(model, data, offsets, tree, qpos, qvel, time, room):
    """R: move with all forces by the Runge-Kutta rule of fourth order, and book the energy."""
    d = memory.words(data, memory.UNBOUNDED)
    inertia = memory.numbers(d[offsets.M // 8], 1, tree.starts[len(qvel)])[0]
    energy = _kinetic_energy(tree, inertia, qvel, room)
    runge_kutta(model, data, offsets, tree, qpos, qvel, time, True, False, room)
    room.exchanged[-1] += _kinetic_energy(tree, inertia, qvel, room) - energy


@subroutine
def _mujoco_step(model, data, offsets, tree, qvel, room):
    """S: take a step of MuJoCo, which contains no friction, and book its gain of energy."""
    d = memory.words(data, memory.UNBOUNDED)
    inertia = memory.numbers(d[offsets.M // 8], 1, tree.starts[len(qvel)])[0]
    applied = memory.numbers(d[offsets.qfrc_applied // 8], 1, len(qvel))[0]
    energy = _kinetic_energy(tree, inertia, qvel, room)
    copy(room.applied, applied)
    add_own_forces(model, data, offsets, tree, room.wrenches, applied)
    _take_step(model, data)
    copy(applied, room.applied)
    update_position(model, data)
    room.exchanged[-1] += _kinetic_energy(tree, inertia, qvel, room) - energy


@subroutine(forceinline=True)
def _kinetic_energy(tree, inertia, qvel, room):
    multiply_inertia(tree, inertia, room.bias, qvel)
    total = 0.0
    for i in range(len(qvel)):
        total += 0.5 * qvel[i] * room.bias[i]
    return total
