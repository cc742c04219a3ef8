"""The ballistic pendulum: a disk on U = cos x, a pendulum if there is no friction."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import ellipk

from magmotor.common import style
from magmotor.devices.disk.scene import Disk
from magmotor.run.simulate import simulate
from paper.disk.systems import METHOD
from paper.figure import Claim, Figure, judged

AMPLITUDES = (0.5, 1.5, 2.5, 3.0)
"""In rad, about the minimum at x = pi."""

FRICTION, ROLLING = 0.1, 1e4
"""Friction with which the swinging is damped, and with which the disk cannot slip."""

TIMESTEP, INTERVAL = 0.002, 25
"""Timestep, and steps between records."""


@dataclass(frozen=True)
class Oscillations:
    """Runs from rest: without friction at each amplitude, with friction at two of them."""

    free: list[xr.Dataset]
    damped: xr.Dataset
    """from the last amplitude"""
    rolling: xr.Dataset
    """from the first amplitude, with so much friction that the disk rolls"""

    @property
    def periods(self) -> NDArray[np.float64]:
        """Measured periods, shape (4,), averaged over complete oscillations."""
        return np.array([_period(run) for run in self.free])


def _period(run: xr.Dataset) -> float:
    t, v = run.time.values, run.v.values
    up = np.flatnonzero((v[1:-1] <= 0) & (v[2:] > 0)) + 1
    crossings = t[up] - v[up] * (t[up + 1] - t[up]) / (v[up + 1] - v[up])
    return float(np.diff(crossings).mean())


def compute(_quick: bool) -> Oscillations:
    """Simulate the oscillations, without noise."""
    numerics = {"method": METHOD, "timestep": TIMESTEP, "record_interval": INTERVAL}
    undamped = Disk(potential="cosine", noise=0.0, friction=0.0)
    free = [simulate(undamped.replace(x=np.pi - a), duration=80.0, **numerics) for a in AMPLITUDES]
    damped = undamped.replace(x=np.pi - AMPLITUDES[-1], friction=FRICTION)
    rolling = undamped.replace(x=np.pi - AMPLITUDES[0], friction=ROLLING)
    return Oscillations(
        free,
        simulate(damped, duration=200.0, **numerics),
        simulate(rolling, duration=80.0, **numerics),
    )


def claims(runs: Oscillations) -> list[Claim]:
    """Return the claims of (fig:ballisticpendulum)."""
    expected = 4 * ellipk(np.sin(np.array(AMPLITUDES) / 2) ** 2)
    difference = float(np.abs(runs.periods / expected - 1).max())
    listed = ", ".join(f"{period:.4f}" for period in runs.periods)
    end = runs.damped.isel(time=slice(-400, None))
    slip = float(np.abs(end.v + end.omega).max())
    slower = _period(runs.rolling) / expected[0]
    sigma = Disk().sigma
    return [
        judged(
            "If U = cos(x), the sliding disk is simply a pendulum",
            f"without friction and noise, periods {listed} at amplitudes of"
            f" {', '.join(map(str, AMPLITUDES))} rad: 4K(sin²(a/2)) to {difference:.0e}",
            difference < 1e-5,
        ),
        judged(
            "... in which the bob in the pendulum is replaced by a disk and the pendulum"
            " is placed within a cylinder",
            f"where friction lets it only roll, c = {ROLLING:g}, its inertia is 1 + σ and its"
            f" period {slower:.5f} times as long as that of a pendulum, √(1 + σ) ="
            f" {np.sqrt(1 + sigma):.5f}; with c = {FRICTION} it swings down to"
            f" {float(np.abs(end.x - np.pi).max()):.1e} rad within a time of 200, and its slip is"
            f" then {slip:.0e}",
            abs(slower / np.sqrt(1 + sigma) - 1) < 1e-3
            and float(np.abs(end.x - np.pi).max()) < 0.1
            and slip < 0.1,
        ),
    ]


def draw(runs: Oscillations, path: Path) -> None:
    """Draw the phase portrait and the damped oscillation."""
    colors = (style.BLUE, style.ORANGE, style.GREEN, style.PURPLE)
    with style.figure(11.0, 4.2) as figure:
        left, right = figure.subplots(1, 2)
        for run, amplitude, color in zip(runs.free, AMPLITUDES, colors, strict=True):
            left.plot(run.x - np.pi, run.v, color=color, label=f"amplitude {amplitude:g}")
        left.set(
            xlabel="x − π (dimensionless)",
            ylabel="v (dimensionless)",
            title="Without friction and noise: a pendulum",
        )
        left.set_ylim(-2.3, 3.1)
        left.legend(loc="upper center", ncols=2)
        run = runs.damped
        right.plot(run.time, run.x - np.pi, color=style.BLUE, label="x − π")
        right.plot(run.time, run.v + run.omega, color=style.ORANGE, lw=0.9, label="slip v + ω")
        right.set(xlabel="t (dimensionless)", title=f"With friction of the slip, c = {FRICTION}")
        right.legend(loc="upper right")
        style.save(figure, path, dpi=90)


FIGURE = Figure(
    "ballistic_pendulum",
    "Ballistic pendulum",
    f"The disk on U = cos x at h = {TIMESTEP:g}, without noise: its phase portrait without"
    " friction, and a damped oscillation with friction on the slip v + ω.",
    compute,
    claims,
    draw,
    (7,),
    (METHOD,),
)
