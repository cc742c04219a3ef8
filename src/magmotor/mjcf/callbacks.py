"""The compiled functions that MuJoCo calls: the control callback, and those of the plugins.

All of them apply the same forces. The callback overwrites `xfrc_applied`, where one can see them;
the plugin adds them to `qfrc_passive`, and leaves `xfrc_applied` and the callback to the user.

The callback calls the user's first.
"""

import ctypes
import math
from functools import cache
from typing import Any

import mujoco

from magmotor.mjcf import binding, error_numbers, error_raising, layout, memory, notice_sentences
from magmotor.mjcf.declarations.hysteresis import PER_SITE, numbers_in_state, state_of
from magmotor.mjcf.declarations.magnetometers import check_magnetometers
from magmotor.mjcf.declarations.marks import (
    COILS,
    FIELDS,
    NOISE,
    POTENTIALS,
    UNMARKED,
    UNREADABLE,
    WRONG,
)
from magmotor.mjcf.declarations.reader import acting_kinds, find_error, table_of
from magmotor.mjcf.declarations.table import header, is_read
from magmotor.mjcf.declarations.user_numbers import count_dipoles
from magmotor.mjcf.declarations.why_inert import MEASURED, SWITCHED_OFF, why_inert
from magmotor.mjcf.error_reports import report, warn_of_misnamed, warn_of_motion
from magmotor.mjcf.forces.all_forces import apply_forces
from magmotor.mjcf.forces.brownian_wrenches import (
    add_brownian_wrenches,
    in_later_stage,
    noise_is_ready,
    step_number,
)
from magmotor.mjcf.forces.drives import drives_checksum
from magmotor.mjcf.forces.magnetometer_field import measure
from magmotor.mjcf.hooks import errors_raised
from magmotor.mjcf.wrench_owners import note_others, note_ours
from magmotor.numerics import c_types as types
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.deferred import External, subroutine
from magmotor_plugin import slots

FAILED = -1
"""Result of `init` after an error."""

IDLE, ACTING, SHIFT = 1 << 15, (1 << 16) - 1, 16
"""Parts of the word in `plugin_data`: a bit for an instance that does not act, the bits of what
acts, and, above them, a checksum of the drives with which the passive forces were computed. All
bits are set if what should act is invalid."""

ACTUATOR_STAGE = 1
"""mjPLUGIN_ACTUATOR."""

DISABLE_SPRING, DISABLE_DAMPER, ENABLE_SLEEP = 1 << 5, 1 << 6, 1 << 4
"""mjDSBL_SPRING, mjDSBL_DAMPER and mjENBL_SLEEP."""

BAD_POSITION = 3
"""mjWARN_BADQPOS."""

_word, _int = types.int64, types.int32
_apply_wrench = External("mj_applyFT", types.void(_word, _word, _word, _word, _word, _int, _word))
_compute_passive = External("mj_passive", types.void(_word, _word))
_warn = External("mj_warning", types.void(_word, _int, _int))
_has_users_callback = memory.variable("magmotor_users_callback")
_call_users_callback = memory.function_at("magmotor_users_callback", types.int64(_word, _word))

users_callback = ctypes.c_int64(0)
"""Address of the control callback that ours has replaced, and calls; 0 without one."""


@cache
def compiled_callback() -> Any:
    """Return the callback for the running MuJoCo, compiled at most once per process."""
    _bind()
    return _callback(layout.current())


@cache
def compiled_plugin(name: bytes) -> dict[str, Any]:
    """Return the functions of a plugin for the running MuJoCo, by their names in `mjpPlugin`."""
    _bind()
    current = layout.current()
    if name == slots.MAGNETOMETER:
        return {"compute": _measure(current), "init": _check_magnetometers(current)}
    functions = {
        "advance": _advance, "copy": _copy, "compute": _compute, "init": _init, "nstate": _nstate,
        "reset": _reset,
    }  # fmt: skip
    return {member: function(current) for member, function in functions.items()}


