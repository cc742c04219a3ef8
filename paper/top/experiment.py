"""The top under its ring, and the experiment that the paper tells of."""

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
    """The ring is lowered over the resting ball, then tilted."""
    return simulate(SCENE, method="mujoco/rk4", timestep=0.025, duration=60.0)


def claims(run: xr.Dataset) -> list[Claim]:
    """Of (fig:moviesnapshot) and (fig:magball), and of the text beside the first."""
    positions, moments = SCENE.ring_sources()
    tilted = run.time.values > SCENE.ring_script[-2].time
    spin = np.abs(run.momentum_map.values) / SCENE.inertia[2]
    before, after = spin[~tilted].max(), spin[tilted].max()
    highest = theory.highest_valley(SCENE)
    first, last = SCENE.ring_script[0].height, SCENE.ring_script[-1].height
    outward = positions - positions.mean(axis=0)
    radius, size = (np.linalg.norm(vectors, axis=1) for vectors in (outward, moments))
    net = np.linalg.norm(moments.sum(axis=0)) / size.sum()
    aside = float((np.linalg.norm(np.cross(outward, moments), axis=1) / radius / size).max())
    return [
        judged(
            "The magnetic dipoles are placed symmetrically around the ring, in radial direction",
            f"{len(positions)} dipoles; their sum is {net:.0e} of the sum of their sizes, and they"
            f" are {aside:.0e} rad off the radii",
            net < 1e-12 and aside < 1e-12,
        ),
        judged(
            "When one lowers the ring to within a certain range of heights",
            f"the place under its center is unstable below H = {highest:.3f} m; the ring comes from"
            f" {first:g} m down to {last:g} m",
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
    """The device, and spin and ring over time."""
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
    " yellow spot on its equator shows how it turns; gray, the ring's shadow), and"
    " the experiment as the paper tells it, `Top.experiment()`: the ring comes down from 0.6 m to"
    " 0.2 m, then it is tilted by π/64.",
    compute,
    claims,
    draw,
    (1, 16),
)
