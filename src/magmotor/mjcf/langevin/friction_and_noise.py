"""O: friction and noise of a kinematic tree at a fixed position, by the Crank-Nicolson rule.

    (M + h C/2) v' = (M - h C/2) v + sum_k sqrt(2 kT_k c_k h) a_k xi_k,   C = sum_k c_k a_k a_k^T

The damper k acts on the velocity a_k v, and has the temperature kT_k. For any h the rule leaves the
Gaussian law of the velocities invariant, also between several temperatures, and diffusion is
exact where no force acts, as in Gronbech-Jensen and Farago, Mol. Phys. 111, 983 (2013). Each
damper exchanges the energy u (noise - h c u), where u = a_k (v + v')/2, to rounding. The mean heat
from one of several baths whose dampers share velocities has an error of first order in h; their
sum has none.
"""

import math
from typing import Any, NamedTuple

from magmotor.common.arrays import Array
from magmotor.mjcf import memory
from magmotor.mjcf.langevin.free_motion import multiply_inertia
from magmotor.mjcf.langevin.position_forces import (
    constraint_count,
    project_wrenches,
    shift_wrench,
    update_rows,
)
from magmotor.noise import HELD, normal
from magmotor.numerics.deferred import subroutine

BRIDGE = 32 << 32
"""Added to the channel for the number that divides a step's increment into two halves."""


@subroutine
def standard_normal(draw, channel):
    """Return the number of one channel for the part of the step that `draw` names.

    `draw` is (seed, replica, step, factor, level, half), where half is 0 if one part takes the
    whole increment, and 1 or -1 for the first or second of two parts.
    """
    seed, replica, step, factor, level, half = draw
    whole = normal(seed, replica, step, channel, factor, level)
    if half == 0:
        return whole
    if level >= HELD:
        return math.sqrt(0.5) * whole
    return math.sqrt(0.5) * (whole + half * normal(seed, replica, step, channel + BRIDGE, 1, 0))


class Visit(NamedTuple):
    """A visit to all dampers: it adds up the matrix C and the noise, or books their heat."""

    tree: Any
    time: float
    """For which the dampers act, in s."""
    draw: Any
    """The part of the step, see `standard_normal`."""
    velocity: Array
    """The velocities, shape (nv,); to book the heat, their means over the step."""
    matrix: Array
    """C, in the sparse form of the friction."""
    noise: Array
    """sum_k sqrt(2 kT_k c_k h) a_k xi_k, shape (nv,)."""
    exchanged: Array
    """Heat from each bath, and at its end the work of the force."""
    book: bool
    """Whether the heat is booked; then the noise is drawn once more, being a function."""


