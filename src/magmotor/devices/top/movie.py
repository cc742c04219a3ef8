"""What movies of the top show: its spin compared with theory, and the ring's tilt from the side."""

import math
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common import style
from magmotor.device.movie import Gauge, MovieContent, SideView, between
from magmotor.devices.top.observables import SPIN, momentum_balance
from magmotor.devices.top.scene import Top

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D


class TopMovieContent(MovieContent):
    """See `magmotor.device.movie.MovieContent`; `value` is the spin in rad/s, without its sign."""

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
        self.spin = np.abs(SPIN(run, scene).values)
        self.value = between(run, self.spin, times)
        self.momentum = np.abs(between(run, run.momentum_map.values, times))
        self.turns = len({waypoint.azimuth for waypoint in scene.ring_script}) > 1
        largest = np.abs(run.momentum_map.values).max()
        self.exponent = int(np.floor(np.log10(max(largest, style.NO_SPIN * scene.inertia[2]))))
        acquires = self.spin[0] < style.NO_SPIN < self.spin.max()
        self.title = "Hamel's top acquires spin" if acquires else "Hamel's top"
        self.caption = f"A magnetic ball under a ring of magnets {_ring(scene)}"
        self.side_view = _side_view(run, scene, times)

    def plot(self, axes: "Axes") -> list["Line2D"]:
        """Draw the spin and, if the ball is balanced, that which follows from friction."""
        lines = axes.plot(self.run.time, self.spin, color=style.BLUE, lw=3, label="|spin|")
        if not self.scene.is_unbalanced:  # then the spin follows from J
            theory = np.abs(momentum_balance(self.run, self.scene).integral)
            theory, label = theory / self.scene.inertia[2], "theory, from friction"
            lines += axes.plot(self.run.time, theory, "--", color=style.ORANGE, label=label)
        axes.set(xlabel="t (s)", ylabel="|spin| (rad/s)")
        axes.set_ylim(0, max(1.08 * float(self.spin.max()), style.NO_SPIN))
        return lines

    def lines(self, i: int) -> list[str]:
        """Return |spin|, |J| and, if the ring moves, its pose."""
        power = str(self.exponent).translate(style.SUPERSCRIPTS)
        size = self.momentum[i] / 10.0**self.exponent
        lines = [f"|spin|  {self.value[i]:.2f} rad/s", f"|J|  {size:.2f} × 10{power} kg m²/s"]
        if self.scene.ring_script:
            height, tilt = self.scene.ring_pose(float(self.times[i]))
            azimuth = np.degrees(self.scene.tilt_direction(float(self.times[i]))) % 360
            toward = f" toward {azimuth:.0f}°" if self.turns else ""
            lines.append(f"ring  {100 * height:.1f} cm high, tilt {np.degrees(tilt):.1f}°{toward}")
        return lines

    def result(self) -> str:
        """Return the largest |spin| and its time."""
        at = int(self.spin.argmax())
        if self.spin[at] < style.NO_SPIN:
            return "The ball has not acquired spin."
        return f"Largest |spin|: {self.spin[at]:.2f} rad/s, at t = {self.run.time.values[at]:.1f} s"


def _ring(scene: Top) -> str:
    """Return in words how the ring stands or moves."""
    if scene.ring_script:
        return "that moves"
    return f"tilted by {math.degrees(scene.tilt):.1f}°" if scene.tilt else "that is level"


def _side_view(run: xr.Dataset, scene: Top, times: NDArray[np.float64]) -> SideView:
    height, tilt = np.transpose([scene.ring_pose(float(time)) for time in times])
    toward = np.array([scene.tilt_direction(float(time)) for time in times])
    x, y = (between(run, run.position.values[:, k], times) for k in range(2))
    ball = x * np.cos(toward) + y * np.sin(toward)
    return SideView(scene.ring_radius, height, tilt, scene.ball_radius, ball)


GAUGE = Gauge(
    name="spin about ξ₃",
    unit=SPIN.unit,
    needs=("position", "axis", "angular_velocity", "momentum_map"),
    values=lambda run, scene: SPIN(run, scene).values,
    alike=("ball_radius", "surface", "ring_dipoles", "ring_radius"),
    height=lambda scene: max([way.height for way in scene.ring_script] or [scene.ring_height]),
)
