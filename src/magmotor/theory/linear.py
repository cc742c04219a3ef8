"""Linear stability: what one step of each method does to small motions about rest."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import exprel

Matrix = NDArray[np.float64]

ROUNDING = 1e-6
"""By how much it may lift the spectral radius of a neutral step: free drifts are defective."""

SHORTEST, LONGEST, FACTOR = 1.0, 30.0, 1.008
"""First, last and ratio of the steps among which an unstable one is sought.

The first is over the motion's largest rate, the last over its largest frequency.
"""


class SmallMotion(NamedTuple):
    """Small motions about rest, q'' = -K q - C q'; each matrix has shape (n, n).

    The coordinates q have unit masses, and the friction C is diagonal; `implicit` is that part of
    it which MuJoCo's implicit integrators treat so.
    """

    stiffness: Matrix
    friction: Matrix
    implicit: Matrix

    @classmethod
    def of(
        cls, inertia: Matrix, stiffness: Matrix, friction: Matrix, implicit: Matrix
    ) -> "SmallMotion":
        """That of M q'' = -K q - C q' in any coordinates.

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


Step = Callable[[SmallMotion, float], Matrix]
"""The matrix by which a step of this length changes (q, v)."""


def splitting_step(parts: str, fractions: Sequence[float], *, exact: bool) -> Step:
    """The product of the parts of a step, each of which acts for its fraction of it.

    The parts are those of `SmallMotion.generators`; friction is the exact flow, or Euler's explicit
    step.
    """

    def step(motion: SmallMotion, h: float) -> Matrix:
        generators, decay = motion.generators(), motion.decay
        n = len(decay)
        product = np.eye(2 * n)
        for part, fraction in zip(parts, fractions, strict=True):
            change = fraction * h * generators[part]
            if exact and part in "OK":
                change[n:] *= exprel(-fraction * h * decay)[:, np.newaxis]
            product = product + change @ product
        return product

    return step


euler_step = splitting_step("KA", (1.0, 1.0), exact=False)
"""Kick with all friction explicit, then drift: the variational Euler scheme and MuJoCo's."""


def implicit_step(motion: SmallMotion, h: float) -> Matrix:
    """Kick with part D of friction implicit, then drift: (1 + h D) (v' - v) = -h (K q + C v)."""
    K, C, D = motion
    one = np.eye(len(K))
    kick = np.linalg.solve(one + h * D, -h * np.hstack([K, C])) + np.eye(len(K), 2 * len(K), len(K))
    stay = np.eye(len(K), 2 * len(K))
    return np.vstack([stay + h * kick, kick])


def runge_kutta_step(motion: SmallMotion, h: float) -> Matrix:
    """The polynomial of the classical Runge-Kutta method of fourth order."""
    parts = motion.generators()
    slope, one = h * (parts["A"] + parts["K"]), np.eye(2 * len(motion.stiffness))
    return one + slope @ (one + slope / 2 @ (one + slope / 3 @ (one + slope / 4)))


def spectral_radius(motion: SmallMotion, step: Step, h: float) -> float:
    """By how much a step of length h multiplies the small motion that grows fastest."""
    return float(np.abs(np.linalg.eigvals(step(motion, h))).max())


def largest_stable_step(motion: SmallMotion, step: Step) -> float:
    """The smallest step, in s, with a spectral radius above one; infinite if there is none.

    It is sought among steps 0.8 % apart, then bisected: schemes with several kicks in a step have
    windows of resonance, of which a narrower one may be missed.
    """
    frequency, decay = motion.frequency, float(motion.decay.max())
    if frequency == decay == 0:
        return math.inf
    longest = LONGEST / (frequency or decay)

    def unstable(h: float) -> bool:
        return spectral_radius(motion, step, h) > 1 + ROUNDING

    stable, h = 0.0, SHORTEST / max(frequency, decay)
    while not unstable(h):
        stable, h = h, FACTOR * h
        if h > longest:
            return math.inf
    while h - stable > 1e-8 * h:
        middle = (stable + h) / 2
        stable, h = (stable, middle) if unstable(middle) else (middle, h)
    return h
