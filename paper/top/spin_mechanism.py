"""Why the ball spins about its own axis: torques and attitude of the fourth case."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from magmotor import dipoles
from magmotor.common import style
from magmotor.devices.top.scene import Top
from magmotor.run.simulate import simulate
from paper.figure import Claim, Figure, judged

Array = NDArray[np.float64]

DURATION = 40.0
"""In s: covers the rise of the spin and its first fall."""

SETTLED = 5.0
"""Time, in s, after which the axis follows the field."""


@dataclass(frozen=True)
class Torques:
    """Torques on the ball and its attitude over time; vectors have shape (T, 3), in SI units."""

    run: xr.Dataset
    scene: Top
    friction: Array
    magnetic: Array
    field: Array

    @property
    def axis(self) -> Array:
        """Direction xi_3."""
        return self.run.axis.values

    @property
    def spin(self) -> Array:
        """Angular velocity about xi_3, shape (T,), in rad/s."""
        return _along(self.run.angular_velocity.values, self.axis)

    @property
    def across(self) -> Array:
        """Magnitude of the angular velocity normal to xi_3, shape (T,), in rad/s."""
        return _across(self.run.angular_velocity.values, self.axis)

    @property
    def impulse(self) -> tuple[Array, Array]:
        """Integrals, in N m s, of the torques of friction and of the magnets normal to xi_3."""
        torques = (_normal(torque, self.axis) for torque in (self.friction, self.magnetic))
        friction, magnetic = (np.trapezoid(torque, self.run.time, axis=0) for torque in torques)
        return friction, magnetic

    @property
    def rotation_impulse(self) -> Array:
        """Impulse, in N m s, that rotates the spin with xi_3: I_3 times int spin d(xi_3)."""
        middle = (self.spin[1:] + self.spin[:-1])[:, np.newaxis] / 2
        return self.scene.inertia[2] * np.sum(middle * np.diff(self.axis, axis=0), axis=0)

    @property
    def misalignment(self) -> Array:
        """Angle between xi_3 and B, shape (T,), in degrees."""
        cosine = _along(self.field, self.axis) / np.linalg.norm(self.field, axis=1)
        return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def _along(vectors: Array, axis: Array) -> Array:
    return np.sum(vectors * axis, axis=1)


def _normal(vectors: Array, axis: Array) -> Array:
    return vectors - _along(vectors, axis)[:, np.newaxis] * axis


def _across(vectors: Array, axis: Array) -> Array:
    return np.linalg.norm(_normal(vectors, axis), axis=1)


def _vertical(torques: Torques) -> float:
    """Return the largest vertical impulse not due to the magnets, over friction's total impulse."""
    time = torques.run.time.values
    gained = torques.scene.inertia[2] * torques.run.angular_velocity.values[:, 2]
    magnets = cumulative_trapezoid(torques.magnetic[:, 2], time, initial=0.0)
    friction = np.trapezoid(np.linalg.norm(torques.friction, axis=1), time)
    return float(np.abs(gained - gained[0] - magnets).max() / friction)


@cache
def compute(_quick: bool) -> Torques:
    """Simulate case 4 by MuJoCo and compute the torques on its ball."""
    scene = Top.paper(4)
    run = simulate(scene, method="mujoco/rk4", timestep=0.0125, duration=DURATION)
    field = dipoles.field(run.position.values, *scene.ring_sources())
    force = -scene.friction * run.slip_velocity.values
    friction = np.cross([0.0, 0.0, -scene.ball_radius], force)
    magnetic = np.cross(scene.moment * run.axis.values, field)
    return Torques(run, scene, friction, magnetic, field)


