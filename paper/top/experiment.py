"""The top under its ring, and the experiment that the paper describes."""

from pathlib import Path

import numpy as np
import xarray as xr

from magmotor import theory
from magmotor.common import style
from magmotor.devices.top.scene import Top
from magmotor.run.simulate import simulate
from paper.device_view import draw_device
from paper.figure import Claim, Figure, judged

SCENE = Top.experiment()


def compute(_quick: bool) -> xr.Dataset:
    """Simulate lowering the ring over the resting ball, then tilting it."""
    return simulate(SCENE, method="mujoco/rk4", timestep=0.025, duration=60.0)


def claims(run: xr.Dataset) -> list[Claim]:
    """Return the claims of (fig:moviesnapshot), the text beside it, and (fig:magball)."""
    positions, moments = SCENE.ring_sources()
    tilted = run.time.values > SCENE.ring_script[-2].time
    spin = np.abs(run.momentum_map.values) / SCENE.inertia[2]
    before, after = spin[~tilted].max(), spin[tilted].max()
    highest = theory.highest_valley(SCENE)
    first, last = SCENE.ring_script[0].height, SCENE.ring_script[-1].height
    outward = positions - positions.mean(axis=0)
    radius, magnitude = (np.linalg.norm(vectors, axis=1) for vectors in (outward, moments))
    net = np.linalg.norm(moments.sum(axis=0)) / magnitude.sum()
    deviation = float(
        (np.linalg.norm(np.cross(outward, moments), axis=1) / radius / magnitude).max()
    )
    return [
        judged(
            "The magnetic dipoles are placed symmetrically around the ring, in radial direction",
            f"{len(positions)} dipoles; their sum is {net:.0e} of the sum of their magnitudes, and"
            f" they deviate from the radii by {deviation:.0e} rad",
            net < 1e-12 and deviation < 1e-12,
        ),
        judged(
            "When one lowers the ring to within a certain range of heights",
            f"the position under its center is unstable below H = {highest:.3f} m; the ring is"
            f" lowered from {first:g} m to {last:g} m",
            last < highest < first,
            figures=(1,),
        ),
        judged(
            "... and then tilts it, the top goes from no spin to nonzero spin",
            f"spin up to {before:.3f} rad/s before the ring is tilted, {after:.1f} rad/s after",
            after > 10 * before,
            figures=(1,),
        ),
    ]


def draw(run: xr.Dataset, path: Path) -> None:
    """Draw the device, and the spin over time with the ring's motion."""
    with style.figure(12.0, 4.6) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(1, 1.1))
        draw_device(left, Top.paper(4), "front")
        left.set_title("The ball on its plane, the ring above it, tilted")
        spin = run.momentum_map / SCENE.inertia[2]
        right.plot(run.time, spin, color=style.BLUE)
        times = [waypoint.time for waypoint in SCENE.ring_script]
        right.axvspan(*times[:2], color=style.GREEN, alpha=0.18, lw=0, label="ring lowered")
        right.axvspan(*times[2:], color=style.ORANGE, alpha=0.4, lw=0, label="ring tilted")
        right.set(xlabel="t (s)", ylabel="spin (rad/s)", title="The experiment: lowered, tilted")
        right.legend(loc="upper left")
        figure.savefig(path, dpi=75)


FIGURE = Figure(
    "top_device",
    "The top under its ring",
    "The MuJoCo model of the top (the ball's dipole is its red arrow, along its axis ξ₃; the"
    " yellow spot on its equator shows its rotation; the ring's shadow is gray), and the"
    " experiment that the paper describes, `Top.experiment()`: the ring is lowered from 0.6 m to"
    " 0.2 m, then tilted by π/64.",
    compute,
    claims,
    draw,
    (1, 16),
    ("mujoco/rk4",),
)