def acting_forces(model: mujoco.MjModel) -> int:
    """Return the bits of what acts on a model, as defined in `magmotor.mjcf.declarations.marks`.

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
        raise error_raising.declaration_error(error) from error


@compiled_once(nogil=True, error_model="numpy")
def _read(checksum: int, offsets: layout.Layout):
    """Define a function that checks a model and returns the bits of what acts on it."""

    def read(model):
        _ = checksum
        table, place = table_of(model, True), memory.error_on_stack()
        kinds = acting_kinds(table, memory.words(model, memory.UNBOUNDED), offsets)
        find_error(model, table, kinds, error_numbers.THOROUGH, place)
        report(memory.words(place, error_numbers.WORDS), model, model)
        return kinds

    return read


def prepare(model: int, data: int, instance: int) -> None:
    """Do what the plugin's `init` does for an mjData, except for notices; `reset` raises errors.

    `model` and `data` are addresses.
    """
    _prepare(layout.current())(model, data, instance)


@compiled_once(error_model="numpy")
def _prepare(checksum: int, offsets: layout.Layout):
    """Define `prepare` for one layout of the structs."""

    def prepare(model, data, instance):
        _ = checksum
        m, table = memory.words(model, memory.UNBOUNDED), table_of(model, True)
        kinds, place = acting_kinds(table, m, offsets), memory.error_on_stack()
        _keep(table, kinds, data, offsets, instance)
        find_error(model, table, kinds, error_numbers.THOROUGH, place)
        if memory.words(place, error_numbers.WORDS)[0] >= 0:
            memory.words(_plugin_data(data, offsets, instance), 1)[0] = WRONG

    return prepare


@cache
def _bind() -> None:
    memory.bind_mujoco("mj_applyFT", "mj_passive", "mj_warning")
    memory.bind_variable("magmotor_users_callback", users_callback)
    binding.bind(lambda: _callback(layout.current()))


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
        if _has_users_callback() != 0:
            _call_users_callback((model, data))
        table = table_of(model, _is_at_start(data, offsets))
        if header(table).instance >= 0:
            return
        kinds = acting_kinds(table, m, offsets)
        place = memory.error_on_stack()
        error, wrenches = memory.words(place, error_numbers.WORDS), d[offsets.xfrc_applied // 8]
        step, stage = step_number(model, data, offsets), in_later_stage(model, data, offsets)
        if kinds & POTENTIALS and m[offsets.nuser_jnt // 8] > 0:
            # Finite differences may keep the passive forces, which then contain ours already.
            _compute_passive(model, data)
        generalized = d[offsets.qfrc_passive // 8]
        note_others(m, d, offsets)
        acting = apply_forces(model, data, table, kinds, wrenches, generalized, stage, place)
        noise = kinds & NOISE and m[offsets.nuser_body // 8] > 0
        if error[0] < 0 and noise and noise_is_ready():
            acting += add_brownian_wrenches((model, data, step, wrenches))
        if error[0] >= 0:
            _abandon_stack(data, offsets)
            report(error, model, data)
            _clear(memory.numbers(wrenches, m[offsets.nbody // 8], 6))
            _mark_failed(model, data, offsets, stage)
            return
        note_ours(m, d, offsets)
        if kinds & UNMARKED and _is_at_start(data, offsets):
            warn_of_misnamed(m, offsets)
        if acting > 0:
            error_raising.remember_acting(table)
            if error[1] >= 0:
                warn_of_motion(error[1], error[2], model)
            if kinds & UNMARKED:
                _notice_once(notice_sentences.ASSUMED, count_dipoles(m, offsets))
        elif (
            acting == 0
            and is_read(table)
            and (_is_at_start(data, offsets) or not error_raising.has_acted(table))
        ):
            reason, number = why_inert(table, m, offsets, kinds)
            if reason != MEASURED:
                _notice_once(reason if reason >= 0 else SWITCHED_OFF, number)

    return callback


@compiled_once(types.int32(_word, _word, _int), error_model="numpy")
def _init(checksum: int, offsets: layout.Layout):
    """Define the plugin's `init`, which checks a model while MuJoCo compiles it."""

    def init(model, data, instance):
        _ = checksum
        m, table = memory.words(model, memory.UNBOUNDED), table_of(model, True)
        kinds, place = acting_kinds(table, m, offsets), memory.error_on_stack()
        find_error(model, table, kinds, error_numbers.THOROUGH, place)
        error = memory.words(place, error_numbers.WORDS)
        if error[0] >= 0:
            report(error, model, model)
            return FAILED
        if data != 0:
            _keep(table, kinds, data, offsets, instance)
        error_raising.forget(notice_sentences.OF_RUNS)
        disabled = memory.integers(model + offsets.disableflags, 1)[0]
        if disabled & DISABLE_SPRING and disabled & DISABLE_DAMPER:
            error_raising.notice(notice_sentences.NO_PASSIVE_FORCES, 0, 0, 0)
        if memory.integers(model + offsets.enableflags, 1)[0] & ENABLE_SLEEP:
            error_raising.notice(notice_sentences.SLEEPING, 0, 0, 0)
        if kinds & UNMARKED:
            error_raising.forget(1 << notice_sentences.NOT_A_MARK)
            warn_of_misnamed(m, offsets)
        reason, number = why_inert(table, m, offsets, kinds)
        if not is_read(table):
            return 0
        if reason >= 0:
            error_raising.notice(reason, number, 0, 0)
        elif kinds & UNMARKED:
            error_raising.notice(notice_sentences.ASSUMED, count_dipoles(m, offsets), 0, 0)
        return 0

    return init


