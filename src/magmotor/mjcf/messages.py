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
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager

import mujoco
from numba import njit, types

from magmotor.mjcf import errors, memory
from magmotor.mjcf.forces import custom
from magmotor.mjcf.forces.dipole_sites import (
    LEFT_ALONE,
    NO_DIPOLES,
    NONE_MOVES,
    NOT_MAGNETIZED,
    NOT_MARKED,
    NOT_NAMED,
    ONE_RIGID_BODY,
    SWITCHED_OFF,
)
from magmotor.mjcf.forces.marks import WORDS
from magmotor.mjcf.hooks import catches_errors
from magmotor_plugin import library, returning

Details = Sequence[float]
"""Numbers of an error, `errors.DETAILS` of them."""

LONGEST_NAME = 60
"""Largest number of characters of a name in a message."""

ASSUMED, NO_PASSIVE_FORCES, SLEEPING, UNRESOLVED, SUNKEN = range(LEFT_ALONE + 1, LEFT_ALONE + 6)
"""Notices, besides the reasons why nothing acts on a model."""

OF_RUNS = 1 << UNRESOLVED | 1 << SUNKEN
"""Bits of the notices about the motion."""

_INERT = {
    NO_DIPOLES: (
        'it has no dipole sites (a site with user="MOMENT" in A m^2, along its z axis); Brownian'
        " wrenches and potentials need a mark and user numbers of bodies or joints"
    ),
    ONE_RIGID_BODY: (
        "its dipole sites and iron are all on one rigid body, so that none acts on another"
    ),
    NONE_MOVES: "none of the bodies with dipole sites can move (they have no joints)",
    SWITCHED_OFF: "its couplings turn all magnetism off (prm is 0, the default)",
    NOT_NAMED: "neither a mark nor a site with a user number names dipoles",
    NOT_MARKED: "it declares {}, but no mark names them",
    NOT_MAGNETIZED: "the susceptibility of its iron is 0",
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
    UNRESOLVED: (
        "within one timestep, magnetism moved body {} by about its size, or turned it by more than"
        " 2 rad, so that it may fly apart; mm.check(model) proposes a timestep and contacts that"
        " hold"
    ),
    SUNKEN: (
        "body {} has sunk into another magnet by more than a quarter of its width, so that their"
        " dipoles are too near; mm.check(model) proposes a timestep and contacts that hold"
    ),
}


def _mark_error(_number: int, text: str, _other: int, config: str, _details: Details) -> str:
    allowed = "dipoles, couplings, noise, potentials, fields, coils, iron, all"
    for mark, data in (("text 'magmotor'", text), ("config 'act' of magmotor.forces", config)):
        words = data.encode().split()  # at ASCII white space only
        if data and not (words and {*words} <= {*allowed.encode().split(b", ")}):
            return f"{mark} = {data!r}: must be one or more of the words {allowed}"
    return (
        f"text 'magmotor' = {text!r} and config 'act' of magmotor.forces = {config!r}: must have"
        " the same words; give one of them"
    )


def _tuple_error(kind: str, sentences: dict[int, str]) -> Callable[..., str]:
    """Return a function that says which element of a tuple breaks which rule."""

    def form(number: int, name: str, position: int, element: str, details: Details) -> str:
        rule, other, element_kind, prm = details[:4]
        sentence = sentences[int(rule)].format(int(other), prm)
        if rule == custom.FEW:
            return f"{kind} tuple {number} {name!r} {sentence}"
        what = f"element {position}, {mujoco.mju_type2Str(int(element_kind))} {element!r},"
        return f"{kind} tuple {number} {name!r}: {what} {sentence}"

    return form


def _outside(number: int, name: str, other: int, table: str, details: Details) -> str:
    """Say whether a dipole is outside a grid or at a node that is not finite, with both places."""
    position, counts, first, spacing = (details[k : k + 3] for k in (1, 4, 7, 10))
    axes = [*zip(position, counts, first, spacing, strict=True)]
    inside = all(0.0 <= (x - start) * (1.0 / step) <= n - 1 for x, n, start, step in axes)
    last = [start + (n - 1) * step for _, n, start, step in axes]
    what = "at a node that is not finite of" if inside else "outside the grid of"
    corners = f"from {_point(first)} to {_point(last)}"
    return (
        f"{_dipole(number, name, bool(details[0]))} is {what} the table in numeric {other}"
        f" {table!r}: it is at {_point(position)} m in the frame of the grid, which reaches"
        f" {corners} m and must contain all dipoles and all iron"
    )


