"""The top under its ring, and the experiment that the paper describes."""

from dataclasses import dataclass
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

ABOVE = 0.36
"""Height, in m, just above the range in which the position under the ring's center is unstable."""


@dataclass(frozen=True)
class Experiment:
    """The experiment, and what it is compared with."""

    run: xr.Dataset
    level: xr.Dataset
    """the ring is lowered but not tilted"""
    above: xr.Dataset
    """the ring is lowered to `ABOVE` only, then tilted"""


def compute(_quick: bool) -> Experiment:
    """Simulate lowering the ring over the resting ball, then tilting it, and without either."""
    script = SCENE.ring_script
    level = tuple(waypoint._replace(tilt=0.0) for waypoint in script)
    above = tuple(each._replace(height=max(each.height, ABOVE)) for each in script)
    return Experiment(
        *(
            simulate(
                SCENE.replace(ring_script=each), method="mujoco/rk4", timestep=0.025, duration=60.0
            )
            for each in (script, level, above)
        )
    )


def claims(found: Experiment) -> list[Claim]:
    """Return the claims of the text beside (fig:moviesnapshot), and ours on (fig:magball)."""
    positions, moments = SCENE.ring_sources()
    tilted = found.run.time.values > SCENE.ring_script[-2].time
    spin = _spin(found.run)
    before, after = spin[~tilted].max(), spin[tilted].max()
    level, above = (float(_spin(run).max()) for run in (found.level, found.above))
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
            "When one lowers the magnetic ring to within a certain range of heights and then tilts"
            " the ring, one observes the top transition from a state of no spin about its axis of"
            " symmetry to a state of nonzero spin",
            f"the ring is lowered from {first:g} m to {last:g} m: spin up to {before:.3f} rad/s"
            f" before it is tilted, {after:.1f} rad/s after ({level:.2f} rad/s in the same time if"
            f" it stays level). The position under its center is unstable below H = {highest:.3f}"
            f" m: under a ring that is lowered to {ABOVE:g} m only, and then tilted, the top"
            f" reaches {above:.2f} rad/s",
            last < highest < ABOVE and after > 10 * max(before, level, above),
            figures=(1,),
        ),
        judged(
            "Ours: the model's dipoles are placed symmetrically around the ring, in the radial"
            " direction, as those of the figures",
            f"{len(positions)} dipoles; their sum is {net:.0e} of the sum of their magnitudes, and"
            f" they deviate from the radii by {deviation:.0e} rad",
            net < 1e-12 and deviation < 1e-12,
        ),
    ]


def _spin(run: xr.Dataset) -> np.ndarray:
    return np.abs(run.momentum_map.values) / SCENE.inertia[2]


def draw(found: Experiment, path: Path) -> None:
    """Draw the device, and the spin over time with the ring's motion."""
    run = found.run
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
    "The MuJoCo model of the top (the red arrow is the ball's dipole, along its axis ξ₃; the"
    " yellow spot on its equator shows its rotation), and the experiment that the paper"
    " describes, `Top.experiment()`: the ring is lowered from 0.6 m to 0.2 m, then tilted by"
    " π/64.",
    compute,
    claims,
    draw,
    (1, 16),
    ("mujoco/rk4",),
)
