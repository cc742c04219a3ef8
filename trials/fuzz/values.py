"""Strategies for valid and hostile arguments, as source text that is evaluated in `material`.

Text says what a value is better than the value does: a finding is printed as the call that anybody
can make again, and an input goes to another process as it is.
"""

import dataclasses
import math
import re
import types
import typing
from functools import cache
from typing import Any

import numpy as np
from hypothesis import strategies as st

import magmotor as mm
from magmotor.device.quantities import is_quantity

from .targets import Parameter
from .words import (
    ARRAYS,
    ATTRIBUTES,
    BY_CLASS,
    BY_NAME,
    DAMAGED_DATA,
    DAMAGED_MODELS,
    DAMAGED_TREES,
    DAMAGES,
    HOSTILE,
    JSON,
    JUNK,
    LATER,
    NUMBERS,
    OTHERS_DATA,
    PATHS,
    SCENES,
    TREES,
)

Text = st.SearchStrategy[str]


def kinds(parameters: tuple[Parameter, ...], owner: Any) -> list[str]:
    """Return the scene classes that a callable accepts by its hints; all if it accepts none.

    For thermostats of any model, and for observables of their runs, these are names of models.
    """
    if owner is not None and owner.__name__ in SCENES:
        return [owner.__name__]
    given = {parameter.name for parameter in parameters}
    if (
        owner in (mm.Langevin, mm.JointNoise)
        or given >= {"model", "kT"}
        or given >= {"model", "run"}
    ):
        return [*TREES]
    taken = [p.hint for p in parameters if p.name in ("scene", "scenes")]
    if owner is not None and not taken:
        hints = typing.get_type_hints(owner.__init__) or typing.get_type_hints(owner)
        taken = [hints.get("scene")]
    names = [c.__name__ for hint in taken for c in classes(hint) if c.__name__ in SCENES]
    return names or [*SCENES]


def classes(hint: Any) -> list[type]:
    """Return the classes in a hint, including nested ones."""
    if isinstance(hint, type) and not typing.get_args(hint):
        return [hint]
    return [c for part in typing.get_args(hint) for c in classes(part)]


@cache
def right(parameter: Parameter, target: str, kind: str) -> Text:
    """Valid arguments."""
    for name in (f"{target}.{parameter.name}", parameter.name):
        if name in BY_NAME and not (
            name == parameter.name
            and parameter.metadata is not None
            and name in ("friction", "axis", "position", "velocity")
        ):
            return filled(BY_NAME[name], kind)
    if parameter.metadata is not None:
        return st.just(repr(parameter.default))
    options = _by_hint(parameter.hint, parameter.doc, kind)
    if parameter.required or parameter.default is None:
        return options
    return st.one_of(options, st.just(repr(parameter.default)))


def filled(texts: list[str], kind: str) -> Text:
    """Texts with the scene class, and a scene of that class, filled in."""
    scene = SCENES.get(kind, ["mm.Disk()"])
    return st.tuples(st.sampled_from(texts), st.sampled_from(scene)).map(
        lambda pair: pair[0].format(kind=repr(kind), bare=kind, scene=pair[1])
    )


@cache
def _by_hint(hint: Any, doc: str, kind: str) -> Text:
    names = [c.__name__ for c in classes(hint)]
    origin = typing.get_origin(hint)
    if "Dataset" not in names and is_array(hint, doc):
        return arrays(doc)
    if any(name in SCENES for name in names) and origin in (None, types.UnionType, typing.Union):
        return st.sampled_from(SCENES[kind])
    if "Dataset" in names:
        ready = [f"run({kind!r})", f"run({kind!r})"]
        if kind in ("Disk", "LangevinParticle"):
            ready += [f"many({kind!r})", f"run({kind!r}, 2)"]
        return st.sampled_from(ready)
    for name in names:
        if name in BY_CLASS:
            one = filled(BY_CLASS[name], kind)
            return one.map("[{}]".format) if origin not in (None, types.UnionType) else one
    simple = {
        "bool": ["True", "False"], "int": ["1", "2", "4"], "float": ["0.1", "0.5", "2.0"],
        "str": ["'symmetric'", "'position'"], "dict": ["{}"], "Path": ["'out.png'"],
    }  # fmt: skip
    for name, texts in simple.items():
        if name in names:
            return st.sampled_from(texts)
    return st.just("None")


def is_array(hint: Any, doc: str) -> bool:
    """Whether an argument is an array according to its hint or docstring."""
    if "Callable" in str(hint):
        return False
    return "array" in doc or "ndarray" in str(hint) or "_SupportsArray" in str(hint)


