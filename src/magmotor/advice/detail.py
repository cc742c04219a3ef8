"""What each feature of a model costs in time and changes, and what can go at an error."""

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

import mujoco
import numpy as np

from magmotor.advice.features import Feature, Numbers, Seen, dipoles, features, switch_off, weakest
from magmotor.advice.measured_quantities import Quantity, relative
from magmotor.advice.path_errors import Samples
from magmotor.advice.paths import STATE, OutOfTime, Runs, quiet
from magmotor.common.arrays import Array

RECORDS = 512
"""Largest number of records of a path, approximately."""

STARTS, SAMPLE = 4, 0.0015
"""Places along the path where steps are timed, and for how long in s altogether."""

ENOUGH, MOST = 16, 400
"""Numbers of turns, if the noise is low, and if not; many short turns are less noisy."""

COPIES = 4
"""Number of times that the unchanged model is timed besides, to see the noise."""

LEAST, DEVIATIONS = 0.01, 3.0
"""Smallest part of the time, and multiple of the noise, that counts as a saving."""

CHANGES, SAVINGS = 0.6, 0.8
"""Parts of the time left at which the search for changes and the measurement of savings end."""


@dataclass(frozen=True)
class Detail:
    """What it changes and saves to do without a feature, or without several."""

    what: str
    """What to write in MJCF."""
    change: float
    """Largest change of the quantity along the path, relative; infinite if the run diverged."""
    saved: float
    """Part of the time that is saved, negative if it takes longer; NaN if it was not measured."""
    can_go: bool
    """Whether the change is admissible, and the saving beyond noise."""
    names: tuple[str, ...] = ()
    """The elements that change, if these are not all of their kind."""
    together: tuple[str, ...] = ()
    """What goes together; empty for a single feature."""


def measure_detail(
    runs: Runs, quantity: Quantity, integrator: str, timestep: float, duration: float,
    error: float, ranges: Array | float, until: float,
) -> tuple[Detail, ...]:  # fmt: skip
    """Switch the features of a model off one by one, and then all that can go together.

    Changes are those along this path, of the quantity that the changed model shows. What only a
    compilation saves is left out: that of visual geoms, and of smaller trees of bounding volumes.

    Parameters
    ----------
    runs : Runs
        Its model is copied, and not changed.
    quantity : Quantity
    integrator : str
    timestep, duration : float
        In s.
    error : float
        Admissible change.
    ranges : float or ndarray
        What changes are relative to: those of the whole, and then those of elements.
    until : float
        Value of `time.perf_counter` after which no run is started or continued.

    Returns
    -------
    tuple of Detail
        One for each feature, and at the end one for all that can go together, if any can. If time
        runs out, these are those that are known.
    """
    began = time.perf_counter()
    left = until - began
    variants = _Variants(runs, quantity, integrator, timestep, duration, ranges)
    changes: dict[Feature, float] = {}
    saved: dict[Feature, float] = {}
    able: list[Feature] = []
    joint: tuple[Detail, ...] = ()
    with suppress(OutOfTime):  # what was known before stays
        changes.update(_changes(variants, error, began + CHANGES * left))
    finite = [feature for feature, change in changes.items() if math.isfinite(change)]
    with suppress(OutOfTime):
        savings, noise = variants.savings([(f,) for f in finite], began + SAVINGS * left)
        saved = dict(zip(finite, savings.tolist(), strict=True))
        saved = {f: s if abs(s) > noise else 0.0 for f, s in saved.items()}
        able = [f for f in finite if changes[f] <= error and saved[f] > 0.0]
        ratios = {feature: changes[feature] / saved[feature] for feature in able}
        joint = _together(variants, ratios, error, until)
    return *(
        Detail(f.what, change, saved.get(f, math.nan), f in able, f.names)
        for f, change in changes.items()
    ), *joint


def _unforced(runs: Runs, start: Array) -> Array:
    """Return a start without the forces that a control callback applies to bodies.

    They are overwritten while it acts, but would persist without what it acts on.
    """
    model, data = runs.model, runs.data
    runs.prepare(runs.integrator, runs.timestep, start)
    data.xfrc_applied[:] = 0.0
    mujoco.mj_forward(model, data)
    own = np.any(data.xfrc_applied, axis=1)
    runs.prepare(runs.integrator, runs.timestep, start)
    data.xfrc_applied[own] = 0.0
    return _state(runs)


def _state(runs: Runs) -> Array:
    state = np.empty_like(runs.start)
    mujoco.mj_getState(runs.model, runs.data, state, STATE)
    return state


