"""What movies of the motor show: azimuth and flights of its ball, and the inner ring's attitude."""

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common import style
from magmotor.device.movie import Gauge, MovieContent, between
from magmotor.devices.motor.flights import flights
from magmotor.devices.motor.observables import azimuth, ring_attitude
from magmotor.devices.motor.scene import Motor

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D


class MotorMovieContent(MovieContent):
    """See `magmotor.device.movie.MovieContent`; `value` is the azimuth in revolutions.

    A run that is a part of a longer one may have the attribute `revolutions_before`, the whole
    revolutions that its azimuth lacks, so that its movie agrees with pictures of the longer run.
    """

    near = "top"
    needs: tuple[str, ...] = ("position", "ring_axis", "ring_orientation")
    title = "The fluctuation-driven motor"

    def __init__(self, run: xr.Dataset, scene: Motor, times: NDArray[np.float64]):
        before = int(run.attrs.get("revolutions_before", 0))
        self.time, self.revolutions = run.time.values, azimuth(run).values / (2 * np.pi) + before
        self.path, self.trail = run.position.values, 0.5 * scene.ball_radius
        self.value = between(run, self.revolutions, times)
        attitude = np.degrees(ring_attitude(run))
        self.tilt, self.yaw = (between(run, attitude[k].values, times) for k in ("tilt", "yaw"))
        self.times, self.flights = times, flights(run, scene)
        shaken = ["the ball"] * bool(scene.alpha_ball) + ["the inner ring"] * bool(scene.alpha_ring)
        noise = f"; noise shakes {' and '.join(shaken)}" if shaken else ""
        self.caption = f"A magnetic ball under two rings of magnets{noise}"

    def plot(self, axes: "Axes") -> list["Line2D"]:
        """Draw the azimuth over time, with the flights in the background."""
        for flight in self._each_flight():
            axes.axvspan(float(flight.begin), float(flight.end), color=style.GREEN, alpha=0.2, lw=0)
        axes.set(xlabel="t (s)", ylabel="θ (revolutions)")
        return axes.plot(self.time, self.revolutions, color=style.BLUE, label="azimuth of the ball")

    def lines(self, i: int) -> list[str]:
        """Return azimuth of the ball, and tilt and yaw of the ring."""
        return [
            f"ball  θ {self.value[i]:+z.2f} revolutions",
            f"ring  tilt {self.tilt[i]:.1f}°, yaw {self.yaw[i]:+z.0f}°",
        ]

    def event(self, i: int) -> str:
        """Return whether a flight begins, goes on or has ended."""
        words = ""
        for flight in self._each_flight():
            begin, end = float(flight.begin), float(flight.end)
            start, now = np.interp([begin, self.times[i]], self.time, self.revolutions)
            if self.times[i] >= begin:
                flown = abs(now - start)
                words = (
                    "the flight begins" if flown < 0.5 else f"in flight: {flown:.1f} revolutions"
                )
            if self.times[i] >= end and not flight.censored:
                words = f"flight over: {abs(float(flight.revolutions)):.1f} revolutions"
        return words

    def result(self) -> str:
        """Return the length of the longest flight."""
        if not self.flights.sizes["flight"]:
            return "No flight in this run"
        longest = max(self._each_flight(), key=lambda flight: abs(float(flight.revolutions)))
        turns, lasts = abs(float(longest.revolutions)), float(longest.end - longest.begin)
        return f"A flight of {turns:.1f} revolutions in {lasts:.0f} s"

    def _each_flight(self) -> list[xr.Dataset]:
        return [self.flights.isel(flight=k) for k in range(self.flights.sizes["flight"])]


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
