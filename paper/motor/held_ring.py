"""The motor's ball under rings that are level and have no wells: what friction is left.

The inner ring is held by its inertia. The outer ring has four times as many dipoles on a circle
that is 4^(1/3) times as wide, so that its field at the center is the same and its ripple vanishes.
Then only the thermal motion of the ball across the valley and of its axis about the field can
change the momentum P of `reduced_theory`.
"""

from functools import cache

import numpy as np
from scipy import stats

from magmotor.common.arrays import Array
from magmotor.devices.ball.landscape import aligned_force, valley
from magmotor.devices.motor.scene import Motor
from paper.motor.long_runs import Size, long_run
from paper.motor.reduced_theory import rolling
from paper.motor.spreading import Measured, over_replicas

HEAVY = 1e9
"""Mass of the held ring in kg."""

WINDOW = 400.0
"""In s, over which the rate is averaged: far more than the thermal motion takes."""

LAGS = 2000.0, 8000.0
"""In s; the rate has forgotten little of itself after the second."""

SETTLING = 2000.0
"""In s."""


def held(scene: Motor) -> Motor:
    """Return the motor with level rings without wells."""
    return scene.replace(
        inner_mass=HEAVY,
        outer_dipoles=4 * scene.outer_dipoles,
        outer_radius=4 ** (1 / 3) * scene.outer_radius,
    )


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


@cache
def remaining_friction(scene: Motor, size: Size) -> Measured:
    """Measure the rate, in 1/s, at which the ball forgets its rolling under held rings.

    The mean square change of the rate grows as 2 <W^2> t times it, between the two `LAGS`; the part
    that does not grow is thermal motion within the valley. The balls start with evenly spaced
    quantiles of Gibbs' law for their rates.
    """
    motor = held(scene)
    quantiles = stats.norm.ppf((np.arange(size.replicas) + 0.5) / size.replicas)
    rates = np.sqrt(motor.kT / rolling(motor).inertia) * quantiles
    azimuths = np.random.default_rng(1).uniform(0, 2 * np.pi, size.replicas)
    start = rolling_start(motor, rates, azimuths)
    run = long_run(motor, size.duration, size.replicas, seed=7, initial=start).after(size.burn_in)
    stride = round(WINDOW / run.interval)
    mean = np.diff(run.azimuth[:, ::stride], axis=1) / WINDOW
    early, late = (
        np.mean((mean[:, lag:] - mean[:, :-lag]) ** 2, axis=1)
        for lag in (round(each / WINDOW) for each in LAGS)
    )
    return over_replicas((late - early) / (2 * np.mean(rates**2) * (LAGS[1] - LAGS[0])))
