"""Axes of a sweep: the values that fields take, on a grid, in a list, or by a random design."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import islice
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from magmotor.arguments import Fractions, checked
from magmotor.checks import check_choice, check_integer, check_number, elements, reject
from magmotor.devices import Scene
from magmotor.noise import check_seed
from magmotor.reproducible import applied
from magmotor.sweep.fields import check_given, full_name, numeric_fields

DESIGNS = ("random", "latin", "sobol")


MOST = 2**20
"""Values of an axis, points of a design, or seeds."""


def listed(name: str, values: Any) -> tuple[Any, ...]:
    """Return what is iterable, and no text, as a tuple; ValueError if it is not, or too long."""
    found = tuple(islice(elements(name, values, "a list of numbers"), MOST + 1))
    if len(found) > MOST:
        raise reject(f"number of values of {name}", f"over {MOST}", f"at most {MOST}")
    return found


def checked_fields(names: Any) -> tuple[str, ...]:
    """The name of a field, or several, as a tuple; ValueError if they are something else."""
    found = (names,) if isinstance(names, str) else names
    if not isinstance(found, tuple) or not all(isinstance(name, str) for name in found):
        raise reject("field", names, "a name, or a tuple of names")
    return found


@dataclass(frozen=True)
class Values:
    """Fields that take the same values together, one value after another."""

    fields: tuple[str, ...]
    values: tuple[float | int, ...]

    def __post_init__(self) -> None:
        """Check what needs no scene."""
        fields, values = checked_fields(self.fields), listed("values", self.values)
        for value in values:
            check_number("value", value)
        if not fields or not values:
            raise reject("values", [*values], "one value at least, of one field at least")
        object.__setattr__(self, "fields", fields)
        object.__setattr__(self, "values", values)

    @property
    def name(self) -> str:
        """Of the dimension."""
        return self.fields[0]

    def __len__(self) -> int:
        """How many values."""
        return len(self.values)

    def at(self, place: int) -> dict[str, float | int]:
        """The value of each field at one place, which counts from zero."""
        check_integer("place", place, at_least=0, at_most=len(self) - 1)
        return dict.fromkeys(self.fields, self.values[place])

    @property
    def ends(self) -> tuple[dict[str, float | int], ...]:
        """The places with the smallest and the largest value."""
        return tuple(dict.fromkeys(self.fields, end(self.values)) for end in (min, max))

    def columns(self) -> dict[str, NDArray[Any]]:
        """Each field's values, shape (n,)."""
        return dict.fromkeys(self.fields, np.array(self.values))


def values_axis(scene: Scene, names: str | tuple[str, ...], values: Iterable[float]) -> Values:
    """An axis of given values, checked.

    Parameters
    ----------
    scene : Top, Motor, Disk or LangevinParticle
    names : str or tuple of str
        A field, or several that are to have equal values.
    values : iterable of float

    Raises
    ------
    ValueError
        Names an unknown field, a value out of its bounds, no value at all, or one twice.
    """
    fields = tuple(full_name(scene, name) for name in checked_fields(names))
    if not fields:
        raise reject("field", names, "one at least")
    known = numeric_fields(scene)
    for field in fields:
        check_given(scene, field)
    checked = [
        [known[field].checked(field, value) for field in fields]
        for value in listed(fields[0], values)
    ]
    if not checked:
        raise reject(fields[0], [], "a range that is not empty")
    taken = tuple(row[0] for row in checked)
    if len(set(taken)) < len(taken):
        raise reject(fields[0], taken, "different values")
    return Values(fields, taken)


class Range(NamedTuple):
    """From where to where a design draws values, evenly or, by `log`, evenly in the logarithm."""

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
    kind = isinstance(bounds, tuple | list) and len(bounds) in (2, 3)
    if not kind or (len(bounds) == 3 and not isinstance(bounds[2], bool)):
        raise reject(f"range of {name}", bounds, "(low, high) or (low, high, log), log a bool")
    return Range(*bounds)


