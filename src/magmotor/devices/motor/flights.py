"""The motor's flights around the rings, the dwells between them, and the mean durations of both.

A flight is a piece of the path on which the ball goes round at least once without ever turning back
by more than a quarter of a well's sector, the half-width of its core. It begins and ends where the
ball turns. A dwell is the time between two flights.
"""

import itertools
import math
from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from magmotor.common.arguments import checked
from magmotor.common.checks import reject
from magmotor.common.hints import flags, shaped
from magmotor.device.analysis import OWN, analysis
from magmotor.device.labels import labeled
from magmotor.devices.motor.observables import azimuth
from magmotor.devices.motor.scene import Motor

Array = NDArray[np.float64]

CORE = 0.25
"""Half-width of a well's core, in sectors; a sector is 2 pi/M wide."""

LABELS = {
    "replica": ("1", "number of the replica"),
    "begin": ("s", "time at which it begins"),
    "once": ("s", "time at which the ball has gone around once"),
    "end": ("s", "time at which it ends"),
    "revolutions": ("1", "revolutions of the ball"),
    "censored": ("1", "whether the run ended first"),
    "time": ("s", "time of the transition"),
    "well": ("1", "number of the well that is reached"),
    "step": ("1", "change of the well's number"),
}


@analysis("position", of=Motor)
def flights(run: xr.Dataset, scene: Motor = OWN) -> xr.Dataset:
    """The flights of a run, as this module defines them.

    Whether the ball turns back matters: a sequence of transitions in one direction may hold long
    rests, after which the ball happens to go on the same way as before.

    Parameters
    ----------
    run : xarray.Dataset
        Of a `Motor`.
    scene : Motor, optional
        Its scene; by default the one that the attributes of the run tell.

    Returns
    -------
    xarray.Dataset
        Over `flight`: `begin` and `end` in s, `once`, when it has gone round once, signed
        `revolutions`, `replica`, and `censored`: the flight was still under way when the run ended.
    """
    back = CORE * 2 * math.pi / scene.outer_dipoles
    rows = []
    for replica, theta in _rows(run):
        points = turning_points(theta, back)
        for begin, end in itertools.pairwise(points):
            turns = (theta[end] - theta[begin]) / (2 * math.pi)
            if abs(turns) >= 1:
                once = begin + np.argmax(np.abs(theta[begin:] - theta[begin]) >= 2 * math.pi)
                rows.append((replica, begin, once, end, turns, end == len(theta) - 1))
    replica, begin, once, end, turns, cut = _columns(rows, 6)
    times = run.time.values
    return _table(
        "flight",
        replica=replica.astype(int),
        begin=times[begin.astype(int)],
        once=times[once.astype(int)],
        end=times[end.astype(int)],
        revolutions=turns,
        censored=cut.astype(bool),
    )


@analysis("position", of=Motor)
def dwell_times(run: xr.Dataset, scene: Motor = OWN) -> xr.Dataset:
    """The times between flights, also those before the first and after the last of a run.

    Where one flight turns into another there is none.

    Parameters
    ----------
    run : xarray.Dataset
        Of a motor, with the ball moving by much less than half a turn between records.
    scene : Motor, optional
        Its scene; by default the one that the attributes of the run tell.

    Returns
    -------
    xarray.Dataset
        Over `dwell`: `begin` and `end` in s, `replica`, and `censored`: the dwell had not
        ended when the run did.
    """
    found, rows = flights(run, scene), []
    first, last = run.time.values[[0, -1]]
    for replica in _replicas(run):
        own = found.isel(flight=found.replica.values == replica)
        begins, ends = [first, *own.end.values], [*own.begin.values, last]
        rows += [
            (replica, begin, end, end == last)
            for begin, end in zip(begins, ends, strict=True)
            if begin < end
        ]
    replica, begin, end, cut = _columns(rows, 4)
    return _table(
        "dwell", replica=replica.astype(int), begin=begin, end=end, censored=cut.astype(bool)
    )


