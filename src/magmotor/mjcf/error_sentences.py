"""The sentences of errors, and how Python forms them; the C part of the library does the same.

An error has one sentence, or several, of which one of its numbers chooses one: its form. In a
sentence, `{number}` and `{name}` are of an element, `{other}` and `{other_name}` of another one,
and `{0:g}` is one of the numbers; `{kind}` is the word for a type of elements, the number `KIND`.
Names are quoted.
"""

from collections.abc import Mapping, Sequence

import mujoco

from magmotor.mjcf import error_numbers
from magmotor.mjcf.declarations import custom
from magmotor.mjcf.declarations.marks import WORDS
from magmotor.mjcf.declarations.meshes import MOST_FACES
from magmotor.mjcf.declarations.valid_indices import APART_FIELDS, FIELDS, SIZES, TEXTS
from magmotor.mjcf.error_numbers import FORM, KIND
from magmotor.mjcf.lookup import decoded
from magmotor.mjcf.notice_sentences import ELSE, NOTICES, Forms, by_form

Details = Sequence[float]
"""Numbers of an error, `error_numbers.DETAILS` of them."""

LONGEST = 60
"""Largest number of characters of a name in a message."""

FIELD_RULE = (
    "must be B in T (3 finite numbers), B and G_xx G_xy G_xz G_yy G_yz in T/m (8), or a table:"
    " numbers of nodes n_x n_y n_z, each at least 4, the first node x y z, positive spacings, and"
    " 3 n_x n_y n_z flux densities"
)
"""What the numbers of a field must be."""

_OF_DRIVES = {
    custom.DELAY: "must not have a delay",
    custom.PRM: (
        "has prm = {1:g}, the drive near which its core saturates: must be finite and at least 0"
        " (0: never)"
    ),
}
_OF_COILS = _OF_DRIVES | {
    custom.FEW: "must name a geom, a site or a body after its actuator",
    custom.FIRST: "must be an actuator, since it is the first",
    custom.KIND: "must be a geom, a site or a body",
    custom.REPEATED: "is also named by coil tuple {0:.0f}",
    custom.CONTAINED: "is a part of a body that coil tuple {0:.0f} names",
    custom.UNPOLARIZED: (
        "has no polarization: its user numbers must be mu0 N I/L in T at a drive of 1, along the"
        " axis of the coil"
    ),
    custom.ASLANT: (
        "must be a cylinder with a polarization along its z axis, or a box with one along x, y or z"
    ),
}
_OF_FIELDS = _OF_DRIVES | {
    custom.FEW: "must name a numeric that is a field",
    custom.KIND: "must be a numeric, a body, a site or an actuator",
    custom.MISNAMED: "must have a name that starts with 'field'",
    custom.REPEATED: "is also named by field tuple {0:.0f}",
    custom.SECOND: "is one too many: at most one body or site, and at most one actuator",
}
_OF_IRON = {
    custom.FEW: "must name a numeric, the material, and a geom",
    custom.KIND: "must be a numeric or a geom",
    custom.SHAPE: "must be a sphere, an ellipsoid, a capsule, a cylinder, a box or a plane",
    custom.REPEATED: "is also named by iron tuple {0:.0f}",
    custom.SECOND: "is one too many: one numeric in the tuple, and at most one plane in the model",
}
_OF_CONDUCTORS = {
    custom.FEW: "must name a numeric, its conductivity, and a geom",
    custom.KIND: "must be a numeric or a geom",
    custom.SHAPE: "must be a plane: the upper face of a plate without edges",
    custom.REPEATED: "is also named by conductor tuple {0:.0f}",
    custom.SECOND: "is one too many: one numeric in the tuple",
}
_OF_HYSTERESIS = {
    custom.FEW: "must name a numeric, its loop, and a site",
    custom.KIND: "must be a numeric or a site",
    custom.REPEATED: "is also named by hysteresis tuple {0:.0f}",
    custom.CONTAINED: "is also driven by coil tuple {0:.0f}",
    custom.SECOND: "is one too many: one numeric in the tuple",
}
"""What is wrong with an element: {0} is another tuple, {1} the element's `prm`."""