class _Variants:
    """Paths and costs of a model without some of its features."""

    def __init__(
        self, runs: Runs, quantity: Quantity, integrator: str, timestep: float, duration: float,
        ranges: Array | float,
    ):  # fmt: skip
        runs.prepare(runs.integrator, runs.timestep)
        self._own, self._work = runs.model, Runs(runs.model)
        self._start = _unforced(self._work, runs.start)
        self._workspace = mujoco.MjData(self._own)
        self._quantity, self._ranges = quantity, ranges
        self._method = integrator, timestep
        self._steps = max(1, round(duration / timestep))
        self._whole: Samples | None = None
        self._starts: list[Array] = []
        self._pace = math.inf

    @property
    def model(self) -> mujoco.MjModel:
        """The unchanged model, with the integrator."""
        switch_off((), self._work.model, self._own)
        self._work.prepare(*self._method)
        return self._work.model

    def look(self, until: float) -> Seen | None:
        """Run the unchanged model, and return what happened along its path; None if it diverges."""
        self._whole = self._path((), until)
        if self._whole is None:
            return None
        work, model = self._work, self.model
        touched, constrained = np.zeros(model.ngeom, bool), False
        with quiet():
            for step in range(self._steps):
                if time.perf_counter() > until:
                    raise OutOfTime
                if step % math.ceil(self._steps / STARTS) == 0:
                    self._starts.append(_state(work))
                work.advance(1)
                constrained = constrained or work.data.nefc > 0
                if work.data.ncon:
                    geoms = work.data.contact.geom
                    touched[geoms[geoms >= 0]] = True
        return Seen(touched, constrained)

    def change(self, off: Sequence[Feature], until: float) -> float:
        """Return the largest relative change along the path; infinite if it diverges."""
        samples = self._path(off, until)
        if samples is None or self._whole is None:
            return math.inf
        return relative(self._quantity.distances(samples.apart(self._whole)), self._ranges)

    def savings(self, variants: Sequence[Sequence[Feature]], until: float) -> tuple[Array, float]:
        """Return the parts of the time that variants save, and what counts as noise.

        All of them are timed in turns, and the least time counts; so are copies of the unchanged
        model, whose savings are the noise.
        """
        timed = [(), *variants, *[()] * COPIES]
        steps = max(1, round(min(SAMPLE / self._pace, self._steps) / STARTS))
        halves = np.full((2, len(timed), len(self._starts)), np.inf)
        order, noise = np.random.default_rng(0), math.inf
        for turn in range(MOST):
            if turn >= ENOUGH and noise <= LEAST:
                break
            try:
                for k in order.permutation(len(timed)).tolist():
                    times = self._timed(timed[k], steps, until)
                    halves[turn % 2, k] = np.minimum(halves[turn % 2, k], times)
            except OutOfTime:
                if not turn:
                    raise
                break
            if turn:
                least = halves.sum(axis=2)
                alike = 1 - least[:, -COPIES:] / least[:, :1]
                noise = DEVIATIONS * float(np.sqrt(np.mean(alike**2)))
        least = halves.min(axis=0).sum(axis=1)
        return 1 - least[1:-COPIES] / least[0], max(LEAST, noise)

    def _timed(self, off: Sequence[Feature], steps: int, until: float) -> list[float]:
        """Return the wall times of a step from each of the places along the path."""
        if time.perf_counter() > until:
            raise OutOfTime
        switch_off(off, self._work.model, self._own)
        times = []
        for start in self._starts:
            self._work.start = start
            times.append(self._work.timed(*self._method, steps))
        return times

    def _path(self, off: Sequence[Feature], until: float) -> Samples | None:
        """Return the quantity along a path; None if it diverges."""
        model, data = self._work.model, self._workspace
        switch_off(off, model, self._own)
        every = math.ceil(self._steps / RECORDS)
        self._work.start = self._start
        records = self._steps // every
        path, states = self._work.path(*self._method, every, records, until=until)
        self._pace = min(self._pace, path.seconds)
        if path.diverged is not None:
            return None
        mujoco.mj_resetData(model, data)
        mujoco.mj_setState(model, data, self._start, STATE)
        return Samples(every, self._quantity.along(model, data, states))


def _changes(variants: _Variants, error: float, until: float) -> Iterator[tuple[Feature, float]]:
    """Yield each feature with the change without it, unless a part of it changes too much."""
    seen = variants.look(until)
    if seen is None:
        return
    too_much: set[str] = set()
    for feature in [*features(variants.model, seen)]:
        if feature.what not in too_much:
            yield feature, (change := variants.change((feature,), until))
            if not change <= error:
                too_much |= feature.within
    sites = dipoles(variants.model)
    if sites.size:
        yield _weakest(variants, sites, error, until)


def _weakest(
    variants: _Variants, sites: Numbers, error: float, until: float
) -> tuple[Feature, float]:
    """Return the removal of as many dipoles as can go, by bisection; at least of the weakest."""
    few, many, count = 0, len(sites) + 1, len(sites)
    changes: dict[int, float] = {}
    while many - few > 1:
        changes[count] = variants.change((weakest(variants.model, sites[:count]),), until)
        few, many = (count, many) if changes[count] <= error else (few, count)
        count = (few + many) // 2
    count = max(1, few)
    return weakest(variants.model, sites[:count]), changes[count]


def _together(
    variants: _Variants, ratios: Mapping[Feature, float], error: float, until: float
) -> tuple[Detail, ...]:
    """Return what can go together, if anything can; what has the largest ratio stays.

    The ratios are those of change to saving, of each feature that can go alone.
    """
    left = dict(ratios)
    while left:
        whats = {feature.what for feature in left}
        off = [feature for feature in left if feature.within.isdisjoint(whats)]
        change = variants.change(off, until)
        if change <= error:
            savings, _ = variants.savings([off], until)
            together = tuple(feature.what for feature in off)
            return (Detail("all of these", change, float(savings[0]), True, (), together),)
        del left[max(off, key=lambda feature: left[feature])]
    return ()
