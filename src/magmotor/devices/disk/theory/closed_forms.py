r"""Closed forms for the sliding disk and the Langevin particle, with their sources in the paper.

Everything is dimensionless. With gamma = (1 + sigma)/sigma and lambda = c gamma, the slip
s = v + omega and the protected combination d = -v + sigma omega obey

    ds = -U'(x) dt - lambda s dt + alpha gamma dW,        dd = U'(x) dt,

since C = n n^T, n = (1, 1/sigma), has rank one: C^(1/2) (dB_v, dB_omega) = n dW with *one* Brownian
motion W.
"""

import numpy as np
from numpy.typing import ArrayLike

from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.checks import check_array
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.devices.disk.theory.stationary import (
    require_one_friction,
    require_one_temperature,
    temperature,
)

Scene = Disk | LangevinParticle


@checked
def y_diffusion(scene: Disk) -> float:
    """Return the limit alpha^2/c^2 of var(x + theta)/t for *any* U: equation (kskjhs3).

    From sigma domega = -c s dt + alpha dW follows, exactly, y_t - y_0 = (alpha/c) W_t - (sigma/c)
    (omega_t - omega_0) for y = x + theta; the mean square of omega stays bounded.
    """
    require_one_friction(scene)
    return (scene.noise / scene.friction) ** 2


@checked
def flat_x_diffusion(scene: Disk) -> float:
    """Return the limit sigma^2 alpha^2/((1 + sigma)^2 c^2) of var(x)/t on flat U: (kskjhs3).

    x = (sigma y - z)/(1 + sigma) with y = x + theta, and z = -x + sigma theta has no noise.
    """
    return (scene.sigma / (1 + scene.sigma)) ** 2 * y_diffusion(scene)


@checked
def velocity_noise_coefficient(scene: Disk) -> float:
    """Return the coefficient alpha of int e^(-lambda (t - s)) dW_s in v_t, equation (eq:v).

    It holds for any sigma: v = (sigma s - d)/(1 + sigma), and the noise of s is alpha gamma dW with
    sigma gamma/(1 + sigma) = 1.
    """
    require_one_friction(scene)
    return scene.noise


@checked
def ballistic_coefficient(scene: Disk) -> float:
    """Return MSD/t^2 = 1/(beta (1 + sigma)) of x in the Gibbs measure, at intermediate times.

    This is the mean square of d over (1 + sigma)^2, for 1/lambda << t << `bulk_time`. Beyond the
    correlation time of d, it decays to zero.
    """
    require_one_temperature(scene)
    return temperature(scene) / (1 + scene.sigma)


@checked
def heat_rate(scene: Scene, velocities: ArrayLike) -> Array:
    """Return the power u.F u lost to friction and drag: c (v + omega)^2 for the paper's disk.

    It is the first term of the energy balance in the remark after (ksddssdkjhs3).

    Parameters
    ----------
    velocities : array_like
        u = (v, omega), or (v,) for the Langevin particle; shape (..., dof), dimensionless.

    Returns
    -------
    numpy.ndarray
        Power, dimensionless, shape (...).
    """
    velocities = check_array("velocities", velocities, ..., len(scene.masses))
    return np.sum(velocities @ scene.friction_matrix * velocities, axis=-1)


@checked
def injection_rate(scene: Scene) -> float:
    """Return the mean power tr(M^-1 G G^T)/2 of the noise G dW/dt, dimensionless.

    For the paper's disk it is (alpha^2/2) (1 + 1/sigma), the second term of its energy balance.
    """
    return float(np.sum(scene.noise_matrix.T**2 / scene.masses)) / 2
