r"""The slow variable d = -v + sigma omega of the disk at weak potential, beta max |U| << 1.

There, the slip reaches equilibrium long before d = d_0 + int U'(x) dt has changed, and d diffuses:

    dp/dt = d/dd [D(d) p_eq d/dd (p/p_eq)],      p_eq = N(0, (1 + sigma)/beta),

where D is the time integral of the correlation of U' at given d. The transport that the paper
considers ballistic forever lasts as long as this equation needs to forget d.
"""

import math
from collections.abc import Callable
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import solve_banded

from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.checks import check_number
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import Times, integer
from magmotor.devices.disk.scene import Disk
from magmotor.devices.disk.theory.stationary import (
    gibbs_mean_squares,
    require_one_temperature,
    slip_rate,
    temperature,
)

Transform = Callable[[complex], complex]

REACH = 9.0
"""Half-width of the grid, in standard deviations of d."""

MOST_CELLS = 10**6
Cells = Annotated[int, integer(at_least=10, at_most=MOST_CELLS)]

ONE_BY_ONE = 100
"""Number of frequencies that take as long as one, in a Python loop."""

MOST_TERMS = 10**9
"""Largest number of terms of continued fractions, for all d together: about ten seconds."""

TALBOT_POINTS = 24
"""Number of points on Talbot's contour, for an error of e^(-1.36 x 24) = 7e-15."""


@checked
def d_diffusion(scene: Disk, d: ArrayLike) -> Array:
    r"""Diffusion coefficient D(d) of d = -v + sigma omega at weak potential.

    For U = sum_k a_k sin kx + b_k cos kx and S^2 = sigma/((1 + sigma) beta),

        D = sum_k k^2 (a_k^2 + b_k^2)/2 int_0^inf cos(k d t/(1 + sigma)) e^(-k^2 S^2 g(t)) dt,
        g(t) = (lambda t - 1 + e^(-lambda t))/lambda^2,

    the correlation of U' along x = x_0 - d t/(1 + sigma) + sigma/(1 + sigma) int s dt, integrated.
    A small `friction_ratio` r adds r alpha^2 (sigma + 1/sigma)^2/2, and background drag g of x and
    g' of theta adds (g + g') kT: the noise on d itself, to first order in friction and drag.

    Parameters
    ----------
    d : array_like
        Values of d, dimensionless, any shape.

    Returns
    -------
    numpy.ndarray
        D, dimensionless (d^2 over time), shaped as `d`.

    Raises
    ------
    ValueError
        The scene has no noise, or its drag has another temperature.
    """
    check_number("noise", scene.noise, above=0)
    require_one_temperature(scene)
    sigma = scene.sigma
    speed = np.asarray(d, dtype=float) / (1 + sigma)
    spread = math.sqrt(sigma / (1 + sigma) * temperature(scene))
    on_x, on_theta = scene.noise_matrix
    total = np.full_like(speed, np.sum((on_theta - on_x) ** 2) / 2)
    for k, (a, b) in enumerate(scene.coefficients, start=1):
        if strength := k**2 * (a**2 + b**2) / 2:
            total += strength * _line_shape(k * speed, k * spread, slip_rate(scene))
    return total


