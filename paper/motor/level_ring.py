"""The motor with its two rings, and the stability of the level inner ring."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from magmotor.common import style
from magmotor.devices.motor.plot_panels import MotorRun
from magmotor.devices.motor.scene import Motor
from paper.device_view import draw_device
from paper.figure import Claim, Figure, judged
from paper.motor.runs import METHOD, paper_runs
from paper.motor.tilted_ring import tilted_ring

TILTS = np.radians(np.linspace(0, 24, 25))
"""Tilts of the inner ring, in rad."""

AZIMUTHS = np.radians([0, 9, 18, 27, 36])
"""Azimuths to which it leans, in rad: the smallest sector; the others are its images."""


@dataclass(frozen=True)
class Stability:
    """Energies with the inner ring tilted, in J, shape (azimuths, tilts), and the runs."""

    alone: NDArray[np.float64]
    """of ring and ball without the outer ring"""
    ball: NDArray[np.float64]
    """of the ball in the field of both rings"""
    outer: NDArray[np.float64]
    """of the inner ring in the field of the outer one"""
    runs: list[MotorRun]

    @property
    def barriers(self) -> NDArray[np.float64]:
        """Barriers to tipping over, for each azimuth, in J."""
        both = self.ball + self.outer
        return both.max(axis=1) - both[:, 0]


def compute(quick: bool) -> Stability:
    """Compute the energies for the simulated motor, with its `ball_ring_factor`."""
    motor = Motor()
    parts = [
        [
            (
                tilted_ring(motor, tilt, azimuth, outer=False).ball,
                *tilted_ring(motor, tilt, azimuth),
            )
            for tilt in TILTS
        ]
        for azimuth in AZIMUTHS
    ]
    alone, ball, outer = np.moveaxis(np.array(parts), -1, 0)
    return Stability(alone, ball, outer, paper_runs(quick))


def claims(found: Stability) -> list[Claim]:
    """Return the claims of (fig:magmotor) and of the text on the inner ring."""
    motor, barriers = Motor(), found.barriers
    both = (found.ball + found.outer)[barriers.argmin()]
    highest = int(both.argmax())
    stable = bool(np.all(np.diff(found.alone) < 0) and 0 < highest < len(both) - 1)
    tipped = {
        kind: [
            f"{run.name} at {run.data.time[-1]:.0f} s"
            for run in found.runs
            if run.scene.temperature == kind and "stopped" in run.data.attrs
        ]
        for kind in ("nonuniform", "uniform")
    }
    tipping = "; ".join(
        f"of the runs at {kind} temperature {len(names)} tip over"
        + (f" ({', '.join(names)})" if names else "")
        for kind, names in tipped.items()
    )
    return [
        judged(
            "The purpose of the outer ring is to prevent the trivial equilibrium in which the inner"
            " ring turns on its side",
            "without it the energy of ring and ball falls as the ring tilts, by at least"
            f" {1e6 * (found.alone[:, 0] - found.alone[:, -1]).min():.0f} µJ up to"
            f" {np.degrees(TILTS[-1]):.0f}°; with it the level ring is stable behind a barrier of"
            f" {1e6 * barriers.min():.0f} to {1e6 * barriers.max():.0f} µJ, depending on the side"
            f" to which it leans. The lowest barrier is at {np.degrees(TILTS[highest]):.0f}°",
            stable,
        ),
        judged(
            "One can obtain a configuration in which the attitude of the inner ring can be randomly"
            " torqued without undergoing large excursions from the vertical position",
            f"the barrier is {barriers.min() / motor.kT:.0f} kT at uniform temperature with"
            f" α = {motor.noises[-1]:g}, but nothing cools the ring at nonuniform temperature:"
            f" {tipping}",
            stable and not any(tipped.values()),
            otherwise="in part" if stable and not tipped["uniform"] else "wrong",
        ),
    ]


def draw(found: Stability, path: Path) -> None:
    """Draw the device, and the energy as the ring tilts to the side of the lowest barrier."""
    azimuth = int(found.barriers.argmin())
    ball, outer = found.ball[azimuth], found.outer[azimuth]
    with style.figure(12.0, 4.6) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(1, 1.1))
        draw_device(left, Motor(), "front")
        left.set_title("Ball, inner ring (free to turn), outer ring (fixed)")
        for values, color, line, label in (
            (ball, style.BLUE, "--", "ball, where it is deepest, in the field of both rings"),
            (outer, style.ORANGE, "-.", "inner ring in the field of the outer one"),
            (ball + outer, style.INK, "-", "both"),
        ):
            energy = 1e6 * (values - values[0])
            right.plot(np.degrees(TILTS), energy, color=color, ls=line, label=label)
        right.set(xlabel="tilt of the inner ring (°)", ylabel="energy gained (µJ)")
        right.set_title("What keeps the inner ring level")
        right.legend()
        figure.savefig(path, dpi=75)


FIGURE = Figure(
    "motor_device",
    "The motor and its rings",
    "The MuJoCo model of the motor, and the energy gained as its inner ring tilts: the energy"
    " of the ball at its deepest position, the energy of the inner ring in the field of the"
    " outer one, and the sum of both. Without the outer ring, only the first of these remains,"
    " almost unchanged. As in the paper's Lagrangian, the interaction of the ball and the inner"
    " ring counts twice. The ring tilts to the side to which it tips most easily; the runs are"
    " those of the next figures.",
    compute,
    claims,
    draw,
    (23,),
    (METHOD,),
    undecided=(1,),
)
