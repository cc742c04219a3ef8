"""Definition of a sweep: a scene, what varies, how each case is run, and what is recorded."""

import dataclasses
import itertools
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, get_args

from magmotor.advice.recommendation import Recommendation
from magmotor.common.checks import check_choice, check_integer, check_number, check_type, elements
from magmotor.common.exceptions import ArgumentError, InputError
from magmotor.common.versions import versions_that_matter
from magmotor.device.device import SCENES, Scene
from magmotor.device.provenance import fields_of, scene_from
from magmotor.run.recommend import Engines, recommend
from magmotor.sweep.axes import Samples, Values, changed, numeric_fields, samples_from, values_axis
from magmotor.sweep.case import Case, case_of, checked_seeds, child
from magmotor.sweep.measures import TRAJECTORY, FromFile, imported, is_own, measure_of, named

MOST_RUNS = 10**8
"""Largest number of cases times replicas; one number for each takes 0.8 GB."""

MOST_FREE = 10
"""Most independent fields for which a timestep is chosen, by `recommend` at all 2^10 corners."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Sweep:
    """A parameter sweep: its cases are all combinations of axes and seeds, generated on demand.

    Parameters
    ----------
    scene : Top, Motor, Disk or LangevinParticle
        Provides all values that do not vary.
    vary : mapping of str or tuple of str to iterable of float
        Values of a numeric field, or of several fields that are equal; `position_x` is a component.
    samples : Samples, optional
        Points of a random design, in other fields than those of `vary`.
    seeds : int or iterable of int
        Seeds, or how many of 0, 1, ...: from each, `numpy.random.SeedSequence.spawn` derives one
        child per point. A top has no noise, so only the first seed is used.
    replicas : int, optional
        Independent runs within a case, computed together by the engine.
    measure : iterable of str
        What to record: names in `measures(scene)`, functions `package.module:function` of run and
        scene, or `trajectory` alone for the whole run.
    duration : float
        In seconds; for the disk, dimensionless.
    method, timestep : optional
        As in `simulate`; by default the method that `recommend` returns for the scene, and its
        shortest timestep at the sweep's corners, which `run` prints.
    engine : str
        As in `recommend`; it has no effect if a method is given.
    record_interval : int
        As in `simulate`.
    versions : mapping, optional
        Versions that workers must have; by default those of this process.

    Attributes
    ----------
    choice : Recommendation or None
        What `method` or `timestep` was chosen by, if it was not given.

    Raises
    ------
    ValueError
        Bad input, or more than 1e8 cases times replicas; the message names the argument, its value
        and the bound.

    Examples
    --------
    >>> import magmotor as mm
    >>> sweep = mm.sweep.Sweep(
    ...     scene=mm.Top(),
    ...     vary={"tilt": [0.02, 0.04], "friction": [0.1, 0.2, 0.3]},
    ...     measure=["max_spin"],
    ...     duration=60.0,
    ... )
    >>> sweep.shape  # tilt, friction, seed
    (2, 3, 1)
    """

    scene: Scene
    vary: Mapping[Any, Iterable[float]] = dataclasses.field(default_factory=dict)
    samples: Samples | None = None
    seeds: int | Iterable[int] = 1
    replicas: int | None = None
    measure: Iterable[str]
    duration: float
    method: str | None = None
    timestep: float | None = None
    engine: Engines = "mujoco"
    record_interval: int = 1
    versions: Mapping[str, str] | None = None
    choice: Recommendation | None = dataclasses.field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        """Check all arguments and choose those that are not given."""
        check_type("scene", self.scene, Scene)
        methods = self.scene.device.methods(self.scene)
        self._check_axes()
        seeds = checked_seeds(self.seeds)
        self._set("seeds", seeds if self.scene.device.is_random else seeds[:1])
        self._set("measure", self._checked_measure(self.measure))
        if self.replicas is not None:
            check_integer("replicas", self.replicas, at_least=1)
        if (runs := math.prod(self.shape) * (self.replicas or 1)) > MOST_RUNS:
            raise ArgumentError("cases times replicas", runs, f"must be at most {MOST_RUNS}")
        if self.method is not None:
            check_choice("method", self.method, methods)
        if self.timestep is not None:
            check_number("timestep", self.timestep, above=0)
        check_choice("engine", self.engine, get_args(Engines))
        check_integer("record_interval", self.record_interval, at_least=1)
        if self.method is None or self.timestep is None:
            self._choose()
        check_number("duration", self.duration, at_least=self.timestep or 0.0)
        if self.versions is None:
            self._set("versions", versions_that_matter(self.method or ""))
        elif not _is_text_mapping(self.versions):
            raise ArgumentError(
                "versions", self.versions, "must be a mapping of names to versions, both strings"
            )

    def _check_axes(self) -> None:
        """Check what varies: some fields, and each only once."""
        if not isinstance(self.vary, Mapping):
            raise ArgumentError("vary", self.vary, "must be a mapping of fields to their values")
        if not isinstance(self.samples, Samples | None):
            raise ArgumentError(
                "samples", self.samples, "must be a magmotor.sweep.Samples, or None"
            )
        if not self.vary and self.samples is None:
            raise ArgumentError("vary", dict(self.vary), "must have at least one field")
        fields = [field for axis in self.axes for field in axis.fields]
        for field in fields:
            if fields.count(field) > 1:
                raise ArgumentError("field", field, "must be varied only once")

    def _set(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    def _checked_measure(self, measure: Any) -> tuple[str, ...]:
        names = checked_names("measure", measure)
        if not names or len(set(names)) < len(names):
            raise ArgumentError("measure", [*names], "must be distinct names, at least one")
        if TRAJECTORY in names and len(names) > 1:
            raise ArgumentError("measure", [*names], f"{TRAJECTORY} excludes other measures")
        for name in names:
            if name != TRAJECTORY:
                measure_of(self.scene, name)
            if is_own(name) and not isinstance(name, FromFile):
                imported(name)
        return names

    def _choose(self) -> None:
        """Choose the method for the base scene and the shortest timestep at the corners."""
        method = self.method
        if method is None:
            choice = recommend(self.scene, timestep=self.timestep, engine=self.engine)
            method = choice.method
            self._set("method", method)
            self._set("choice", choice)
        if self.timestep is not None:
            return
        choices, failure = [], None
        free = sum(len(a.fields) if isinstance(a, Samples) else 1 for a in self.axes)
        if free > MOST_FREE:
            raise ArgumentError(
                "timestep", None, f"must be given if more than {MOST_FREE} fields vary"
            )
        for corner in itertools.product(*[axis.ends for axis in self.axes]):
            changes = {name: value for part in corner for name, value in part.items()}
            try:
                corner = self._scene(changes)
            except ValueError as error:
                failure = error
                continue
            choices.append(recommend(corner, method=method))
        if not choices:
            assert failure is not None
            raise failure
        shortest = min(choices, key=lambda choice: choice.timestep)
        self._set("timestep", shortest.timestep)
        self._set("choice", shortest)

    @cached_property
    def axes(self) -> tuple[Values | Samples, ...]:
        """The axes, in the order of the dimensions."""
        drawn = () if self.samples is None else (self.samples.of(self.scene),)
        return *drawn, *[values_axis(self.scene, names, v) for names, v in self.vary.items()]

    @property
    def shape(self) -> tuple[int, ...]:
        """Lengths of the axes, and the number of seeds."""
        return (*[len(axis) for axis in self.axes], len(self._seeds))

    def __len__(self) -> int:
        """Return the number of cases."""
        return math.prod(self.shape)

    @property
    def _seeds(self) -> tuple[int, ...]:
        assert isinstance(self.seeds, tuple)
        return self.seeds

    @cached_property
    def _fields(self) -> dict[str, Any]:
        return fields_of(self.scene)

    @cached_property
    def _numeric_fields(self) -> dict[str, Any]:
        return numeric_fields(self.scene)

    def _scene(self, changes: dict[str, Any]) -> Scene:
        kind = type(self.scene).__name__
        return scene_from(kind, changed(self._fields, self._numeric_fields, changes))

    @cached_property
    def _common(self) -> dict[str, Any]:
        """The part of the specification that all cases share."""
        assert self.timestep is not None
        return {
            "scene": type(self.scene).__name__,
            "method": self.method,
            "timestep": float(self.timestep),
            "duration": float(self.duration),
            "record_interval": int(self.record_interval),
            "replicas": None if self.replicas is None else int(self.replicas),
            "versions": self.versions,
        }

    def changes(self, index: int) -> dict[str, float | int]:
        """Return the fields in which a case differs from the scene."""
        found = {}
        index = check_integer("index", index, at_least=0, at_most=len(self) - 1)
        index //= len(self._seeds)
        for axis in reversed(self.axes):
            index, position = divmod(index, len(axis))
            found = axis.at(position) | found
        return found

    def case(self, index: int) -> Case:
        """Return a case by its index, in which the seed varies fastest."""
        fields = changed(self._fields, self._numeric_fields, self.changes(index))
        point, own = divmod(index, len(self._seeds))
        spec = {"scene_fields": fields, "seed": child(self._seeds[own], point)}
        return case_of({**self._common, **spec})

    def label(self, index: int) -> str:
        """Return a text label of a case: the values of what varies."""
        words = [f"{name} = {value:.6g}" for name, value in self.changes(index).items()]
        if len(self._seeds) > 1:
            words.append(f"seed = {self._seeds[index % len(self._seeds)]}")
        return ", ".join(words)

    def __iter__(self) -> Iterator[Case]:
        """Iterate over all cases."""
        return map(self.case, range(len(self)))

    def as_json(self) -> dict[str, Any]:
        """Return the complete specification."""
        samples = [axis.as_json() for axis in self.axes if isinstance(axis, Samples)]
        grids = [axis for axis in self.axes if isinstance(axis, Values)]
        return {
            **self._common,
            "scene_fields": self._fields,
            "samples": samples,
            "vary": [[list(axis.fields), list(axis.values)] for axis in grids],
            "seeds": list(self._seeds),
            "measure": list(self.measure),
        }


def checked_names(argument: str, names: Any) -> tuple[str, ...]:
    """Return names as a tuple; ValueError unless they are a list of strings."""
    sentence = "must be a list of names"
    if isinstance(names, str):
        raise ArgumentError(argument, names, f"{sentence}: write [{names!r}]")
    if callable(names):
        names = [names]
    found = tuple(elements(argument, names, sentence))
    for name in found:
        if callable(name):
            raise ArgumentError(
                argument, names, f"{sentence}; a function is named by {named(name)}"
            )
        if not isinstance(name, str):
            raise ArgumentError(argument, names, sentence)
    return found


def _is_text_mapping(versions: Any) -> bool:
    if not isinstance(versions, Mapping):
        return False
    return all(isinstance(text, str) for pair in versions.items() for text in pair)


def sweep_from(spec: Mapping[str, Any], *, measures: Iterable[str] = ()) -> Sweep:
    """Return the sweep that `as_json` specifies.

    Parameters
    ----------
    spec : mapping
        It may be untrusted: a function named in its `measure` is not imported.
    measures : iterable of str
        Those of its measures `package.module:function` that may be imported, which running the
        sweep requires.

    Raises
    ------
    ValueError
        `spec` does not specify a sweep, or `measures` names something else than its measures.
    """
    allowed = checked_names("measures", measures)
    _check_spec(spec)
    names = [FromFile(n) if is_own(n) and n not in allowed else n for n in spec["measure"]]
    for name in allowed:
        if not any(map(is_own, names)):
            raise ArgumentError(
                "measures", name, "must be left out: no measure of this sweep is its user's own"
            )
        check_choice("measures", name, tuple(filter(is_own, names)))
    arguments = ("seeds", "replicas", "method", "timestep", "duration", "record_interval")
    try:
        samples = [samples_from(recipe) for recipe in spec["samples"]]
        return Sweep(
            scene=scene_from(spec["scene"], spec["scene_fields"]),
            vary={tuple(fields): values for fields, values in spec["vary"]},
            samples=samples[0] if samples else None,
            measure=names,
            versions=spec["versions"],
            **{name: spec[name] for name in arguments},
        )
    except ValueError:
        raise
    except Exception as error:  # a file may hold anything
        kind = type(error).__name__
        raise InputError(f"the sweep's specification is invalid ({kind}: {error})") from None


def _check_spec(spec: Any) -> None:
    """Check what `Sweep` does not check, and that nothing is missing that it would choose."""
    if not isinstance(spec, Mapping):
        raise ArgumentError("sweep", spec, "must be the specification of a sweep, a mapping")
    missing = sorted(SPEC_ENTRIES - spec.keys())
    if missing:
        raise ArgumentError(
            "sweep", sorted(map(str, spec)), f"the entries lack {', '.join(missing)}"
        )
    check_choice("scene", spec["scene"], tuple(SCENES))
    for name in ("method", "timestep"):
        if spec[name] is None:
            raise ArgumentError(name, None, "must be given")
    for name in ("measure", "vary", "samples", "seeds"):
        if not isinstance(spec[name], list):
            raise ArgumentError(name, spec[name], "must be a list")
    for axis in spec["vary"]:
        pair = isinstance(axis, list) and len(axis) == 2
        if not pair or not all(isinstance(part, list) for part in axis):
            raise ArgumentError("vary", axis, "must be a list of fields and a list of values")
    if len(spec["samples"]) > 1:
        raise ArgumentError("samples", spec["samples"], "must be at most one design")
    checked_names("measure", spec["measure"])


SPEC_ENTRIES = frozenset(
    {"scene", "scene_fields", "method", "timestep", "duration", "record_interval", "replicas"}
    | {"versions", "samples", "vary", "seeds", "measure"}
)
"""The entries of `as_json`."""
