"""The compiled functions that MuJoCo calls: the control callback, and the plugin's two.

All of them apply the same forces. The callback overwrites `xfrc_applied`, where one can see them;
the plugin adds them to `qfrc_passive`, and leaves `xfrc_applied` and the callback to the user.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false, reportGeneralTypeIssues=false

import math
from functools import cache
from typing import Any

import mujoco
from numba import njit, types

from magmotor.mjcf import layout, memory, messages
from magmotor.mjcf.forces import clusters, tiles
from magmotor.mjcf.forces.brownian_wrenches import (
    add_brownian_wrenches,
    clear_driven_bodies,
    has_step_number,
    in_later_stage,
    invalid_row,
    step_number,
    userdata_at,
)
from magmotor.mjcf.forces.couplings import invalid_coupling
from magmotor.mjcf.forces.dipole_sites import (
    SWITCHED_OFF,
    count_dipoles,
    invalid_moment,
    why_inert,
)
from magmotor.mjcf.forces.joint_potentials import add_potential_forces, invalid_potential
from magmotor.mjcf.forces.magnetic_wrenches import set_magnetic_wrenches
from magmotor.mjcf.forces.marks import (
    COUPLINGS,
    DIPOLES,
    NOISE,
    POTENTIALS,
    UNMARKED,
    forces_of,
    marks_of,
    plugin_instance,
)
from magmotor.mjcf.forces.tolerance import invalid_tolerance
from magmotor.mjcf.hooks import errors_raised
from magmotor.numerics.numba_cache import compiled_once

FAILED = -1
"""Result of `init` after an error."""

NO_ERROR = (-1, -1, -1)

IDLE = -2
"""Stands in `plugin_data` for an instance that does not act; for others, it holds the bits."""

DISABLE_SPRING, DISABLE_DAMPER, ENABLE_SLEEP = 1 << 5, 1 << 6, 1 << 4
"""mjDSBL_SPRING, mjDSBL_DAMPER and mjENBL_SLEEP."""

BAD_POSITION = 3
"""mjWARN_BADQPOS."""

_word, _int = types.int64, types.int32
_apply_wrench = types.ExternalFunction(
    "mj_applyFT", types.void(_word, _word, _word, _word, _word, _int, _word)
)
_compute_passive = types.ExternalFunction("mj_passive", types.void(_word, _word))
_warn = types.ExternalFunction("mj_warning", types.void(_word, _int, _int))


@cache
def compiled_callback() -> Any:
    """Return the callback for the running MuJoCo, compiled at most once per process."""
    _bind()
    return _callback(layout.current())


@cache
def compiled_plugin() -> tuple[Any, Any]:
    """Return the plugin's `init` and `compute` for the running MuJoCo."""
    _bind()
    return _init(layout.current()), _compute(layout.current())


def acting_forces(model: mujoco.MjModel) -> int:
    """Return the bits of what acts on a model, as defined in `magmotor.mjcf.forces.marks`.

    Raises
    ------
    ValueError
        A mark, or a `user` number or tuple that acts, is invalid.
    """
    _bind()
    try:
        with errors_raised():
            return _read(layout.current())(model._address)
    except mujoco.FatalError as error:
        raise ValueError(str(error)) from error


@compiled_once(nogil=True, error_model="numpy")
def _read(checksum: int, offsets: layout.Layout):
    """Define a function that checks a model and returns the bits of what acts on it."""

    def read(model):
        _ = checksum
        m = memory.words(model, memory.UNBOUNDED)
        kinds = forces_of(m, offsets)
        report(_first_error(m, offsets, kinds), m, m, offsets)
        return kinds

    return read


def prepare(model: int, data: int, instance: int) -> None:
    """Do what the plugin's `init` does for an mjData, except for errors and notices.

    `model` and `data` are addresses.
    """
    _prepare(layout.current())(model, data, instance)


@compiled_once(error_model="numpy")
def _prepare(checksum: int, offsets: layout.Layout):
    """Define `prepare` for one layout of the structs."""

    def prepare(model, data, instance):
        _ = checksum
        _keep(memory.words(model, memory.UNBOUNDED), data, offsets, instance)

    return prepare


@cache
def _bind() -> None:
    messages.bind()
    tiles.bind()
    clusters.bind()
    memory.bind_mujoco("mj_applyFT", "mj_passive", "mj_warning")


