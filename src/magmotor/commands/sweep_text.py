"""Parsing of a sweep's axes and seeds from the command line."""

import math
from dataclasses import dataclass, field

import numpy as np

from magmotor.common.exceptions import ArgumentError, InputError
from magmotor.numerics.reproducible import geometric
from magmotor.sweep import Range, Samples
from magmotor.sweep.axes import MOST

FORMS = "FIELD=START:STOP:COUNT or FIELD=VALUE,VALUE,..."
"""What `--vary` may be without `--design`."""


@dataclass
class Varied:
    """The axes given by `--vary` and `--design`."""

    vary: dict[str | tuple[str, ...], list[float]] = field(default_factory=dict)
    samples: Samples | None = None


def varied(entries: list[str], design: str | None) -> Varied:
    """Parse entries like tilt=0:0.2:21, tilt=0,0.1, or with a design tilt=0:0.2."""
    if not entries:
        raise InputError(f"--vary is missing: it must be {FORMS}")
    found, ranges = Varied(), {}
    for entry in entries:
        names, equals, text = entry.partition("=")
        if not (names and equals and text):
            raise ArgumentError("vary", entry, f"must be {FORMS}")
        fields = tuple(names.split(","))
        if fields in found.vary or names in ranges:
            raise ArgumentError("vary", entry, "must vary each field only once")
        bounds = _range(entry, text)
        if bounds is None:
            found.vary[fields] = _values(entry, text)
        elif design is None:
            raise ArgumentError("vary", entry, "must be FIELD=START:STOP:COUNT without --design")
        elif len(fields) > 1:
            raise ArgumentError("vary", entry, "must name a single field with --design")
        else:
            ranges[names] = bounds
    if design is not None:
        found.samples = _samples(design, ranges)
    return found


def _range(entry: str, text: str) -> Range | None:
    """Parse START:STOP or START:STOP:log; None if the text has another form."""
    parts = text.split(":")
    log = parts[-1] == "log"
    if len(parts) - log != 2:
        return None
    return Range(_number(entry, parts[0]), _number(entry, parts[1]), log)


def _values(entry: str, text: str) -> list[float]:
    """Parse START:STOP:COUNT, START:STOP:COUNT:log, or values separated by commas."""
    if ":" not in text:
        return [_number(entry, part) for part in text.split(",")]
    start, stop, count, *log = text.split(":")
    if log not in ([], ["log"]) or not count.isdecimal():
        raise ArgumentError(
            "vary", entry, "must be FIELD=START:STOP:COUNT or FIELD=START:STOP:COUNT:log"
        )
    first, last = _number(entry, start), _number(entry, stop)
    if int(count) < 1:
        raise ArgumentError("vary", entry, "COUNT must be at least 1")
    if int(count) > MOST:
        raise ArgumentError("vary", entry, f"COUNT must be at most {MOST}")
    if not math.isfinite(first) or not math.isfinite(last):
        raise ArgumentError("vary", entry, "START and STOP must be finite")
    if not log:
        return np.linspace(first, last, int(count)).tolist()
    if min(first, last) <= 0:
        raise ArgumentError("vary", entry, "START and STOP must be positive in a logarithmic range")
    return geometric(first, last, int(count))


def _number(entry: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ArgumentError("vary", entry, f"{text!r} is not a number") from None


def _samples(design: str, ranges: dict[str, Range]) -> Samples:
    """Parse KIND:SIZE or KIND:SIZE:SEED."""
    kind, *numbers = design.split(":")
    if len(numbers) not in (1, 2) or not all(number.isdecimal() for number in numbers):
        raise ArgumentError("design", design, "must be KIND:SIZE or KIND:SIZE:SEED, like sobol:256")
    if not ranges:
        raise ArgumentError(
            "vary", [], "must be FIELD=LOW:HIGH for at least one field with --design"
        )
    size, seed = (*map(int, numbers), 0)[:2]
    return Samples(ranges, size, kind, seed)


def seeds(text: str) -> list[int]:
    """Parse 0:8, the numbers from 0 to 7, or numbers separated by commas."""
    try:
        if ":" in text:
            first, last = text.split(":")
            found = [*range(int(first), int(last))[: MOST + 1]]
        else:
            found = [int(part) for part in text.split(",")]
    except ValueError:
        raise ArgumentError(
            "seeds", text, "must be FIRST:LAST, or numbers separated by commas"
        ) from None
    if not found:
        raise ArgumentError("seeds", text, "must be at least one seed")
    if len(found) > MOST:
        raise ArgumentError("seeds", text, f"must be at most {MOST} seeds")
    return found
