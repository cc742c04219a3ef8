"""Dormand and Prince's method of order 8(5,3) with SciPy's coefficients, its sums in fixed order.

SciPy's own solver adds by BLAS, whose last digits depend on the processor.
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853

Array = NDArray[np.float64]

SAFETY, SMALLEST_FACTOR, LARGEST_FACTOR = 0.9, 0.2, 10.0
"""As in SciPy: how the next step follows from the error of the last."""

FEWEST_ROUNDINGS = 10
"""A step is at least so many times the spacing of numbers at its time."""


class Integrator:
    """A solution of dy/dt = derivative(t, y), and the step that its error allows.

    Parameters
    ----------
    derivative : callable
    time : float
    state : ndarray, shape (n,)
    step : float
        The first that is tried.
    relative : float
    absolute : ndarray, shape (n,)
        Tolerances of each step's error.
    """

    def __init__(
        self,
        derivative: Callable[[float, Array], Array],
        time: float,
        state: Array,
        step: float,
        *,
        relative: float,
        absolute: Array,
    ):
        self.derivative, self.time, self.state, self.step = derivative, time, state, step
        self.relative, self.absolute = relative, absolute
        self.stages = np.empty((DOP853.n_stages + 1, len(state)))
        self.stages[-1] = derivative(time, state)

    def advance(self, end: float) -> Array:
        """The state at a later time.

        Raises
        ------
        ArithmeticError
            No step is short enough.
        """
        while self.time < end:
            self._step(end)
        return self.state.copy()

    def _step(self, end: float) -> None:
        shortest = FEWEST_ROUNDINGS * (math.nextafter(self.time, math.inf) - self.time)
        step, most = max(self.step, shortest), LARGEST_FACTOR
        while True:
            if step < shortest:
                raise ArithmeticError(
                    f"dop853 stopped at t = {self.time:g} s: no step is short enough"
                )
            time = min(self.time + step, end)
            step = time - self.time
            error, state = self._tried(step, time)
            factor = SAFETY * error ** (-1 / 8) if error > 0 else LARGEST_FACTOR
            if error < 1:
                break
            most, step = (
                1.0,
                step * (max(SMALLEST_FACTOR, factor) if error >= 1 else SMALLEST_FACTOR),
            )
        self.time, self.state, self.step = time, state, step * min(most, factor)

    def _tried(self, step: float, time: float) -> tuple[float, Array]:
        """Error over tolerance of a step, and the state after it."""
        stages, slope = self.stages, self.stages[-1].copy()
        stages[0] = slope
        for k in range(1, DOP853.n_stages):
            change = step * _combined(DOP853.A[k, :k], stages)
            stages[k] = self.derivative(self.time + DOP853.C[k] * step, self.state + change)
        state = self.state + step * _combined(DOP853.B, stages)
        stages[-1] = self.derivative(time, state)
        scale = self.absolute + self.relative * np.maximum(np.abs(self.state), np.abs(state))
        fifth, third = (
            float(np.sum((_combined(weights, stages) / scale) ** 2))
            for weights in (DOP853.E5, DOP853.E3)
        )
        together = math.sqrt((fifth + 0.01 * third) * len(scale))
        error = step * fifth / together if together else 0.0
        if not error < 1:
            stages[-1] = slope
        return error, state


def _combined(weights: Array, stages: Array) -> Array:
    """Sum of the first stages with these weights."""
    return (weights[:, np.newaxis] * stages[: len(weights)]).sum(axis=0)
