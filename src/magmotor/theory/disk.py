r"""Closed forms of the sliding disk and of its control, each with its source in the paper.

Everything is dimensionless. With gamma = (1 + sigma)/sigma and lambda = c gamma, the slip
s = v + omega and the protected combination d = -v + sigma omega obey

    ds = -U'(x) dt - lambda s dt + alpha gamma dW,        dd = U'(x) dt,

since C = n n^T, n = (1, 1/sigma), has rank one: C^(1/2) (dB_v, dB_omega) = n dW with *one* Brownian
motion W. The paper diagonalises C^(1/2) with the matrix V that diagonalises C diag(1, sigma), which
is right only at sigma = 1; that is the source of its wrong coefficients, kept here as `paper_...`.
"""

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor.checks import check_number, reject
from magmotor.scenes import Disk, LangevinParticle
from magmotor.scenes.potential import derivative, steepest_curvature

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

Scene = Disk | LangevinParticle
Array = NDArray[np.float64]


def temperature(scene: Scene) -> float:
    """Temperature kT = 1/beta = alpha^2/(2c), dimensionless; zero without noise (theorem 1)."""
    return scene.noise**2 / (2 * scene.friction) if scene.noise else 0.0


def slip_factor(scene: Disk) -> float:
    """Return gamma = (1 + sigma)/sigma, by which a force at the contact accelerates the slip."""
    return (1 + scene.sigma) / scene.sigma


def slip_rate(scene: Disk) -> float:
    """Rate lambda = c gamma at which the slip v + omega decays, dimensionless (equation (eq:2)).

    For one direction of friction; `friction_rates` holds for any `friction_ratio`.
    """
    return scene.friction * slip_factor(scene)


def friction_rates(scene: Scene) -> Array:
    """Eigenvalues of the friction c C M, ascending, M = diag(masses); shape (degrees of freedom,).

    The disk's are 0 (of d) and lambda (of the slip) while `friction_ratio` is 0.
    """
    return _friction_modes(scene)[0]


def gibbs_mean_squares(scene: Disk) -> dict[str, float]:
    """Mean squares of v, omega, slip = v + omega and d = -v + sigma omega under Gibbs' measure.

    kT, kT/sigma, gamma kT and (1 + sigma) kT, dimensionless: the measure of (kjhss).
    """
    kT = temperature(scene)
    return {
        "v": kT,
        "omega": kT / scene.sigma,
        "slip": slip_factor(scene) * kT,
        "d": (1 + scene.sigma) * kT,
    }


def gibbs_deviations(scene: Scene) -> Array:
    """Standard deviations sqrt(kT/mass) of the velocities under (kjhss), shape (dof,)."""
    return np.sqrt(temperature(scene) / np.array(scene.masses))