class ReducedDisk:
    r"""The reduced Fokker-Planck equation of d, and the displacement of x that follows from it.

    It is valid for beta max |U| << 1 and a small `friction_ratio` and drag, at times beyond
    1/lambda; the drag may be large if rotational_drag = sigma drag. With y = x + theta, z = -x +
    sigma theta and dz/dt = d, the displacement is x = (sigma y - z)/(1 + sigma). It is assumed that
    y moves as on flat U (without drag, the limit var(y)/t = alpha^2/c^2 is valid for any U) and is
    independent of z; the neglected terms are of relative order beta |U|.

    Finite volumes on d >= 0 (the equation is even in d) conserve probability and detailed balance.
    Functions of time are inverse Laplace transforms on Talbot's contour, with one or two
    tridiagonal solves for each point; the relative accuracy is the same from t << 1 to 1e10.

    Parameters
    ----------
    scene : Disk
        The disk; it must have noise.
    cells : int, optional
        Number of cells from d = 0 to nine standard deviations; the default resolves D(d), for an
        error of a few 1e-5 in the displacement.

    Raises
    ------
    ValueError
        The scene has no noise, its drag has another temperature, or D(d) needs more than a million
        cells.
    """

    @checked
    def __init__(self, scene: Disk, cells: Cells | None = None) -> None:
        check_number("noise", scene.noise, above=0)
        self.scene = scene
        self.mean_square = gibbs_mean_squares(scene)["d"]
        """Stationary mean square of d, (1 + sigma)/beta."""
        if cells is None:
            cells = self._default_cells()
        if cells > MOST_CELLS:
            sentence = f"must be at most {MOST_CELLS:g}; sigma, noise or friction is too extreme"
            raise ArgumentError("cells for D(d)", float(cells), sentence)
        self.d = np.linspace(0, REACH * math.sqrt(self.mean_square), cells + 1)
        """Nodes, shape (cells + 1,)."""
        self.probability = self._equilibrium()
        """Stationary probabilities of the nodes, shape (cells + 1,); their sum is 1."""
        self.up, self.down = self._hopping_rates()
        """Rates to the next and to the previous node, shape (cells + 1,)."""

    @property
    def bulk_time(self) -> float:
        """Correlation time (1 + sigma)/(beta D(0)) of d if D were constant; infinite on flat U.

        It is shorter than the true correlation time, since D decreases with |d|.
        """
        center = float(d_diffusion(self.scene, 0.0))
        return self.mean_square / center if center else math.inf

    @cached_property
    def correlation_time(self) -> float:
        """Integral correlation time int_0^inf C_d dt/C_d(0) = (1 + sigma)/beta E_mu[1/D(d)]."""
        diffusion = d_diffusion(self.scene, self.d)
        if not diffusion.all():
            return math.inf
        return self.mean_square * float(self.probability @ (1 / diffusion))

    @property
    def x_diffusion(self) -> float:
        """Asymptotic diffusion coefficient lim MSD/(2t) of x, dimensionless; infinite on flat U."""
        fast = gibbs_mean_squares(self.scene)["slip"] / slip_rate(self.scene)
        slow = self.mean_square * self.correlation_time
        return (self.scene.sigma**2 * fast + slow) / (1 + self.scene.sigma) ** 2

    @checked
    def d_correlation(self, t: Times) -> Array:
        """Return C_d(t) = E_mu[d_0 d_t], shaped as `t` (> 0)."""
        return _inverse_laplace(self._d_correlation, t)

    @checked
    def d_mean_square_from_rest(self, t: Times) -> Array:
        """Return E[d_t^2] from d_0 = 0, shaped as `t` (> 0)."""
        return _inverse_laplace(lambda p: self._solve_even(p, self.d**2)[0], t)

    @checked
    def msd_from_gibbs(self, t: Times) -> Array:
        """Return E_mu[(x_t - x_0)^2], shaped as `t` (> 0)."""
        return _inverse_laplace(self._msd_from_gibbs, t)

    @checked
    def msd_from_rest(self, t: Times) -> Array:
        """Return E[(x_t - x_0)^2] from rest, v_0 = omega_0 = 0, shaped as `t` (> 0)."""
        return _inverse_laplace(self._msd_from_rest, t)

    @checked
    def slope_from_gibbs(self, t: Times) -> Array:
        """Return the local slope d log MSD/d log t of `msd_from_gibbs`, shaped as `t` (> 0)."""
        return _log_slope(self._msd_from_gibbs, t)

    @checked
    def slope_from_rest(self, t: Times) -> Array:
        """Return the local slope d log MSD/d log t of `msd_from_rest`, shaped as `t` (> 0)."""
        return _log_slope(self._msd_from_rest, t)

    @checked
    def increment_correlation(self, lag: Times) -> Array:
        """Return the correlation of successive increments of x over a time `lag` (> 0), under mu.

        It is MSD(2 lag)/(2 MSD(lag)) - 1: 1 for ballistic motion, 0 for diffusion.
        """
        lag = np.asarray(lag, dtype=float)
        return self.msd_from_gibbs(2 * lag) / (2 * self.msd_from_gibbs(lag)) - 1

    def _default_cells(self) -> int:
        """Return the number of cells that resolve the width of D(d)."""
        sigma, rate = self.scene.sigma, slip_rate(self.scene)
        spread = math.sqrt(sigma / (1 + sigma) * temperature(self.scene))
        width = math.sqrt(sigma) * min(1.0, spread / rate)
        return math.ceil(90 * REACH * max(1.0, 0.7 / width))

    def _equilibrium(self) -> Array:
        weight = np.exp(-(self.d**2) / (2 * self.mean_square))
        weight[0] /= 2  # half a cell
        return weight / weight.sum()

    def _hopping_rates(self) -> tuple[Array, Array]:
        """Return rates with detailed balance: D p_eq at a face over p_eq at a node."""
        step = self.d[1]
        faces = self.d[:-1] + step / 2
        conductance = d_diffusion(self.scene, faces) / step**2
        exponent = faces**2 / (2 * self.mean_square)
        nodes = self.d**2 / (2 * self.mean_square)
        up = np.append(conductance * np.exp(nodes[:-1] - exponent), 0.0)
        down = np.append(0.0, conductance * np.exp(nodes[1:] - exponent))
        up[0] *= 2  # out of half a cell
        return up, down

    def _solve_even(self, p: complex, values: NDArray) -> NDArray:
        """Apply (p - L)^-1 to an even function of d; L is the backward operator."""
        return self._resolvent(p, values, 0)

    def _solve_odd(self, p: complex, values: NDArray) -> NDArray:
        """Apply (p - L)^-1 to an odd function of d, which vanishes at d = 0."""
        return np.append(0.0, self._resolvent(p, values[1:], 1))

    def _resolvent(self, p: complex, values: NDArray, first: int) -> NDArray:
        up, down = self.up[first:], self.down[first:]
        bands = np.zeros((3, len(up)), dtype=complex)
        bands[0, 1:] = -up[:-1]
        bands[1] = p + up + down
        bands[2, :-1] = -down[1:]
        return solve_banded((1, 1), bands, values, overwrite_ab=True, check_finite=False)

    def _d_correlation(self, p: complex) -> complex:
        return complex((self.probability * self.d) @ self._solve_odd(p, self.d))

    def _msd_from_gibbs(self, p: complex) -> complex:
        return self._combine(
            2 * gibbs_mean_squares(self.scene)["slip"] / (p**2 * (p + slip_rate(self.scene))),
            2 * self._d_correlation(p) / p**2,
        )

    def _msd_from_rest(self, p: complex) -> complex:
        rate = slip_rate(self.scene)
        kicks = 2 * rate * gibbs_mean_squares(self.scene)["slip"]
        mean = self._solve_odd(p, self.d)  # of z_t at given d_0, times p
        return self._combine(
            2 * kicks / (p**2 * (p + rate) * (p + 2 * rate)),
            2 * self._solve_even(p, self.d * mean)[0] / p,
        )

    def _combine(self, y: complex, z: complex) -> complex:
        return (self.scene.sigma**2 * y + z) / (1 + self.scene.sigma) ** 2


