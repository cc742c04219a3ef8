"""What a sweep is to do: a scene, what varies in it, how it is run, and what is recorded."""

import dataclasses
import itertools
import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from magmotor.checks import check_choice, check_integer, check_number, reject
from magmotor.dataset import scene_from
from magmotor.devices import Scene, device_of
from magmotor.recommendation import recommend
from magmotor.scenes import Top
from magmotor.sweep.axes import Samples, Values, samples_from, values_axis
from magmotor.sweep.case import Case, case_of
from magmotor.sweep.fields import changed, numeric_fields
from magmotor.sweep.measures import TRAJECTORY, measure_of
from magmotor.sweep.seeds import checked_seeds, child
from magmotor.sweep.versions import versions_that_matter


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
        Names what is wrong, its value and the bound.

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
        methods = device_of(self.scene).methods(self.scene)
        if not self.vary and self.samples is None:
            raise reject("vary", dict(self.vary), "one field at least")
        seeds = checked_seeds(self.seeds)
        self._set("seeds", seeds[:1] if isinstance(self.scene, Top) else seeds)
        self._set("measure", self._checked_measure(self.measure))
        if self.replicas is not None:
            check_integer("replicas", self.replicas, at_least=1)
        if self.method is not None:
            check_choice("method", self.method, methods)
        if self.timestep is not None:
            check_number("timestep", self.timestep, above=0)
        check_integer("record_interval", self.record_interval, at_least=1)
        fields = [field for axis in self.axes for field in axis.fields]
        for field in fields:
            if fields.count(field) > 1:
                raise reject("field", field, "varied once")
        if self.method is None or self.timestep is None:
            self._choose()
        check_number("duration", self.duration, at_least=self.timestep or 0.0)
        if self.versions is None:
            self._set("versions", versions_that_matter(self.method or ""))

    def _set(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    def _checked_measure(self, names: Iterable[str]) -> tuple[str, ...]:
        names = tuple(names)
        if not names or len(set(names)) < len(names):
            raise reject("measure", [*names], "different names, one at least")
        if TRAJECTORY in names and len(names) > 1:
            raise reject("measure", [*names], f"{TRAJECTORY} alone, or other names")
        for name in names:
            if name != TRAJECTORY:
                measure_of(self.scene, name)
        return names

    def _choose(self) -> None:
        """Choose the base scene's method, and the shortest of the corners' timesteps."""
        method = self.method or recommend(self.scene, timestep=self.timestep).method
        self._set("method", method)
        if self.timestep is not None:
            return
        steps, mistake = [], None
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
        return int(np.prod(self.shape, dtype=object))

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
        index //= len(self._seeds)
        for axis in reversed(self.axes):
            index, place = divmod(index, len(axis))
            found = axis.at(place) | found
        return found

    def case(self, index: int) -> Case:
        """One of the cases, seeds running fastest."""
        point, own = divmod(index, len(self._seeds))
        fields = changed(self._fields, self._known, self.changes(index))
        told = {"scene_fields": fields, "seed": child(self._seeds[own], point)}
        return case_of({**self._common, **told})

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


def sweep_from(told: dict[str, Any]) -> Sweep:
    """The sweep that `as_json` tells of."""
    names = ("measure", "seeds", "replicas", "method", "timestep", "duration", "record_interval")
    names += ("versions",)
    samples = [samples_from(recipe) for recipe in told["samples"]]
    return Sweep(
        scene=scene_from(told["scene"], told["scene_fields"]),
        vary={tuple(fields): values for fields, values in told["vary"]},
        samples=samples[0] if samples else None,
        **{name: told[name] for name in names},
    )
