"""The sentences of errors and notices."""

import difflib
from collections.abc import Callable, Iterable, Sequence

import mujoco
import numpy as np

from magmotor.mjcf import error_numbers
from magmotor.mjcf.declarations import custom
from magmotor.mjcf.declarations.marks import WORDS
from magmotor.mjcf.declarations.valid_indices import APART_FIELDS, FIELDS, SIZES, TEXTS
from magmotor.mjcf.declarations.why_inert import (
    LEFT_ALONE,
    NO_DIPOLES,
    NONE_MOVES,
    NOT_MAGNETIZED,
    NOT_MARKED,
    NOT_NAMED,
    ONE_RIGID_BODY,
    SWITCHED_OFF,
)
from magmotor.mjcf.lookup import decoded

Details = Sequence[float]
"""Numbers of an error, `errors.DETAILS` of them."""

_LONGEST = 60
"""Largest number of characters of a name in a message."""

ASSUMED, NO_PASSIVE_FORCES, SLEEPING, UNRESOLVED, SUNKEN, OVERWRITTEN, NOT_A_MARK = range(
    LEFT_ALONE + 1, LEFT_ALONE + 8
)
"""Notices, besides the reasons why nothing acts on a model."""

OF_RUNS = 1 << UNRESOLVED | 1 << SUNKEN
"""Bits of the notices about the motion."""

MARK_NAME, ALIKE = "magmotor", 0.85
"""The name of the text that is a mark, and the ratio from which on another is taken for it."""

ONLY_NAME = f"since only the name {MARK_NAME} makes it a mark"
"""Why a text with the words of a mark is none."""

FIELD_RULE = (
    "must be B in T (3 finite numbers), B and G_xx G_xy G_xz G_yy G_yz in T/m (8), or a table:"
    " numbers of nodes n_x n_y n_z, each at least 4, the first node x y z, positive spacings, and"
    " 3 n_x n_y n_z flux densities"
)
"""What the numbers of a field must be."""