def _line_shape(frequency: Array, width: float, rate: float) -> Array:
    """Integrate cos(frequency t) exp[-(width/rate)^2 (rate t - 1 + e^(-rate t))] over t > 0.

    Kubo's continued fraction 1/(p + w^2/(p + r + 2 w^2/(p + 2r + ...))) at p = -i frequency.
    """
    # Beyond its turning point n = (frequency/(2 width))^2, the wave along the chain decays as
    # exp(-2/3 n^1.5 rate/width).
    turning = (np.max(np.abs(frequency), initial=0.0) / (2 * width)) ** 2
    depth = math.ceil(50 + (60 * width / rate) ** (2 / 3) + 2 * turning)
    terms = depth * max(frequency.size, ONE_BY_ONE)
    if terms > MOST_TERMS:
        sentence = f"must be at most {MOST_TERMS:g}; d, noise or friction is too extreme"
        raise ArgumentError("terms of D(d)", float(terms), sentence)
    p = -1j * frequency
    tail = np.zeros_like(p)
    for n in range(depth, 0, -1):
        tail = n * width**2 / (p + n * rate + tail)
    return (1 / (p + tail)).real


def _log_slope(transform: Transform, t: ArrayLike) -> Array:
    growth = _inverse_laplace(lambda p: p * transform(p), t)
    return np.asarray(t, dtype=float) * growth / _inverse_laplace(transform, t)


def _inverse_laplace(transform: Transform, t: ArrayLike) -> Array:
    """Return the function of t > 0 with a given transform, analytic off the negative axis.

    The midpoint rule on the modified Talbot contour, Trefethen, Weideman and Schmelzer, BIT 46
    (2006).
    """
    times = np.asarray(t, dtype=float)
    angle = (np.arange(TALBOT_POINTS // 2) + 0.5) * 2 * np.pi / TALBOT_POINTS
    half = 0.6407 * angle
    contour = TALBOT_POINTS * (0.5017 * angle / np.tan(half) - 0.6122 + 0.2645j * angle)
    tangent = 0.5017 / np.tan(half) - 0.5017 * half / np.sin(half) ** 2 + 0.2645j
    weight = 2 * np.exp(contour) * tangent
    values = [
        sum(w * transform(p / time) for w, p in zip(weight, contour, strict=True)).imag / time
        for time in times.flat
    ]
    return np.reshape(values, times.shape)
