"""Periodic potentials of the sliding disk as Fourier coefficients, the paper's four by name."""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor.checks import check_choice, check_number, reject
from magmotor.reproducible import applied

Coefficients = tuple[tuple[float, float], ...]

MOST_WAVES = 100

NAMED: dict[str, Coefficients] = {
    "symmetric": ((1.0, 0.0),),
    "asymmetric": ((1.0, 0.0), (0.4, 0.0)),
    "flat": (),
    "cosine": ((0.0, 1.0),),
}
"""The paper's sin x, sin x + 0.4 sin 2x, 0, and cos x (its ballistic pendulum)."""


def check_potential(potential: Any) -> str | Coefficients:
    """Return a name as it is, coefficients as tuples of floats.

    Raises
    ------
    ValueError
        An unknown name, or coefficients that are not at most 100 pairs of finite numbers.
    """
    if isinstance(potential, str):
        check_choice("potential", potential, tuple(NAMED))
        return potential
    if not isinstance(potential, tuple | list):
        bound = "one of " + ", ".join(NAMED) + ", or pairs (a_k, b_k) of Fourier coefficients"
        raise reject("potential", potential, bound)
    if len(potential) > MOST_WAVES:
        raise reject("number of pairs in potential", len(potential), f"at most {MOST_WAVES}")
    pairs: list[tuple[float, float]] = []
    for i, pair in enumerate(potential):
        if not isinstance(pair, tuple | list) or len(pair) != 2:
            raise reject(f"potential[{i}]", pair, f"a pair (a_{i + 1}, b_{i + 1}) of numbers")
        a, b = (
            check_number(f"potential[{i}].{name}", value)
            for name, value in zip("ab", pair, strict=True)
        )
        pairs.append((a, b))
    while pairs and pairs[-1] == (0.0, 0.0):
        pairs.pop()
    return tuple(pairs)


def derivative(coefficients: Coefficients, x: ArrayLike, order: int = 0) -> NDArray[np.float64]:
    """U or one of its derivatives, of the given order; U = sum_k a_k sin kx + b_k cos kx."""
    x = np.asarray(x, dtype=float)
    value = np.zeros_like(x)
    for k, (a, b) in enumerate(coefficients, start=1):
        # Each derivative turns sine and cosine by a quarter.
        phase = k * x + order * (np.pi / 2)
        for amplitude, wave in ((a, math.sin), (b, math.cos)):
            if amplitude:
                value += k**order * amplitude * applied(wave, phase)
    return value


def steepest_curvature(coefficients: Coefficients) -> float:
    """Max |U''|, from a grid of a thousand points to the shortest wave, then a parabola's top."""
    if not coefficients:
        return 0.0
    x = np.linspace(0, 2 * np.pi, 1000 * len(coefficients), endpoint=False)
    return float(np.abs(derivative(coefficients, x, 2)).max())
