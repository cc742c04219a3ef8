"""Axes of a sweep: the values that fields take, listed or drawn by a random design."""

import dataclasses
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import islice
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.common.arguments import checked
from magmotor.common.checks import check_choice, check_integer, check_number, elements
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import Fractions
from magmotor.device.device import Scene
from magmotor.device.quantities import check_value, is_quantity
from magmotor.noise import check_seed
from magmotor.numerics.reproducible import applied

DESIGNS = ("random", "latin", "sobol")

MOST = 2**20
"""Largest number of values of an axis, points of a design, or seeds."""


def listed(name: str, values: Any) -> tuple[Any, ...]:
    """Return an iterable as a tuple; ValueError if it is a string, not iterable, or too long."""
    found = tuple(islice(elements(name, values, "must be a list of numbers"), MOST + 1))
    if len(found) > MOST:
        raise ArgumentError(
            f"number of values of {name}", f"over {MOST}", f"must be at most {MOST}"
        )
    return found


def checked_fields(names: Any) -> tuple[str, ...]:
    """Return the name of a field, or a tuple of names, as a tuple; ValueError if it is neither."""
    found = (names,) if isinstance(names, str) else names
    if not isinstance(found, tuple) or not all(isinstance(name, str) for name in found):
        raise ArgumentError("field", names, "must be a name, or a tuple of names")
    return found


@dataclass(frozen=True)
class Values:
    """An axis along which one or more fields take the same listed values."""

    fields: tuple[str, ...]
    values: tuple[float | int, ...]

    def __post_init__(self) -> None:
        """Check what does not depend on the scene."""
        fields, values = checked_fields(self.fields), listed("values", self.values)
        for value in values:
            check_number("value", value)
        if not fields or not values:
            raise ArgumentError(
                "values", [*values], "must be at least one value of at least one field"
            )
        object.__setattr__(self, "fields", fields)
        object.__setattr__(self, "values", values)

    @property
    def name(self) -> str:
        """The name of the dimension."""
        return self.fields[0]

    def __len__(self) -> int:
        """Return the number of values."""
        return len(self.values)

    def at(self, index: int) -> dict[str, float | int]:
        """Return the value of each field at an index."""
        check_integer("index", index, at_least=0, at_most=len(self) - 1)
        return dict.fromkeys(self.fields, self.values[index])

    @property
    def ends(self) -> tuple[dict[str, float | int], ...]:
        """The fields at the smallest and at the largest value."""
        return tuple(dict.fromkeys(self.fields, end(self.values)) for end in (min, max))

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return the values of each field, shape (n,)."""
        return dict.fromkeys(self.fields, np.array(self.values))


def values_axis(scene: Scene, names: str | tuple[str, ...], values: Iterable[float]) -> Values:
    """Return a checked axis of listed values.

    Parameters
    ----------
    scene : Top, Motor, Disk or LangevinParticle
    names : str or tuple of str
        A field, or several with equal values.
    values : iterable of float

    Raises
    ------
    ValueError
        A field is unknown, a value is out of bounds or repeated, or there are no values.
    """
    fields = tuple(full_name(scene, name) for name in checked_fields(names))
    if not fields:
        raise ArgumentError("field", names, "must be at least one name")
    known = numeric_fields(scene)
    for field in fields:
        check_given(scene, field)
    checked = [
        [known[field].checked(field, value) for field in fields]
        for value in listed(fields[0], values)
    ]
    if not checked:
        raise ArgumentError(fields[0], [], "must have at least one value")
    taken = tuple(row[0] for row in checked)
    if len(set(taken)) < len(taken):
        raise ArgumentError(fields[0], taken, "must be distinct values")
    return Values(fields, taken)


class Range(NamedTuple):
    """The range from which a design draws values.

    Parameters
    ----------
    low, high : float
        Its ends.
    log : bool
        Whether to draw log-uniformly instead of uniformly.
    """

    low: float
    high: float
    log: bool = False

    @checked
    def stretch(self, unit: Fractions) -> NDArray[np.float64]:
        """Map numbers in [0, 1) to the range."""
        if self.log:
            return self.low * applied(partial(math.pow, self.high / self.low), unit)
        return self.low + (self.high - self.low) * unit


def _range(name: Any, bounds: Any) -> Range:
    checked_fields(name)
    fits = isinstance(bounds, tuple | list) and len(bounds) in (2, 3)
    if not fits or (len(bounds) == 3 and not isinstance(bounds[2], bool)):
        raise ArgumentError(
            f"range of {name}", bounds, "must be (low, high) or (low, high, log) with a bool log"
        )
    return Range(*bounds)


@dataclass(frozen=True)
class Samples:
    """An axis `sample` of points in a box: independent, Latin hypercube, or Sobol.

    Parameters
    ----------
    ranges : mapping of str to (low, high) or (low, high, log)
        The range of each field.
    size : int
        Number of points; for a Sobol sequence, a power of two.
    design : str
        `random`, `latin` or `sobol`.
    seed : int
        Seed of the design.

    Raises
    ------
    ValueError
        Bad input; the sweep checks the fields.
    """

    ranges: Mapping[str, Any]
    size: int
    design: str = "sobol"
    seed: int = 0
    name = "sample"

    def __post_init__(self) -> None:
        """Check what does not depend on the scene."""
        check_choice("design", self.design, DESIGNS)
        object.__setattr__(self, "size", check_integer("size", self.size, at_least=1, at_most=MOST))
        check_seed(self.seed)
        if not isinstance(self.ranges, Mapping):
            raise ArgumentError(
                "ranges", self.ranges, "must be a mapping of fields to (low, high) or Range"
            )
        ranges = {name: _range(name, bounds) for name, bounds in self.ranges.items()}
        if not ranges:
            raise ArgumentError("ranges", {}, "must be ranges of at least one field")
        for name, (low, high, log) in ranges.items():
            if log:
                check_number(f"{name}, lower end of a logarithmic range", low, above=0.0)
            check_number(f"{name}, upper end of a range from {low:g}", high, above=low)
        if self.design == "sobol" and self.size & (self.size - 1):
            near = 1 << self.size.bit_length()
            raise ArgumentError(
                "size", self.size, f"must be a power of two (for example {near}) for design 'sobol'"
            )
        object.__setattr__(self, "ranges", ranges)

    @checked
    def of(self, scene: Scene) -> "Samples":
        """Return a copy with full field names; ValueError if the scene cannot have such values."""
        known, ranges = numeric_fields(scene), {}
        for name, bounds in self.ranges.items():
            field = full_name(scene, name)
            check_given(scene, field)
            if isinstance(known[field].declared.default, int):
                raise ArgumentError(
                    "field", field, "takes integers only: list its values instead of drawing them"
                )
            for end in (bounds.low, bounds.high):
                known[field].checked(field, end)
            ranges[field] = bounds
        return Samples(ranges, self.size, self.design, self.seed)

    def __len__(self) -> int:
        """Return the number of points."""
        return self.size

    @property
    def fields(self) -> tuple[str, ...]:
        """The fields that are drawn."""
        return tuple(self.ranges)

    def at(self, index: int) -> dict[str, float | int]:
        """Return the value of each field at the point with an index."""
        check_integer("index", index, at_least=0, at_most=len(self) - 1)
        return dict(zip(self.fields, self._points[index].tolist(), strict=True))

    @property
    def ends(self) -> tuple[dict[str, float | int], ...]:
        """The corners of the box."""
        corners: list[dict[str, float | int]] = [{}]
        for name, bounds in self.ranges.items():
            corners = [{**corner, name: end} for corner in corners for end in bounds[:2]]
        return tuple(corners)

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return the values of each field, shape (size,)."""
        return dict(zip(self.fields, self._points.T, strict=True))

    def as_json(self) -> dict[str, Any]:
        """Return the specification for `samples_from`; the order of the ranges matters."""
        ranges = [[name, *bounds] for name, bounds in self.ranges.items()]
        return {"ranges": ranges, "size": self.size, "design": self.design, "seed": self.seed}

    @cached_property
    def _points(self) -> NDArray[np.float64]:
        """All points, shape (size, fields)."""
        dimensions = len(self.ranges)
        if self.design == "random":
            unit = np.random.default_rng(self.seed).random((self.size, dimensions))
        else:
            from scipy.stats import qmc

            engine = {"latin": qmc.LatinHypercube, "sobol": qmc.Sobol}[self.design]
            unit = engine(dimensions, rng=self.seed).random(self.size)
        ranges = zip(self.ranges.values(), unit.T, strict=True)
        return np.stack([bounds.stretch(column) for bounds, column in ranges], axis=1)


