"""Errors and notices of compiled code, whose sentences are formed in Python.

MuJoCo ends the process at an error that nobody handles, as on the threads of a rollout. There, an
error is recorded, the caller marks the state as failed, and the error is raised at the end of the
`magnetism` block; without a block, it is a warning.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import ctypes
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import mujoco
from numba import njit, types

from magmotor.mjcf import memory
from magmotor.mjcf.forces.dipole_sites import (
    LEFT_ALONE,
    NO_DIPOLES,
    NONE_MOVES,
    NOT_NAMED,
    ONE_RIGID_BODY,
    SWITCHED_OFF,
)
from magmotor_plugin import library

COINCIDENCE, MARK, COUPLING, WRENCH, POTENTIAL, MOMENT, PATH = range(7)
"""Errors; each has up to two numbers with names, and a value."""

ASSUMED, NO_PASSIVE_FORCES, SLEEPING = range(LEFT_ALONE + 1, LEFT_ALONE + 4)
"""Notices, besides the reasons why nothing acts on a model."""

_INERT = {
    NO_DIPOLES: (
        'it has no dipole sites (a site with user="MOMENT" in A m^2, along its z axis); Brownian'
        " wrenches and potentials need a mark and user numbers of bodies or joints"
    ),
    ONE_RIGID_BODY: "its dipole sites are all on one rigid body, so that none acts on another",
    NONE_MOVES: "none of the bodies with dipole sites can move (they have no joints)",
    SWITCHED_OFF: "its couplings turn all magnetism off (prm is 0, the default)",
    NOT_NAMED: "neither a mark nor a site with a user number names dipoles",
    LEFT_ALONE: (
        "its user numbers may have another meaning; to say which of them act, add"
        ' <custom><text name="magmotor" data="dipoles couplings noise potentials"/></custom>'
    ),
}
_NOTICES = {
    NO_PASSIVE_FORCES: (
        "MuJoCo skips the plugin magmotor.forces, since the flags spring and damper are both"
        " disabled; enable one of them"
    ),
    SLEEPING: "a sleeping body is not woken by forces of the plugin magmotor.forces",
}


def _mark_error(_number: int, text: str, _other: int, config: str, _value: float) -> str:
    allowed = "dipoles, couplings, noise, potentials, all"
    for mark, data in (("text 'magmotor'", text), ("config 'act' of magmotor.forces", config)):
        unknown = [word for word in data.split() if word not in allowed.split(", ")]
        if unknown or (data and not data.split()):
            return f"{mark} = {data!r}: must be words out of {allowed}"
    return (
        f"text 'magmotor' = {text!r} and config 'act' of magmotor.forces = {config!r}: must name"
        " the same forces if both are given"
    )


_ERRORS: dict[int, Callable[..., str]] = {
    COINCIDENCE: (
        "dipole sites {} {!r} and {} {!r} coincide: their force is undefined".format
    ),
    MARK: _mark_error,
    COUPLING: "coupling tuple {} {!r}: its elements must be two bodies with equal prm".format,
    WRENCH: "body {} {!r}: its user numbers must be rows of six, the Brownian wrenches".format,
    POTENTIAL: (
        "joint {} {!r}: its user numbers must be pairs, the Fourier coefficients of a potential,"
        " and the joint must be a slide or a hinge".format
    ),
    MOMENT: (
        "site {} {!r}: its only user number must be its moment in A m^2, which must be"
        " finite".format
    ),
    PATH: (
        "userdata[{0}] = {4:g}: the numbers that select the noise (seed, replica, factor, level,"
        " first step) must be integers from 0 to 2^53 - 1, a factor at most 2^24 and a level at"
        " most 31".format
    ),
}  # fmt: skip

_word = types.int64
_exchange_handler = types.ExternalFunction("_mjPRIVATE_setTlsLogHandler", _word(_word))
_user_error = memory.variable("mju_user_error")
_error_text = types.ExternalFunction(
    "magmotor_error_text", _word(_word, _word, _word, _word, _word, types.float64, _word)
)
_raise = types.ExternalFunction("mju_error", types.void(_word))
notice = types.ExternalFunction("magmotor_notice", types.void(_word, _word))
"""Report a notice and a number to Python."""

notices_given = memory.variable("magmotor_notices_given")
"""Bits of the notices that the running `magnetism` block has given."""


@njit
def fail(error, number, name, other, other_name, value):
    """Raise an error; on a thread that does not handle errors, record it and return.

    `name` and `other_name` are addresses of C strings, or 0.
    """
    handler = _exchange_handler(0)
    _exchange_handler(handler)
    is_handled = handler != 0 or _user_error() != 0
    text = _error_text(error, number, name, other, other_name, value, is_handled)
    if text != 0:
        _raise(text)


def bind() -> None:
    """Bind the functions of this module to the symbols in compiled code."""
    memory.bind_mujoco("mju_error")
    memory.bind_variable("mju_user_error", ctypes.c_int64.in_dll(library(), "mju_user_error"))
    exchange = getattr(library(), "_mjPRIVATE_setTlsLogHandler", _always_handled)
    memory.bind_function("_mjPRIVATE_setTlsLogHandler", exchange)
    memory.bind_function("magmotor_error_text", _form_error)
    memory.bind_function("magmotor_notice", _give_notice)
    memory.bind_variable("magmotor_notices_given", _given)


_given = ctypes.c_int64(0)
_texts: dict[int, ctypes.Array] = {}
"""Last error of each thread, kept while C code reads it."""

_recorded: list[str] = []
"""Errors of threads that do not handle errors."""

_printed: set[str] = set()
"""Lines about models without a mark, each of which a process prints once."""

_blocks = 0
"""Number of open `magnetism` blocks."""

_lock = threading.Lock()


@ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)
def _always_handled(_handler):
    """Replaces a private function of MuJoCo, should a version lack it."""
    return 1


@ctypes.CFUNCTYPE(
    ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64, ctypes.c_char_p, ctypes.c_int64,
    ctypes.c_char_p, ctypes.c_double, ctypes.c_int64,
)  # fmt: skip
def _form_error(error, number, name, other, other_name, value, is_handled):
    names = [(text or b"").decode(errors="replace") for text in (name, other_name)]
    sentence = _ERRORS[error](number, names[0], other, names[1], value)
    if is_handled:
        # MuJoCo takes it for a format.
        text = ctypes.create_string_buffer(sentence.replace("%", "%%").encode())
        _texts[threading.get_ident()] = text
        return ctypes.addressof(text)
    with _lock:
        if _blocks and sentence not in _recorded:
            _recorded.append(sentence)
    if not _blocks:
        warnings.warn(f"{sentence}; the state is set to NaN", stacklevel=1)
    return None


@ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_int64)
def _give_notice(which, number):
    _given.value |= 1 << which
    if which == ASSUMED:
        line = (
            f"{number} sites with one user number act as dipoles; to say so, or otherwise, add"
            ' <custom><text name="magmotor" data="dipoles"/></custom> to the model'
        )
        if line not in _printed:
            _printed.add(line)
            print(f"magmotor: {line}", file=sys.stderr)
    elif which in _INERT:
        warnings.warn(f"nothing acts on this model: {_INERT[which]}", stacklevel=2)
    else:
        warnings.warn(_NOTICES[which], stacklevel=2)


@contextmanager
def recorded_errors() -> Iterator[None]:
    """Record errors of threads that do not handle any, and raise them at the end of the block.

    The first of several blocks also makes all notices be given again.

    Raises
    ------
    mujoco.FatalError
    """
    global _blocks
    with _lock:
        if _blocks == 0:
            _given.value = 0
            _recorded.clear()  # of a block that ended by another exception
        _blocks += 1
    try:
        yield
    finally:
        with _lock:
            _blocks -= 1
    raise_recorded()


def raise_recorded() -> None:
    """Raise the errors recorded so far, if there are any.

    Raises
    ------
    mujoco.FatalError
    """
    with _lock:
        recorded = _recorded.copy()
        _recorded.clear()
    if recorded:
        others = len(recorded) - 1
        more = f" (and {others} other error{'s' * (others > 1)})" if others else ""
        raise mujoco.FatalError(f"{recorded[0]}{more}; the states of these runs are NaN")
