"""What movies of the motor show: azimuth of the ball, and tilt and yaw of the inner ring."""

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common import style
from magmotor.device.movie import Gauge, between
from magmotor.devices.motor.observables import azimuth, ring_attitude
from magmotor.devices.motor.scene import Motor

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D


class MotorMovieContent:
    """See `magmotor.device.movie.MovieContent`; `value` is the azimuth in revolutions."""

    near = "top"
    needs: tuple[str, ...] = ("position", "ring_axis", "ring_orientation")

    def __init__(self, run: xr.Dataset, scene: Motor, times: NDArray[np.float64]):
        self.time, self.revolutions = run.time.values, azimuth(run).values / (2 * np.pi)
        self.path, self.trail = run.position.values, 0.5 * scene.ball_radius
        self.value = between(run, self.revolutions, times)
        attitude = np.degrees(ring_attitude(run))
        self.tilt, self.yaw = (between(run, attitude[k].values, times) for k in ("tilt", "yaw"))

    def plot(self, axes: "Axes") -> list["Line2D"]:
        """Draw the azimuth over time."""
        axes.set(xlabel="t (s)", ylabel="θ (revolutions)")
        return axes.plot(self.time, self.revolutions, color=style.BLUE, label="azimuth of the ball")

    def lines(self, i: int) -> list[str]:
        """Return azimuth of the ball, and tilt and yaw of the ring."""
        return [
            f"ball  θ {self.value[i]:+z.2f} revolutions",
            f"ring  tilt {self.tilt[i]:.1f}°, yaw {self.yaw[i]:+z.0f}°",
        ]


GAUGE = Gauge(
    name="azimuth",
    unit="revolutions",
    needs=("position",),
    values=lambda run, scene: azimuth(run).values / (2 * np.pi),
    alike=(
        *("ball_radius", "surface", "inner_dipoles", "inner_radius", "inner_height"),
        *("outer_dipoles", "outer_radius", "outer_height"),
    ),
    height=lambda scene: scene.outer_height,
)
