"""The sentences of notices, and of the reasons why nothing acts on a model.

A notice has one sentence, or several, of which the number of an element chooses one: its form. In
a sentence, `{one}` and `{another}` are the quoted names of elements, or else their numbers;
`{number}` is that of the first one. Python and the C part of the library form the sentences.
"""

import difflib
from collections.abc import Mapping
from itertools import combinations

from magmotor.mjcf.declarations.marks import WORDS
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

Forms = str | Mapping[int, str]
"""A sentence, or several by their forms."""

ELSE = -1
"""The form of the sentence for all others."""

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

_ON_ONE_BODY = (
    "its dipole sites, iron and fields are all on one rigid body, so that none acts on another"
)
_OTHER_SITES = "; sites without a user number ({number}) are no dipoles"
_DECLARED = {
    sum(WORDS[word] for word in words): f"it declares {' and '.join(words)}, but no mark names them"
    for count in (1, 2, 3)
    for words in combinations(("dipoles", "fields", "iron"), count)
}
_INERT: dict[int, Forms] = {
    NO_DIPOLES: (
        'it has no dipole sites (a site with user="MOMENT" in A m^2, along its z axis); Brownian'
        " wrenches and potentials need a mark and user numbers of bodies or joints"
    ),
    ONE_RIGID_BODY: {0: _ON_ONE_BODY, ELSE: _ON_ONE_BODY + _OTHER_SITES},
    NONE_MOVES: "none of the bodies with dipole sites can move (they have no joints)",
    SWITCHED_OFF: "its couplings turn all magnetism off (prm is 0, the default)",
    NOT_NAMED: "neither a mark nor a site with a user number names dipoles",
    NOT_MARKED: _DECLARED,
    NOT_MAGNETIZED: "the susceptibility of its iron is 0",
    LEFT_ALONE: (
        "its user numbers may have another meaning; to say which of them act, add"
        ' <custom><text name="magmotor" data="dipoles couplings noise potentials"/></custom>'
    ),
}
_OF_NOTICES: dict[int, Forms] = {
    ASSUMED: (
        "{number} sites that each have one user number act as dipoles; to confirm or change this,"
        ' add <custom><text name="magmotor" data="dipoles"/></custom> to the model'
    ),
    NO_PASSIVE_FORCES: (
        "MuJoCo skips the plugin magmotor.forces, since the flags spring and damper are both"
        " disabled; enable one of them"
    ),
    SLEEPING: "a sleeping body is not woken by forces of the plugin magmotor.forces",
    UNRESOLVED: (
        "within one timestep, magnetism moved body {one} by about its size, or alone would turn it"
        " by more than 4 rad from rest, so that it may fly apart; mm.check(model) proposes a"
        " timestep and contacts for magnets that touch"
    ),
    SUNKEN: (
        "body {one} has sunk into body {another} by more than a quarter of its width, so that their"
        " dipoles are too near; mm.check(model) proposes a timestep and contacts for magnets that"
        " touch"
    ),
    OVERWRITTEN: (
        "magnetism() has overwritten the force that was set in xfrc_applied of body {one}: it sets"
        " this row at the start of each step, so that a force has an effect only if it is set"
        " between mj_step1 and mj_step2, and added to what is there; set qfrc_applied"
        " (mm.apply_perturbation does, for the viewer's mouse), or let the plugin magmotor.forces"
        " act, which leaves xfrc_applied to you"
    ),
    NOT_A_MARK: (
        "text {one} does not say what acts, "
        + ONLY_NAME
        + " (MjSpec.attach adds prefixes to names)"
    ),
}


def by_form(forms: Forms) -> Mapping[int, str]:
    """Return sentences by their forms."""
    return {ELSE: forms} if isinstance(forms, str) else forms


NOTICES = {notice: by_form(forms) for notice, forms in _OF_NOTICES.items()} | {
    reason: {form: f"nothing acts on this model: {why}" for form, why in by_form(forms).items()}
    for reason, forms in _INERT.items()
}
"""The sentences of notices, by their numbers and forms."""


def resembles_mark(name: str) -> bool:
    """Whether the name of a text is nearly that of a mark, or contains it."""
    name = name.lower()
    near = difflib.SequenceMatcher(None, name, MARK_NAME).ratio() >= ALIKE
    return name != "" and (near or MARK_NAME in name)
