"""`add_magnetism`: the plugin and the mark of an `MjSpec`, which let act what it declares.

The words are in the mark, a text, and not in the plugin's key `act`, since `MjSpec.attach` drops
the plugin with its keys. It keeps texts, tuples and numerics, but puts a prefix before their names,
so that they declare nothing. The mark of an attached spec says what the prefix is, and which of the
names were declarations.
"""

from collections.abc import Iterable

import mujoco
import numpy as np

from magmotor.common.arguments import checked
from magmotor.common.exceptions import ArgumentError
from magmotor.mjcf.declarations.marks import WORDS
from magmotor.mjcf.not_acting import NUMERICS, PREFIXES
from magmotor.mjcf.notice_sentences import MARK_NAME
from magmotor_plugin import slots

FORCES, INSTANCE = slots.FORCES.decode(), "magnets"
"""The plugin, and the name of its instance."""


@checked
def add_magnetism(spec: mujoco.MjSpec) -> None:
    """Let everything magnetic in an `MjSpec` act, also what others brought that were attached.

    The other functions that add something do so, too. Call this one after `MjSpec.attach`, which
    drops the plugin, and puts a prefix before the names of the mark, fields, coils, iron,
    conductors, couplings and hysteresis, so that they are none. Names such as `hand/coil` become
    `coil_hand/coil`. Specs that these functions have composed have a mark, from which the prefix is
    known; call this function for any other spec before it is attached.

    Parameters
    ----------
    spec : mujoco.MjSpec
        Gets the plugin `magmotor.forces` and a mark, whose words are those of its own mark, of its
        plugin's key `act`, and of the marks of attached specs. Without any of these, dipoles act.
        The sizes `nuser_site`, `nuser_body`, `nuser_jnt` and `nuser_geom`, if set, increase to what
        is needed.

    Raises
    ------
    ValueError
        An attached spec has another `magnetic_constant` or `magnetic_tolerance` than the spec, or
        another plugin's instance is named `magnets`.

    Examples
    --------
    >>> import mujoco
    >>> import magmotor as mm
    >>> hand, arm = mujoco.MjSpec(), mujoco.MjSpec()
    >>> field = mm.add_field(hand, [0, 0, 0.02])
    >>> _ = arm.attach(hand, prefix="hand/", frame=arm.worldbody.add_frame())
    >>> mm.add_magnetism(arm)
    >>> print(arm.numerics[0].name, arm.texts[0].data)
    field_hand/field fields
    """
    let_act(spec)


def let_act(spec: mujoco.MjSpec, *added: str) -> None:
    """Add or complete the plugin and the mark, with the words of what was added."""
    instance = next((each for each in spec.plugins if each.plugin_name == FORCES), None)
    if instance is None:
        if spec.plugin(INSTANCE) is not None:
            sentence = f"must be that of {FORCES}, which needs this name for its instance"
            raise ArgumentError(f"plugin {INSTANCE!r}", spec.plugin(INSTANCE).plugin_name, sentence)
        spec.activate_plugin(FORCES)
        instance = spec.add_plugin(name=INSTANCE, plugin_name=FORCES, active=True)
    mark = spec.text(MARK_NAME)
    words = [*(mark.data.split() if mark else []), *instance.config.get("act", "").split()]
    for text in spec.texts:
        prefix, found, suffix = text.name.rpartition(MARK_NAME)
        act = text.data.split()
        if found and text.name != MARK_NAME and act and {*act} <= {*WORDS}:
            _give_names_back(spec, prefix, suffix, act)
            spec.delete(text)
            words += act
    if not words and (not added or any(np.any(site.userdata) for site in spec.sites)):
        words = ["dipoles"]
    data = "all" if "all" in words else " ".join(dict.fromkeys([*words, *added]))
    if mark:
        mark.data = data
    else:
        spec.add_text(name=MARK_NAME, data=data)
    instance.config = {}  # which would have to have the same words
    for size, elements in (
        ("nuser_site", spec.sites), ("nuser_body", spec.bodies), ("nuser_jnt", spec.joints),
        ("nuser_geom", spec.geoms),
    ):  # fmt: skip
        if getattr(spec, size) >= 0:  # else MuJoCo counts
            longest = max((len(each.userdata) for each in elements), default=0)
            setattr(spec, size, max(getattr(spec, size), longest))


def _give_names_back(spec: mujoco.MjSpec, prefix: str, suffix: str, words: Iterable[str]) -> None:
    """Put the word in front of names of an attached spec that started with it, if it is marked."""
    for name in NUMERICS:
        own, attached = spec.numeric(name), spec.numeric(f"{prefix}{name}{suffix}")
        if attached is not None:
            numbers, given = [*attached.data], [*own.data] if own else "missing"
            if numbers != given:
                sentence = f"must be as in the spec to which it is attached, where it is {given}"
                raise ArgumentError(f"numeric {attached.name!r}", numbers, sentence)
            spec.delete(attached)
    marked = [each for each in PREFIXES if {"all", each, f"{each}s"} & {*words}] if prefix else []
    fields: dict[str, str] = {}
    for word in marked:
        for each in [*spec.tuples, *(spec.numerics if word == "field" else ())]:
            if each.name.startswith(prefix + word) and each.name.endswith(suffix):
                name = f"{word}_{each.name}"
                if isinstance(each, mujoco.MjsNumeric):
                    fields[each.name] = name
                each.name = name
    for each in spec.tuples:
        numeric = [kind == mujoco.mjtObj.mjOBJ_NUMERIC for kind in each.objtype]
        names = zip(each.objname, numeric, strict=True)
        each.objname = [fields.get(name, name) if is_one else name for name, is_one in names]
