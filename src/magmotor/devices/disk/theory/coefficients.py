r"""Closed forms of the sliding disk and of its control, each with its source in the paper.

Everything is dimensionless. With gamma = (1 + sigma)/sigma and lambda = c gamma, the slip
s = v + omega and the protected combination d = -v + sigma omega obey

    ds = -U'(x) dt - lambda s dt + alpha gamma dW,        dd = U'(x) dt,

since C = n n^T, n = (1, 1/sigma), has rank one: C^(1/2) (dB_v, dB_omega) = n dW with *one* Brownian
motion W. The paper diagonalises C^(1/2) with the matrix V that diagonalises C diag(1, sigma), which
is right only at sigma = 1; that is the source of its wrong coefficients, kept here as `paper_...`.
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor.common.arguments import checked
from magmotor.common.checks import check_array
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.devices.disk.theory.stationary import require_one_friction, temperature

Scene = Disk | LangevinParticle
Array = NDArray[np.float64]


@checked
def y_diffusion(scene: Disk) -> float:
    """Limit alpha^2/c^2 of var(x + theta)/t, dimensionless, for *any* U: equation (kskjhs3).

    From sigma domega = -c s dt + alpha dW, exactly y_t - y_0 = (alpha/c) W_t - (sigma/c) (omega_t -
    omega_0), y = x + theta, and omega stays bounded in mean square.
    """
    require_one_friction(scene)
    return (scene.noise / scene.friction) ** 2


@checked
def paper_y_diffusion(scene: Disk) -> float:
    """The paper's limit of var(x + theta)/t, 2 alpha^2 sigma^2/(c^2 (sigma^2 + 1)): (kskjhs3).

    Wrong unless sigma = 1: its slip noise sqrt(2) alpha (sigma + 1)/sqrt(sigma^2 + 1) dB_s should
    be alpha gamma dW.
    """
    sigma = scene.sigma
    return 2 * (scene.noise * sigma / scene.friction) ** 2 / (sigma**2 + 1)


@checked
def flat_x_diffusion(scene: Disk) -> float:
    """Limit sigma^2 alpha^2/((1 + sigma)^2 c^2) of var(x)/t on flat U: second (kskjhs3).

    x = (sigma y - z)/(1 + sigma) with y = x + theta, and z = -x + sigma theta without noise.
    """
    return (scene.sigma / (1 + scene.sigma)) ** 2 * y_diffusion(scene)


@checked
def paper_flat_x_diffusion(scene: Disk) -> float:
    """The paper's limit of var(x)/t on flat U, `paper_y_diffusion`/(1 + sigma)^2: second (kskjhs3).

    Wrong unless sigma = 1: wrong for y, and the factor sigma^2 of x = (sigma y - z)/(1 + sigma) is
    lost.
    """
    return paper_y_diffusion(scene) / (1 + scene.sigma) ** 2


@checked
def velocity_noise_coefficient(scene: Disk) -> float:
    """Coefficient of int e^(-lambda (t - s)) dW_s in v_t: alpha, for any sigma (equation (eq:v)).

    v = (sigma s - d)/(1 + sigma), and s has the noise alpha gamma dW: sigma gamma/(1 + sigma) = 1.
    """
    require_one_friction(scene)
    return scene.noise


@checked
def paper_velocity_noise_coefficient(scene: Disk) -> float:
    """The paper's coefficient in v_t, sqrt(2) alpha/sqrt(sigma^2 + 1): equation (eq:v).

    Wrong unless sigma = 1: the slip's noise is wrong, and the factor sigma of
    v = (sigma s - d)/(1 + sigma) is lost.
    """
    return math.sqrt(2) * scene.noise / math.hypot(scene.sigma, 1)


@checked
def ballistic_coefficient(scene: Disk) -> float:
    """MSD/t^2 = 1/(beta (1 + sigma)) of x under Gibbs' measure, for 1/lambda << t << `bulk_time`.

    The mean square of d over (1 + sigma)^2. Beyond the correlation time of d it decays to zero.
    """
    return temperature(scene) / (1 + scene.sigma)


@checked
def paper_upper_ballistic_bound(scene: Disk) -> float:
    """4/(beta (1 + sigma)), the paper's bound on lim sup var(x)/t^2: second (ksddssdkjhs3).

    True but vacuous: v has mean zero and mu is ergodic, so that the limit is zero.
    """
    return 4 * ballistic_coefficient(scene)


@checked
def paper_lower_ballistic_bound(scene: Disk) -> float:
    """1/(4 beta (1 + sigma)), the paper's bound on lim inf var(x)/t^2: third (ksddssdkjhs3).

    False: the limit is zero. Time reversal gives E[A_t^2] = E[B_t^2] in the proof only before the
    mean E[. | xi_0] is subtracted; afterwards A_t -> 0 and B_t -> d_t.
    """
    return ballistic_coefficient(scene) / 4


@checked
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
    velocities = check_array("velocities", velocities, ..., len(scene.masses))
    slips = velocities @ scene.slip_directions.T
    return scene.friction * np.sum(slips**2, axis=-1)


@checked
def injection_rate(scene: Scene) -> float:
    """Mean power (alpha^2/2) tr(M^-1 sum_j w_j w_j^T) of the noise, dimensionless.

    (alpha^2/2) (1 + 1/sigma) for the paper's disk: the second term of its energy balance, right.
    """
    return scene.noise**2 / 2 * float(np.sum(scene.slip_directions**2 / scene.masses))
