"""Whether a run resolves the magnetic forces: no magnet jumps, or sinks deep into another one.

A magnet jumps if magnetism alone would move it from rest by its size, or turn it by 4 rad, within
one timestep, and if the step does change its velocity by at least half as much. The force at the
start of such a step, or at a stage of RK4, says nothing about the rest of the step. A body that
this force hardly accelerates is held by something else, such as joints or strong damping. Contacts
that let magnets sink into each other do not keep their dipoles apart. At time 0, this is an error
unless joints connect the two, since links of robots often overlap.
"""

import ctypes
import math

import numpy as np

from magmotor.mjcf import memory
from magmotor.mjcf.error_numbers import NO_ERROR, OVERLAP
from magmotor.mjcf.forces.dipole_table import BODY, FIRST, LABEL, MOVES
from magmotor.numerics.deferred import subroutine

FASTEST_TURN = 4.0
"""Largest turn in rad from rest within one timestep: (omega h)^2 = 4 across the field."""

MOVED = 0.5
"""Part of a jump that the change of the velocity must give, too."""

SUNK = 0.5
"""Largest depth of a contact over half the least extent of a geom."""

DATA, MODEL, JUMPER, TIME, VELOCITY, HELD, WORDS = 0, 1, 2, 3, 4, 10, 11
"""Words about a step that may be a jump: of which data, model and body (or -1), when, and how fast;
and bits of the bodies that did not jump, since something holds them."""

BITS = 62
"""Bodies share the bits of `HELD` modulo this number."""

ADDRESS_BITS = 8
"""Two data share these words with a chance of 2^-8; then a jump of one of them may be missed."""

_suspects = (ctypes.c_int64 * (WORDS << ADDRESS_BITS))()

_suspects_address = memory.variable("magmotor_suspects_address")


def bind() -> None:
    """Bind the variable of this module to its symbol in compiled code."""
    memory.bind_storage("magmotor_suspects_address", _suspects)


