"""How long flights of the disk last by the reduced equation of d: a first-passage problem.

Far out D(d) = A/d^4 with A = c kT (1 + sigma)^4 sum_k (a_k^2 + b_k^2)/2, and d has the stationary
variance m = (1 + sigma) kT. The path that returns to d = 0 after a long time t at the least cost
int (d' + D d/m)^2/(4D) dt climbs to d^4 = 3 A t/(4 m) and falls again, symmetrically. Its cost is
(t/tau)^(1/2) with

    tau = 3 m^3/A = 6 kT^2/[c (1 + sigma) sum_k (a_k^2 + b_k^2)],

so that the probability to fly longer is exp[-(t/tau)^(1/2)] in the end, up to a power of t.
"""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh_tridiagonal

from magmotor.devices.disk.ensemble.accumulators import HYSTERESIS
from magmotor.devices.disk.scene import Disk
from magmotor.theory import d_diffusion, gibbs_mean_squares, temperature

Array = NDArray[np.float64]

REACH = 9.0
"""End of the grid, in standard deviations of d."""

CELLS = 40
"""Number of cells between the values of d at which a flight ends and begins."""


def stretched_time(scene: Disk) -> float:
    """Return tau of the law exp[-(t/tau)^(1/2)]."""
    strength = sum(a**2 + b**2 for a, b in scene.coefficients)
    return 6 * temperature(scene) ** 2 / (scene.friction * (1 + scene.sigma) * strength)


class FlightLaw:
    """The law of flights of a disk, without a fitted number.

    A flight begins when d has reached +0.1 standard deviations from below, and ends at -0.1, as in
    `magmotor.ensemble`. Finite volumes in d with an absorbing end give the survival as a sum of
    exponentials.

    Parameters
    ----------
    scene : Disk
    """

    def __init__(self, scene: Disk):
        self.scene = scene

    @cached_property
    def modes(self) -> tuple[Array, Array]:
        """Rates and weights of the exponentials whose sum is the survival."""
        variance = gibbs_mean_squares(self.scene)["d"]
        end = HYSTERESIS * variance**0.5
        step = 2 * end / CELLS
        d = np.arange(-end, REACH * variance**0.5, step)
        faces = d[:-1] + step / 2
        rate = d_diffusion(self.scene, faces) / step**2
        level, at_faces = d**2 / (2 * variance), faces**2 / (2 * variance)
        up = np.append(rate * np.exp(level[:-1] - at_faces), 0.0)[1:]
        down = rate * np.exp(level[1:] - at_faces)
        rates, modes = eigh_tridiagonal(up + down, -np.sqrt(up[:-1] * down[1:]))
        root = np.exp(-level[1:] / 2)
        begin = CELLS - 1
        return rates, modes[begin] / root[begin] * (root @ modes)

    def survival(self, t: Array) -> Array:
        """Return the probability that a flight lasts longer than t, shaped as `t`."""
        rates, weights = self.modes
        return np.exp(-np.multiply.outer(np.asarray(t, float), rates)) @ weights

    def slope(self, t: Array) -> Array:
        """Return d log(survival)/d log t, shaped as `t`."""
        rates, weights = self.modes
        decay = np.exp(-np.multiply.outer(np.asarray(t, float), rates))
        return -t * (decay @ (weights * rates)) / (decay @ weights)