@compiled_once(types.void(_word, _word, _int, _int), error_model="numpy")
def _compute(checksum: int, offsets: layout.Layout):
    """Define the plugin's `compute`, which adds the forces to `qfrc_passive`."""

    def compute(model, data, instance, capability):
        _ = checksum
        m = memory.words(model, memory.UNBOUNDED)
        d = memory.words(data, memory.UNBOUNDED)
        word = memory.words(_plugin_data(data, offsets, instance), 1)
        kinds, table = word[0] & ACTING, table_of(model, _is_at_start(data, offsets))
        if kinds & IDLE:
            return
        kinds = _kinds_now(kinds, table, m, offsets)
        if kinds != UNREADABLE and kinds & (COILS | FIELDS):
            drives = drives_checksum(table, m, d, offsets)
            if capability == ACTUATOR_STAGE and drives != word[0] >> SHIFT:
                # Finite differences change controls, but keep the passive forces.
                _compute_passive(model, data)
            word[0] = kinds | drives << SHIFT
        if capability == ACTUATOR_STAGE:
            return
        # Both are read before our own use of the stack.
        step, stage = step_number(model, data, offsets), in_later_stage(model, data, offsets)
        bodies = m[offsets.nbody // 8]
        passive = d[offsets.qfrc_passive // 8]
        stack = d.ctypes.data
        memory.mark_stack(stack)
        room = memory.allocate(stack, 48 * bodies, 8)
        applied = memory.numbers(room, bodies, 6)
        _clear(applied)
        place = memory.error_on_stack()
        apply_forces(model, data, table, kinds, room, passive, stage, place)
        error = memory.words(place, error_numbers.WORDS)
        if error[0] >= 0:
            memory.free_stack(stack)
            _abandon_stack(data, offsets)
            report(error, model, data)
            _mark_failed(model, data, offsets, stage)
            return
        if kinds & NOISE and m[offsets.nuser_body // 8] > 0 and noise_is_ready():
            add_brownian_wrenches((model, data, step, room))
        awake = memory.integers(d[offsets.body_awake // 8], bodies)
        for body in range(1, bodies):
            if awake[body] != memory.ASLEEP and memory.any_number(applied, body, 0, 6):
                wrench = room + 48 * body
                center = d[offsets.xipos // 8] + 24 * body
                _apply_wrench(model, data, wrench, wrench + 24, center, body, passive)
        memory.free_stack(stack)
        if error[1] >= 0:
            warn_of_motion(error[1], error[2], model)

    return compute


@subroutine(forceinline=True)
def _kinds_now(kept, table, m, offsets):
    """Return what acts by a table, whatever was kept for the model that `mjData` was made for.

    One `mjData` may serve several models in turn, as in a rollout of a list of models. What is kept
    counts in models without a mark: whether their dipoles act is decided once.
    """
    declared = header(table).kinds
    if header(table).instance < 0 and declared != UNREADABLE:
        return kept  # nothing could be read, which is an error
    if declared == UNMARKED and kept & UNMARKED:
        return kept
    return acting_kinds(table, m, offsets)


@compiled_once(types.void(_word, _word, _word, _int), error_model="numpy")
def _copy(checksum: int, offsets: layout.Layout):
    """Define the plugin's `copy`.

    The copied passive forces belong to the drives of the source, which are in its checksum.
    """

    def copy(target, model, source, instance):
        _ = checksum
        to = memory.words(_plugin_data(target, offsets, instance), 1)
        of = memory.words(_plugin_data(source, offsets, instance), 1)
        to[0] = (to[0] & ACTING) | (of[0] >> SHIFT << SHIFT)

    return copy


@compiled_once(types.int32(_word, _int), error_model="numpy")
def _nstate(checksum: int, offsets: layout.Layout):
    """Define the plugin's `nstate`, how many numbers the state of an instance has."""

    def nstate(model, instance):
        _ = checksum
        return numbers_in_state(memory.words(model, memory.UNBOUNDED), offsets)

    return nstate


@compiled_once(types.void(_word, _word, _int), error_model="numpy")
def _advance(checksum: int, offsets: layout.Layout):
    """Define the plugin's `advance`, by which a step remembers the fields that it began with."""

    def advance(model, data, instance):
        _ = checksum
        m, d = memory.words(model, memory.UNBOUNDED), memory.words(data, memory.UNBOUNDED)
        state = state_of(instance, m, d, offsets)
        for k in range(0, len(state), PER_SITE):
            state[k] = state[k + 1]

    return advance


@compiled_once(types.void(_word, _word, _word, _int), error_model="numpy")
def _reset(checksum: int, offsets: layout.Layout):
    """Define the plugin's `reset`, which MuJoCo calls after `init` and which may raise errors.

    Python's `init`, in whose place `prepare` is called, must not.
    """

    def reset(model, state, word, instance):
        _ = checksum
        room = memory.integers(
            memory.words(model, memory.UNBOUNDED)[offsets.plugin_statenum // 8], memory.UNBOUNDED
        )
        memory.numbers(state, 1, room[instance])[0, :] = 0.0
        if word & ACTING == ACTING:
            m, table = memory.words(model, memory.UNBOUNDED), table_of(model, True)
            kinds, place = acting_kinds(table, m, offsets), memory.error_on_stack()
            find_error(model, table, kinds, error_numbers.THOROUGH, place)
            report(memory.words(place, error_numbers.WORDS), model, model)

    return reset


@compiled_once(types.int32(_word, _word, _int), error_model="numpy")
def _check_magnetometers(checksum: int, offsets: layout.Layout):
    """Define the magnetometer's `init`, which checks a model while MuJoCo compiles it."""

    def init(model, data, instance):
        _ = checksum
        table, place = table_of(model, True), memory.error_on_stack()
        error = memory.words(place, error_numbers.WORDS)
        _find_error_of_sensors(error, model, table, 0, instance)
        report(error, model, model)
        return FAILED if error[0] >= 0 else 0

    return init


@compiled_once(types.void(_word, _word, _int, _int), error_model="numpy")
def _measure(checksum: int, offsets: layout.Layout):
    """Define the magnetometer's `compute`, which writes to `sensordata`."""

    def compute(model, data, instance, capability):
        _ = checksum
        m = memory.words(model, memory.UNBOUNDED)
        d = memory.words(data, memory.UNBOUNDED)
        table = table_of(model, _is_at_start(data, offsets))
        place = memory.error_on_stack()
        kinds, error = acting_kinds(table, m, offsets), memory.words(place, error_numbers.WORDS)
        _find_error_of_sensors(error, model, table, kinds, instance)
        if error[0] < 0:
            error[0], error[1], error[2] = measure(m, d, offsets, table, kinds, instance)
        report(error, model, data)

    return compute


@subroutine
def _find_error_of_sensors(error, model, table, kinds, instance):
    """Find an error in what acts, or else in the magnetometers of an instance."""
    find_error(model, table, kinds, error_numbers.IN_STEP, error.ctypes.data)
    if error[0] < 0:
        check_magnetometers(error, table, instance)


@subroutine
def _is_at_start(data, offsets):
    """Whether the time is 0."""
    return memory.numbers(data + offsets.time, 1, 1)[0, 0] == 0.0


@subroutine
def _abandon_stack(data, offsets):
    """Empty the stack of `mjData` if an error is going to end all functions that use it.

    Else later steps by RK4 would take all of their stages for later ones.
    """
    if error_raising.handler_of_thread() != 0:
        memory.words(data + offsets.pstack, 1)[0] = 0
        memory.words(data + offsets.pbase, 1)[0] = 0


@subroutine
def _keep(table, kinds, data, offsets, instance):
    """Write what acts to the word in `plugin_data` that belongs to an instance."""
    word = memory.words(_plugin_data(data, offsets, instance), 1)
    word[0] = kinds if instance == header(table).instance else IDLE


@subroutine
def _plugin_data(data, offsets, instance):
    """Return the address of the word in `plugin_data` that belongs to an instance."""
    return memory.words(data + offsets.plugin_data, 1)[0] + 8 * instance


@subroutine
def _clear(applied):
    """Set all wrenches to zero."""
    for body in range(len(applied)):
        for k in range(6):
            applied[body, k] = 0.0


@subroutine
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


@subroutine
def _notice_once(notice, number):
    """Report a notice to Python, once per `magnetism` block."""
    error_raising.notice(notice, number, 0, 1 << notice)