def samples_from(spec: dict[str, Any]) -> Samples:
    """Return the samples that `as_json` specifies."""
    ranges = {name: bounds for name, *bounds in spec["ranges"]}
    return Samples(ranges, spec["size"], spec["design"], spec["seed"])


COMPONENTS = "xyz"


class NumericField(NamedTuple):
    """A number in a scene: a field, or a component of a vector field."""

    declared: dataclasses.Field
    component: int | None

    @property
    def attributes(self) -> dict[str, str]:
        """Unit and description, in the form used in datasets."""
        label = self.declared.metadata["doc"]
        if self.component is not None:
            label += f", {COMPONENTS[self.component]}"
        return {"units": self.declared.metadata["unit"], "long_name": label}

    def checked(self, name: str, value: Any) -> float | int:
        """Return a value as a plain number; ValueError if it is outside the field's bounds."""
        if isinstance(self.declared.default, int) and check_number(name, value).is_integer():
            value = int(value)
        return check_value(self.declared, value, name)


def numeric_fields(scene: Scene) -> dict[str, NumericField]:
    """Return all numbers of a scene by name: `tilt`, or `position_x` for components."""
    found = {}
    for field in dataclasses.fields(scene):
        is_number = is_quantity(field) and not field.metadata["choices"]
        if not is_number or isinstance(field.default, str):
            continue
        size = field.metadata["size"]
        if size is None:
            found[field.name] = NumericField(field, None)
        else:
            found |= {f"{field.name}_{COMPONENTS[i]}": NumericField(field, i) for i in range(size)}
    return found


def full_name(scene: Scene, name: str) -> str:
    """Return the full name of a numeric field from an unambiguous ending like `height`.

    Raises
    ------
    ValueError
        No field matches, or several do; the message lists all fields.
    """
    known = numeric_fields(scene)
    ending = [field for field in known if field.endswith(f"_{name}")]
    if name not in known and len(ending) == 1:
        return ending[0]
    check_choice("field", name, tuple(known))
    return name


def changed(fields: dict[str, Any], numeric: dict[str, NumericField], changes: dict[str, Any]):
    """Return a scene's fields, in JSON form, with some numbers replaced."""
    fields = dict(fields)
    for name, value in changes.items():
        field = numeric[name]
        if field.component is None:
            fields[name] = value
        else:
            vector = list(fields[field.declared.name])
            vector[field.component] = value
            fields[field.declared.name] = vector
    return fields


def check_given(scene: Scene, name: str) -> None:
    """Raise ValueError if a component is to vary of a vector that has no value."""
    field, component = numeric_fields(scene)[name]
    if component is not None and getattr(scene, field.name) is None:
        raise ArgumentError(
            field.name, None, f"the scene must give it a value if {name} is to vary"
        )