_INERT = {
    NO_DIPOLES: (
        'it has no dipole sites (a site with user="MOMENT" in A m^2, along its z axis); Brownian'
        " wrenches and potentials need a mark and user numbers of bodies or joints"
    ),
    ONE_RIGID_BODY: (
        "its dipole sites, iron and fields are all on one rigid body, so that none acts on another"
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
_OF_NOTICES = {
    ASSUMED: (
        "{} sites that each have one user number act as dipoles; to confirm or change this, add"
        ' <custom><text name="magmotor" data="dipoles"/></custom> to the model'
    ),
    NO_PASSIVE_FORCES: (
        "MuJoCo skips the plugin magmotor.forces, since the flags spring and damper are both"
        " disabled; enable one of them"
    ),
    SLEEPING: "a sleeping body is not woken by forces of the plugin magmotor.forces",
    UNRESOLVED: (
        "within one timestep, magnetism moved body {} by about its size, or alone would turn it by"
        " more than 4 rad from rest, so that it may fly apart; mm.check(model) proposes a timestep"
        " and contacts for magnets that touch"
    ),
    SUNKEN: (
        "body {} has sunk into body {} by more than a quarter of its width, so that their dipoles"
        " are too near; mm.check(model) proposes a timestep and contacts for magnets that touch"
    ),
    OVERWRITTEN: (
        "magnetism() has overwritten the force that was set in xfrc_applied of body {}: it sets"
        " this row at the start of each step, so that a force has an effect only if it is set"
        " between mj_step1 and mj_step2, and added to what is there; set qfrc_applied"
        " (mm.apply_perturbation does, for the viewer's mouse), or let the plugin magmotor.forces"
        " act, which leaves xfrc_applied to you"
    ),
    NOT_A_MARK: (
        "text {} does not say what acts, " + ONLY_NAME + " (MjSpec.attach adds prefixes to names)"
    ),
}


def _mark_error(_number: int, text: str, _other: int, config: str, _details: Details) -> str:
    allowed = "dipoles, couplings, noise, potentials, fields, coils, iron, all"
    for mark, data in (("text 'magmotor'", text), ("config 'act' of magmotor.forces", config)):
        words = data.encode().split()  # at ASCII white space only
        if data and not (words and {*words} <= {*allowed.encode().split(b", ")}):
            rule = f"must be one or more of the words {allowed}, separated by spaces"
            return f"{mark} = {data!r}: {rule}"
    return (
        f"text 'magmotor' = {text!r} and config 'act' of magmotor.forces = {config!r}: must have"
        " the same words, or only one of the two must be given"
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


def _index_error(number: int, _name: str, element: int, _other_name: str, details: Details) -> str:
    """Say which index of a model leads out of an array."""
    field, (value, extent, limit) = FIELDS[number], map(int, details[:3])
    if field in dict(TEXTS):
        return f"{field} of the model: must end with a zero"
    given = f"{field}[{element}] of the model = {np.int32(np.uint32(value))}"
    if not (sizes := SIZES.get(field)):
        return f"{given}: must be at least 0 and less than {limit}"
    length = np.int32(np.uint32(extent))
    apart = " behind those before" if field in APART_FIELDS else ""
    return (
        f"{given} and {sizes}[{element}] = {length}: must be a range within {limit} elements{apart}"
    )


def _outside(number: int, name: str, other: int, table: str, details: Details) -> str:
    """Say whether a dipole is outside a grid or at a node that is not finite, with both places."""
    position, counts, first, spacing = (details[k : k + 3] for k in (1, 4, 7, 10))
    if not all(spacing):  # a gradient
        what = f"where numeric {other} {table!r} gives a force that is not finite"
        return f"{_dipole(number, name, bool(details[0]))} is {what}"
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


def _material(number: int, name: str, _other: int, _other_name: str, details: Details) -> str:
    count = int(details[0])
    given = " ".join([f"{each:g}" for each in details[1:4][:count]] + ["..."] * (count > 3))
    given = given or "no number"
    return (
        f"numeric {number} {name!r} = {given}: a material must be a susceptibility, at least -1,"
        " and optionally a saturation magnetization in A/m, not negative; both finite"
    )


_OF_DRIVES = {
    custom.DELAY: "must not have a delay",
    custom.PRM: (
        "has prm = {1:g}, the drive near which its core saturates: must be finite and at least 0"
        " (0: never)"
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

_OF_ERRORS: dict[int, Callable[..., str]] = {
    error_numbers.COINCIDENCE: _coincidence,
    error_numbers.OUTSIDE: _outside,
    error_numbers.BEHIND: (
        lambda number, name, body, of_body, details: (
            f"{_dipole(number, name, bool(details[0]))} is below the plane of iron (on body"
            f" {body} {of_body!r}), where mirror images do not give the field; mm.check(model)"
            " says what keeps it above"
        )
    ),
    error_numbers.MERGED: _of_dipole("has its center at a dipole, where the field is not finite"),
    error_numbers.UNSOLVED: _of_dipole(
        "is so close to other iron, or to its image in a plane, that one dipole each does not"
        " describe them: such dipoles would magnetize each other without any field; put the geoms"
        " farther apart, or make one geom of them"
    ),
    error_numbers.COIL: _tuple_error("coil", _OF_COILS),
    error_numbers.FIELD: ("numeric {} {!r}: a field " + FIELD_RULE).format,
    error_numbers.FIELD_TUPLE: _tuple_error("field", _OF_FIELDS),
    error_numbers.IRON: _tuple_error("iron", _OF_IRON),
    error_numbers.MATERIAL: _material,
    error_numbers.SIZE: (
        "iron geom {} {!r}: its size must be positive and finite".format
    ),
    error_numbers.OVERLAP: (
        "bodies {} {!r} and {} {!r} are magnets that overlap at the start, by more than a quarter"
        " of the width of the first; move them apart, or exclude their contact".format
    ),
    error_numbers.COUPLED_IRON: (
        "iron geom {} {!r} belongs to a body of coupling tuple {} {!r}: couplings do not apply to"
        " iron".format
    ),
    error_numbers.MARK: _mark_error,
    error_numbers.COUPLING: (
        "coupling tuple {} {!r}: its elements must be two bodies with equal and finite prm".format
    ),
    error_numbers.NO_SITE: "magnetometer {} {!r}: its objtype must be 'site'".format,
    error_numbers.UNMEASURED: (
        "magnetometer {} {!r}: its site {} {!r} coincides with a dipole, is outside the table of a"
        " field, or is below the plane of iron".format
    ),
    error_numbers.WRENCH: (
        "body {} {!r}: its user numbers must be rows of six, the Brownian wrenches, and"
        " finite".format
    ),
    error_numbers.POTENTIAL: (
        "joint {} {!r}: its user numbers must be pairs, the finite Fourier coefficients of a"
        " potential, and the joint must be a slide or a hinge".format
    ),
    error_numbers.MOMENT: (
        "site {} {!r}: its only user number must be its moment in A m^2, which must be finite; the"
        " direction is its z axis".format
    ),
    error_numbers.PATH: (
        "userdata[{0}] = {4[0]:g}: the numbers that select the noise (seed, replica, factor, level,"
        " first step) must be integers from 0 to 2^53 - 1, a factor at most 2^24 and a level at"
        " most 31, or 32 plus the window for a held path".format
    ),
    error_numbers.TIME: (
        "time = {4[0]:g}: must be finite and between -2^53 and 2^53 timesteps while noise"
        " acts".format
    ),
    error_numbers.INDEX: _index_error,
    error_numbers.CONSTANT: (
        "numeric {} {!r}: the magnetic constant must be one positive finite number, mu0 in the"
        " units of the model".format
    ),
    error_numbers.UNLOADED: "the compiled code of magmotor could not be loaded; see stderr".format,
    error_numbers.TOLERANCE: (
        "numeric {} {!r}: the tolerance must be one number from 0 (exact) to 0.1".format
    ),
}  # fmt: skip


def sentence_of_error(
    error: int,
    number: int,
    name: bytes | None,
    other: int,
    other_name: bytes | None,
    details: Details,
) -> str:
    """Return the sentence of an error with two elements, their names, and numbers."""
    return _OF_ERRORS[error](number, _shortened(name), other, _shortened(other_name), details)


def resembles_mark(name: str) -> bool:
    """Whether the name of a text is nearly that of a mark, or contains it."""
    name = name.lower()
    near = difflib.SequenceMatcher(None, name, MARK_NAME).ratio() >= ALIKE
    return name != "" and (near or MARK_NAME in name)


def sentence_of_notice(
    which: int, number: int, name: bytes | None, other: int, other_name: bytes | None
) -> str:
    """Return the sentence of a notice, or the reason why nothing acts.

    It names up to two elements, by a name or else a number.
    """
    sentence = _OF_NOTICES.get(which) or f"nothing acts on this model: {_INERT[which]}"
    what: int | str = repr(_shortened(name)) if name else number
    if which == NOT_MARKED:
        what = " and ".join(word for word, bit in WORDS.items() if bit & number == bit)
    if which == ONE_RIGID_BODY and number:
        sentence += "; sites without a user number ({}) are no dipoles"
    return sentence.format(what, repr(_shortened(other_name)) if other_name else other)


def _shortened(characters: bytes | None) -> str:
    """Return a name or text so short that MuJoCo does not cut the message."""
    text = decoded(characters or b"")
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."
