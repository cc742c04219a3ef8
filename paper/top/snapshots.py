"""Snapshots of the fourth case: the top aligns with the field, moves away, and spins."""

from pathlib import Path

import numpy as np

from magmotor import observables
from magmotor.common import style
from magmotor.device.movie import between
from magmotor.render.trail import Trail
from magmotor.render.views import Views
from paper.figure import Claim, Figure, judged, repeated
from paper.top.cases import run_case
from paper.top.spin_mechanism import DURATION, Torques, compute

TIMES = np.array([0.0, 1.0, 3.0, 6.0, 9.0, 14.0, 21.6, 28.0, DURATION])
"""Times of the nine pictures, in s."""

PICTURE, CLOSE_UP = (300, 400), (96, 112)
"""Height and width, in pixels, of each picture and of the close-up in its corner."""


def claims(torques: Torques) -> list[Claim]:
    """Return the claims of (fig:snapshots)."""
    scene, run = torques.scene, run_case(4).mujoco
    first, later = torques.misalignment[0], torques.misalignment[torques.run.time.values > 10]
    start = observables.effective_potential(scene, [scene.position])[0]
    end = run.energy.values[-1]
    depth = observables.minimum(scene).energy
    progress = (end - start) / (depth - start)
    spin = np.abs(torques.spin).max()
    away = run.position.values[run.time.values > 10] - run.position.values[0]
    nearest = float(np.linalg.norm(away, axis=1).min())
    return [
        judged(
            "The axis of symmetry then aligns with the ambient magnetic field",
            f"{first:.1f}° off at the start, {later.max():.1f}° at most after 10 s",
            later.max() < first,
        ),
        judged(
            "The state is not a minimum of V_e, and hence, the state is unstable",
            f"V_e = {1e3 * start:.2f} mJ at the start, {1e3 * depth:.2f} mJ at the minimum; after"
            f" 10 s the ball never comes within {100 * nearest:.0f} cm of its start again",
            start > depth + 1e-3 and nearest > 0.05,
        ),
        judged(
            "The top moves towards a state that minimizes its magnetic potential energy",
            f"energy {1e3 * end:.2f} mJ after {run.time[-1]:.0f} s, {100 * progress:.0f} % of the"
            " way to the minimum",
            progress > 0.9,
        ),
        repeated(
            "... and acquires spin in this process",
            f"spin up to {spin:.2f} rad/s",
            "nonconservative_tilted",
        ),
    ]


def draw(torques: Torques, path: Path) -> None:
    """Draw nine pictures of the ball, its trail and the ring."""
    run, scene = torques.run, torques.scene
    poses = scene.device.joints(run, scene, TIMES)
    spins = between(run, torques.spin, TIMES)
    trail = Trail(run.time.values, run.position.values, 0.35 * scene.ball_radius)
    views = Views(scene, {"front": PICTURE, "ball": CLOSE_UP})
    try:
        with style.figure(12.0, 9.6) as figure:
            panels = figure.subplots(3, 3).flat
            for axes, pose, time, spin in zip(panels, poses, TIMES, spins, strict=True):
                views.pose(pose, time)
                picture = views.draw("front", trail, time)
                picture[: CLOSE_UP[0] + 2, -CLOSE_UP[1] - 2 :] = 255
                picture[: CLOSE_UP[0], -CLOSE_UP[1] :] = views.draw("ball", trail, time)
                axes.imshow(picture)
                axes.set_axis_off()
                axes.set_title(f"t = {time:g} s, spin {spin:+z.2f} rad/s".replace("-", "−"))
            figure.savefig(path, dpi=70)
    finally:
        views.close()


FIGURE = Figure(
    "snapshots",
    "Snapshots of the nonconservative tilted simulation",
    "The fourth case, rendered by MuJoCo: the ball (the red arrow is its dipole, along its axis"
    " ξ₃; the yellow spot on its equator shows its rotation), the trail of its contact point,"
    " and the tilted ring with its dipoles. The corners show the ball in close-up.",
    compute,
    claims,
    draw,
    (2,),
    ("mujoco/rk4",),
)
