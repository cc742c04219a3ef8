"""The motor with its two rings, and what keeps the inner one level."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from magmotor.common import style
from magmotor.devices.motor.plot_panels import MotorRun
from magmotor.devices.motor.scene import Motor
from magmotor.devices.motor.tilted_ring import tilted_ring
from paper.device_view import draw_device
from paper.figure import Claim, Figure, judged
from paper.motor.runs import paper_runs

TILTS = np.radians(np.linspace(0, 24, 25))
"""Of the inner ring, in rad."""

AZIMUTHS = np.radians([0, 9, 18, 27, 36])
"""To which it leans, in rad: the least sector of which the others are images."""


@dataclass(frozen=True)
class Stability:
    """Energies of the tilted inner ring in J, shape (5, 25) by azimuth and tilt, and the runs."""

    alone: NDArray[np.float64]
    """with the ball, without the outer ring"""
    ball: NDArray[np.float64]
    """of the ball in the field of both rings"""
    outer: NDArray[np.float64]
    """of the inner ring in the field of the outer one"""
    runs: list[MotorRun]

    @property
    def barriers(self) -> NDArray[np.float64]:
        """Over which the ring tips, for each azimuth, in J."""
        both = self.ball + self.outer
        return both.max(axis=1) - both[:, 0]


def compute(_quick: bool) -> Stability:
    """Energies of the motor that is run, with its `ball_ring_factor`."""
    motor = Motor()
    parts = [
        [
            (tilted_ring(motor, tilt, side, outer=False).ball, *tilted_ring(motor, tilt, side))
            for tilt in TILTS
        ]
        for side in AZIMUTHS
    ]
    alone, ball, outer = np.moveaxis(np.array(parts), -1, 0)
    return Stability(alone, ball, outer, paper_runs())


def claims(found: Stability) -> list[Claim]:
    """Of (fig:magmotor)."""
    motor, barriers = Motor(), found.barriers
    both = (found.ball + found.outer)[barriers.argmin()]
    top = int(both.argmax())
    stable = bool(np.all(np.diff(found.alone) < 0) and 0 < top < len(both) - 1)
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
            "The inner and outer rings have radii r_outer and r_inner respectively",
            f"the parameters have r_inner = {motor.inner_radius:g} m, r_outer ="
            f" {motor.outer_radius:g} m: exchanged in the caption",
            motor.inner_radius > motor.outer_radius,
        ),
        judged(
            "The purpose of the outer ring is to prevent the trivial equilibrium in which the inner"
            " ring turns on its side",
            f"without it the energy of ring and ball falls as the ring tilts, by"
            f" {1e6 * (found.alone[:, 0] - found.alone[:, -1]).min():.0f} µJ at least up to"
            f" {np.degrees(TILTS[-1]):.0f}°; with it level is stable behind a barrier of"
            f" {1e6 * barriers.min():.0f} to {1e6 * barriers.max():.0f} µJ, as the side to which it"
            f" leans, the least at {np.degrees(TILTS[top]):.0f}° and"
            f" {barriers.min() / motor.kT:.0f} kT at uniform temperature, α = 0.001; {tipping}",
            stable and not any(tipped.values()),
            otherwise="in part" if stable else "wrong",
        ),
    ]


def draw(found: Stability, path: Path) -> None:
    """The device, and the inner ring's energy, on the side of the least barrier."""
    side = int(found.barriers.argmin())
    ball, outer = found.ball[side], found.outer[side]
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
    "The MuJoCo model of the motor, and the energy gained as its inner ring tilts: that of the ball"
    " where it is deepest, that of the ring in the field of the outer one, and both; without the"
    " outer ring the first, hardly changed, is all there is. As in the paper's Lagrangian, ball and"
    " inner ring count twice. The side is that to which the ring tips most easily; the runs are"
    " those of the next figures.",
    compute,
    claims,
    draw,
    (23,),
)
