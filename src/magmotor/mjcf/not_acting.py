"""What a model declares that does not act, and why."""

import difflib
import re
from collections.abc import Iterable, Iterator, Sequence

import mujoco
import numpy as np

from magmotor.mjcf import declared
from magmotor.mjcf.declarations.custom import NUMERIC
from magmotor.mjcf.declared import (
    can_move,
    dipole_counts,
    has_plugin,
    name_of,
    site_moments,
    with_kind,
)
from magmotor.mjcf.langevin.temperature import joined
from magmotor.mjcf.lookup import disabled, given_name, number_of
from magmotor.mjcf.notice_sentences import MARK_NAME, ONLY_NAME, resembles_mark
from magmotor_plugin import slots

PREFIXES = ("coupling", "field", "coil", "iron", "conductor", "hysteresis")
"""How the names of tuples start that declare something."""

NUMERICS = ("magnetic_tolerance", "magnetic_constant")
"""Names of numerics that declare something, besides fields."""

ALIKE = 0.9
"""Similarity of names, at most 1, from which one is probably meant as the other."""

ATTACHED = " (MjSpec.attach adds a prefix)"

SKIPPED = "since MuJoCo skips it while the flag actuation is disabled"
"""Why `magnetism` does nothing with some models."""

LISTED = 8
"""Largest number of bodies, pairs or joints that the text lists."""


def listed(entries: Iterable[str]) -> str:
    """Return a list of names as text, which may end with the number of further ones."""
    entries = [*entries]
    more = [f"and {len(entries) - LISTED} more"] if len(entries) > LISTED else []
    return ", ".join(entries[:LISTED] + more)


def idle_elements(
    model: mujoco.MjModel, named: Sequence[str], unmarked: bool, paired: bool
) -> Iterator[str]:
    """Yield what does not act, and why."""
    present = {
        "dipoles": ("user numbers of sites", bool(model.nuser_site and model.site_user.any())),
        "couplings": ("tuples named coupling...", _has_tuples(model, "coupling")),
        "noise": ("user numbers of bodies", bool(model.nuser_body and model.body_user.any())),
        "potentials": ("user numbers of joints", bool(model.nuser_jnt and model.jnt_user.any())),
        "fields": ("numerics named field...", bool(declared.fields(model))),
        "coils": ("tuples named coil...", _has_tuples(model, "coil")),
        "iron": ("tuples named iron...", _has_tuples(model, "iron")),
        "magnets": ("user numbers of geoms", bool(model.nuser_geom and model.geom_user.any())),
        "conductors": ("tuples named conductor...", _has_tuples(model, "conductor")),
        "hysteresis": ("tuples named hysteresis...", _has_tuples(model, "hysteresis")),
    }
    mark = "the mark" if number_of(model, "text", MARK_NAME) >= 0 else "the plugin's act"
    for word, (what, exists) in present.items():
        if exists and word not in named:
            missing = f'there is no mark, such as <text name="{MARK_NAME}" data="{word}"/>'
            yield f"{what}, since {missing if unmarked else f'{mark} does not name {word}'}"
    absent = [word for word in named if not present[word][1]]
    if absent and not unmarked and len(named) < len(present):
        yield f"{joined(absent)}, which {mark} names, since the model has none"
    measured = bool(declared.magnetometers(model))
    acting = ("dipoles", "noise", "potentials", "iron", "magnets", *["fields"] * measured)
    if not any(present[word][1] for word in acting):
        yield 'sites without user numbers (a dipole has user="MOMENT", in A m^2)'
    if "iron" in named and present["iron"][1] and not any(declared.iron(model).values()):
        yield "iron, since its susceptibility is 0"
    magnets = [
        word for word in ("dipoles", "iron", "magnets") if word in named and present[word][1]
    ]
    if magnets and not paired and not measured:
        yield from _idle_magnets(model, magnets, "fields" in named)
        if unnumbered := _unnumbered(model):
            yield f'{listed(unnumbered)}: a site is a dipole if it has user="MOMENT", in A m^2'
    if "noise" in named and (undriven := _undriven(model)):
        yield f"noise of {listed(undriven)}, since what cannot move is not driven"
    yield from renamed(model)
    yield from _misplaced_fields(model)
    if has_plugin(model):
        yield from _idle_plugin(model)
    elif disabled(model, "actuation"):
        yield f"magnetism(), {SKIPPED}"