def position_density(scene: Scene, x: ArrayLike) -> Array:
    """Density of x mod 2 pi under (kjhss), proportional to exp(-beta U(x)).

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


def position_cdf(scene: Scene, x: ArrayLike) -> Array:
    """Probability that x mod 2 pi, in [0, 2 pi), is at most the given x mod 2 pi, under (kjhss).

    A periodic quintic spline through the density, integrated; shaped as `x`.
    """
    integral = _boltzmann(scene).antiderivative()
    return integral(np.mod(x, 2 * np.pi)) - integral(0.0)


def flat_mean_displacement(scene: Scene, t: ArrayLike, direction: ArrayLike | None = None) -> Array:
    """Mean displacement on flat U from the scene's initial velocities: equation (eq:v), integrated.

    Parameters
    ----------
    t : array_like
        Times, dimensionless, any shape.
    direction : array_like, optional
        Coefficients of (x, theta) in the displacement; x alone by default, (1, 1) for x + theta.

    Returns
    -------
    numpy.ndarray
        Mean of direction.(q_t - q_0), shaped as `t`. The potential is taken as flat.
    """
    t = np.asarray(t, dtype=float)
    rates, modes = _friction_modes(scene)
    root = np.sqrt(scene.masses)
    velocities = (scene.v, scene.omega) if isinstance(scene, Disk) else (scene.v,)
    weights = (modes.T @ (_direction(scene, direction) / root)) * (modes.T @ (root * velocities))
    return sum((w * _decayed(r, t) for w, r in zip(weights, rates, strict=True)), np.zeros_like(t))


def flat_variance_from_rest(
    scene: Scene, t: ArrayLike, direction: ArrayLike | None = None
) -> Array:
    r"""Exact variance of the displacement on flat U, given the initial state.

    For the disk's x: D [t - 2 (1 - e^(-lambda t))/lambda + (1 - e^(-2 lambda t))/(2 lambda)] with
    D = `flat_x_diffusion`, and the same for x + theta with D = `y_diffusion`; for the Langevin
    particle lambda = c and D = alpha^2/c^2, which it follows in any potential when kT >> max U.
    With `friction_ratio` > 0 it is the sum of two such terms.

    Parameters
    ----------
    t : array_like
        Times, dimensionless, any shape.
    direction : array_like, optional
        Coefficients of (x, theta) in the displacement; x alone by default, (1, 1) for x + theta.

    Returns
    -------
    numpy.ndarray
        E[(q_t - E[q_t])^2], dimensionless, shaped as `t`; from rest it is E[(q_t - q_0)^2].
    """
    return _sum_over_modes(scene, t, direction, _from_rest)


def flat_msd_from_gibbs(scene: Scene, t: ArrayLike, direction: ArrayLike | None = None) -> Array:
    """Exact E_mu[(q_t - q_0)^2] on flat U, with velocities drawn from (kjhss).

    A mode of rate r adds 2 kT (r t - 1 + e^(-r t))/r^2 times its weight. The disk's d is then
    conserved, r = 0: x gains t^2/(beta (1 + sigma)), ballistic for ever *without* any potential.

    Parameters
    ----------
    t : array_like
        Times, dimensionless, any shape.
    direction : array_like, optional
        Coefficients of (x, theta) in the displacement; x alone by default, (1, 1) for x + theta.

    Returns
    -------
    numpy.ndarray
        Mean squared displacement, dimensionless, shaped as `t`.
    """
    return _sum_over_modes(scene, t, direction, _from_gibbs)


def y_diffusion(scene: Disk) -> float:
    """Limit alpha^2/c^2 of var(x + theta)/t, dimensionless, for *any* U: equation (kskjhs3).

    From sigma domega = -c s dt + alpha dW, exactly y_t - y_0 = (alpha/c) W_t - (sigma/c) (omega_t -
    omega_0), y = x + theta, and omega stays bounded in mean square.
    """
    _require_one_friction(scene)
    return (scene.noise / scene.friction) ** 2


def paper_y_diffusion(scene: Disk) -> float:
    """The paper's limit of var(x + theta)/t, 2 alpha^2 sigma^2/(c^2 (sigma^2 + 1)): (kskjhs3).

    Wrong unless sigma = 1: its slip noise sqrt(2) alpha (sigma + 1)/sqrt(sigma^2 + 1) dB_s should
    be alpha gamma dW.
    """
    sigma = scene.sigma
    return 2 * (scene.noise * sigma / scene.friction) ** 2 / (sigma**2 + 1)


def flat_x_diffusion(scene: Disk) -> float:
    """Limit sigma^2 alpha^2/((1 + sigma)^2 c^2) of var(x)/t on flat U: second (kskjhs3).

    x = (sigma y - z)/(1 + sigma) with y = x + theta, and z = -x + sigma theta without noise.
    """
    return (scene.sigma / (1 + scene.sigma)) ** 2 * y_diffusion(scene)


def paper_flat_x_diffusion(scene: Disk) -> float:
    """The paper's limit of var(x)/t on flat U, `paper_y_diffusion`/(1 + sigma)^2: second (kskjhs3).

    Wrong unless sigma = 1: wrong for y, and the factor sigma^2 of x = (sigma y - z)/(1 + sigma) is
    lost.
    """
    return paper_y_diffusion(scene) / (1 + scene.sigma) ** 2


def velocity_noise_coefficient(scene: Disk) -> float:
    """Coefficient of int e^(-lambda (t - s)) dW_s in v_t: alpha, for any sigma (equation (eq:v)).

    v = (sigma s - d)/(1 + sigma), and s has the noise alpha gamma dW: sigma gamma/(1 + sigma) = 1.
    """
    _require_one_friction(scene)
    return scene.noise


def paper_velocity_noise_coefficient(scene: Disk) -> float:
    """The paper's coefficient in v_t, sqrt(2) alpha/sqrt(sigma^2 + 1): equation (eq:v).

    Wrong unless sigma = 1: the slip's noise is wrong, and the factor sigma of
    v = (sigma s - d)/(1 + sigma) is lost.
    """
    return math.sqrt(2) * scene.noise / math.hypot(scene.sigma, 1)


def ballistic_coefficient(scene: Disk) -> float:
    """MSD/t^2 = 1/(beta (1 + sigma)) of x under Gibbs' measure, for 1/lambda << t << `bulk_time`.

    The mean square of d over (1 + sigma)^2. Beyond the correlation time of d it decays to zero.
    """
    return temperature(scene) / (1 + scene.sigma)


def paper_upper_ballistic_bound(scene: Disk) -> float:
    """4/(beta (1 + sigma)), the paper's bound on lim sup var(x)/t^2: second (ksddssdkjhs3).

    True but vacuous: v has mean zero and mu is ergodic, so that the limit is zero.
    """
    return 4 * ballistic_coefficient(scene)


def paper_lower_ballistic_bound(scene: Disk) -> float:
    """1/(4 beta (1 + sigma)), the paper's bound on lim inf var(x)/t^2: third (ksddssdkjhs3).

    False: the limit is zero. Time reversal gives E[A_t^2] = E[B_t^2] in the proof only before the
    mean E[. | xi_0] is subtracted; afterwards A_t -> 0 and B_t -> d_t.
    """
    return ballistic_coefficient(scene) / 4


def heat_rate(scene: Scene, velocities: ArrayLike) -> Array:
    """Power c sum_j (w_j.u)^2 that friction takes: c (v + omega)^2 for the paper's disk.

    The first term of the energy balance in the remark after (ksddssdkjhs3).

    Parameters
    ----------
    velocities : array_like
        u = (v, omega), or (v,) of the Langevin particle; shape (..., dof), dimensionless.

    Returns
    -------
    numpy.ndarray
        Power, dimensionless, shape (...).
    """
    slips = np.asarray(velocities, dtype=float) @ scene.slip_directions.T
    return scene.friction * np.sum(slips**2, axis=-1)


def injection_rate(scene: Scene) -> float:
    """Mean power (alpha^2/2) tr(M^-1 sum_j w_j w_j^T) of the noise, dimensionless.

    (alpha^2/2) (1 + 1/sigma) for the paper's disk: the second term of its energy balance, right.
    """
    return scene.noise**2 / 2 * float(np.sum(scene.slip_directions**2 / scene.masses))


def euler_slip_variance(scene: Disk, timestep: float) -> float:
    """Mean square gamma kT/(1 - lambda h/2) of the slip that (eq:svi) has on flat U.

    Its slip is autoregressive: s' = (1 - lambda h) s + alpha gamma sqrt(h) N(0, 1).

    Raises
    ------
    ValueError
        A step that is not in (0, 2/lambda), or `friction_ratio` > 0.
    """
    _require_one_friction(scene)
    check_number("timestep", timestep, above=0, below=friction_step_limit(scene))
    return gibbs_mean_squares(scene)["slip"] / (1 - slip_rate(scene) * timestep / 2)


def friction_step_limit(scene: Scene) -> float:
    """Step 2/(largest of `friction_rates`) beyond which explicit friction, (eq:svi), diverges."""
    fastest = friction_rates(scene)[-1]
    return 2 / float(fastest) if fastest else math.inf


def potential_step_limit(scene: Scene) -> float:
    """Step 2/sqrt(max |U''|) beyond which a kick-type scheme is linearly unstable in a well."""
    curvature = steepest_curvature(scene.coefficients)
    return 2 / math.sqrt(curvature) if curvature else math.inf


def alias_period(scene: Disk, timestep: float) -> float:
    """Shift 2 pi (1 + sigma)/h of d = -v + sigma omega that a kick-type scheme cannot see.

    x then moves by one more period of U each step. So d of such a scheme wanders over copies of
    the line for ever, and the scheme has no invariant probability. Infinite on flat U.
    """
    check_number("timestep", timestep, above=0)
    waves = _common_waves(scene)
    return 2 * math.pi * (1 + scene.sigma) / (waves * timestep) if waves else math.inf


def largest_timestep(scene: Disk, deviations: float = 6.0) -> float:
    """Step that keeps half an `alias_period` at so many standard deviations of d.

    (pi/6) sqrt((1 + sigma) beta) by default, for a U of period 2 pi: the binding limit on h.
    """
    check_number("deviations", deviations, above=0)
    reach = deviations * math.sqrt(gibbs_mean_squares(scene)["d"])
    return alias_period(scene, 1.0) / (2 * reach) if reach else math.inf


def _require_one_friction(scene: Disk) -> None:
    if scene.friction_ratio > 0:
        raise reject("friction_ratio", scene.friction_ratio, "zero for this closed form")


def _common_waves(scene: Disk) -> int:
    """Number of periods of U in 2 pi; 0 if it is flat."""
    return math.gcd(*(k for k, pair in enumerate(scene.coefficients, start=1) if any(pair)))


def _boltzmann(scene: Scene) -> "BSpline":
    from scipy.interpolate import make_interp_spline

    check_number("noise", scene.noise, above=0)
    sharpness = math.sqrt(scene.beta * steepest_curvature(scene.coefficients))
    x = np.linspace(0, 2 * np.pi, 1024 * math.ceil(2 + sharpness) + 1)
    energy = derivative(scene.coefficients, x)
    weight = np.exp(-scene.beta * (energy - energy.min()))
    weight[-1] = weight[0]  # the spline wants them equal to the last bit
    spline = make_interp_spline(x, weight, k=5, bc_type="periodic")
    spline.c /= spline.integrate(0, 2 * np.pi)
    return spline


def _friction_modes(scene: Scene) -> tuple[Array, Array]:
    """Rates and orthonormal modes of the friction on velocities weighted by sqrt(mass)."""
    directions = scene.slip_directions / np.sqrt(scene.masses)
    rates, modes = np.linalg.eigh(scene.friction * directions.T @ directions)
    rates[rates < 1e-14 * rates[-1]] = 0.0  # of a mode without friction, but for rounding
    return rates, modes


def _direction(scene: Scene, direction: ArrayLike | None) -> Array:
    if direction is None:
        return np.eye(len(scene.masses))[0]
    vector = np.asarray(direction, dtype=float)
    if vector.shape != (len(scene.masses),):
        raise reject("direction", direction, f"{len(scene.masses)} numbers")
    return vector


def _sum_over_modes(scene: Scene, t: ArrayLike, direction: ArrayLike | None, term) -> Array:
    t = np.asarray(t, dtype=float)
    rates, modes = _friction_modes(scene)
    weights = (modes.T @ (_direction(scene, direction) / np.sqrt(scene.masses))) ** 2
    terms = (w * term(r * t) for w, r in zip(weights, rates, strict=True))
    return temperature(scene) * t**2 * sum(terms, np.zeros_like(t))


def _decayed(rate: float, t: Array) -> Array:
    """Integral of e^(-rate t)."""
    return -np.expm1(-rate * t) / rate if rate else t


def _from_gibbs(z: Array) -> Array:
    """2 (z - 1 + e^(-z))/z^2, which is 1 at 0."""
    series = 1 - z / 3 * (1 - z / 4 * (1 - z / 5 * (1 - z / 6)))
    safe = np.maximum(z, 1e-3)
    return np.where(z < 1e-3, series, 2 * (safe + np.expm1(-safe)) / safe**2)


def _from_rest(z: Array) -> Array:
    """2 (z - 2 (1 - e^(-z)) + (1 - e^(-2z))/2)/z^2, about 2z/3 at 0."""
    series = np.zeros_like(z)
    for k in range(3, 10):
        series += (4 - 2.0**k) / math.factorial(k) * (-1) ** k * z ** (k - 2)
    safe = np.maximum(z, 0.03)
    closed = 2 * (safe + 2 * np.expm1(-safe) - np.expm1(-2 * safe) / 2) / safe**2
    return np.where(z < 0.03, series, closed)