@subroutine
def unresolved_body(table, magnets, m, d, offsets, applied, later):
    """Return -1, a body that jumped in the step before, and -1; or two bodies that have sunk in.

    Where magnets overlap at time 0 that no joints connect, it is an error for `report`. All numbers
    are -1 if nothing jumps or sinks in, and in a `later` stage of RK4. `applied` (nbody, 6) are the
    magnetic wrenches now, which decide whether this step may be a jump.
    """
    timestep = memory.numbers(m.ctypes.data + offsets.timestep, 1, 1)[0, 0]
    time = memory.numbers(d.ctypes.data + offsets.time, 1, 1)[0, 0]
    place = _suspects_address() + 8 * WORDS * memory.spread(d.ctypes.data, ADDRESS_BITS)
    suspect, began = memory.words(place, WORDS), memory.numbers(place, 1, WORDS)[0]
    same = suspect[DATA] == d.ctypes.data and suspect[MODEL] == m.ctypes.data
    pending = same and suspect[JUMPER] >= 0
    if pending and not later:
        # Another thread may write the same words at the same time.
        body = min(max(suspect[JUMPER], 0), m[offsets.nbody // 8] - 1)
        if 0.25 < (time - began[TIME]) / timestep < 1.25:
            shift, turn = _change(body, began[VELOCITY:], m, d, offsets)
            size = _size(body, m, offsets)
            if timestep * shift > MOVED * size or timestep * turn > MOVED * FASTEST_TURN:
                return -1, np.int64(body), -1
            suspect[HELD] |= np.int64(1) << (body % BITS)
        suspect[JUMPER], pending = -1, False
    held = suspect[HELD] if same else np.int64(0)
    jumper, largest, last = -1, 1.0, np.int64(1)
    for k in range(0 if pending else magnets.number):
        if table[MOVES, k] > 0.0:
            body = int(table[BODY, k])
            shift, turn = _motion_from_rest(body, applied[body], timestep, m, d, offsets)
            jump = max(turn / FASTEST_TURN, shift / _size(body, m, offsets))
            is_held = (held >> (body % BITS)) & 1
            # Those that something held before come last.
            if jump > 1.0 and (is_held < last or (is_held == last and jump > largest)):
                jumper, largest, last = body, jump, is_held
    if jumper >= 0:
        suspect[DATA], suspect[MODEL], suspect[HELD] = d.ctypes.data, m.ctypes.data, held
        suspect[JUMPER], began[TIME] = jumper, time
        for k, number in enumerate(_velocity(jumper, m, d, offsets)):
            began[VELOCITY + k] = number
    if later:
        return NO_ERROR
    sunken, other = _sunken_bodies(table, magnets, m, d, offsets)
    root = memory.integers(m[offsets.body_rootid // 8], memory.UNBOUNDED)
    overlap = sunken >= 0 and time == 0.0 and root[sunken] != root[other]
    return OVERLAP if overlap else -1, sunken, other


@subroutine
def _size(body, m, offsets):
    """Return the radius of a body's largest geom, or of the largest one of the body it belongs to.

    Without geoms, it is that of a solid ball with its mass and largest inertia.
    """
    weld = np.int64(memory.integers(m[offsets.body_weldid // 8], memory.UNBOUNDED)[body])
    size = _largest_geom(body, m, offsets)
    size = size if size > 0.0 else _largest_geom(weld, m, offsets)
    size = size if size > 0.0 else _radius_of_inertia(body, m, offsets)
    size = size if size > 0.0 else _radius_of_inertia(weld, m, offsets)
    return size if size > 0.0 else math.inf


@subroutine
def _largest_geom(body, m, offsets):
    """Return the radius of a body's largest geom; 0 without one."""
    geoms = np.int64(memory.integers(m[offsets.body_geomnum // 8], memory.UNBOUNDED)[body])
    first = np.int64(memory.integers(m[offsets.body_geomadr // 8], memory.UNBOUNDED)[body])
    radius = memory.numbers(m[offsets.geom_rbound // 8], 1, memory.UNBOUNDED)[0]
    size = 0.0
    for geom in range(first, first + geoms if geoms > 0 else first):
        size = max(size, radius[geom])
    return size


@subroutine
def _radius_of_inertia(body, m, offsets):
    """Return the radius of a solid ball with a body's mass and largest inertia; 0 without mass."""
    mass = memory.numbers(m[offsets.body_mass // 8], 1, memory.UNBOUNDED)[0, body]
    inertia = memory.numbers(m[offsets.body_inertia // 8], memory.UNBOUNDED, 3)[body]
    largest = max(inertia[0], inertia[1], inertia[2])
    return math.sqrt(2.5 * largest / mass) if mass > 0.0 else 0.0


@subroutine
def _motion_from_rest(body, wrench, timestep, m, d, offsets):
    """Return how far a wrench moves and turns a body within a timestep, at most.

    The inverse inertia is at most the body's own, and at most three times the mean that its joints
    leave, which is exact for hinges and slides.
    """
    mean = memory.numbers(m[offsets.body_invweight0 // 8], memory.UNBOUNDED, 2)[body]
    mass = memory.numbers(m[offsets.body_mass // 8], 1, memory.UNBOUNDED)[0, body]
    inertia = memory.numbers(m[offsets.body_inertia // 8], memory.UNBOUNDED, 3)[body]
    frame = memory.numbers(d[offsets.ximat // 8], memory.UNBOUNDED, 9)[body]
    push = turn = 0.0
    for k in range(3):
        push += wrench[k] * wrench[k]
        torque = frame[k] * wrench[3] + frame[3 + k] * wrench[4] + frame[6 + k] * wrench[5]
        angular = _inverse(inertia[k], mean[1]) * torque
        turn += angular * angular
    shift = _inverse(mass, mean[0]) * math.sqrt(push)
    return timestep * timestep * shift, timestep * timestep * math.sqrt(turn)


@subroutine
def _inverse(inertia, mean):
    """Return the inverse of a body's own inertia, or three times the mean one if that is less."""
    return min(3.0 * mean, 1.0 / inertia) if inertia > 0.0 else 3.0 * mean


@subroutine
def _change(body, before, m, d, offsets):
    """Return by how much the velocity and the angular velocity of a body have changed, in size."""
    turn = shift = 0.0
    for k, number in enumerate(_velocity(body, m, d, offsets)):
        square = (number - before[k]) ** 2
        if k < 3:
            turn += square
        else:
            shift += square
    return math.sqrt(shift), math.sqrt(turn)


@subroutine
def _velocity(body, m, d, offsets):
    """Return the angular velocity of a body, and the velocity of its center of mass."""
    root = memory.integers(m[offsets.body_rootid // 8], memory.UNBOUNDED)[body]
    v = memory.numbers(d[offsets.cvel // 8], memory.UNBOUNDED, 6)[body]
    origin = memory.numbers(d[offsets.subtree_com // 8], memory.UNBOUNDED, 3)[root]
    center = memory.numbers(d[offsets.xipos // 8], memory.UNBOUNDED, 3)[body]
    r = center[0] - origin[0], center[1] - origin[1], center[2] - origin[2]
    x = v[3] + v[1] * r[2] - v[2] * r[1]
    y = v[4] + v[2] * r[0] - v[0] * r[2]
    z = v[5] + v[0] * r[1] - v[1] * r[0]
    return v[0], v[1], v[2], x, y, z


@subroutine
def _sunken_bodies(table, magnets, m, d, offsets):
    """Return the body of a geom that is deep in that of another magnet, and that one; or -1, -1."""
    body_of = memory.integers(m[offsets.geom_bodyid // 8], memory.UNBOUNDED)
    box = memory.numbers(m[offsets.geom_aabb // 8], memory.UNBOUNDED, 6)
    place = d[offsets.contact // 8]
    for _ in range(memory.integers(d.ctypes.data + offsets.ncon, 1)[0]):
        depth = -memory.numbers(place + offsets.contact_dist, 1, 1)[0, 0]
        geom = memory.integers(place + offsets.contact_geom, 2)
        place += offsets.contact_size
        if depth <= 0.0 or max(geom[0], geom[1]) >= m[offsets.ngeom // 8]:  # -1 of a flex
            continue
        for k in range(2):
            half = min(box[geom[k], 3], box[geom[k], 4], box[geom[k], 5])
            if depth > SUNK * half > 0.0:
                one, other = body_of[geom[0]], body_of[geom[1]]
                both = _is_magnet(one, table, magnets, m, offsets)
                if both and _is_magnet(other, table, magnets, m, offsets):
                    return np.int64(body_of[geom[k]]), np.int64(body_of[geom[1 - k]])
    return -1, -1


@subroutine
def _is_magnet(body, table, magnets, m, offsets):
    """Whether a body belongs to a rigid body with dipoles or iron; the world itself does not."""
    weld = memory.integers(m[offsets.body_weldid // 8], memory.UNBOUNDED)[body]
    found = False
    for k in range(magnets.number):
        whole = weld > 0 and table[LABEL, int(table[FIRST, k])] == weld
        found = found or whole or (body > 0 and table[BODY, k] == body)
    return found
