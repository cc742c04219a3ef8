"""What movies of the top show: spin, and J(t) compared with theory."""

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common import style
from magmotor.device.movie import Gauge, between
from magmotor.devices.top.observables import SPIN
from magmotor.devices.top.plots import draw_momentum
from magmotor.devices.top.scene import Top

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

TYPESET = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class TopMovieContent:
    """See `magmotor.device.movie.MovieContent`; `value` is J."""

    near = "ball"
    needs: tuple[str, ...] = (
        "position",
        "axis",
        "angular_velocity",
        "slip_velocity",
        "momentum_map",
    )

    def __init__(self, run: xr.Dataset, scene: Top, times: NDArray[np.float64]):
        self.run, self.scene, self.times = run, scene, times
        self.path, self.trail = run.position.values, 0.25 * scene.ball_radius
        self.value = between(run, run.momentum_map.values, times)
        self.spin = between(run, SPIN(run, scene).values, times)
        self.turns = len({waypoint.azimuth for waypoint in scene.ring_script}) > 1
        largest = np.abs(run.momentum_map.values).max()
        self.exponent = int(np.floor(np.log10(max(largest, style.NO_SPIN * scene.inertia[2]))))

    def plot(self, axes: "Axes") -> list["Line2D"]:
        """Draw J and the integral of the friction torque."""
        return draw_momentum(axes, self.run, self.scene)[0]

    def lines(self, i: int) -> list[str]:
        """Return spin, J and, if the ring moves, its pose."""
        momentum, power = self.value[i], str(self.exponent).translate(TYPESET)
        size = momentum / 10.0**self.exponent
        lines = [f"spin  {self.spin[i]:+z.2f} rad/s", f"J  {size:+z.2f} × 10{power} kg m²/s"]
        if self.scene.ring_script:
            height, tilt = self.scene.ring_pose(float(self.times[i]))
            azimuth = np.degrees(self.scene.tilt_direction(float(self.times[i]))) % 360
            toward = f" toward {azimuth:.0f}°" if self.turns else ""
            lines.append(f"ring  {100 * height:.1f} cm high, tilt {np.degrees(tilt):.1f}°{toward}")
        return lines


GAUGE = Gauge(
    name="spin about ξ₃",
    unit=SPIN.unit,
    needs=("position", "axis", "angular_velocity", "momentum_map"),
    values=lambda run, scene: SPIN(run, scene).values,
    alike=("ball_radius", "surface", "ring_dipoles", "ring_radius"),
    height=lambda scene: max([way.height for way in scene.ring_script] or [scene.ring_height]),
)