def _undriven(model: mujoco.MjModel) -> list[str]:
    """Return the bodies with noise that cannot move."""
    fixed = (body for body in range(model.nbody) if not can_move(model, body))
    return [name_of(model, "body", body) for body in fixed if model.body_user[body].any()]


def _idle_plugin(model: mujoco.MjModel) -> Iterator[str]:
    """Yield when MuJoCo does not call the plugin, or not for all."""
    if (model.plugin == slots.register()).sum() > 1:
        yield "further instances of magmotor.forces, since the first one acts on the whole model"
    if disabled(model, "spring") and disabled(model, "damper"):
        yield "magmotor.forces, since MuJoCo skips it if flags spring and damper are both disabled"
    if model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_SLEEP:
        yield "magmotor.forces on sleeping bodies, which it does not wake"


def _idle_magnets(model: mujoco.MjModel, named: Sequence[str], fields: bool) -> Iterator[str]:
    """Yield why dipoles and iron do not act; `named` says which of them there are."""
    bodies = [*dipole_counts(model)] if "dipoles" in named else []
    iron = [geom for geom, value in declared.iron(model).items() if value and "iron" in named]
    shapes = [*declared.polarizations(model)] if "magnets" in named else []
    bodies += model.geom_bodyid[iron + shapes].tolist()
    if not bodies:  # iron without susceptibility
        return
    welds = {int(model.body_weldid[body]) for body in bodies}
    owners = declared.field_owners(model) if fields else set()
    what = joined([word for word in named if word != "iron" or iron])
    one, fixed = len(welds) == 1, not any(can_move(model, body) for body in {*bodies, *owners})
    if fixed and not (one and not owners):
        yield f"the {what}, since none of their bodies can move"
    elif one and owners <= welds:
        also = f", to which the field{'s are' if len(owners) > 1 else ' is'} fixed" * bool(owners)
        yield f"the {what}, since all are on one rigid body{also}"
    else:
        yield f"the {what}, since couplings switch all pairs off (prm is 0, the default)"


def _unnumbered(model: mujoco.MjModel) -> list[str]:
    """Return the sites without user numbers."""
    sites = np.flatnonzero(site_moments(model) == 0).tolist()
    return [with_kind("site", name_of(model, "site", site)) for site in sites]


def renamed(model: mujoco.MjModel) -> Iterator[str]:
    """Yield what a prefix, a suffix or a slip hides, as in models that were attached to another."""
    for kind, prefixes in (("tuple", PREFIXES), ("numeric", ("field",))):
        for k in range(getattr(model, f"n{kind}")):
            name = name_of(model, kind, k)
            for prefix in () if name.startswith(prefixes) else prefixes:
                attached = f"/{prefix}" in name or f"_{prefix}" in name
                slip = re.fullmatch(rf"{prefix}s?[ _-]?\d*", name, re.IGNORECASE)
                if attached or slip:
                    only = f"names that start with {prefix} count"
                    then = ", so that its sites are permanent magnets" * (prefix == "coil")
                    yield f"{kind} {name!r}, since only {only}{ATTACHED * attached}{then}"
    for k in range(model.nnumeric):
        name = name_of(model, "numeric", k)
        attached = [known for known in NUMERICS if name.endswith((f"/{known}", f"_{known}"))]
        alike = difflib.get_close_matches(name.casefold(), NUMERICS, 1, ALIKE)
        for known in (attached or alike) if name not in NUMERICS else ():
            yield f"numeric {name!r}, since only the name {known} counts{ATTACHED * bool(attached)}"
    for k in range(model.ntext):
        name = name_of(model, "text", k)
        if resembles_mark(name) and name != MARK_NAME:
            yield f"text {name!r}, {ONLY_NAME}"


def _misplaced_fields(model: mujoco.MjModel) -> Iterator[str]:
    """Yield tuples that name a field, but are not read since their own names do not."""
    for k in range(model.ntuple):
        name, first = given_name(model, "tuple", k), int(model.tuple_adr[k])
        for i in range(first, first + int(model.tuple_size[k])):
            kind, number = model.tuple_objtype[i], model.tuple_objid[i]
            field = name_of(model, "numeric", number) if kind == NUMERIC else ""
            if field.startswith("field") and not name.startswith(PREFIXES):
                what = "since the name of a tuple that places or drives a field starts with field"
                yield f"tuple {name!r} on {field!r}, {what}"


def _has_tuples(model: mujoco.MjModel, prefix: str) -> bool:
    return any(given_name(model, "tuple", k).startswith(prefix) for k in range(model.ntuple))