def _point(coordinates: Iterable[float]) -> str:
    return f"({', '.join(f'{x:.6g}' for x in coordinates)})"


def _dipole(number: int, name: str, is_geom: bool) -> str:
    return f"{'iron geom' if is_geom else 'dipole site'} {number} {name!r}"


def _of_dipole(sentence: str) -> Callable[..., str]:
    """Return a function that forms a sentence about a dipole."""

    def form(number: int, name: str, _other: int, _name: str, details: Details) -> str:
        return f"{_dipole(number, name, bool(details[0]))} {sentence}"

    return form


def _coincidence(number: int, name: str, other: int, other_name: str, details: Details) -> str:
    geoms = int(details[0])
    one, two = _dipole(number, name, bool(geoms & 1)), _dipole(other, other_name, geoms > 1)
    both = f"dipole sites {number} {name!r} and {other} {other_name!r}" if not geoms else ""
    return f"{both or f'{one} and {two}'} coincide: their force is undefined"


_OF_DRIVES = {
    custom.DELAY: "must not have a delay",
    custom.PRM: (
        "has prm = {1:g}, where its core saturates, which must be finite and not negative (0: it"
        " does not)"
    ),
}
_OF_COILS = _OF_DRIVES | {
    custom.FEW: "must name a site or a body after its actuator",
    custom.FIRST: "must be an actuator, since it is the first",
    custom.KIND: "must be a site or a body",
    custom.REPEATED: "is also named by coil tuple {0}",
    custom.CONTAINED: "is a part of a body that coil tuple {0} names",
}
_OF_FIELDS = _OF_DRIVES | {
    custom.FEW: "must name a numeric that is a field",
    custom.KIND: "must be a numeric, a body, a site or an actuator",
    custom.MISNAMED: "must have a name that starts with 'field'",
    custom.REPEATED: "is also named by field tuple {0}",
    custom.SECOND: "is one too many: at most one body or site, and at most one actuator",
}
_OF_IRON = {
    custom.FEW: "must name a numeric, the material, and a geom",
    custom.KIND: "must be a numeric or a geom",
    custom.SHAPE: "must be a sphere, an ellipsoid, a capsule, a cylinder, a box or a plane",
    custom.REPEATED: "is also named by iron tuple {0}",
    custom.SECOND: "is one too many: one numeric in the tuple, and at most one plane in the model",
}
"""What is wrong with an element: {0} is another tuple, {1} the element's `prm`."""

