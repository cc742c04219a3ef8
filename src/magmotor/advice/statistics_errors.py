"""Errors of statistics, for chaotic motion, whose path no timestep can follow."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from magmotor.advice.points import Point
from magmotor.common.arrays import Array

REPLICAS = 8
"""Number of runs from perturbed starts."""

FINE = 0.25
"""Timestep of the reference over the model's."""

OCTAVES = 4
"""Number of bands of the spectrum; the lowest contains all that is slower."""


class Statistic(NamedTuple):
    """The error of a statistic, with one method at one timestep."""

    method: str
    timestep: float
    """In s."""
    name: str
    error: float
    """Distance from the reference: of a mean over the spread, else relative; or infinite."""
    doubt: float
    """Standard error of that distance."""
    seconds: float
    """Wall time per simulated second."""
    unproven: float = 0.0
    """How far the reference itself may be off, with two standard errors; infinite if unknown."""

    @property
    def bound(self) -> float:
        """What the error is certain not to exceed, with two standard errors."""
        return self.error + 2 * self.doubt + self.unproven


class Ensemble(NamedTuple):
    """The same motion from several starts that differ slightly."""

    paths: Sequence[Array]
    """The quantity along each path, shape (records, n)."""
    kinetic: Sequence[Array]
    """Kinetic energy in J along each path, shape (records,)."""
    seconds: float
    """Wall time per simulated second."""

    def statistics(self) -> dict[str, Array]:
        """Return statistics by name, shape (replicas, components)."""
        means = [path.mean(axis=0) for path in self.paths]
        spreads = [[np.sqrt(path.var(axis=0).sum())] for path in self.paths]
        energies = [[energy.mean()] for energy in self.kinetic]
        powers = [_powers(path) for path in self.paths]
        named = {"mean": means, "spread": spreads, "kinetic energy": energies, "spectrum": powers}
        return {name: np.array(rows) for name, rows in named.items()}


def errors(
    ensemble: Callable[[str, float], Ensemble | None],
    timestep: float,
    references: Iterable[str],
    candidates: Iterable[tuple[str, float]],
) -> Iterator[Statistic]:
    """Yield the errors of ensembles against a reference that proves itself by halving its timestep.

    Those of the reference's own method, from which the proof is, come first.

    Parameters
    ----------
    ensemble : callable
        Returns the ensemble of a method at a multiple of a timestep; None if a run diverged.
    timestep : float
        In s.
    references : iterable of str
        Methods, the first of which that does not diverge is the reference.
    candidates : iterable of (str, float)
        Methods and multiples of the timestep.
    """
    for name in references:
        truth = ensemble(name, FINE)
        if truth is None:
            continue
        known = {(name, times * FINE): ensemble(name, times * FINE) for times in (2, 4)}
        doubts = unproven(truth, *known.values())
        for key in dict.fromkeys((*known, *candidates)):
            own = known[key] if key in known else ensemble(*key)
            for row in compared(key[0], key[1] * timestep, own, truth):
                yield row._replace(unproven=doubts[row.name])
        return


def unproven(truth: Ensemble, half: Ensemble | None, whole: Ensemble | None) -> dict[str, float]:
    """Return how far statistics may be off, with two standard errors.

    The others have twice and four times the timestep. As for paths, the last halving's change
    counts, and at least half of the change before, or twice the last one if that is not known.
    """
    last = {row.name: row.bound for row in compared("", 0.0, half, truth)}
    if half is None or whole is None:
        return {name: 2 * bound for name, bound in last.items()}
    return {row.name: max(last[row.name], row.bound / 2) for row in compared("", 0.0, whole, half)}


def compared(
    method: str, timestep: float, own: Ensemble | None, truth: Ensemble
) -> tuple[Statistic, ...]:
    """Return the distance of each statistic from the truth; infinite for runs that diverged."""
    theirs = truth.statistics()
    if own is None:
        return tuple(
            Statistic(method, timestep, name, math.inf, math.inf, math.nan) for name in theirs
        )
    ours = own.statistics()
    scales = {name: np.abs(rows.mean(axis=0)).sum() for name, rows in theirs.items()}
    scales["mean"] = scales["spread"]
    found = []
    for name, rows in theirs.items():
        # In pairs, since the same start and noise may give nearly the same path.
        error, doubt = (size / (scales[name] or 1.0) for size in paired(ours[name] - rows))
        found.append(Statistic(method, timestep, name, error, doubt, own.seconds))
    return tuple(found)


def paired(apart: Array) -> tuple[float, float]:
    """Return the size of the mean of differences (pairs, n), and its standard error."""
    variance = apart.var(axis=0, ddof=1).sum() / len(apart)
    return float(np.linalg.norm(apart.mean(axis=0))), float(np.sqrt(variance))


def certain(statistics: Sequence[Statistic]) -> list[Point]:
    """Return points with what the errors of all their statistics do not exceed.

    Runs that diverged are left out.
    """
    alike: dict[tuple[str, float], list[Statistic]] = {}
    for row in statistics:
        if math.isfinite(row.error):
            alike.setdefault((row.method, row.timestep), []).append(row)
    return [
        Point(*key, rows[0].seconds, max(row.bound for row in rows)) for key, rows in alike.items()
    ]


def _powers(path: Array) -> Array:
    """Return the power of a path in octaves of its spectrum, shape (OCTAVES,)."""
    power = (np.abs(np.fft.rfft(path - path.mean(axis=0), axis=0)) ** 2).sum(axis=1)
    octave = np.log2(len(power) / np.maximum(np.arange(len(power)), 1)).astype(int)
    return np.bincount(np.minimum(octave, OCTAVES - 1), power, OCTAVES).astype(float)
