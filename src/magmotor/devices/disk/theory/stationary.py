"""Temperature, friction rates and stationary distribution of disk and particle."""

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.checks import check_number
from magmotor.common.exceptions import ArgumentError
from magmotor.devices.disk.scene import Disk, LangevinParticle, derivative, steepest_curvature

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

Scene = Disk | LangevinParticle

SHARPEST = 1e3
"""Largest sqrt(beta max|U''|) for which the density is computed on a grid."""


@checked
def temperature(scene: Scene) -> float:
    """Return the temperature kT = 1/beta = alpha^2/(2c), zero without noise (theorem 1)."""
    return scene.noise**2 / (2 * scene.friction) if scene.noise else 0.0


def hottest(scene: Scene) -> float:
    """Return the highest temperature kT of the friction and the background drag."""
    kT = temperature(scene)
    if isinstance(scene, Disk) and not scene.has_one_temperature:
        return max(kT, scene.drag_temperature or 0.0)
    return kT


@checked
def slip_factor(scene: Disk) -> float:
    """Return gamma = (1 + sigma)/sigma, the inverse mass of the slip."""
    return (1 + scene.sigma) / scene.sigma


@checked
def slip_rate(scene: Disk) -> float:
    """Return the rate lambda = c gamma at which the slip v + omega decays (equation (eq:2)).

    It assumes one direction of friction; `friction_rates` covers any `friction_ratio`. Background
    drag g of x and g' of theta adds (sigma g + g'/sigma)/(1 + sigma), the rate at d = 0. If g' =
    sigma g, this is exact for any d; otherwise the slip also feels d, to first order in the drag.
    """
    drags = scene.drag * scene.sigma + scene.rotational_drag / scene.sigma
    return scene.friction * slip_factor(scene) + drags / (1 + scene.sigma)


@checked
def friction_rates(scene: Scene) -> Array:
    """Return the decay rates of the velocities, ascending: eigenvalues of c C M; shape (dof,).

    Here M = diag(masses); with background drag, C includes it. For a disk with neither drag nor
    `friction_ratio`, they are 0 (for d) and lambda (for the slip).
    """
    return friction_modes(scene)[0]


def friction_modes(scene: Scene) -> tuple[Array, Array]:
    """Return rates and orthonormal modes of the friction, for velocities times sqrt(mass)."""
    root = np.sqrt(scene.masses)
    rates, modes = np.linalg.eigh(scene.friction_matrix / np.outer(root, root))
    rates[rates < 1e-14 * rates[-1]] = 0.0  # only rounding
    return rates, modes


@checked
def gibbs_mean_squares(scene: Disk) -> dict[str, float]:
    """Return the mean squares of v, omega, slip and d in the Gibbs measure (kjhss).

    They are kT, kT/sigma, gamma kT and (1 + sigma) kT; slip = v + omega, d = -v + sigma omega.
    """
    require_one_temperature(scene)
    kT = temperature(scene)
    return {
        "v": kT,
        "omega": kT / scene.sigma,
        "slip": slip_factor(scene) * kT,
        "d": (1 + scene.sigma) * kT,
    }


@checked
def gibbs_deviations(scene: Scene) -> Array:
    """Return the standard deviations sqrt(kT/mass) of the velocities in (kjhss), shape (dof,)."""
    require_one_temperature(scene)
    return np.sqrt(temperature(scene) / np.array(scene.masses))


@checked
def position_density(scene: Scene, x: ArrayLike) -> Array:
    """Return the density of x mod 2 pi in (kjhss), proportional to exp(-beta U(x)).

    Parameters
    ----------
    x : array_like
        Positions, dimensionless, any shape; the density has period 2 pi.

    Returns
    -------
    numpy.ndarray
        Density, shaped as `x`; its integral over one period is 1.
    """
    return _boltzmann(scene)(np.mod(x, 2 * np.pi))


@checked
def position_cdf(scene: Scene, x: ArrayLike) -> Array:
    """Return the cumulative distribution of x mod 2 pi in [0, 2 pi), in (kjhss).

    It is the integral of a periodic quintic spline through the density.

    Parameters
    ----------
    x : array_like
        Positions, dimensionless, any shape.

    Returns
    -------
    numpy.ndarray
        Probability, shaped as `x`.
    """
    integral = _boltzmann(scene).antiderivative()
    return integral(np.mod(x, 2 * np.pi)) - integral(0.0)


def _boltzmann(scene: Scene) -> "BSpline":
    from scipy.interpolate import make_interp_spline

    check_number("noise", scene.noise, above=0)
    require_one_temperature(scene)
    sharpness = math.sqrt(scene.beta * steepest_curvature(scene.coefficients))
    if sharpness > SHARPEST:
        sentence = f"must be so large that beta max|U''| is at most {SHARPEST**2:g}"
        raise ArgumentError("noise", scene.noise, sentence)
    x = np.linspace(0, 2 * np.pi, 1024 * math.ceil(2 + sharpness) + 1)
    energy = derivative(scene.coefficients, x)
    weight = np.exp(-scene.beta * (energy - energy.min()))
    weight[-1] = weight[0]  # the spline requires exact equality
    spline = make_interp_spline(x, weight, k=5, bc_type="periodic")
    spline.c /= spline.integrate(0, 2 * np.pi)
    return spline


def require_one_friction(scene: Disk) -> None:
    """Refuse scenes with friction in the second direction, or with background drag."""
    for name in ("friction_ratio", "drag", "rotational_drag"):
        if getattr(scene, name) > 0:
            raise ArgumentError(name, getattr(scene, name), "must be zero for this closed form")


def require_one_temperature(scene: Scene) -> None:
    """Refuse scenes whose background drag has another temperature: their law is not Gibbs'."""
    if isinstance(scene, Disk) and not scene.has_one_temperature:
        sentence = f"must be None or {temperature(scene):g}, the disk's kT, for a Gibbs measure"
        raise ArgumentError("drag_temperature", scene.drag_temperature, sentence)
