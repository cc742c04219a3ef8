"""Effects of a finite timestep: biases, stability, aliasing."""

import math

import numpy as np

from magmotor.common.arguments import checked
from magmotor.common.checks import check_number
from magmotor.common.hints import Positive
from magmotor.devices.disk.scene import Disk, LangevinParticle, steepest_curvature
from magmotor.devices.disk.theory.stationary import (
    friction_rates,
    gibbs_mean_squares,
    hottest,
    require_one_friction,
    slip_rate,
)
from magmotor.numerics.linear_stability import SmallMotion

Scene = Disk | LangevinParticle


@checked
def euler_slip_variance(scene: Disk, timestep: Positive) -> float:
    """Return the mean square gamma kT/(1 - lambda h/2) of the slip in (eq:svi) on flat U.

    The slip is autoregressive: s' = (1 - lambda h) s + alpha gamma sqrt(h) N(0, 1).

    Raises
    ------
    ValueError
        The timestep is not in (0, 2/lambda), or there is a `friction_ratio` or background drag.
    """
    require_one_friction(scene)
    check_number("timestep", timestep, above=0, below=friction_step_limit(scene))
    return gibbs_mean_squares(scene)["slip"] / (1 - slip_rate(scene) * timestep / 2)


@checked(finite=False)
def friction_step_limit(scene: Scene) -> float:
    """Return the timestep 2/max(`friction_rates`) above which explicit friction diverges, (eq:svi).

    Returns
    -------
    float
        Dimensionless; infinite if there is no friction.
    """
    fastest = friction_rates(scene)[-1]
    return 2 / float(fastest) if fastest else math.inf


@checked(finite=False)
def potential_step_limit(scene: Scene) -> float:
    """Return the timestep 2/sqrt(max |U''|) above which kick-type schemes are linearly unstable.

    Returns
    -------
    float
        Dimensionless; infinite if U is flat.
    """
    curvature = steepest_curvature(scene.coefficients)
    return 2 / math.sqrt(curvature) if curvature else math.inf


@checked(finite=False)
def alias_period(scene: Disk, timestep: Positive) -> float:
    """Return the period 2 pi (1 + sigma)/h in d = -v + sigma omega of kick-type schemes.

    Shifting d by it moves x by one more period of U in each step, which such a scheme cannot
    detect. Its d therefore diffuses forever, and it has no invariant probability distribution.

    Returns
    -------
    float
        Dimensionless; infinite if U is flat.
    """
    waves = _common_waves(scene)
    return 2 * math.pi * (1 + scene.sigma) / (waves * timestep) if waves else math.inf


@checked(finite=False)
def largest_timestep(scene: Disk, deviations: Positive = 6.0) -> float:
    """Return the timestep at which half an `alias_period` is a number of standard deviations of d.

    By default it is (pi/6) sqrt((1 + sigma) beta) if U has the period 2 pi; the most restrictive
    limit on h. If the background drag is hotter than the disk, beta is that of the drag.

    Returns
    -------
    float
        Dimensionless; infinite if U is flat or there is no noise.
    """
    reach = deviations * math.sqrt((1 + scene.sigma) * hottest(scene))
    return alias_period(scene, 1.0) / (2 * reach) if reach else math.inf


def _common_waves(scene: Disk) -> int:
    """Return the number of periods of U in 2 pi; 0 if U is flat."""
    return math.gcd(*(k for k, pair in enumerate(scene.coefficients, start=1) if any(pair)))


def small_motion(scene: Scene) -> SmallMotion:
    """Linearize x and theta where |U''| is largest."""
    friction = scene.friction_matrix
    stiffness = np.zeros_like(friction)
    stiffness[0, 0] = steepest_curvature(scene.coefficients)
    # MuJoCo's implicit integrator includes only the diagonal part of a tendon's damping.
    on_floor = isinstance(scene, Disk) and scene.surface == "plane"
    implicit = np.zeros_like(friction) if on_floor else np.diag(np.diag(friction))
    return SmallMotion.of(np.diag(scene.masses), stiffness, friction, implicit)
