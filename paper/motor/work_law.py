"""Fluctuation theorems: the slope of ln P(x)/P(-x) over x, by maximum likelihood."""

import itertools
from typing import Any

import numpy as np
from scipy.optimize import brentq

from magmotor.common.arrays import Array
from paper.motor.spreading import Measured

STEEPEST = 50.0
"""Largest slope that is looked for."""


def slope_of_the_law(samples: Array) -> Measured:
    """Return the slope s for which ln P(x)/P(-x) = s x is most likely.

    Given |x|, x is positive with the probability 1/(1 + exp(-s |x|)). The likelihood of the signs
    is largest where the mean of x equals that of x tanh(s x/2). The error follows from the scatter
    of this difference over the replicas, so that the samples of one replica may be correlated.

    Parameters
    ----------
    samples : ndarray, shape (R, ...)
        Of R independent replicas, in which both signs occur.
    """
    x = samples.reshape(len(samples), -1)

    def scores(slope: float) -> Array:
        return np.sum(x - x * np.tanh(slope * x / 2), axis=1)

    slope: Any = brentq(lambda s: scores(s).sum(), -STEEPEST, STEEPEST)
    falls = np.sum((x / np.cosh(slope * x / 2)) ** 2) / 2
    return Measured(slope, np.sqrt(np.sum(scores(slope) ** 2)) / falls)


def log_ratios(x: Array, edges: Array) -> tuple[Array, Array, Array]:
    """Return the mean |x|, ln P(x)/P(-x) and its standard error in bins of |x|.

    Bins in which a sign is missing are left out.
    """
    found = []
    for low, high in itertools.pairwise(edges):
        inside = x[(np.abs(x) >= low) & (np.abs(x) < high)]
        more, less = np.sum(inside > 0), np.sum(inside < 0)
        if more and less:
            found.append((np.abs(inside).mean(), np.log(more / less), np.sqrt(1 / more + 1 / less)))
    mean, ratio, error = np.array(found).T
    return mean, ratio, error
