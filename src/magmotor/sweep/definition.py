"""What a sweep is to do: a scene, what varies in it, how it is run, and what is recorded."""

import dataclasses
import itertools
import json
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from magmotor.common.checks import (
    check_choice,
    check_integer,
    check_number,
    check_type,
    elements,
    reject,
)
from magmotor.common.versions import versions_that_matter
from magmotor.device.device import SCENES, Scene
from magmotor.device.provenance import scene_from
from magmotor.run.recommend import recommend
from magmotor.sweep.axes import Samples, Values, changed, numeric_fields, samples_from, values_axis
from magmotor.sweep.case import Case, case_of, checked_seeds, child
from magmotor.sweep.measures import TRAJECTORY, FromFile, imported, is_own, measure_of

MOST_RUNS = 10**8
"""Cases times replicas; a number of each is 0.8 GB."""

MOST_FREE = 10
"""Numbers that vary on their own, at whose 2^10 corners a timestep is recommended."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Sweep:
    """A parameter sweep: the cases are all combinations of its axes and seeds, made as needed.

    Parameters
    ----------
    scene : Top, Motor, Disk or LangevinParticle
        What does not vary.
    vary : mapping of str or tuple of str to iterable of float
        Values of a numeric field, or of several that are to be equal; `position_x` is a component.
    samples : Samples, optional
        Points of a random design, in other fields.
    seeds : int or iterable of int
        Seeds, or how many of 0, 1, ...: from each, every point gets a child of its own by
        `numpy.random.SeedSequence.spawn`. Of a top, which has no noise, only the first counts.
    replicas : int, optional
        Independent runs within a case, which the engine takes side by side.
    measure : iterable of str
        What is recorded: names in `measures(scene)`, functions `package.module:function` of run
        and scene, or `trajectory` alone: the whole run.
    duration : float
        In seconds; of the disk dimensionless.
    method, timestep : optional
        As in `simulate`; by default the method that `recommend` has for the scene, and its shortest
        timestep at the sweep's corners.
    record_interval : int
        As in `simulate`.
    versions : mapping, optional
        Of what computes; by default those here.

    Raises
    ------
    ValueError
        Names what is wrong, its value and the bound; cases times replicas are at most 1e8.

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
    record_interval: int = 1
    versions: Mapping[str, str] | None = None

    def __post_init__(self) -> None:
        """Check everything, and choose what is not given."""
        check_type("scene", self.scene, Scene)
        methods = self.scene.device.methods(self.scene)
        if not isinstance(self.vary, Mapping):
            raise reject("vary", self.vary, "must be a mapping of fields to their values")
        if not isinstance(self.samples, Samples | None):
            raise reject(
                "samples", self.samples, "must be an object of magmotor.sweep.Samples, or None"
            )
        if not self.vary and self.samples is None:
            raise reject("vary", dict(self.vary), "must be one field at least")
        seeds = checked_seeds(self.seeds)
        self._set("seeds", seeds if self.scene.device.is_random else seeds[:1])
        self._set("measure", self._checked_measure(self.measure))
        if self.replicas is not None:
            check_integer("replicas", self.replicas, at_least=1)
        if (runs := math.prod(self.shape) * (self.replicas or 1)) > MOST_RUNS:
            raise reject("runs, cases times replicas", runs, f"must be at most {MOST_RUNS}")
        if self.method is not None:
            check_choice("method", self.method, methods)
        if self.timestep is not None:
            check_number("timestep", self.timestep, above=0)
        check_integer("record_interval", self.record_interval, at_least=1)
        fields = [field for axis in self.axes for field in axis.fields]
        for field in fields:
            if fields.count(field) > 1:
                raise reject("field", field, "must be varied once")
        if self.method is None or self.timestep is None:
            self._choose()
        check_number("duration", self.duration, at_least=self.timestep or 0.0)
        if self.versions is None:
            self._set("versions", versions_that_matter(self.method or ""))
        elif not _is_of_text(self.versions):
            raise reject(
                "versions", self.versions, "must be a mapping of names to versions, both str"
            )

    def _set(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    def _checked_measure(self, measure: Any) -> tuple[str, ...]:
        names = checked_names("measure", measure)
        if not names or len(set(names)) < len(names):
            raise reject("measure", [*names], "must be different names, one at least")
        if TRAJECTORY in names and len(names) > 1:
            raise reject("measure", [*names], f"must be {TRAJECTORY} alone, or other names")
        for name in names:
            if name != TRAJECTORY:
                measure_of(self.scene, name)
            if is_own(name) and not isinstance(name, FromFile):
                imported(name)
        return names

    def _choose(self) -> None:
        """Choose the base scene's method, and the shortest of the corners' timesteps."""
        method = self.method or recommend(self.scene, timestep=self.timestep).method
        self._set("method", method)
        if self.timestep is not None:
            return
        steps, mistake = [], None
        free = sum(len(a.fields) if isinstance(a, Samples) else 1 for a in self.axes)
        if free > MOST_FREE:
            raise reject(
                "timestep", None, f"must be given where more than {MOST_FREE} numbers vary"
            )
        for corner in itertools.product(*[axis.ends for axis in self.axes]):
            changes = {name: value for part in corner for name, value in part.items()}
            try:
                steps.append(recommend(self._scene(changes), method=method).timestep)
            except ValueError as error:
                mistake = error
        if not steps:
            assert mistake is not None
            raise mistake
        self._set("timestep", min(steps))

    @cached_property
    def axes(self) -> tuple[Values | Samples, ...]:
        """What varies, in the order of the dimensions."""
        drawn = () if self.samples is None else (self.samples.of(self.scene),)
        return *drawn, *[values_axis(self.scene, names, v) for names, v in self.vary.items()]

    @property
    def shape(self) -> tuple[int, ...]:
        """Lengths of the axes, and the number of seeds."""
        return (*[len(axis) for axis in self.axes], len(self._seeds))

    def __len__(self) -> int:
        """How many cases."""
        return math.prod(self.shape)

    @property
    def _seeds(self) -> tuple[int, ...]:
        assert isinstance(self.seeds, tuple)
        return self.seeds

    @cached_property
    def _fields(self) -> dict[str, Any]:
        return json.loads(json.dumps(dataclasses.asdict(self.scene)))

    @cached_property
    def _known(self) -> dict[str, Any]:
        return numeric_fields(self.scene)

    def _scene(self, changes: dict[str, Any]) -> Scene:
        kind = type(self.scene).__name__
        return scene_from(kind, changed(self._fields, self._known, changes))

    @cached_property
    def _common(self) -> dict[str, Any]:
        """What all cases have."""
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
        """What a case has instead of the scene's own numbers."""
        found = {}
        index = check_integer("index", index, at_least=0, at_most=len(self) - 1)
        index //= len(self._seeds)
        for axis in reversed(self.axes):
            index, place = divmod(index, len(axis))
            found = axis.at(place) | found
        return found

    def case(self, index: int) -> Case:
        """One of the cases, seeds running fastest."""
        fields = changed(self._fields, self._known, self.changes(index))
        point, own = divmod(index, len(self._seeds))
        spec = {"scene_fields": fields, "seed": child(self._seeds[own], point)}
        return case_of({**self._common, **spec})

    def label(self, index: int) -> str:
        """A case in words: what varies."""
        words = [f"{name} = {value:.6g}" for name, value in self.changes(index).items()]
        if len(self._seeds) > 1:
            words.append(f"seed = {self._seeds[index % len(self._seeds)]}")
        return ", ".join(words)

    def __iter__(self) -> Iterator[Case]:
        """All cases, one after another."""
        return map(self.case, range(len(self)))

    def as_json(self) -> dict[str, Any]:
        """All that tells it from other sweeps."""
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
    """Names as a tuple; ValueError if they are no list of text."""
    found = tuple(elements(argument, names, "must be a list of names"))
    if not all(isinstance(name, str) for name in found):
        raise reject(argument, names, "must be a list of names")
    return found


def _is_of_text(versions: Any) -> bool:
    if not isinstance(versions, Mapping):
        return False
    return all(isinstance(text, str) for pair in versions.items() for text in pair)


def sweep_from(spec: Mapping[str, Any], *, measures: Iterable[str] = ()) -> Sweep:
    """The sweep that `as_json` tells of.

    Parameters
    ----------
    spec : mapping
        May be anybody's: nothing is imported because its `measure` names it.
    measures : iterable of str
        Those of its measures `package.module:function` that may be imported, so that the sweep can
        be run.

    Raises
    ------
    ValueError
        It tells of no sweep, or `measures` names what is not among its measures.
    """
    allowed = checked_names("measures", measures)
    _check_spec(spec)
    names = [FromFile(n) if is_own(n) and n not in allowed else n for n in spec["measure"]]
    for name in allowed:
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
        raise ValueError(f"sweep: must be as a sweep tells it ({kind}: {error})") from None


def _check_spec(spec: Any) -> None:
    """Check what is spec as far as `Sweep` would not, or would choose what is missing."""
    if not isinstance(spec, Mapping):
        raise reject("sweep", spec, "must be what a sweep tells, a mapping")
    missing = sorted(SPEC_ENTRIES - spec.keys())
    if missing:
        raise reject("sweep", sorted(map(str, spec)), f"must be with {', '.join(missing)}, too")
    check_choice("scene", spec["scene"], tuple(SCENES))
    for name in ("method", "timestep"):
        if spec[name] is None:
            raise reject(name, None, "must be given")
    for name in ("measure", "vary", "samples", "seeds"):
        if not isinstance(spec[name], list):
            raise reject(name, spec[name], "must be a list")
    for axis in spec["vary"]:
        pair = isinstance(axis, list) and len(axis) == 2
        if not pair or not all(isinstance(part, list) for part in axis):
            raise reject("vary", axis, "must be a list of fields and one of values")
    if len(spec["samples"]) > 1:
        raise reject("samples", spec["samples"], "must be one design at most")
    checked_names("measure", spec["measure"])


SPEC_ENTRIES = frozenset(
    {"scene", "scene_fields", "method", "timestep", "duration", "record_interval", "replicas"}
    | {"versions", "samples", "vary", "seeds", "measure"}
)
"""What `as_json` has."""