def _of_tuple(tuples: str, rules: dict[int, str]) -> Forms:
    """Return the sentences that say which element of a tuple breaks which rule, by the rules."""
    element = ": element {other}, {kind} {other_name},"
    return {
        rule: f"{tuples} tuple {{number}} {{name}}{element * (rule != custom.FEW)} {sentence}"
        for rule, sentence in rules.items()
    }


def _of_dipole(*sentences: str) -> dict[int, str]:
    """Return sentences about a dipole, each for a site and then for a geom, a magnet or iron."""
    kinds = "dipole site {number} {name}", "geom {number} {name}"
    both = [sentence.replace("{dipole}", kind) for sentence in sentences for kind in kinds]
    return dict(enumerate(both))


def _of_index(field: str) -> str:
    """Return the sentence about an index in a field of a model that leads out of an array."""
    if field in dict(TEXTS):
        return f"{field} of the model: must end with a zero"
    given = f"{field}[{{other}}] of the model = {{0:.0f}}"
    if not (sizes := SIZES.get(field)):
        return f"{given}: must be at least 0 and less than {{2:.0f}}"
    apart = " behind those before" if field in APART_FIELDS else ""
    given += f" and {sizes}[{{other}}] = {{1:.0f}}"
    return f"{given}: must be a range within {{2:.0f}} elements{apart}"


_TEXT, _CONFIG = "text 'magmotor' = {name}", "config 'act' of magmotor.forces = {other_name}"
_WORDS_RULE = f"must be one or more of the words {', '.join(WORDS)}, separated by spaces"
_OF_GRID = (
    " the table in numeric {other} {other_name}: it is at ({0:.6g}, {1:.6g}, {2:.6g}) m in the"
    " frame of the grid, which reaches from ({3:.6g}, {4:.6g}, {5:.6g}) to"
    " ({6:.6g}, {7:.6g}, {8:.6g}) m and must contain all magnets and all iron"
)
_MESH = "geom {number} {name} is a magnet, by its user numbers: its mesh must"
_MATERIALS = "no number", "{1:g}", "{1:g} {2:g}", "{1:g} {2:g} {3:g}", "{1:g} {2:g} {3:g} ..."

