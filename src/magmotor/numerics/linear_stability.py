"""Linear stability: what one step of each method does to small motions about rest."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import exprel

from magmotor.common.arguments import checked
from magmotor.common.hints import Elapsed, Inertia, Square

Matrix = NDArray[np.float64]

ROUNDING = 1e-6
"""By how much it may lift the spectral radius of a neutral step: free drifts are defective."""

SHORTEST, LONGEST, FACTOR = 1.0, 30.0, 1.008
"""First, last and ratio of the steps among which an unstable one is sought.

The first is over the motion's largest rate, the last over its largest frequency.
"""

BATCH = 16
"""How many of these steps are tried in one call."""


class SmallMotion(NamedTuple):
    """Small motions about rest, q'' = -K q - C q'; each matrix has shape (n, n).

    The coordinates q have unit masses, and the friction C is diagonal; `implicit` is that part of
    it which MuJoCo's implicit integrators treat so.
    """

    stiffness: Matrix
    friction: Matrix
    implicit: Matrix

    @classmethod
    @checked
    def of(
        cls, inertia: Inertia, stiffness: Square, friction: Square, implicit: Square
    ) -> "SmallMotion":
        """That of M q'' = -K q - C q' in any coordinates; M is positive definite.

        Negative parts of K count as none: rest is unstable there in truth, by no method's fault.
        """
        values, vectors = np.linalg.eigh(inertia)
        root = vectors / np.sqrt(values) @ vectors.T
        _, modes = np.linalg.eigh(root @ friction @ root)
        turn = root @ modes
        values, vectors = np.linalg.eigh(turn.T @ stiffness @ turn)
        restoring = vectors * np.maximum(values, 0.0) @ vectors.T
        return cls(restoring, *(turn.T @ part @ turn for part in (friction, implicit)))

    @property
    def decay(self) -> Matrix:
        """Rates of friction on the velocities, in 1/s, shape (n,)."""
        return np.diag(self.friction)

    @property
    def frequency(self) -> float:
        """The largest angular frequency without friction, in rad/s."""
        return math.sqrt(abs(np.linalg.eigvalsh(self.stiffness)[-1]))

    def generators(self) -> dict[str, Matrix]:
        """Of (q, v): A that of the drift, B of the kick, O of friction, K of kick and friction."""
        n = len(self.stiffness)
        drift, kick, friction = np.zeros((3, 2 * n, 2 * n))
        drift[:n, n:], kick[n:, :n] = np.eye(n), -self.stiffness
        friction[n:, n:] = -np.diag(self.decay)
        return {"A": drift, "B": kick, "O": friction, "K": kick + friction}


Lengths = float | Matrix
"""One length, in s, or several, shape (..., 1, 1)."""

Step = Callable[[SmallMotion, Lengths], Matrix]
"""The matrix by which a step of this length changes (q, v), shape (..., 2n, 2n)."""


def splitting_step(parts: str, fractions: Sequence[float], *, exact: bool) -> Step:
    """The product of the parts of a step, each of which acts for its fraction of it.

    The parts are those of `SmallMotion.generators`; friction is the exact flow, or Euler's explicit
    step.
    """

    def step(motion: SmallMotion, h: Lengths) -> Matrix:
        generators, decay = motion.generators(), motion.decay[:, np.newaxis]
        n = len(decay)
        product = np.eye(2 * n)
        for part, fraction in zip(parts, fractions, strict=True):
            change = fraction * h * generators[part]
            if exact and part in "OK":
                change[..., n:, :] *= exprel(-fraction * h * decay)
            product = product + change @ product
        return product

    return step


euler_step = splitting_step("KA", (1.0, 1.0), exact=False)
"""Kick with all friction explicit, then drift: the variational Euler scheme and MuJoCo's."""


def implicit_step(motion: SmallMotion, h: Lengths) -> Matrix:
    """Kick with part D of friction implicit, then drift: (1 + h D) (v' - v) = -h (K q + C v)."""
    K, C, D = motion
    one = np.eye(len(K))
    kick = np.linalg.solve(one + h * D, -h * np.hstack([K, C])) + np.eye(len(K), 2 * len(K), len(K))
    stay = np.eye(len(K), 2 * len(K))
    return np.concatenate([stay + h * kick, kick], axis=-2)


def runge_kutta_step(motion: SmallMotion, h: Lengths) -> Matrix:
    """The polynomial of the classical Runge-Kutta method of fourth order."""
    parts = motion.generators()
    slope, one = h * (parts["A"] + parts["K"]), np.eye(2 * len(motion.stiffness))
    return one + slope @ (one + slope / 2 @ (one + slope / 3 @ (one + slope / 4)))


@checked
def spectral_radius(motion: SmallMotion, step: Step, h: Elapsed) -> NDArray[np.float64]:
    """By how much a step multiplies the small motion that grows fastest.

    Parameters
    ----------
    motion : SmallMotion
    step : callable
        The matrix by which a step of the method, of given lengths, changes (q, v).
    h : array_like
        Lengths of steps in s, any shape.

    Returns
    -------
    ndarray
        Shaped as `h`; more than 1 where the step is unstable.
    """
    lengths = np.asarray(h, dtype=float)[..., np.newaxis, np.newaxis]
    return np.abs(np.linalg.eigvals(step(motion, lengths))).max(axis=-1)


class StableSteps:
    """The steps of a method at which small motions stay small, up to the first unstable one.

    That is sought among steps 0.8 % apart, then bisected: schemes with several kicks in a step have
    windows of resonance, of which a narrower one may be missed. It is sought no further than was
    asked for; the next time, from there.
    """

    def __init__(self, motion: SmallMotion, step: Step):
        self._motion, self._step = motion, step
        self._trials, self._stable = _trials(motion), 0
        self._end: float | None = None

    def end(self, enough: float = math.inf) -> float:
        """The smallest unstable step, in s, infinite if there is none.

        Where it is longer than `enough`, a stable step that is longer, too, may stand for it.
        """
        while self._end is None and self._trials[self._stable] <= enough:
            stable = self._stable  # another thread may go on meanwhile
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
    """The smallest step, in s, with a spectral radius above one; see `StableSteps`."""
    return StableSteps(motion, step).end()


def _trials(motion: SmallMotion) -> NDArray[np.float64]:
    """Zero and the steps among which an unstable one is sought."""
    frequency, decay = motion.frequency, float(motion.decay.max())
    if frequency == decay == 0:
        return np.zeros(1)
    first, longest = SHORTEST / max(frequency, decay), LONGEST / (frequency or decay)
    count = int(math.log(longest / first) / math.log(FACTOR)) + 1
    steps = np.multiply.accumulate([first, *count * [FACTOR]])
    return np.array([0.0, *steps[steps <= longest]])