@analysis("position", of=Motor)
def transitions(run: xr.Dataset, scene: Motor = OWN) -> xr.Dataset:
    """The ball's transitions between wells, with hysteresis.

    The ball belongs to the well whose core, the middle half of its sector, it has visited last; a
    transition is a change of that, at the record at which the new core is reached.

    Parameters
    ----------
    run : xarray.Dataset
        Of a motor, with the ball moving by much less than half a turn between records.
    scene : Motor, optional
        Its scene; by default the one that the attributes of the run tell.

    Returns
    -------
    xarray.Dataset
        Over `transition`: `time` in s, `well`, the one reached, counted on when the ball goes round
        (at azimuth 2 pi well/M), `step`, +1 or -1 (more if it is recorded too seldom), `replica`.
    """
    rows = []
    for replica, theta in _rows(run):
        sectors = theta * scene.outer_dipoles / (2 * math.pi)
        nearest = np.rint(sectors)
        in_core = np.abs(sectors - nearest) <= CORE
        visited = np.maximum.accumulate(np.where(in_core, np.arange(len(theta)), 0))
        well = nearest[visited]
        at = np.flatnonzero(np.diff(well)) + 1
        rows += [(replica, i, well[i], well[i] - well[i - 1]) for i in at]
    replica, at, well, step = _columns(rows, 4).astype(int)
    return _table("transition", replica=replica, time=run.time.values[at], well=well, step=step)


class CensoredMean(NamedTuple):
    """A mean, its standard error, and the number of values that were seen to their end."""

    mean: float
    error: float
    completed: int


@checked(finite=False)
def censored_mean(
    values: Annotated[ArrayLike, shaped("N")], censored: Annotated[ArrayLike, flags("N")]
) -> CensoredMean:
    """Mean of durations, some of which were cut off by the end of the observation.

    The sum of all over the number of those completed, the most likely mean of an exponential law:
    it has no memory, so that those under way when the observation began count like the others. The
    error, sqrt(sum (value - mean [completed])^2)/number, holds for any law as long as durations are
    independent.

    Parameters
    ----------
    values : array_like, shape (N,)
        Durations, in any unit; of those cut off as far as seen.
    censored : array_like of bool, shape (N,)
        Which were cut off.

    Returns
    -------
    CensoredMean
        `mean` and `error` in that unit, NaN if none was completed, and `completed`.

    Examples
    --------
    Of flights, in revolutions of which each has one at least:

    >>> import magmotor as mm
    >>> revolutions, censored = [1.5, -3.0, 2.5], [False, False, True]
    >>> above_one = [abs(number) - 1 for number in revolutions]
    >>> mm.observables.censored_mean(above_one, censored).mean + 1
    3.0
    """
    values = np.asarray(values, dtype=float)
    completed = ~np.asarray(censored, dtype=bool)
    if len(values) != len(completed):
        raise reject(
            "lengths of values and censored", (len(values), len(completed)), "must be equal"
        )
    count = int(completed.sum())
    if not count:
        return CensoredMean(math.nan, math.nan, 0)
    mean = float(values.sum() / count)
    error = float(np.sqrt(np.sum((values - mean * completed) ** 2)) / count)
    return CensoredMean(mean, error, count)


def turning_points(theta: Array, back: float) -> list[int]:
    """First and last index, and those between where theta turns to go further than `back`."""
    angles = theta.tolist()
    points, lowest, highest, extreme, direction = [0], 0, 0, 0, 0
    for i, angle in enumerate(angles):
        if direction == 0:
            lowest = i if angle < angles[lowest] else lowest
            highest = i if angle > angles[highest] else highest
            if angles[highest] - angles[lowest] > back:
                points += [min(lowest, highest)] if min(lowest, highest) else []
                extreme, direction = i, 1 if i == highest else -1
        elif (angle - angles[extreme]) * direction > 0:
            extreme = i
        elif (angle - angles[extreme]) * direction < -back:
            points.append(extreme)
            extreme, direction = i, -direction
    return [*points, len(angles) - 1]


def _rows(run: xr.Dataset) -> Iterator[tuple[int, Array]]:
    yield from zip(_replicas(run), np.atleast_2d(azimuth(run).values), strict=True)


def _replicas(run: xr.Dataset) -> list[int]:
    """Numbers of the replicas in a run: its own, also where some were selected."""
    if "replica" in run.coords:
        return np.atleast_1d(run.replica.values).tolist()
    return [*range(run.sizes.get("replica", 1))]


def _columns(rows: list[Any], count: int) -> Array:
    """Rows of a table as its columns, also if there are none."""
    return np.array(rows, dtype=float).reshape(-1, count).T


def _table(dimension: str, **columns: NDArray[Any]) -> xr.Dataset:
    data = {name: (dimension, values) for name, values in columns.items()}
    return labeled(xr.Dataset(data), LABELS)