_OF_ERRORS: dict[int, Forms] = {
    error_numbers.COINCIDENCE: {
        number: f"{both} coincide: their force is undefined"
        for number, both in enumerate(
            (
                "dipole sites {number} {name} and {other} {other_name}",
                "the center of magnet geom {number} {name} and dipole site {other} {other_name}",
                "dipole site {number} {name} and the center of magnet geom {other} {other_name}",
                "the centers of magnet geoms {number} {name} and {other} {other_name}",
            )
        )
    },
    error_numbers.OUTSIDE: _of_dipole(
        "{dipole} is outside the grid of" + _OF_GRID,
        "{dipole} is at a node that is not finite of" + _OF_GRID,
        "{dipole} is where numeric {other} {other_name} gives a force that is not finite",
    )
    | {
        error_numbers.AT_NODE + 1: (
            "geom {number} {name} reaches out of the grid, or to a node that is not finite, of"
            + _OF_GRID
        )
    },
    error_numbers.BEHIND: _of_dipole(
        "{dipole} is below the plane of iron (on body {other} {other_name}), where mirror images"
        " do not give the field; mm.check(model) says what keeps it above"
    ),
    error_numbers.UNANSWERED: (
        "iron geom {number} {name}: how it responds to fields is computed in Python, by"
        " mm.save_responses(model, path), and not in the file that MAGMOTOR_RESPONSES names"
    ),
    error_numbers.UNSOLVED: (
        "iron geom {number} {name} is too near other iron, or its image in a plane, for its nodes:"
        " the charges on it cannot be found; put the geoms farther apart, or give the material a"
        " smaller distance of nodes, its third number"
    ),
    error_numbers.CIRCUIT: (
        "iron geom {number} {name} and others form a ring through the coil of geom {other}"
        " {other_name}: flux along a closed ring is not computed; leave a gap between two pieces"
    ),
    error_numbers.COIL: _of_tuple("coil", _OF_COILS),
    error_numbers.FIELD: "numeric {number} {name}: a field " + FIELD_RULE,
    error_numbers.FIELD_TUPLE: _of_tuple("field", _OF_FIELDS),
    error_numbers.IRON: _of_tuple("iron", _OF_IRON),
    error_numbers.MATERIAL: {
        count: f"numeric {{number}} {{name}} = {given}: a material must be a susceptibility, at"
        " least -1, and optionally a saturation magnetization in A/m and the distance of nodes in"
        " m, not negative; all finite"
        for count, given in enumerate(_MATERIALS)
    },
    error_numbers.CONDUCTOR: _of_tuple("conductor", _OF_CONDUCTORS),
    error_numbers.CONDUCTIVITY: {
        count: f"numeric {{number}} {{name}} = {given}: a conductor must have a conductivity in S/m"
        " and optionally a thickness in m, 0 for a half-space; not negative and finite"
        for count, given in enumerate(_MATERIALS)
    },
    error_numbers.BELOW: _of_dipole(
        "{dipole} is below the upper face of a conductor, plane geom {other} {other_name}: only"
        " magnets above it brake"
    ),
    error_numbers.COLD: {
        form: f"{what} tuple {{number}} {{name}} brakes the motion, without the noise of any"
        " temperature: in the same model, no body may have Brownian wrenches, as body {other}"
        " {other_name} does"
        for form, what in enumerate(("conductor", "hysteresis"))
    },
    error_numbers.HYSTERESIS: _of_tuple("hysteresis", _OF_HYSTERESIS),
    error_numbers.LOOP: {
        count: f"numeric {{number}} {{name}} = {given}: a loop must have a coercivity in A/m, which"
        " is positive and finite, and the remanence over the saturation, between 0 and 1"
        for count, given in enumerate(_MATERIALS)
    },
    error_numbers.UNSTORED: {
        error_numbers.NO_PLUGIN: (
            "hysteresis tuple {number} {name}: the plugin magmotor.forces stores what its sites"
            " remember; add it to the model, instead of magmotor.magnetism()"
        ),
        error_numbers.OLD_BINARY: (
            "hysteresis tuple {number} {name}: the model has no room for what its sites remember;"
            " compile it again"
        ),
    },
    error_numbers.IRON_NEARBY: (
        "hysteresis tuple {number} {name}: iron, such as geom {other} {other_name}, must not act in"
        " the same model"
    ),
    error_numbers.UNSETTLED: (
        "site {number} {name} is too near another one with hysteresis: the moments that they give"
        " each other cannot be found"
    ),
    error_numbers.SIZE: (
        "geom {number} {name}: the size of iron and of magnets must be positive and finite"
    ),
    error_numbers.OVERLAP: (
        "bodies {number} {name} and {other} {other_name} are magnets or iron that overlap at the"
        " start, by more than a quarter of the width of the first; move them apart, or exclude"
        " their contact"
    ),
    error_numbers.COUPLED_IRON: (
        "iron geom {number} {name} belongs to a body of coupling tuple {other} {other_name}:"
        " couplings do not apply to iron"
    ),
    error_numbers.MARK: {
        0: f"{_TEXT}: {_WORDS_RULE}",
        error_numbers.OF_CONFIG: f"{_CONFIG}: {_WORDS_RULE}",
        error_numbers.OF_BOTH: (
            f"{_TEXT} and {_CONFIG}: must have the same words, or only one of the two must be given"
        ),
    },
    error_numbers.COUPLING: (
        "coupling tuple {number} {name}: its elements must be two bodies with equal and finite prm"
    ),
    error_numbers.NO_SITE: "magnetometer {number} {name}: its objtype must be 'site'",
    error_numbers.UNMEASURED: (
        "magnetometer {number} {name}: its site {other} {other_name} coincides with a dipole, is"
        " outside the table of a field, or is below the plane of iron"
    ),
    error_numbers.WRENCH: (
        "body {number} {name}: its user numbers must be rows of six, the Brownian wrenches, and"
        " finite"
    ),
    error_numbers.POTENTIAL: (
        "joint {number} {name}: its user numbers must be pairs, the finite Fourier coefficients of"
        " a potential, and the joint must be a slide or a hinge"
    ),
    error_numbers.MOMENT: {
        ELSE: (
            "site {number} {name}: its only user number must be its moment in A m^2, which must be"
            " finite; the direction is its z axis"
        ),
        error_numbers.AT_SATURATION: (
            "site {number} {name} = {0:g}: the moment of a site with hysteresis is that at"
            " saturation, in A m^2, and must not be negative; its z axis may point the other way"
        ),
    },
    error_numbers.PATH: (
        "userdata[{number}] = {0:g}: the numbers that select the noise (seed, replica, factor,"
        " level, first step) must be integers from 0 to 2^53 - 1, a factor at most 2^24 and a level"
        " at most 31, or 32 plus the window for a held path"
    ),
    error_numbers.TIME: (
        "time = {0:g}: must be finite and between -2^53 and 2^53 timesteps while noise acts"
    ),
    error_numbers.INDEX: dict(enumerate(map(_of_index, FIELDS))),
    error_numbers.CONSTANT: (
        "numeric {number} {name}: the magnetic constant must be one positive finite number, mu0 in"
        " the units of the model"
    ),
    error_numbers.POLARIZATION: {
        0: (
            "geom {number} {name}: its user numbers {0:g} {1:g} {2:g} are a polarization in T, at"
            " most 2.5 T (iron has 2.2 T)"
        ),
        error_numbers.INFINITE: (
            "geom {number} {name}: its user numbers {0:g} {1:g} {2:g} are a polarization, and"
            " must be finite"
        ),
    },
    error_numbers.SHAPELESS: (
        "geom {number} {name} has a polarization (its user numbers): it must be a sphere, an"
        " ellipsoid, a capsule, a cylinder, a box or a convex mesh"
    ),
    error_numbers.POLYHEDRON: {
        error_numbers.NOT_CONVEX: f"{_MESH} be convex: decompose it into convex ones, a geom each",
        error_numbers.NOT_CLOSED: f"{_MESH} be closed, and enclose a volume",
        error_numbers.CROWDED: f"{_MESH} have at most {MOST_FACES} faces: simplify it",
    },
    error_numbers.COUPLED_MAGNET: (
        "geom {number} {name} is a magnet of a body of coupling tuple {other} {other_name}:"
        " couplings do not apply to geoms, but to dipole sites"
    ),
    error_numbers.MAGNETIC_IRON: (
        "geom {number} {name} is a magnet, by its user numbers, and iron: it must be one of them"
    ),
    error_numbers.UNLOADED: "the compiled code of magmotor could not be loaded; see stderr",
    error_numbers.TOLERANCE: (
        "numeric {number} {name}: the tolerance must be one number from 0 (exact) to 0.1"
    ),
}


