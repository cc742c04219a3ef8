"""What a finite timestep does: biases, stability, aliasing."""

import math

import numpy as np
from numpy.typing import NDArray

from magmotor.common.arguments import checked
from magmotor.common.checks import check_number
from magmotor.common.hints import Positive
from magmotor.devices.disk.scene import Disk, LangevinParticle, steepest_curvature
from magmotor.devices.disk.theory.stationary import (
    friction_rates,
    gibbs_mean_squares,
    require_one_friction,
    slip_rate,
)
from magmotor.numerics.linear_stability import SmallMotion

Scene = Disk | LangevinParticle
Array = NDArray[np.float64]


@checked
def euler_slip_variance(scene: Disk, timestep: Positive) -> float:
    """Mean square gamma kT/(1 - lambda h/2) of the slip that (eq:svi) has on flat U.

    Its slip is autoregressive: s' = (1 - lambda h) s + alpha gamma sqrt(h) N(0, 1).

    Raises
    ------
    ValueError
        A step that is not in (0, 2/lambda), or `friction_ratio` > 0.
    """
    require_one_friction(scene)
    check_number("timestep", timestep, above=0, below=friction_step_limit(scene))
    return gibbs_mean_squares(scene)["slip"] / (1 - slip_rate(scene) * timestep / 2)


@checked(finite=False)
def friction_step_limit(scene: Scene) -> float:
    """Step 2/(largest of `friction_rates`) beyond which explicit friction, (eq:svi), diverges.

    Returns
    -------
    float
        Dimensionless; infinite if there is no friction.
    """
    fastest = friction_rates(scene)[-1]
    return 2 / float(fastest) if fastest else math.inf


@checked(finite=False)
def potential_step_limit(scene: Scene) -> float:
    """Step 2/sqrt(max |U''|) beyond which a kick-type scheme is linearly unstable in a well.

    Returns
    -------
    float
        Dimensionless; infinite if U is flat.
    """
    curvature = steepest_curvature(scene.coefficients)
    return 2 / math.sqrt(curvature) if curvature else math.inf


@checked(finite=False)
def alias_period(scene: Disk, timestep: Positive) -> float:
    """Shift 2 pi (1 + sigma)/h of d = -v + sigma omega that a kick-type scheme cannot see.

    x then moves by one more period of U each step. So d of such a scheme wanders over copies of
    the line for ever, and the scheme has no invariant probability.

    Returns
    -------
    float
        Dimensionless; infinite if U is flat.
    """
    waves = _common_waves(scene)
    return 2 * math.pi * (1 + scene.sigma) / (waves * timestep) if waves else math.inf


@checked(finite=False)
def largest_timestep(scene: Disk, deviations: Positive = 6.0) -> float:
    """Step that keeps half an `alias_period` at so many standard deviations of d.

    (pi/6) sqrt((1 + sigma) beta) by default, for a U of period 2 pi: the binding limit on h.

    Returns
    -------
    float
        Dimensionless; infinite if U is flat or there is no noise.
    """
    reach = deviations * math.sqrt(gibbs_mean_squares(scene)["d"])
    return alias_period(scene, 1.0) / (2 * reach) if reach else math.inf


def _common_waves(scene: Disk) -> int:
    """Number of periods of U in 2 pi; 0 if it is flat."""
    return math.gcd(*(k for k, pair in enumerate(scene.coefficients, start=1) if any(pair)))


def small_motion(scene: Scene) -> SmallMotion:
    """The disk where U is steepest: x and theta."""
    wrenches = scene.slip_directions
    friction = scene.friction * wrenches.T @ wrenches
    stiffness = np.zeros_like(friction)
    stiffness[0, 0] = steepest_curvature(scene.coefficients)
    # Of a tendon's damping MuJoCo's implicit integrator sees what a joint does to itself.
    on_floor = isinstance(scene, Disk) and scene.surface == "plane"
    implicit = np.zeros_like(friction) if on_floor else np.diag(np.diag(friction))
    return SmallMotion.of(np.diag(scene.masses), stiffness, friction, implicit)
