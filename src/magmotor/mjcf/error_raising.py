"""Errors and notices of compiled code, which Python raises or gives.

MuJoCo ends the process at an error that nobody handles, as on the threads of a rollout. There, an
error is recorded, the caller marks the state as failed, and the error is raised at the end of the
`magnetism` block; without a block, it is a warning.
"""

import ctypes
import sys
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import mujoco

from magmotor.common.exceptions import DeclarationError, InputError
from magmotor.mjcf import error_numbers, memory
from magmotor.mjcf.error_sentences import sentence_of_error, sentence_of_notice
from magmotor.mjcf.hooks import catches_errors, inside_errors_raised
from magmotor.mjcf.notice_sentences import ASSUMED, NOT_A_MARK, resembles_mark
from magmotor.numerics import c_types as types
from magmotor.numerics.deferred import External, subroutine
from magmotor_plugin.c_callbacks import returning
from magmotor_plugin.library import library

_word = types.int64
_exchange_handler = External("_mjPRIVATE_setTlsLogHandler", _word(_word))
_user_error = memory.variable("mju_user_error")
_form_error_text = External(
    "magmotor_form_error",
    types.void(_word, _word, _word, _word, _word, _word, _word, _word, _word),
)
_form_notice = External(
    "magmotor_form_notice",
    types.void(_word, _word, _word, _word, _word, _word, _word, _word, _word),
)
_raise = External("mju_error", types.void(_word))

acted_address = memory.variable("magmotor_acted_address")
given_address = memory.variable("magmotor_given_address")
notices_given = memory.variable("magmotor_notices_given")
"""Bits of the notices that the running `magnetism` block has given."""


@subroutine
def handler_of_thread():
    """Return the address of this thread's handler, which ends the call of MuJoCo; 0 without one."""
    handler = _exchange_handler(0)
    _exchange_handler(handler)
    return handler


@subroutine
def fail(error, number, name, other, other_name, details):
    """Raise an error; on a thread that does not handle errors, record it and return.

    `name` and `other_name` are addresses of C strings, or 0, and `details` that of numbers.
    """
    text = memory.word_on_stack()
    handler, user = handler_of_thread(), _user_error()
    _form_error_text(error, number, name, other, other_name, details, handler, user, text)
    _raise_if_formed(text)


@subroutine
def notice(which, number, name, unless, other=-1, other_name=0):
    """Report a notice of one or two elements, which is an error if warnings are errors.

    An element has a number and a name, which is the address of a C string, or 0. If any of the
    notices whose bits are `unless` has been given, this one is not.
    """
    if notices_given() & unless == 0:
        text = memory.word_on_stack()
        handler, user = handler_of_thread(), _user_error()
        _form_notice(which, number, name, other, other_name, unless, handler, user, text)
        _raise_if_formed(text)


@subroutine
def _raise_if_formed(text):
    """Raise the sentence whose address is at `text`, unless that is 0."""
    sentence = memory.words(text, 1)[0]
    if sentence != 0:
        _raise(sentence)


@subroutine
def remember_acting(table):
    """Remember the table of the model on which something has acted last."""
    acted = memory.words(acted_address(), 1)
    if acted[0] != table:
        acted[0] = table


@subroutine
def forget(bits):
    """Let notices be given again."""
    given = memory.words(given_address(), 1)
    given[0] &= ~bits


@subroutine
def has_acted(table):
    """Whether something has acted last on a model with this table, as before a switch."""
    return memory.words(acted_address(), 1)[0] == table


def bind() -> None:
    """Bind the functions of this module to the symbols in compiled code."""
    memory.bind_mujoco("mju_error")
    memory.bind_variable("mju_user_error", ctypes.c_int64.in_dll(library(), "mju_user_error"))
    exchange = getattr(library(), "_mjPRIVATE_setTlsLogHandler", _presumed_handler)
    memory.bind_function("_mjPRIVATE_setTlsLogHandler", exchange)
    memory.bind_function("magmotor_form_error", _form_error)
    memory.bind_function("magmotor_form_notice", _give_notice)
    memory.bind_variable("magmotor_notices_given", _given)
    memory.bind_storage("magmotor_acted_address", _acted)
    memory.bind_storage("magmotor_given_address", _given)


_given = ctypes.c_int64(0)
_acted = ctypes.c_int64(0)
_texts: dict[int, ctypes.Array] = {}
"""Last error of each thread, kept while C code reads it."""

_of_thread = threading.local()
"""Its `found` is the last error of a thread: its sentence, its number and its first element."""

_printed: set[str] = set()
"""Lines about models without a mark, each of which a process prints once."""

_open_blocks: list[list[str]] = []
"""Errors recorded during each open `magnetism` block, on threads that do not handle errors."""

_lock = threading.Lock()


@ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)
@returning
def _presumed_handler(_handler):
    """Replaces a private function of MuJoCo, should a version lack it.

    Threads that Python entered have a frame of Python below this one, and MuJoCo's bindings handle
    their errors, unless `errors_raised` does; the threads of a rollout have none.
    """
    return int(sys._getframe(1).f_back is not None and not inside_errors_raised())


@ctypes.CFUNCTYPE(
    None, ctypes.c_int64, ctypes.c_int64, ctypes.c_char_p, ctypes.c_int64, ctypes.c_char_p,
    ctypes.POINTER(ctypes.c_double), ctypes.c_int64, ctypes.c_int64,
    ctypes.POINTER(ctypes.c_int64),
)  # fmt: skip
@returning
def _form_error(error, number, name, other, other_name, details, handler, user, text):
    """Write the address of the sentence to `text` if the thread handles errors, else record it."""
    numbers = details[: error_numbers.DETAILS]
    sentence = sentence_of_error(error, number, name, other, other_name, numbers)
    # The number of an invalid index is that of its array.
    _of_thread.found = sentence, error, other if error == error_numbers.INDEX else number
    if handler or catches_errors(user):
        text[0] = _kept(sentence)
        return
    with _lock:
        for recorded in _open_blocks:
            if sentence not in recorded:
                recorded.append(sentence)
        inside = bool(_open_blocks)
    if not inside:
        _warn(f"{sentence}; the state is set to NaN")


@ctypes.CFUNCTYPE(
    None, ctypes.c_int64, ctypes.c_int64, ctypes.c_char_p, ctypes.c_int64, ctypes.c_char_p,
    ctypes.c_int64, ctypes.c_int64, ctypes.c_int64, ctypes.POINTER(ctypes.c_int64),
)  # fmt: skip
@returning
def _give_notice(which, number, name, other, other_name, unless, handler, user, text):
    """Print or warn; write the address of the sentence to `text` if the warning is an error."""
    if which == NOT_A_MARK and not resembles_mark((name or b"").decode(errors="replace")):
        return
    with _lock:  # another thread may have given it since compiled code looked
        if _given.value & unless:
            return
        _given.value |= 1 << which
    sentence = sentence_of_notice(which, number, name, other, other_name)
    if which == ASSUMED:
        if sentence not in _printed:
            _printed.add(sentence)
            print(f"magmotor: {sentence}", file=sys.stderr)
        return
    try:
        warnings.warn(sentence, stacklevel=3)
    except Warning as error:
        if not (handler or catches_errors(user)):
            raise
        text[0] = _kept(str(error))


def declaration_error(error: mujoco.FatalError) -> InputError:
    """Return an error that compiled code has just raised in this thread, with its attributes."""
    sentence, number, element = getattr(_of_thread, "found", ("", 0, -1))
    if sentence != str(error):  # of MuJoCo itself
        return InputError(str(error))
    return DeclarationError(sentence, error_numbers.KINDS[number], element)


def silence(bits: int) -> None:
    """Do not give notices in the blocks that are open."""
    _given.value |= bits


def _kept(sentence: str) -> int:
    """Return the address of a sentence, which stays valid until the next one of this thread."""
    text = ctypes.create_string_buffer(sentence.replace("%", "%%").encode())  # it is a format
    _texts[threading.get_ident()] = text
    return ctypes.addressof(text)


def _warn(sentence: str) -> None:
    """Warn on a thread that cannot raise; if warnings are errors, print the sentence."""
    try:
        warnings.warn(sentence, stacklevel=3)
    except Warning:
        print(f"magmotor: {sentence}", file=sys.stderr)


@contextmanager
def recorded_errors() -> Iterator[None]:
    """Record errors of threads that do not handle any, and raise them at the end of the block.

    They are recorded for each block that is open in the process, and are a warning where another
    exception ends the block. The first of several blocks also makes all notices be given again.

    Raises
    ------
    mujoco.FatalError
    """
    recorded: list[str] = []
    with _lock:
        if not _open_blocks:
            _given.value = _acted.value = 0
        _open_blocks.append(recorded)
    try:
        yield
    except BaseException:
        with _lock:
            lost, recorded[:] = recorded.copy(), []
        for sentence in lost:
            _warn(f"{sentence}; the states of these runs are NaN")
        raise
    finally:
        with _lock:
            _open_blocks[:] = [other for other in _open_blocks if other is not recorded]
    _raise_all(recorded)


def raise_recorded() -> None:
    """Raise the errors recorded so far in the open blocks, if there are any.

    Raises
    ------
    mujoco.FatalError
    """
    with _lock:
        errors = [*dict.fromkeys(error for recorded in _open_blocks for error in recorded)]
        for recorded in _open_blocks:
            recorded.clear()
    _raise_all(errors)


def _raise_all(errors: list[str]) -> None:
    if errors:
        others = len(errors) - 1
        more = f" (and {others} other error{'s' * (others > 1)})" if others else ""
        raise mujoco.FatalError(f"{errors[0]}{more}; the states of these runs are NaN")