@compiled_once(types.void(_word, _word), error_model="numpy")
def _callback(checksum: int, offsets: layout.Layout):
    """Define the callback for one layout of the structs.

    The offsets are plain numbers in a closure cell. A compiled function in a closure cell would
    give a different key of Numba's cache in every process.
    """

    def callback(model, data):
        _ = checksum
        m = memory.words(model, memory.UNBOUNDED)
        d = memory.words(data, memory.UNBOUNDED)
        if plugin_instance(m, offsets) >= 0:
            return
        kinds = forces_of(m, offsets)
        applied = memory.numbers(d[offsets.xfrc_applied // 8], memory.UNBOUNDED, 6)
        generalized = memory.numbers(d[offsets.qfrc_passive // 8], 1, memory.UNBOUNDED)[0]
        step = step_number(model, data, offsets)
        if kinds & POTENTIALS and m[offsets.nuser_jnt // 8] > 0:
            # Finite differences may keep the passive forces, which then contain ours already.
            _compute_passive(model, data)
        acting, error = apply_forces(model, data, offsets, kinds, applied, generalized)
        if error[0] < 0 and kinds & NOISE and m[offsets.nuser_body // 8] > 0:
            acting += add_brownian_wrenches(model, data, offsets, step, applied)
        if error[0] >= 0:
            _abandon_stack(data, offsets)
            report(error, m, d, offsets)
            _clear(memory.numbers(d[offsets.xfrc_applied // 8], m[offsets.nbody // 8], 6))
            _mark_failed(model, data, offsets, in_later_stage(model, data, offsets))
        elif acting == 0:
            reason = why_inert(m, offsets, kinds)
            _notice_once(reason if reason >= 0 else SWITCHED_OFF, 0)
        elif kinds & UNMARKED:
            _notice_once(messages.ASSUMED, count_dipoles(m, offsets))

    return callback


@compiled_once(types.int32(_word, _word, _int), error_model="numpy")
def _init(checksum: int, offsets: layout.Layout):
    """Define the plugin's `init`, which checks a model while MuJoCo compiles it."""

    def init(model, data, instance):
        _ = checksum
        m = memory.words(model, memory.UNBOUNDED)
        kinds = forces_of(m, offsets)
        error = _first_error(m, offsets, kinds)
        if error[0] >= 0:
            report(error, m, m, offsets)
            return FAILED
        if data != 0:
            _keep(m, data, offsets, instance)
        disabled = memory.integers(model + offsets.disableflags, 1)[0]
        if disabled & DISABLE_SPRING and disabled & DISABLE_DAMPER:
            messages.notice(messages.NO_PASSIVE_FORCES, 0)
        if memory.integers(model + offsets.enableflags, 1)[0] & ENABLE_SLEEP:
            messages.notice(messages.SLEEPING, 0)
        inert = why_inert(m, offsets, kinds)
        if inert >= 0:
            messages.notice(inert, 0)
        elif kinds & UNMARKED:
            messages.notice(messages.ASSUMED, count_dipoles(m, offsets))
        return 0

    return init


@compiled_once(types.void(_word, _word, _int, _int), error_model="numpy")
def _compute(checksum: int, offsets: layout.Layout):
    """Define the plugin's `compute`, which adds the forces to `qfrc_passive`."""

    def compute(model, data, instance, capability):
        _ = checksum
        m = memory.words(model, memory.UNBOUNDED)
        d = memory.words(data, memory.UNBOUNDED)
        kinds = memory.words(d[offsets.plugin_data // 8] + 8 * instance, 1)[0]
        if kinds == IDLE:
            return
        # Both are read before our own use of the stack.
        step, stage = step_number(model, data, offsets), in_later_stage(model, data, offsets)
        bodies = m[offsets.nbody // 8]
        passive = d[offsets.qfrc_passive // 8]
        generalized = memory.numbers(passive, 1, memory.UNBOUNDED)[0]
        stack = d.ctypes.data
        memory.mark_stack(stack)
        room = memory.allocate(stack, 48 * bodies, 8)
        applied = memory.numbers(room, bodies, 6)
        _clear(applied)
        _, error = apply_forces(model, data, offsets, kinds, applied, generalized)
        if error[0] >= 0:
            memory.free_stack(stack)
            _abandon_stack(data, offsets)
            report(error, m, d, offsets)
            _mark_failed(model, data, offsets, stage)
            return
        if kinds & NOISE and m[offsets.nuser_body // 8] > 0:
            add_brownian_wrenches(model, data, offsets, step, applied)
        awake = memory.integers(d[offsets.body_awake // 8], bodies)
        for body in range(1, bodies):
            if awake[body] != memory.ASLEEP and memory.any_number(applied, body, 0, 6):
                wrench = room + 48 * body
                center = d[offsets.xipos // 8] + 24 * body
                _apply_wrench(model, data, wrench, wrench + 24, center, body, passive)
        memory.free_stack(stack)

    return compute


@njit(forceinline=True)
def apply_forces(model, data, offsets, kinds, applied, generalized):
    """Compute all forces except noise; return how many act, and an error for `report`.

    `model` and `data` are the addresses of mjModel and mjData, `offsets` is their layout, and
    `kinds` are the bits of `forces_of`. The wrenches overwrite those of the bodies on which any
    act, in `applied` (nbody, 6); forces on joints are added to `generalized` (nv,).
    """
    m = memory.words(model, memory.UNBOUNDED)
    d = memory.words(data, memory.UNBOUNDED)
    error = _first_error(m, offsets, kinds)
    if error[0] >= 0:
        return 0, error
    acting = 0
    if kinds & NOISE and m[offsets.nuser_body // 8] > 0:
        invalid = clear_driven_bodies(m, d, offsets, applied)
        if invalid >= 0:
            return 0, (messages.PATH, invalid, -1)
        if not has_step_number(model, data, offsets):
            return 0, (messages.TIME, -1, -1)
    if kinds & DIPOLES:
        acting, first, second = set_magnetic_wrenches(m, d, offsets, kinds, applied)
        if first >= 0:
            return 0, (messages.COINCIDENCE, first, second)
    if kinds & POTENTIALS and m[offsets.nuser_jnt // 8] > 0:
        acting += add_potential_forces(m, d, offsets, generalized)
    return acting, NO_ERROR


@njit
def _first_error(m, offsets, kinds):
    """Check a model's mark, and the `user` numbers and tuples that act.

    Returns the number of the error, or -1, and of the element.
    """
    if kinds < 0:
        return messages.MARK, -1, -1
    site = invalid_moment(m, offsets) if kinds & DIPOLES else -1
    if site >= 0:
        return messages.MOMENT, site, -1
    numeric = invalid_tolerance(m, offsets) if kinds & DIPOLES else -1
    if numeric >= 0:
        return messages.TOLERANCE, numeric, -1
    pair = invalid_coupling(m, offsets) if kinds & COUPLINGS else -1
    if pair >= 0:
        return messages.COUPLING, pair, -1
    body = invalid_row(m, offsets) if kinds & NOISE else -1
    if body >= 0:
        return messages.WRENCH, body, -1
    joint = invalid_potential(m, offsets) if kinds & POTENTIALS else -1
    if joint >= 0:
        return messages.POTENTIAL, joint, -1
    return NO_ERROR


@njit
def report(error, m, d, offsets):
    """Raise an error, or record it: its number, and those of up to two elements, or -1."""
    number, first, second = error
    if number == messages.MARK:
        text, config = marks_of(m, offsets)
        messages.fail(number, 0, text, 0, config, 0.0)
    elif number == messages.TIME:
        time = memory.numbers(d.ctypes.data + offsets.time, 1, 1)[0, 0]
        messages.fail(number, -1, 0, 0, 0, time)
    elif number == messages.PATH:
        messages.fail(number, first, 0, 0, 0, userdata_at(d, offsets, first))
    elif number >= 0:
        starts = m[offsets.name_siteadr // 8]
        if number == messages.COUPLING:
            starts = m[offsets.name_tupleadr // 8]
        elif number == messages.TOLERANCE:
            starts = m[offsets.name_numericadr // 8]
        elif number == messages.WRENCH:
            starts = m[offsets.name_bodyadr // 8]
        elif number == messages.POTENTIAL:
            starts = m[offsets.name_jntadr // 8]
        names, starts = m[offsets.names // 8], memory.integers(starts, memory.UNBOUNDED)
        other = names + starts[second] if second >= 0 else 0
        messages.fail(number, first, names + starts[first], second, other, 0.0)


@njit
def _abandon_stack(data, offsets):
    """Empty the stack of `mjData` if an error is going to end all functions that use it.

    Else later steps by RK4 would take all of their stages for later ones.
    """
    if messages.handler_of_thread() != 0:
        memory.words(data + offsets.pstack, 1)[0] = 0
        memory.words(data + offsets.pbase, 1)[0] = 0


@njit
def _keep(m, data, offsets, instance):
    """Write what acts to the word in `plugin_data` that belongs to an instance."""
    first = instance == plugin_instance(m, offsets)
    place = memory.words(data + offsets.plugin_data, 1)[0] + 8 * instance
    memory.words(place, 1)[0] = forces_of(m, offsets) if first else IDLE


@njit
def _clear(applied):
    """Set all wrenches to zero."""
    for body in range(len(applied)):
        for k in range(6):
            applied[body, k] = 0.0


@njit
def _mark_failed(model, data, offsets, later_stage):
    """Make the state that this step produces NaN, where no error could be raised."""
    m = memory.words(model, memory.UNBOUNDED)
    d = memory.words(data, memory.UNBOUNDED)
    if later_stage:
        forces = memory.numbers(d[offsets.qfrc_passive // 8], 1, m[offsets.nv // 8])
        forces[:] = math.nan
    else:
        # MuJoCo would reset the state at a force that is NaN, but has already used the position.
        positions = memory.numbers(d[offsets.qpos // 8], 1, m[offsets.nq // 8])
        positions[:] = math.nan
    _warn(data, BAD_POSITION, 0)  # ends the rollout, whose next step would reset the state


@njit
def _notice_once(notice, number):
    """Report a notice to Python, once per `magnetism` block."""
    if messages.notices_given() & (1 << notice) == 0:
        messages.notice(notice, number)