_ERRORS: dict[int, Callable[..., str]] = {
    errors.COINCIDENCE: _coincidence,
    errors.OUTSIDE: _outside,
    errors.BEHIND: (
        lambda number, name, body, of_body, details: (
            f"{_dipole(number, name, bool(details[0]))} is below the plane of iron (on body"
            f" {body} {of_body!r}), where mirror images do not give the field; mm.check(model)"
            " proposes contacts that keep it above"
        )
    ),
    errors.MERGED: _of_dipole("has its center at a dipole, where the field is not finite"),
    errors.UNSOLVED: _of_dipole(
        "is so close to other iron, or to its image in a plane, that one dipole each does not"
        " describe them: such dipoles would magnetize each other without any field; put the geoms"
        " farther apart, or make one geom of them"
    ),
    errors.COIL: _tuple_error("coil", _OF_COILS),
    errors.FIELD: (
        "numeric {} {!r}: a field must be B in T (3 finite numbers), B and G_xx G_xy G_xz G_yy G_yz"
        " in T/m (8), or a table: numbers of nodes n_x n_y n_z, each at least 4, the first node"
        " x y z, positive spacings, and 3 n_x n_y n_z flux densities".format
    ),
    errors.FIELD_TUPLE: _tuple_error("field", _OF_FIELDS),
    errors.IRON: _tuple_error("iron", _OF_IRON),
    errors.MATERIAL: (
        "numeric {0} {1!r}: a material must be a susceptibility, at least -1 (here {4[0]:g}), and"
        " optionally a saturation magnetization in A/m, not negative; both finite".format
    ),
    errors.SIZE: (
        "iron geom {} {!r}: its size must be positive and finite".format
    ),
    errors.COUPLED_IRON: (
        "iron geom {} {!r} belongs to a body of coupling tuple {} {!r}: couplings do not apply to"
        " iron".format
    ),
    errors.MARK: _mark_error,
    errors.COUPLING: (
        "coupling tuple {} {!r}: its elements must be two bodies with equal and finite prm".format
    ),
    errors.NO_SITE: "magnetometer {} {!r}: its objtype must be 'site'".format,
    errors.UNMEASURED: (
        "magnetometer {} {!r}: its site {} {!r} coincides with a dipole, is outside the table of a"
        " field, or is below the plane of iron".format
    ),
    errors.WRENCH: (
        "body {} {!r}: its user numbers must be rows of six, the Brownian wrenches, and"
        " finite".format
    ),
    errors.POTENTIAL: (
        "joint {} {!r}: its user numbers must be pairs, the finite Fourier coefficients of a"
        " potential, and the joint must be a slide or a hinge".format
    ),
    errors.MOMENT: (
        "site {} {!r}: its only user number must be its moment in A m^2, which must be finite; the"
        " direction is its z axis".format
    ),
    errors.PATH: (
        "userdata[{0}] = {4[0]:g}: the numbers that select the noise (seed, replica, factor, level,"
        " first step) must be integers from 0 to 2^53 - 1, a factor at most 2^24 and a level at"
        " most 31".format
    ),
    errors.TIME: (
        "time = {4[0]:g}: must be finite and less than 2^53 timesteps while noise acts".format
    ),
    errors.TOLERANCE: (
        "numeric {} {!r}: the tolerance must be one number from 0 (exact) to 0.1".format
    ),
}  # fmt: skip

_word = types.int64
_exchange_handler = types.ExternalFunction("_mjPRIVATE_setTlsLogHandler", _word(_word))
_user_error = memory.variable("mju_user_error")
_form_error_text = types.ExternalFunction(
    "magmotor_form_error",
    types.void(_word, _word, _word, _word, _word, _word, _word, _word, _word),
)
_form_notice = types.ExternalFunction(
    "magmotor_form_notice", types.void(_word, _word, _word, _word, _word, _word, _word)
)
_raise = types.ExternalFunction("mju_error", types.void(_word))

acted_address = memory.variable("magmotor_acted_address")
given_address = memory.variable("magmotor_given_address")
notices_given = memory.variable("magmotor_notices_given")
"""Bits of the notices that the running `magnetism` block has given."""


@njit
def handler_of_thread():
    """Return the address of this thread's handler, which ends the call of MuJoCo; 0 without one."""
    handler = _exchange_handler(0)
    _exchange_handler(handler)
    return handler


@njit
def fail(error, number, name, other, other_name, details):
    """Raise an error; on a thread that does not handle errors, record it and return.

    `name` and `other_name` are addresses of C strings, or 0, and `details` that of numbers.
    """
    text = memory.word_on_stack()
    handler, user = handler_of_thread(), _user_error()
    _form_error_text(error, number, name, other, other_name, details, handler, user, text)
    _raise_if_formed(text)


@njit
def notice(which, number, name, unless):
    """Report a notice, a number and a name, which is an error if warnings are errors.

    `name` is the address of a C string, or 0. If any of the notices whose bits are `unless` has
    been given, this one is not.
    """
    if notices_given() & unless == 0:
        text = memory.word_on_stack()
        _form_notice(which, number, name, unless, handler_of_thread(), _user_error(), text)
        _raise_if_formed(text)


@njit
def _raise_if_formed(text):
    """Raise the sentence whose address is at `text`, unless that is 0."""
    sentence = memory.words(text, 1)[0]
    if sentence != 0:
        _raise(sentence)


@njit
def remember_acting(model):
    """Remember the address of the model on which something has acted last."""
    acted = memory.words(acted_address(), 1)
    if acted[0] != model:
        acted[0] = model


@njit
def forget(bits, model):
    """Let notices be given again if the model is not the one of the last call."""
    given = memory.words(given_address(), 2)
    if given[1] != model:
        given[0] &= ~bits
        given[1] = model