@dataclass(frozen=True)
class Samples:
    """A dimension `sample` of points drawn in a box: independent, Latin hypercube, or Sobol.

    Parameters
    ----------
    ranges : mapping of str to (low, high) or (low, high, log)
        By field.
    size : int
        How many points; of a Sobol sequence a power of two.
    design : str
        random, latin or sobol.
    seed : int
        Of the design.

    Raises
    ------
    ValueError
        Bad input; the fields are checked by the sweep.
    """

    ranges: Mapping[str, Any]
    size: int
    design: str = "sobol"
    seed: int = 0
    name = "sample"

    def __post_init__(self) -> None:
        """Check the parameters that need no scene."""
        check_choice("design", self.design, DESIGNS)
        object.__setattr__(self, "size", check_integer("size", self.size, at_least=1, at_most=MOST))
        check_seed(self.seed)
        if not isinstance(self.ranges, Mapping):
            raise reject("ranges", self.ranges, "a mapping of fields to (low, high) or Range")
        ranges = {name: _range(name, bounds) for name, bounds in self.ranges.items()}
        if not ranges:
            raise reject("ranges", {}, "a range of one field at least")
        for name, (low, high, log) in ranges.items():
            check_number(f"{name}, lower end", low, above=0.0 if log else -math.inf)
            check_number(f"{name}, upper end", high, above=low)
        if self.design == "sobol" and self.size & (self.size - 1):
            near = 1 << self.size.bit_length()
            raise reject("size", self.size, f"a power of two, such as {near}, for design 'sobol'")
        object.__setattr__(self, "ranges", ranges)

    @checked
    def of(self, scene: Scene) -> "Samples":
        """The same with full names of fields; ValueError if the scene cannot have such values."""
        known, ranges = numeric_fields(scene), {}
        for name, bounds in self.ranges.items():
            field = full_name(scene, name)
            check_given(scene, field)
            if isinstance(known[field].declared.default, int):
                raise reject("field", field, "one that takes all numbers: give it a list of values")
            for end in (bounds.low, bounds.high):
                known[field].checked(field, end)
            ranges[field] = bounds
        return Samples(ranges, self.size, self.design, self.seed)

    def __len__(self) -> int:
        """How many points."""
        return self.size

    @property
    def fields(self) -> tuple[str, ...]:
        """Those that are drawn."""
        return tuple(self.ranges)

    def at(self, place: int) -> dict[str, float | int]:
        """The value of each field at one point, which counts from zero."""
        check_integer("place", place, at_least=0, at_most=len(self) - 1)
        return dict(zip(self.fields, self._points[place].tolist(), strict=True))

    @property
    def ends(self) -> tuple[dict[str, float | int], ...]:
        """Corners of the box."""
        corners: list[dict[str, float | int]] = [{}]
        for name, bounds in self.ranges.items():
            corners = [{**corner, name: end} for corner in corners for end in bounds[:2]]
        return tuple(corners)

    def columns(self) -> dict[str, NDArray[Any]]:
        """Each field's values, shape (size,)."""
        return dict(zip(self.fields, self._points.T, strict=True))

    def as_json(self) -> dict[str, Any]:
        """What `samples_from` makes it again from; the order of the ranges matters."""
        ranges = [[name, *bounds] for name, bounds in self.ranges.items()]
        return {"ranges": ranges, "size": self.size, "design": self.design, "seed": self.seed}

    @cached_property
    def _points(self) -> NDArray[np.float64]:
        """All points, shape (size, fields)."""
        dimensions = len(self.ranges)
        if self.design == "random":
            unit = np.random.default_rng(self.seed).random((self.size, dimensions))
        else:
            engine = {"latin": qmc.LatinHypercube, "sobol": qmc.Sobol}[self.design]
            unit = engine(dimensions, rng=self.seed).random(self.size)
        ranges = zip(self.ranges.values(), unit.T, strict=True)
        return np.stack([bounds.stretch(column) for bounds, column in ranges], axis=1)


def samples_from(told: dict[str, Any]) -> Samples:
    """The samples that `as_json` tells of."""
    ranges = {name: bounds for name, *bounds in told["ranges"]}
    return Samples(ranges, told["size"], told["design"], told["seed"])
