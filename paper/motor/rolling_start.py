"""States of the motor in which the ball rolls around its valley, at the rates of Gibbs' law."""

import numpy as np
from scipy import stats

from magmotor.common.arrays import Array
from magmotor.devices.ball.landscape import aligned_force, valley
from magmotor.devices.motor.scene import Motor
from paper.motor.reduced_theory import rolling


def rolling_start(scene: Motor, rates: Array, azimuths: Array) -> dict[str, Array]:
    """Return states of balls that roll around the valley, shape (replicas, 3).

    Parameters
    ----------
    scene : Motor
    rates, azimuths : ndarray, shape (replicas,)
        In rad/s and rad.
    """
    places = valley(scene, azimuths)
    distance = np.linalg.norm(places, axis=1)
    axis = aligned_force(scene, places)[1]
    inward = -np.sum(axis[:, :2] * places, axis=1) / distance
    spin = rates * distance / (scene.ball_radius * inward)
    x, y = (rates[:, np.newaxis] * places).T
    flat = np.zeros_like(x)
    turning = np.stack([flat, flat, rates], axis=1)
    return {
        "position": np.pad(places, ((0, 0), (0, 1)), constant_values=scene.ball_radius),
        "velocity": np.stack([-y, x, flat], axis=1),
        "axis": axis,
        "angular_velocity": turning + spin[:, np.newaxis] * axis,
    }


def thermal_start(scene: Motor, replicas: int) -> dict[str, Array]:
    """Return balls that roll at evenly spaced quantiles of Gibbs' law, at random azimuths.

    The rest of the motor reaches its temperature within minutes; rolling would take 5e4 s.
    """
    quantiles = stats.norm.ppf((np.arange(replicas) + 0.5) / replicas)
    azimuths = np.random.default_rng(13).uniform(0, 2 * np.pi, replicas)
    return rolling_start(scene, np.sqrt(scene.kT / rolling(scene).inertia) * quantiles, azimuths)