ERRORS = {error: by_form(forms) for error, forms in _OF_ERRORS.items()}
"""The sentences of errors, by their numbers and forms."""


def sentence_of_error(
    error: int,
    number: int,
    name: bytes | None,
    other: int,
    other_name: bytes | None,
    details: Details,
) -> str:
    """Return the sentence of an error with two elements, their names, and numbers."""
    sentence = _chosen(ERRORS[error], int(details[FORM]))
    fields = {"name": _quoted(name), "other_name": _quoted(other_name)}
    if "{kind}" in sentence:
        fields["kind"] = str(mujoco.mju_type2Str(int(details[KIND])))
    return sentence.format(*details, number=number, other=other, **fields)


def sentence_of_notice(
    which: int, number: int, name: bytes | None, other: int, other_name: bytes | None
) -> str:
    """Return the sentence of a notice, or the reason why nothing acts.

    It names up to two elements, by a name or else a number.
    """
    one = _quoted(name) if name else number
    another = _quoted(other_name) if other_name else other
    return _chosen(NOTICES[which], number).format(number=number, one=one, another=another)


def _chosen(forms: Mapping[int, str], form: int) -> str:
    return forms.get(form) or forms[ELSE]


def _quoted(characters: bytes | None) -> str:
    """Return a name or text as a literal, so short that MuJoCo does not cut the message."""
    text = decoded(characters or b"")
    return repr(text if len(text) <= LONGEST else f"{text[:LONGEST]}...")