@subroutine(forceinline=True)
def damp_and_drive(model, data, offsets, tree, dampers, qvel, force, time, draw, room, exchanged):
    """Apply friction, noise and a constant force for a time.

    The position and inertia of `data` must be current. `exchanged` receives the heat from each
    bath, and at its end the work of the force.
    """
    d = memory.words(data, memory.UNBOUNDED)
    n = len(qvel)
    inertia = memory.numbers(d[offsets.M // 8], 1, tree.starts[n])[0]
    matrix, factor, change, mean = room.matrix, room.factor, room.acceleration, room.middle
    matrix[:] = 0.0
    change[:] = 0.0
    if dampers.has_rows or tree.constraints:
        update_rows(model, data, tree)
    _visit(d, offsets, dampers, Visit(tree, time, draw, qvel, matrix, change, exchanged, False),
           room)  # fmt: skip
    _multiply(tree, matrix, mean, qvel)
    for i in range(n):
        change[i] += time * (force[i] - mean[i])
    # The factor has the pattern of C, of which that of M is a part.
    for k in range(len(matrix)):
        factor[k] = 0.5 * time * matrix[k]
    for i in range(n):
        for k in range(tree.starts[i], tree.starts[i + 1]):
            factor[tree.place[i * n + tree.columns[k]]] += inertia[k]
    _solve(tree, factor, change)
    for i in range(n):
        mean[i] = qvel[i] + 0.5 * change[i]
        qvel[i] += change[i]
    work = 0.0
    for i in range(n):
        work += time * force[i] * mean[i]
    exchanged[-1] += work
    if len(exchanged) > 2:
        _visit(d, offsets, dampers, Visit(tree, time, draw, mean, matrix, change, exchanged, True),
               room)  # fmt: skip
    else:  # one bath: what the kinetic energy gained beyond the work, without a second visit
        multiply_inertia(tree, inertia, room.bias, change)
        heat = -work
        for i in range(n):
            heat += mean[i] * room.bias[i]
        exchanged[0] += heat


@subroutine
def _visit(d, offsets, dampers, visit, room):
    """Visit all dampers; each has channels of its own, numbered in this order."""
    tree, row = visit.tree, room.row
    n = len(visit.velocity)
    for i in range(n):
        if dampers.damping[i] > 0.0:
            _add_joint(visit, dampers.damping[i], dampers.kT[i], dampers.baths[i], i)
    channel = n
    for k in range(len(dampers.tendons)):
        _read_tendon(d, offsets, dampers, k, row)
        _add_row(visit, dampers.tendon_damping[k], dampers.tendon_kT[k], dampers.tendon_baths[k],
                 channel + k, row)  # fmt: skip
    channel += len(dampers.tendons)
    for k in range(len(dampers.actuators)):
        _read_actuator(d, offsets, dampers.actuators[k], row)
        _add_row(visit, dampers.actuator_damping[k], dampers.actuator_kT[k],
                 dampers.actuator_baths[k], channel + k, row)  # fmt: skip
    channel += len(dampers.actuators)
    for k in range(len(dampers.rows)):
        _add_row(visit, 1.0, dampers.constraint_kT, 0, channel + k, dampers.rows[k])
    channel += len(dampers.rows)
    if len(dampers.drag) > 0:
        _add_drag(d, offsets, dampers, visit, channel, room)
    channel += 6 * len(dampers.drag)
    if dampers.rate > 0.0 and not visit.book:  # always of one bath
        _add_rate(d, offsets, dampers, visit, channel)
    if tree.constraints:
        channel += n
        count = constraint_count(d.ctypes.data, offsets)
        rows = memory.numbers(d[offsets.efc_J // 8], count, n)
        numbers = memory.numbers(d[offsets.efc_KBIP // 8], count, 4)
        weight = memory.numbers(d[offsets.efc_D // 8], 1, count)[0]
        for k in range(count):  # a constraint's damper is its b over its R
            _add_row(visit, weight[k] * numbers[k, 1], dampers.constraint_kT, 0, channel + k,
                     rows[k])  # fmt: skip


@subroutine(forceinline=True)
def _add_joint(visit, damping, kT, bath, i):
    """Visit the damper of one velocity."""
    strength = math.sqrt(2.0 * kT * damping * visit.time) * standard_normal(visit.draw, i)
    if visit.book:
        rate = visit.velocity[i]
        visit.exchanged[bath] += rate * (strength - visit.time * damping * rate)
    else:
        visit.matrix[visit.tree.place[i * len(visit.velocity) + i]] += damping
        visit.noise[i] += strength


@subroutine
def _add_row(visit, damping, kT, bath, channel, row):
    """Visit the damper of one row (nv,): the force -damping (row v) row, and its noise."""
    velocity, n = visit.velocity, len(visit.velocity)
    strength = math.sqrt(2.0 * kT * damping * visit.time) * standard_normal(visit.draw, channel)
    if visit.book:
        rate = 0.0
        for i in range(n):
            rate += row[i] * velocity[i]
        visit.exchanged[bath] += rate * (strength - visit.time * damping * rate)
        return
    for i in range(n):
        if row[i] != 0.0:
            visit.noise[i] += strength * row[i]
            for j in range(i + 1):
                if row[j] != 0.0:
                    visit.matrix[visit.tree.place[i * n + j]] += damping * row[i] * row[j]


@subroutine(forceinline=True)
def _read_tendon(d, offsets, dampers, k, row):
    """Copy the Jacobian of a tendon to a dense row."""
    values = memory.numbers(d[offsets.ten_J // 8], 1, memory.UNBOUNDED)[0]
    row[:] = 0.0
    first = dampers.tendon_starts[k]
    for k2 in range(first, first + dampers.tendon_counts[k]):
        row[dampers.tendon_columns[k2]] = values[k2]


@subroutine(forceinline=True)
def _read_actuator(d, offsets, output, row):
    """Copy the moment of an actuator's output to a dense row."""
    values = memory.numbers(d[offsets.actuator_moment // 8], 1, memory.UNBOUNDED)[0]
    counts = memory.integers(d[offsets.moment_rownnz // 8], memory.UNBOUNDED)
    starts = memory.integers(d[offsets.moment_rowadr // 8], memory.UNBOUNDED)
    columns = memory.integers(d[offsets.moment_colind // 8], memory.UNBOUNDED)
    row[:] = 0.0
    for k in range(starts[output], starts[output] + counts[output]):
        row[columns[k]] = values[k]


@subroutine
def _add_rate(d, offsets, dampers, visit, channel):
    """Add the friction rate M, and noise L^T sqrt(D) xi of covariance M = L^T D L."""
    tree, n = visit.tree, len(visit.noise)
    inertia = memory.numbers(d[offsets.M // 8], 1, tree.starts[n])[0]
    factor = memory.numbers(d[offsets.qLD // 8], 1, tree.starts[n])[0]
    scale = math.sqrt(2.0 * dampers.constraint_kT * dampers.rate * visit.time)
    for i in range(n):
        last = tree.starts[i + 1] - 1  # the diagonal, which holds D
        strength = scale * math.sqrt(factor[last]) * standard_normal(visit.draw, channel + i)
        visit.noise[i] += strength
        for k in range(tree.starts[i], last):
            visit.noise[tree.columns[k]] += factor[k] * strength
        for k in range(tree.starts[i], last + 1):
            visit.matrix[tree.place[i * n + tree.columns[k]]] += dampers.rate * inertia[k]


@subroutine
def _add_drag(d, offsets, dampers, visit, channel, room):
    """Visit the Stokes drag of all bodies, summed over the tree like an inertia."""
    tree, time = visit.tree, visit.time
    n, bodies = len(visit.velocity), len(tree.parents)
    axes = memory.numbers(d[offsets.cdof // 8], n, 6)
    points = memory.numbers(d[offsets.subtree_com // 8], bodies, 3)
    centers = memory.numbers(d[offsets.xipos // 8], bodies, 3)
    geoms = memory.numbers(d[offsets.geom_xpos // 8], memory.UNBOUNDED, 3)
    wrenches, drag, twist, wrench = room.wrenches, room.drag, room.twist, room.wrench
    wrenches[:] = 0.0
    drag[:] = 0.0
    for k in range(len(dampers.drag)):
        body, geom = dampers.drag_bodies[k], dampers.drag_geoms[k]
        center = geoms[geom] if geom >= 0 else centers[body]
        linear, angular = dampers.drag[k, 0], dampers.drag[k, 1]
        point = points[tree.roots[body]]
        pushes = math.sqrt(2.0 * dampers.drag_kT[k] * linear * time)
        turns = math.sqrt(2.0 * dampers.drag_kT[k] * angular * time)
        for j in range(3):
            wrench[j] = pushes * standard_normal(visit.draw, channel + 6 * k + j)
            wrench[3 + j] = turns * standard_normal(visit.draw, channel + 6 * k + 3 + j)
        if visit.book:
            _twist_at(tree, axes, body, visit.velocity, center, point, twist)
            for j in range(3):
                visit.exchanged[dampers.drag_baths[k]] += twist[3 + j] * (
                    wrench[j] - time * linear * twist[3 + j]
                ) + twist[j] * (wrench[3 + j] - time * angular * twist[j])
        else:
            shift_wrench(wrench, center, point)
            for j in range(6):
                wrenches[body, j] += wrench[j]
            _add_point_drag(drag[body], linear, angular, center, point)
    if not visit.book:
        project_wrenches(d, offsets, tree, wrenches, visit.noise)
        _project_drag(axes, visit, drag, wrench)


@subroutine(forceinline=True)
def _project_drag(axes, visit, drag, wrench):
    """Add the drag of the bodies to C as the composite-rigid-body algorithm adds their inertia."""
    tree, n = visit.tree, len(visit.velocity)
    for body in range(len(tree.parents) - 1, 0, -1):
        parent = tree.parents[body]
        if parent > 0:
            for k in range(10):
                drag[parent, k] += drag[body, k]
    for i in range(n):
        _drag_of(drag[tree.bodies[i]], axes[i], wrench)
        j = i
        while j >= 0:
            total = 0.0
            for k in range(6):
                total += axes[j, k] * wrench[k]
            visit.matrix[tree.place[i * n + j]] += total
            j = tree.ancestors[j]


@subroutine(forceinline=True)
def _twist_at(tree, axes, body, velocity, center, point, twist):
    """Compute the angular velocity of a body and the velocity of one of its points."""
    twist[:] = 0.0
    i = tree.last_dofs[body]
    while i >= 0:
        for k in range(6):
            twist[k] += axes[i, k] * velocity[i]
        i = tree.ancestors[i]
    x, y, z = center[0] - point[0], center[1] - point[1], center[2] - point[2]
    twist[3] += twist[1] * z - twist[2] * y
    twist[4] += twist[2] * x - twist[0] * z
    twist[5] += twist[0] * y - twist[1] * x


@subroutine(forceinline=True)
def _add_point_drag(drag, linear, angular, center, point):
    """Add the drag of a sphere in the form of an inertia: xx yy zz xy xz yz, first moment, mass."""
    x, y, z = center[0] - point[0], center[1] - point[1], center[2] - point[2]
    drag[0] += angular + linear * (y * y + z * z)
    drag[1] += angular + linear * (x * x + z * z)
    drag[2] += angular + linear * (x * x + y * y)
    drag[3] -= linear * x * y
    drag[4] -= linear * x * z
    drag[5] -= linear * y * z
    drag[6] += linear * x
    drag[7] += linear * y
    drag[8] += linear * z
    drag[9] += linear


@subroutine(forceinline=True)
def _drag_of(drag, twist, wrench):
    """Multiply a drag in the form of an inertia by a twist (angular, linear velocity)."""
    p, q, r, u, v, w = twist[0], twist[1], twist[2], twist[3], twist[4], twist[5]
    x, y, z = drag[6], drag[7], drag[8]
    wrench[0] = drag[0] * p + drag[3] * q + drag[4] * r + y * w - z * v
    wrench[1] = drag[3] * p + drag[1] * q + drag[5] * r + z * u - x * w
    wrench[2] = drag[4] * p + drag[5] * q + drag[2] * r + x * v - y * u
    wrench[3] = drag[9] * u + q * z - r * y
    wrench[4] = drag[9] * v + r * x - p * z
    wrench[5] = drag[9] * w + p * y - q * x


@subroutine(forceinline=True)
def _multiply(tree, matrix, result, velocity):
    """Multiply a symmetric matrix in the sparse form of the friction by a vector."""
    result[:] = 0.0
    for i in range(len(velocity)):
        for k in range(tree.friction_starts[i], tree.friction_starts[i + 1]):
            j = tree.friction_columns[k]
            result[i] += matrix[k] * velocity[j]
            if j != i:
                result[j] += matrix[k] * velocity[i]


@subroutine(forceinline=True)
def _solve(tree, factor, x):
    """Solve a positive definite system in place by L^T D L, which keeps the sparsity of trees."""
    n = len(x)
    starts, columns = tree.friction_starts, tree.friction_columns
    for i in range(n - 1, -1, -1):
        first, last = starts[i], starts[i + 1] - 1
        inverse = 1.0 / factor[last]
        for k in range(first, last):
            ratio = factor[k] * inverse
            row = columns[k]
            if tree.nested:
                start = starts[row]
                for other in range(k - first + 1):
                    factor[start + other] -= ratio * factor[first + other]
            else:
                for other in range(first, k + 1):
                    factor[tree.place[row * n + columns[other]]] -= ratio * factor[other]
            x[row] -= ratio * x[i]
        x[i] *= inverse
        factor[last] = inverse
    for i in range(n):
        total = 0.0
        for k in range(starts[i], starts[i + 1] - 1):
            total += factor[k] * x[columns[k]]
        x[i] -= total * factor[starts[i + 1] - 1]
