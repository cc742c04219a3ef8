"""Linear stability of integrators for small motions about an equilibrium."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor.common.arguments import checked
from magmotor.common.checks import check_array
from magmotor.common.hints import Elapsed, Inertia, Square

Matrix = NDArray[np.float64]

ROUNDING = 1e-6
"""Largest rounding error of the spectral radius of a neutral step; free drifts are defective."""

SHORTEST, LONGEST, FACTOR = 1.0, 30.0, 1.008
"""First, last and ratio of the timesteps that are tested for stability.

The first is divided by the motion's largest rate, the last by its largest frequency.
"""

BATCH = 16
"""Number of timesteps that are tested in one call."""


class SmallMotion(NamedTuple):
    """Small motions about an equilibrium, q'' = -K q - C q'; each matrix has shape (n, n).

    The coordinates q have unit masses, and the friction matrix C is diagonal; `implicit` is the
    part of it that MuJoCo's implicit integrators treat implicitly.
    """

    stiffness: Matrix
    friction: Matrix
    implicit: Matrix

    @classmethod
    @checked
    def of(
        cls, inertia: Inertia, stiffness: Square, friction: Square, implicit: Square
    ) -> "SmallMotion":
        """Return the motion for M q'' = -K q - C q' in any coordinates; M is positive definite.

        Negative eigenvalues of K are set to zero, since there the equilibrium itself is unstable.
        """
        values, vectors = np.linalg.eigh(inertia)
        root = vectors / np.sqrt(values) @ vectors.T
        _, modes = np.linalg.eigh(root @ friction @ root)
        basis = root @ modes
        values, vectors = np.linalg.eigh(basis.T @ stiffness @ basis)
        restoring = vectors * np.maximum(values, 0.0) @ vectors.T
        return cls(restoring, *(basis.T @ part @ basis for part in (friction, implicit)))

    @property
    def decay(self) -> Matrix:
        """Decay rates of the velocities by friction, in 1/s, shape (n,)."""
        return np.diag(self.friction)

    @property
    def frequency(self) -> float:
        """Largest angular frequency without friction, in rad/s."""
        return math.sqrt(abs(np.linalg.eigvalsh(self.stiffness)[-1]))

    def generators(self) -> dict[str, Matrix]:
        """Return the generators on (q, v): A drift, B kick, O friction, K kick and friction."""
        n = len(self.stiffness)
        drift, kick, friction = np.zeros((3, 2 * n, 2 * n))
        drift[:n, n:], kick[n:, :n] = np.eye(n), -self.stiffness
        friction[n:, n:] = -np.diag(self.decay)
        return {"A": drift, "B": kick, "O": friction, "K": kick + friction}


Lengths = float | Matrix
"""One timestep, in s, or several, shape (..., 1, 1)."""

Step = Callable[[SmallMotion, Lengths], Matrix]
"""Returns the matrix that takes (q, v) through one step, shape (..., 2n, 2n)."""


def exact_response(exponent: Matrix) -> Matrix:
    """Return the mean of exp over the interval from 0 to an exponent."""
    from scipy.special import exprel

    return exprel(exponent)


def splitting_step(
    parts: str,
    fractions: Sequence[float],
    *,
    exact: bool,
    response: Callable[[Matrix], Matrix] = exact_response,
) -> Step:
    """Return the step of a splitting method, the product of its parts.

    Each part acts for its fraction of the timestep. Its letters are the keys of
    `SmallMotion.generators`, or R for all forces without friction by the Runge-Kutta method.
    Friction is integrated by `response`, a function of -(rate) (time) and by default exact; or, if
    not `exact`, by an explicit Euler step.
    """

    def step(motion: SmallMotion, h: Lengths) -> Matrix:
        generators, decay = motion.generators(), motion.decay[:, np.newaxis]
        n = len(decay)
        product = np.eye(2 * n)
        for part, fraction in zip(parts, fractions, strict=True):
            if part == "R":
                slope = fraction * h * (generators["A"] + generators["B"])
                product = _runge_kutta(slope) @ product
                continue
            change = fraction * h * generators[part]
            if exact and part in "OK":
                change[..., n:, :] *= response(-fraction * h * decay)
            product = product + change @ product
        return product

    return step


euler_step = splitting_step("KA", (1.0, 1.0), exact=False)
"""Kick with explicit friction, then drift: the variational Euler scheme and MuJoCo's Euler."""


