"""The motor's ball under rings that are level and have no wells: what friction is left.

The inner ring is held by its inertia. The outer ring has four times as many dipoles on a circle
that is 4^(1/3) times as wide, so that its field at the center is the same and its ripple vanishes.
Then only the thermal motion of the ball across the valley and of its axis about the field can
change the momentum P of `reduced_theory`.
"""

from functools import cache

import numpy as np

from magmotor.devices.motor.scene import Motor
from paper.motor.long_runs import Size, long_run
from paper.motor.reduced_theory import rolling
from paper.motor.rolling_start import thermal_start
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


@cache
def remaining_friction(scene: Motor, size: Size) -> Measured:
    """Measure the rate, in 1/s, at which the ball forgets its rolling under held rings.

    The mean square change of the rate grows as 2 <W^2> t times it, between the two `LAGS`; the part
    that does not grow is thermal motion within the valley.
    """
    motor = held(scene)
    start = thermal_start(motor, size.replicas)
    run = long_run(motor, size.duration, size.replicas, seed=7, initial=start).after(size.burn_in)
    stride = round(WINDOW / run.interval)
    mean = np.diff(run.azimuth[:, ::stride], axis=1) / WINDOW
    early, late = (
        np.mean((mean[:, lag:] - mean[:, :-lag]) ** 2, axis=1)
        for lag in (round(each / WINDOW) for each in LAGS)
    )
    mean_square = motor.kT / rolling(motor).inertia
    return over_replicas((late - early) / (2 * mean_square * (LAGS[1] - LAGS[0])))
