"""Errors of statistics, for chaotic motion, whose path no timestep can follow."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from magmotor.common.arrays import Array

REPLICAS = 8
"""Number of runs from perturbed starts."""

OCTAVES = 4
"""Number of bands of the spectrum; the lowest contains all that is slower."""


class Statistic(NamedTuple):
    """The error of a statistic, with one integrator at one timestep."""

    integrator: str
    timestep: float
    """In s."""
    name: str
    error: float
    """Distance from the reference: of a mean over the spread, else relative; or infinite."""
    doubt: float
    """Standard error of that distance."""
    seconds: float
    """Wall time per simulated second."""


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


def compared(
    integrator: str, timestep: float, own: Ensemble | None, truth: Ensemble
) -> tuple[Statistic, ...]:
    """Return the distance of each statistic from the truth; infinite for runs that diverged."""
    theirs = truth.statistics()
    if own is None:
        return tuple(
            Statistic(integrator, timestep, name, math.inf, math.nan, math.nan) for name in theirs
        )
    ours = own.statistics()
    scales = {name: np.abs(rows.mean(axis=0)).sum() for name, rows in theirs.items()}
    scales["mean"] = scales["spread"]
    found = []
    for name, rows in theirs.items():
        # In pairs, since the same start and noise may give nearly the same path.
        apart = ours[name] - rows
        variance = apart.var(axis=0, ddof=1).sum() / len(apart)
        scale = scales[name] or 1.0
        error, doubt = np.linalg.norm(apart.mean(axis=0)) / scale, np.sqrt(variance) / scale
        found.append(Statistic(integrator, timestep, name, float(error), float(doubt), own.seconds))
    return tuple(found)


def certain(statistics: Sequence[Statistic]) -> dict[tuple[str, float], float]:
    """Return the largest error of all statistics, with two standard errors, by cost.

    The keys are integrators and timesteps, the cheapest first.
    """
    alike: dict[tuple[str, float], list[Statistic]] = {}
    for row in statistics:
        alike.setdefault((row.integrator, row.timestep), []).append(row)
    finite = [key for key, rows in alike.items() if math.isfinite(rows[0].error)]
    finite.sort(key=lambda key: alike[key][0].seconds)
    return {key: max(row.error + 2 * row.doubt for row in alike[key]) for key in finite}


def _powers(path: Array) -> Array:
    """Return the power of a path in octaves of its spectrum, shape (OCTAVES,)."""
    power = (np.abs(np.fft.rfft(path - path.mean(axis=0), axis=0)) ** 2).sum(axis=1)
    octave = np.log2(len(power) / np.maximum(np.arange(len(power)), 1)).astype(int)
    return np.bincount(np.minimum(octave, OCTAVES - 1), power, OCTAVES).astype(float)