def arrays(doc: str) -> Text:
    """Arrays of the shapes in a docstring."""
    shapes = re.findall(r"\(([^()]*)\)", doc.partition("shape")[2])
    texts = ["0.5", "np.linspace(0.1, 2.0, 5)"] if not shapes else []
    for shape in shapes:
        lengths = [int(w) if w.isdigit() else 4 for w in re.findall(r"\w+", shape)]
        count = math.prod(lengths)
        texts.append(f"np.linspace(0.1, 2.0, {count}).reshape({tuple(lengths)})")
    return st.sampled_from(texts)


@cache
def hostile(parameter: Parameter, target: str, kind: str) -> Text:
    """Invalid or unusual arguments; three in four have the parameter's own type."""
    near = _near(parameter, target, kind)
    if parameter.name == "executor" or target == "magnetism":
        return near  # without an executor, a sweep starts processes; the other is no argument
    return st.one_of(near, near, near, st.sampled_from(JUNK))


def _near(parameter: Parameter, target: str, kind: str) -> Text:
    good, hint = right(parameter, target, kind), str(parameter.hint)
    names = [c.__name__ for c in classes(parameter.hint)]
    for name in (f"{target}.{parameter.name}", parameter.name):
        if name in HOSTILE:
            return st.sampled_from(HOSTILE[name])
    if parameter.metadata is not None:
        return field_values(parameter.metadata)
    if parameter.name in ("directory", "sweep.sweep_of.path") or target == "sweep.sweep_of":
        return st.one_of(damaged_folders(kind), damaged_folders(kind), st.sampled_from(PATHS))
    if "Path" in names and "BrownianPath" not in names:
        return st.sampled_from(PATHS)
    if "MjData" in names:
        hurt = st.tuples(good, st.sampled_from(DAMAGED_DATA)).map(lambda t: t[1].format(t[0]))
        return st.one_of(hurt, hurt, st.sampled_from(OTHERS_DATA)) if kind in TREES else hurt
    if parameter.name in ("fields", "ranges", "vary", "initial"):
        values = st.sampled_from([*NUMBERS, *ATTRIBUTES])
        whole = st.tuples(good, st.integers(0, 30), values)
        return whole.map(lambda t: _entries(parameter.name, *t))
    if parameter.name == "runs" and target.startswith("render"):
        return damaged(st.just(f"run({kind!r})")).map("[{}]".format)
    if "Dataset" in names:
        return damaged(good)
    if any(name in SCENES for name in names) and parameter.name == "scene":
        others = [scene for scenes in SCENES.values() for scene in scenes]
        return st.one_of(scenes(kind), scenes(kind), st.sampled_from(others))
    if "MjModel" in names:
        damages = DAMAGED_TREES if kind in TREES else DAMAGED_MODELS
        return st.tuples(good, st.sampled_from(damages)).map(lambda t: t[1].format(t[0]))
    if "MjvPerturb" in names:
        return st.sampled_from(["perturb(-1)", "perturb(10**6)", "perturb(-2**31)"])
    if is_array(parameter.hint, parameter.doc):
        return st.tuples(good, st.sampled_from(ARRAYS)).map(lambda t: t[1].replace("{}", t[0]))
    if {"int", "float"} & set(names):
        return st.sampled_from(NUMBERS)
    if "equence" in hint:
        return st.tuples(good, st.sampled_from(["[]", "{0}*2", "({0},)", "[{0}]", "iter({0})"])
                         ).map(lambda t: t[1].format(t[0]))  # fmt: skip
    for name in names:
        if name in BY_CLASS and name != "SmallMotion":
            return st.one_of(good, st.sampled_from(JUNK))
    return st.sampled_from(JUNK)


def _entries(name: str, good: str, place: int, value: str) -> str:
    """A mapping with an invalid entry."""
    keys = ["x", "v", "position", "axis", "orientation", "friction", "sigma", "nonsense", "theta"]
    key = keys[place % len(keys)]
    value = "None" if value == "dropped" else value
    if name == "vary":
        value = value if place % 2 else f"[0.1, {value}]"
    if name == "ranges":
        value = value if place % 2 else f"(0.1, {value})"
    return f"{{{key!r}: {value}}}"


def damaged(dataset: Text) -> Text:
    """A dataset with one change."""
    damages, attributes = st.sampled_from(DAMAGES), st.sampled_from(ATTRIBUTES)
    return st.tuples(damages, st.integers(0, 30), attributes, dataset).map(
        lambda t: t[0].replace("{n}", str(t[1])).replace("{}", t[3]).replace("{value}", t[2])
    )


