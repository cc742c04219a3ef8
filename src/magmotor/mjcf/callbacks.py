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
from magmotor.mjcf.forces.brownian_wrenches import (
    add_brownian_wrenches,
    clear_driven_bodies,
    in_later_stage,
    invalid_row,
    step_number,
    userdata_at,
)
from magmotor.mjcf.forces.dipole_sites import (
    SWITCHED_OFF,
    count_dipoles,
    invalid_moment,
    why_inert,
)
from magmotor.mjcf.forces.dipole_wrenches import invalid_coupling, set_magnetic_wrenches
from magmotor.mjcf.forces.joint_potentials import add_potential_forces, invalid_potential
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
from magmotor.mjcf.hooks import errors_raised
from magmotor.numerics.numba_cache import compiled_once

FAILED = -1
"""Result of functions that have reported an error."""

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
        _is_valid(m, offsets, kinds)
        return kinds

    return read


def _bind() -> None:
    messages.bind()
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
        acting = apply_forces(model, data, offsets, kinds, applied, generalized)
        if acting >= 0 and kinds & NOISE and m[offsets.nuser_body // 8] > 0:
            acting += add_brownian_wrenches(model, data, offsets, step, applied)
        if acting < 0:
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
        if not _is_valid(m, offsets, kinds):
            return FAILED
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
        if instance != plugin_instance(m, offsets):
            return  # only the first of several instances acts
        kinds = forces_of(m, offsets)
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
        acting = apply_forces(model, data, offsets, kinds, applied, generalized)
        if acting >= 0 and kinds & NOISE and m[offsets.nuser_body // 8] > 0:
            add_brownian_wrenches(model, data, offsets, step, applied)
        if acting < 0:
            _clear(applied)
            _mark_failed(model, data, offsets, stage)
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
    """Compute all forces except noise, and return how many act; `FAILED` after an error.

    `model` and `data` are the addresses of mjModel and mjData, `offsets` is their layout, and
    `kinds` are the bits of `forces_of`. The wrenches overwrite those of the bodies on which any
    act, in `applied` (nbody, 6); forces on joints are added to `generalized` (nv,).
    """
    m = memory.words(model, memory.UNBOUNDED)
    d = memory.words(data, memory.UNBOUNDED)
    if not _is_valid(m, offsets, kinds):
        return FAILED
    acting = 0
    if kinds & NOISE and m[offsets.nuser_body // 8] > 0:
        invalid = clear_driven_bodies(m, d, offsets, applied)
        if invalid >= 0:
            value = userdata_at(d, offsets, invalid)
            messages.fail(messages.PATH, invalid, 0, 0, 0, value)
            return FAILED
    if kinds & DIPOLES:
        acting, first, second = set_magnetic_wrenches(m, d, offsets, kinds, applied)
        if first >= 0:
            names, start = m[offsets.names // 8], m[offsets.name_siteadr // 8]
            start = memory.integers(start, memory.UNBOUNDED)
            one, other = names + start[first], names + start[second]
            messages.fail(messages.COINCIDENCE, first, one, second, other, 0.0)
            return FAILED
    if kinds & POTENTIALS and m[offsets.nuser_jnt // 8] > 0:
        acting += add_potential_forces(m, d, offsets, generalized)
    return acting


@njit
def _is_valid(m, offsets, kinds):
    """Check a model's marks, and the `user` numbers and tuples that act; report the first error."""
    if kinds < 0:
        text, config = marks_of(m, offsets)
        messages.fail(messages.MARK, 0, text, 0, config, 0.0)
        return False
    site = invalid_moment(m, offsets) if kinds & DIPOLES else -1
    _fail_at(site, messages.MOMENT, m, offsets, offsets.name_siteadr)
    pair = invalid_coupling(m, offsets) if kinds & COUPLINGS else -1
    _fail_at(pair, messages.COUPLING, m, offsets, offsets.name_tupleadr)
    body = invalid_row(m, offsets) if kinds & NOISE else -1
    _fail_at(body, messages.WRENCH, m, offsets, offsets.name_bodyadr)
    joint = invalid_potential(m, offsets) if kinds & POTENTIALS else -1
    _fail_at(joint, messages.POTENTIAL, m, offsets, offsets.name_jntadr)
    return site < 0 and pair < 0 and body < 0 and joint < 0


@njit
def _fail_at(number, error, m, offsets, name_starts):
    """Report the error of a named element, unless its number is -1."""
    if number >= 0:
        starts = memory.integers(m[name_starts // 8], memory.UNBOUNDED)
        messages.fail(error, number, m[offsets.names // 8] + starts[number], 0, 0, 0.0)


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