def claims(torques: Torques) -> list[Claim]:
    """Return the claims of (fig:whyspin) and of the remark that explains it."""
    axis = torques.axis
    largest = float(np.abs(_along(torques.magnetic, axis)).max())
    tilt = np.degrees(np.arccos(np.clip(axis[:, 2], -1, 1)))
    late = torques.run.time.values > SETTLED
    angle = float(torques.misalignment[late].max())
    first = float(torques.misalignment[0])
    vertical = _vertical(torques)
    inertia = torques.scene.inertia[0]
    friction, magnetic = torques.impulse
    difference = friction + magnetic - torques.rotation_impulse
    by_friction, combined, residual = (
        float(np.linalg.norm(vector)) / inertia
        for vector in (friction, friction + magnetic, difference)
    )
    strength = np.linalg.norm(torques.magnetic, axis=1).max()
    spin, across = (float(np.sqrt(np.mean(w[late] ** 2))) for w in (torques.spin, torques.across))
    return [
        judged(
            "The torque due to the sliding friction is in directions orthogonal to the moment arm"
            " q",
            "q is vertical, and the ball gains angular momentum about the vertical only from the"
            f" magnets: any other gain is at most {vertical:.0e} of friction's total angular"
            " impulse",
            vertical < 1e-4,
        ),
        judged(
            "The torque due to the magnetic field counters the torques about the axes perpendicular"
            " to ξ₃",
            f"within {DURATION:.0f} s friction alone would give the ball {by_friction:.1f} rad/s"
            " across"
            f" ξ₃, both torques together {combined:.1f} rad/s, which rotates the spin along with ξ₃"
            f" except for {residual:.2f} rad/s; the magnetic torque has no component along ξ₃"
            f" (≤ {largest:.0e} N m of up to {strength:.1e} N m)",
            residual < 0.05 * by_friction and combined < by_friction / 2 and largest < 1e-12,
        ),
        judged(
            "The magnetic torque keeps ξ₃ aligned with the local magnetic field",
            f"{first:.1f}° at the start; after {SETTLED:g} s within {angle:.1f}° of B, while ξ₃"
            f" leans by up to {tilt[late].max():.0f}°",
            angle < 0.1 * tilt[late].max(),
        ),
        judged(
            "This argument clarifies why the spin is primarily along ξ₃",
            f"root mean square of the angular velocity from {SETTLED:g} to {DURATION:.0f} s: along"
            f" ξ₃ {spin:.2f} rad/s, across it {across:.2f} rad/s",
            spin > 2 * across,
            otherwise="in part" if spin > across else "wrong",
        ),
    ]


def draw(torques: Torques, path: Path) -> None:
    """Draw angular velocity, alignment, and friction's torque along and across the axis."""
    time = torques.run.time
    with style.figure(12.0, 4.0) as figure:
        left, middle, right = figure.subplots(1, 3)
        left.plot(time, torques.across, color=style.ORANGE, lw=0.8, label="across ξ₃")
        left.plot(time, torques.spin, color=style.BLUE, label="along ξ₃: the spin")
        left.set(ylabel="angular velocity (rad/s)", title="The ball turns about ξ₃")
        middle.plot(time, torques.misalignment, color=style.BLUE, lw=0.8)
        middle.plot(0, torques.misalignment[0], "o", ms=5, color=style.BLUE)
        middle.annotate(
            f"start: {torques.misalignment[0]:.1f}°", (0, torques.misalignment[0]), (8, -3),
            textcoords="offset points",
        )  # fmt: skip
        middle.set(ylabel="angle between ξ₃ and B (°)", title="ξ₃ swings about the field")
        friction = 1e6 * torques.friction
        right.plot(
            time, _across(friction, torques.axis), color=style.ORANGE, lw=0.8, label="across ξ₃"
        )
        right.plot(time, _along(friction, torques.axis), color=style.BLUE, label="along ξ₃")
        right.set(ylabel="torque of friction (µN m)", title="Friction's torque on the ball")
        for axes in (left, middle, right):
            axes.set(xlabel="t (s)", xlim=(-1, DURATION))
        for axes in (left, right):
            axes.legend()
        style.save(figure, path, dpi=90)


FIGURE = Figure(
    "spin_mechanism",
    "Mechanism behind spin",
    "The fourth case (c = 0.3 kg/s, tilt π/64) at h = 0.0125 s: the angular velocity, the angle"
    " between the axis and the field, and the friction torque q × F, along and across ξ₃. Here"
    " ξ₃ is the ball's axis, q the arm from its center to its contact point, F the friction"
    " force, and B the field. The measured torques replace the paper's sketch.",
    compute,
    claims,
    draw,
    (15,),
    ("mujoco/rk4",),
)