@cache
def damaged_folders(kind: str) -> Text:
    """The directory of a sweep with a changed file."""
    whole = st.sampled_from([f"folder({kind!r})", f"folder({kind!r}, 'trajectory')"])
    hurt = st.tuples(
        whole, st.sampled_from(["flip", "flip", "cut", "empty", "remove", "folder"]),
        st.integers(0, 999),
    ).map(lambda t: f"damaged_file({t[0]}, {t[1]!r}, {t[2] / 1000})")  # fmt: skip
    edited = st.tuples(whole, st.integers(0, 60), st.sampled_from(JSON)).map(
        lambda t: f"rewritten({t[0]}, {t[1]}, {t[2]})"
    )
    return st.one_of(hurt, edited)


@cache
def scenes(kind: str) -> Text:
    """A scene with an unusual value of a field, usually a valid one."""
    fields = dataclasses.fields(getattr(mm, kind))

    def one(field: Any) -> Text:
        bounds = field.metadata
        if not is_quantity(field) or bounds["choices"] or isinstance(field.default, str):
            return field_values(field).map(lambda text: f"mm.{kind}({field.name}={text})")
        odd = ["5e-324", "1e-200", "1e-30", "1e-9", "1e9", "1e30", "1e100", "1e200", "1e300"]
        if bounds["above"] < 0 and bounds["at_least"] < 0:
            odd += ["-1e300", "-1e30"]
        if bounds["at_least"] <= 0 and bounds["above"] < 0:
            odd += ["0.0"]
        if isinstance(field.default, int):
            odd = ["1", "2", "3", "1000"]
        if size := bounds["size"]:
            odd = [f"({', '.join([text] + ['0.01'] * (size - 1))})" for text in odd]
        return st.sampled_from(odd).map(lambda text: f"mm.{kind}({field.name}={text})")

    return st.one_of([one(field) for field in fields])


@cache
def field_values(field: Any) -> Text:
    """Values of a scene's field: on its bounds, just outside, of another length or type."""
    bounds = field.metadata
    if not is_quantity(field):
        return st.sampled_from(NUMBERS)
    values = list(NUMBERS)
    for name in ("above", "at_least", "below"):
        if math.isfinite(bound := bounds[name]):
            values += [repr(float(v)) for v in (bound, *np.nextafter(bound, (-9e9, 9e9)))] * 2
    if bounds["choices"] or isinstance(field.default, str):
        values = [repr(c) for c in bounds["choices"]] * 3 + ["'nonsense'", "''", "b'planar'", "3"]
        values += ["[(0.1, nan)]", "[(1e300, 0.0)]", "((0.1, 0.2), (1, 2))", "[]", "[(5e-324, 0)]"]
    if size := bounds["size"]:
        values = [f"({', '.join([value] * n)},)" for value in values for n in (size, size + 1)]
    return st.sampled_from(values)


@cache
def instance(kind_of: type, kind: str) -> Text:
    """A valid instance of a class."""
    if kind_of.__name__ in SCENES:
        return st.sampled_from(SCENES[kind_of.__name__])
    return filled(BY_CLASS[kind_of.__name__], kind)


@cache
def odd_instance(kind_of: type, kind: str) -> Text:
    """An instance of a class that checks its arguments, from unusual ones."""
    name = kind_of.__name__
    if name in SCENES:
        return scenes(name)
    if name in ("DiskTheory", "ReducedDisk", "SmallMotion"):
        make = {"SmallMotion": "small_motion"}.get(name, name)
        return scenes(kind).map(lambda scene: f"mm.theory.{make}({scene})")
    if name == "MotorRun":
        return damaged(st.just("run('Motor')")).map("mm.plots.MotorRun('a', {})".format)
    if name in ("Langevin", "JointNoise"):
        made = st.tuples(st.sampled_from(DAMAGED_TREES), instance(kind_of, kind))
        if name == "JointNoise":
            return made.map(
                lambda t: t[1].replace(f"model({kind!r})", t[0].format(f"model({kind!r})"))
            )
        later = st.sampled_from(LATER)
        return st.one_of(
            made.map(lambda t: t[1].replace(f"model({kind!r})", t[0].format(f"model({kind!r})"))),
            st.tuples(later, instance(kind_of, kind)).map(lambda t: t[0].format(t[1])),
        )
    if name == "BrownianPath":
        return st.sampled_from(NUMBERS).map("mm.noise.BrownianPath(1, {})".format)
    if name == "LiveSimulation":
        return st.sampled_from(DAMAGED_MODELS).map(
            lambda t: "live.LiveSimulation(" + t.format("model('free')") + ")"
        )
    return instance(kind_of, kind)
