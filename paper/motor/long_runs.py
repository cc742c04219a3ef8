"""Long runs of many motors, of which only the ball's azimuth and its rate are kept."""

from collections.abc import Mapping
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from magmotor.devices.motor.scene import Motor
from magmotor.run.simulate import simulate
from paper.motor.rolling_start import thermal_start

METHOD, TIMESTEP = "variational/middle", 0.4

EVERY = 25
"""Steps between two records, that is 10 s; at alpha = 1e-3 the ball moves by at most 0.2 rad."""

PIECE = 1e5
"""A run is simulated in pieces of at most this duration, in s, to bound the memory."""

STATE = (
    *("position", "velocity", "orientation", "angular_velocity"),
    *("ring_orientation", "ring_angular_velocity"),
)


class LongRun(NamedTuple):
    """Azimuth of the ball and its rate, in R replicas at N times."""

    method: str
    interval: float
    """Time between two records, in s."""
    azimuth: NDArray[np.float64]
    """Unwrapped, in rad, shape (R, N)."""
    rate: NDArray[np.float64]
    """In rad/s, shape (R, N)."""
    last: dict[str, NDArray[np.float64]]
    """The last state, as `simulate` takes it for its `initial`."""

    def after(self, time: float) -> "LongRun":
        """Return the run without its first part, of this duration in s."""
        first = round(time / self.interval)
        return self._replace(azimuth=self.azimuth[:, first:], rate=self.rate[:, first:])


def long_run(
    scene: Motor,
    duration: float,
    replicas: int,
    seed: int,
    method: str = METHOD,
    initial: Mapping[str, Any] | None = None,
) -> LongRun:
    """Simulate many motors for a long time.

    Parameters
    ----------
    scene : Motor
    duration : float
        In s.
    replicas : int
    seed : int
    method : str
    initial : mapping, optional
        As in `simulate`.

    Raises
    ------
    ValueError
        The ball moves by more than a quarter revolution between two records.
    """
    pieces = max(1, round(duration / PIECE))
    azimuths, rates, last = [], [], initial
    state: dict[str, NDArray[np.float64]] = {}
    for piece in range(pieces):
        run = simulate(
            scene, method=method, timestep=TIMESTEP, duration=duration / pieces, seed=seed,
            replicas=replicas, record_interval=EVERY, initial=last,
        )  # fmt: skip
        last = run.isel(time=[-1])
        state = {name: run[name].values[:, -1] for name in STATE}
        x, y = np.moveaxis(run.position.values[:, bool(piece) :, :2], -1, 0)
        v_x, v_y = np.moveaxis(run.velocity.values[:, bool(piece) :, :2], -1, 0)
        azimuths.append(np.arctan2(y, x))
        rates.append((x * v_y - y * v_x) / (x**2 + y**2))
    azimuth = np.unwrap(np.concatenate(azimuths, axis=1), axis=1).astype(float)
    largest = float(np.abs(np.diff(azimuth, axis=1)).max())
    if largest > np.pi / 2:
        raise ValueError(
            f"largest rotation between two records = {largest:.2f}: must be at most 1.57 rad"
        )
    return LongRun(method, TIMESTEP * EVERY, azimuth, np.concatenate(rates, axis=1), state)


class Size(NamedTuple):
    """Replicas, duration and burn-in, both in s."""

    replicas: int
    duration: float
    burn_in: float


@cache
def stationary_run(alpha: float, factor: float, size: Size, seed: int) -> LongRun:
    """Simulate the motor at uniform temperature from a thermal start, and omit the burn-in."""
    scene = Motor(alpha_ball=alpha, alpha_ring=alpha, ball_ring_factor=factor)
    start = thermal_start(scene, size.replicas)
    run = long_run(scene, size.duration, size.replicas, seed, initial=start)
    return run.after(size.burn_in)