@njit
def has_acted(model):
    """Whether this model is the one on which something has acted last, as before a switch."""
    return memory.words(acted_address(), 1)[0] == model


def bind() -> None:
    """Bind the functions of this module to the symbols in compiled code."""
    memory.bind_mujoco("mju_error")
    memory.bind_variable("mju_user_error", ctypes.c_int64.in_dll(library(), "mju_user_error"))
    exchange = getattr(library(), "_mjPRIVATE_setTlsLogHandler", _always_handled)
    memory.bind_function("_mjPRIVATE_setTlsLogHandler", exchange)
    memory.bind_function("magmotor_form_error", _form_error)
    memory.bind_function("magmotor_form_notice", _give_notice)
    memory.bind_variable("magmotor_notices_given", _given)
    memory.bind_variable("magmotor_acted_address", _acted_address)
    memory.bind_variable("magmotor_given_address", _given_address)


_given_and_model = (ctypes.c_int64 * 2)()
_given = ctypes.c_int64.from_buffer(_given_and_model)
_given_address = ctypes.c_int64(ctypes.addressof(_given))
_acted = ctypes.c_int64(0)
_acted_address = ctypes.c_int64(ctypes.addressof(_acted))
_texts: dict[int, ctypes.Array] = {}
"""Last error of each thread, kept while C code reads it."""

_printed: set[str] = set()
"""Lines about models without a mark, each of which a process prints once."""

_open_blocks: list[list[str]] = []
"""Errors recorded during each open `magnetism` block, on threads that do not handle errors."""

_lock = threading.Lock()


@ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)
def _always_handled(_handler):
    """Replaces a private function of MuJoCo, should a version lack it."""
    return 1


@ctypes.CFUNCTYPE(
    None, ctypes.c_int64, ctypes.c_int64, ctypes.c_char_p, ctypes.c_int64, ctypes.c_char_p,
    ctypes.POINTER(ctypes.c_double), ctypes.c_int64, ctypes.c_int64,
    ctypes.POINTER(ctypes.c_int64),
)  # fmt: skip
@returning
def _form_error(error, number, name, other, other_name, details, handler, user, text):
    """Write the address of the sentence to `text` if the thread handles errors, else record it."""
    names = [_shortened(characters) for characters in (name, other_name)]
    numbers = details[: errors.DETAILS]
    sentence = _ERRORS[error](number, names[0], other, names[1], numbers)
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
    None, ctypes.c_int64, ctypes.c_int64, ctypes.c_char_p, ctypes.c_int64, ctypes.c_int64,
    ctypes.c_int64, ctypes.POINTER(ctypes.c_int64),
)  # fmt: skip
@returning
def _give_notice(which, number, name, unless, handler, user, text):
    """Print or warn; write the address of the sentence to `text` if the warning is an error."""
    with _lock:  # another thread may have given it since compiled code looked
        if _given.value & unless:
            return
        _given.value |= 1 << which
    if which == ASSUMED:
        line = (
            f"{number} sites that each have one user number act as dipoles; to confirm or change"
            ' this, add <custom><text name="magmotor" data="dipoles"/></custom> to the model'
        )
        if line not in _printed:
            _printed.add(line)
            print(f"magmotor: {line}", file=sys.stderr)
        return
    sentence = _NOTICES.get(which) or f"nothing acts on this model: {_INERT[which]}"
    what: int | str = repr(_shortened(name)) if name else number
    if which == NOT_MARKED:
        what = " and ".join(word for word, bit in WORDS.items() if bit & number == bit)
    if which == ONE_RIGID_BODY and number:
        sentence += "; sites without a user number ({}) are no dipoles"
    try:
        warnings.warn(sentence.format(what), stacklevel=3)
    except Warning as error:
        if not (handler or catches_errors(user)):
            raise
        text[0] = _kept(str(error))


def silence(bits: int) -> None:
    """Do not give notices in the blocks that are open."""
    _given.value |= bits


def _shortened(characters: bytes | None) -> str:
    """Return a name or text so short that MuJoCo does not cut the message."""
    text = (characters or b"").decode(errors="replace")
    return text if len(text) <= LONGEST_NAME else f"{text[:LONGEST_NAME]}..."


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