def implicit_step(motion: SmallMotion, h: Lengths) -> Matrix:
    """Kick with the part D of friction implicit, then drift: (1 + hD)(v' - v) = -h(K q + C v)."""
    K, C, D = motion
    one = np.eye(len(K))
    kick = np.linalg.solve(one + h * D, -h * np.hstack([K, C])) + np.eye(len(K), 2 * len(K), len(K))
    stay = np.eye(len(K), 2 * len(K))
    return np.concatenate([stay + h * kick, kick], axis=-2)


def runge_kutta_step(motion: SmallMotion, h: Lengths) -> Matrix:
    """Return the step of the classical Runge-Kutta method of fourth order."""
    parts = motion.generators()
    return _runge_kutta(h * (parts["A"] + parts["K"]))


def _runge_kutta(slope: Matrix) -> Matrix:
    one = np.eye(slope.shape[-1])
    return one + slope @ (one + slope / 2 @ (one + slope / 3 @ (one + slope / 4)))


@checked
def spectral_radius(motion: SmallMotion, step: Step, h: Elapsed) -> NDArray[np.float64]:
    """Compute the spectral radius of a step, the growth factor of the fastest-growing small motion.

    Parameters
    ----------
    motion : SmallMotion
    step : callable
        Function of a motion and timesteps that returns the matrices that take (q, v) through a step
        of the method.
    h : array_like
        Timesteps in s, any shape.

    Returns
    -------
    ndarray, same shape as `h`
        Greater than 1 where the step is unstable.
    """
    lengths = np.asarray(h, dtype=float)[..., np.newaxis, np.newaxis]
    matrices = check_array("matrices of the step", step(motion, lengths), ..., "n", "n")
    return np.abs(np.linalg.eigvals(matrices)).max(axis=-1)


class StableSteps:
    """Search for the smallest unstable timestep of a method.

    Timesteps 0.8 % apart are tested, and the first unstable one is refined by bisection. Schemes
    with several kicks per step have resonance windows; narrower ones may be missed. The search
    extends only as far as requested, and a later call continues it.
    """

    def __init__(self, motion: SmallMotion, step: Step):
        self._motion, self._step = motion, step
        self._trials, self._stable = _trials(motion), 0
        self._end: float | None = None

    def end(self, enough: float = math.inf) -> float:
        """Return the smallest unstable timestep, in s; infinite if there is none.

        If that exceeds `enough`, the result may instead be a stable timestep longer than `enough`.
        """
        while self._end is None and self._trials[self._stable] <= enough:
            stable = self._stable  # another thread may change it meanwhile
            batch = self._trials[stable + 1 :][:BATCH]
            batch = batch[: np.searchsorted(batch, enough, side="right") + 1]
            unstable = self._unstable(batch)
            if unstable.any():
                first = stable + 1 + int(unstable.argmax())
                self._end = self._bisect(*self._trials[first - 1 : first + 1].tolist())
            elif len(batch):
                self._stable = stable + len(batch)
            else:
                self._end = math.inf
        return float(self._trials[self._stable]) if self._end is None else self._end

    def _unstable(self, h: ArrayLike) -> NDArray[np.bool_]:
        return spectral_radius(self._motion, self._step, h) > 1 + ROUNDING

    def _bisect(self, stable: float, unstable: float) -> float:
        while unstable - stable > 1e-8 * unstable:
            middle = (stable + unstable) / 2
            if self._unstable(middle):
                unstable = middle
            else:
                stable = middle
        return unstable


@checked(finite=False)
def largest_stable_step(motion: SmallMotion, step: Step) -> float:
    """Return the smallest timestep, in s, with a spectral radius above 1; see `StableSteps`."""
    return StableSteps(motion, step).end()


def _trials(motion: SmallMotion) -> NDArray[np.float64]:
    """Return zero and the timesteps to test."""
    frequency, decay = motion.frequency, float(motion.decay.max())
    if frequency == decay == 0:
        return np.zeros(1)
    first, longest = SHORTEST / max(frequency, decay), LONGEST / (frequency or decay)
    count = int(math.log(longest / first) / math.log(FACTOR)) + 1
    steps = np.multiply.accumulate([first, *count * [FACTOR]])
    return np.array([0.0, *steps[steps <= longest]])
