"""Flights of the motor's ball around the rings, dwell times between them, and transitions.

A flight is a part of the path on which the ball completes at least one revolution and never moves
back by more than a quarter of a sector, the half-width of a well's core. It begins and ends where
the ball reverses. A dwell is the time between two flights.
"""

import itertools
import math
from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import flags, shaped
from magmotor.device.analysis import OWN, analysis
from magmotor.device.observable import labeled
from magmotor.devices.motor.observables import azimuth
from magmotor.devices.motor.scene import Motor

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
    """Find the flights of a run, as defined in `magmotor.devices.motor.flights`.

    The definition uses reversals rather than transitions, since the ball may rest for a long time
    between two transitions in the same direction.

    Parameters
    ----------
    run : xarray.Dataset
        A run in which the ball goes around by much less than half a revolution between records.
    scene : Motor, optional
        The scene of the run; by default the one in its attributes.

    Returns
    -------
    xarray.Dataset
        Over `flight`: `begin`, `end` and `once`, the time of the first completed revolution, in s;
        signed `revolutions`; `replica`; and `censored`, whether the run ended before the flight.
    """
    back = CORE * 2 * math.pi / scene.outer_dipoles
    rows = []
    for replica, theta in _rows(run):
        for begin, once, end in directed_spans(theta, back, 2 * math.pi):
            turns = (theta[end] - theta[begin]) / (2 * math.pi)
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
    """Find the times between flights, before the first and after the last one.

    There is no dwell between two flights if one begins where the other ends.

    Parameters
    ----------
    run : xarray.Dataset
        A run in which the ball goes around by much less than half a revolution between records.
    scene : Motor, optional
        The scene of the run; by default the one in its attributes.

    Returns
    -------
    xarray.Dataset
        Over `dwell`: `begin` and `end` in s; `replica`; and `censored`, whether the run ended
        before the dwell.
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
    """Find the transitions of the ball between wells, with hysteresis.

    The core of a well is the middle half of its sector. The ball belongs to the well whose core it
    has visited last; a transition is the first record in the core of another well.

    Parameters
    ----------
    run : xarray.Dataset
        A run in which the ball goes around by much less than half a revolution between records.
    scene : Motor, optional
        The scene of the run; by default the one in its attributes.

    Returns
    -------
    xarray.Dataset
        Over `transition`: `time` in s; `well`, the number of the well that is reached, at azimuth
        2 pi well/M, which keeps counting after a revolution; `step`, +1 or -1, or more if the run
        is recorded too seldom; and `replica`.
    """
    rows = [
        (replica, change.reached, change.well, change.step)
        for replica, theta in _rows(run)
        for change in well_changes(theta, scene.outer_dipoles)
    ]
    replica, at, well, step = _columns(rows, 4).astype(int)
    return _table("transition", replica=replica, time=run.time.values[at], well=well, step=step)


class CensoredMean(NamedTuple):
    """Mean, standard error, and number of completed durations."""

    mean: float
    error: float
    completed: int


@checked(finite=False)
def censored_mean(
    values: Annotated[ArrayLike, shaped("N")], censored: Annotated[ArrayLike, flags("N")]
) -> CensoredMean:
    """Compute the mean of durations, some of which are censored by the end of the observation.

    The mean is the sum of all durations over the number of completed ones, the maximum likelihood
    estimate for an exponential distribution. This distribution has no memory, so that durations
    that began before the observation count like the others. The error,
    sqrt(sum (value - mean [completed])^2)/number, is valid for any distribution of independent
    durations.

    Parameters
    ----------
    values : array_like, shape (N,)
        Durations in any unit, up to the end of the observation where they are censored.
    censored : array_like of bool, shape (N,)
        Which durations had not ended.

    Returns
    -------
    CensoredMean
        `mean` and `error` in that unit, NaN if no duration was completed, and `completed`.

    Examples
    --------
    Revolutions of flights, each of which has at least one:

    >>> import magmotor as mm
    >>> revolutions, censored = [1.5, -3.0, 2.5], [False, False, True]
    >>> above_one = [abs(number) - 1 for number in revolutions]
    >>> mm.observables.censored_mean(above_one, censored).mean + 1
    3.0
    """
    values = np.asarray(values, dtype=float)
    completed = ~np.asarray(censored, dtype=bool)
    if len(values) != len(completed):
        raise ArgumentError(
            "lengths of values and censored", (len(values), len(completed)), "must be equal"
        )
    count = int(completed.sum())
    if not count:
        return CensoredMean(math.nan, math.nan, 0)
    mean = float(values.sum() / count)
    error = float(np.sqrt(np.sum((values - mean * completed) ** 2)) / count)
    return CensoredMean(mean, error, count)


class WellChange(NamedTuple):
    """A transition between two wells; the first two fields are indices of records."""

    left: int
    """The last record in the core of the well that the ball leaves."""
    reached: int
    """The first record in the core of the other well."""
    well: int
    """Number of the well that is reached."""
    step: int
    """Change of that number."""


def well_changes(theta: Array, count: int) -> list[WellChange]:
    """Return the transitions between `count` wells on a path of azimuths; see `transitions`."""
    sectors = theta * count / (2 * math.pi)
    nearest = np.rint(sectors)
    in_core = np.abs(sectors - nearest) <= CORE
    visited = np.maximum.accumulate(np.where(in_core, np.arange(len(theta)), 0))
    well = nearest[visited].astype(int)
    return [
        WellChange(int(visited[at - 1]), int(at), int(well[at]), int(well[at] - well[at - 1]))
        for at in np.flatnonzero(np.diff(well)) + 1
    ]


def directed_spans(theta: Array, back: float, far: float) -> Iterator[tuple[int, int, int]]:
    """Find the parts of a path that go far in one direction.

    Parameters
    ----------
    theta : ndarray, shape (T,)
        Azimuths in rad.
    back : float
        Angle, in rad, by which the ball moves back at most.
    far : float
        Angle, in rad, by which it moves on at least.

    Yields
    ------
    begin, gone, end : int
        Indices of the records where the part begins, where the ball has gone `far`, and of the end.
    """
    for begin, end in itertools.pairwise(turning_points(theta, back)):
        if abs(theta[end] - theta[begin]) >= far:
            part = np.abs(theta[begin : end + 1] - theta[begin])
            yield begin, begin + int(np.argmax(part >= far)), end


def turning_points(theta: Array, back: float) -> list[int]:
    """Return the first and last index, and those of reversals by more than `back`."""
    angles, last = theta.tolist(), len(theta) - 1
    points, lowest, highest, extreme, direction = [0], 0, 0, 0, 0
    ways = np.sign(np.diff(theta))
    # Only where the path is highest or lowest can it reverse.
    for i in [*(np.flatnonzero(ways[:-1] * (ways[1:] - ways[:-1])) + 1).tolist(), last]:
        angle = angles[i]
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
    return [*points, last]


def _rows(run: xr.Dataset) -> Iterator[tuple[int, Array]]:
    yield from zip(_replicas(run), np.atleast_2d(azimuth(run).values), strict=True)


def _replicas(run: xr.Dataset) -> list[int]:
    """Return the numbers of the replicas in a run, also if only some were selected."""
    if "replica" in run.coords:
        return np.atleast_1d(run.replica.values).tolist()
    return [*range(run.sizes.get("replica", 1))]


def _columns(rows: list[Any], count: int) -> Array:
    """Return the columns of a table, also if it has no rows."""
    return np.array(rows, dtype=float).reshape(-1, count).T


def _table(dimension: str, **columns: NDArray[Any]) -> xr.Dataset:
    data = {name: (dimension, values) for name, values in columns.items()}
    return labeled(xr.Dataset(data), LABELS)
