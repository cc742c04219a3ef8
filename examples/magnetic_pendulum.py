"""Basins of attraction of a magnetic pendulum over three magnets.

Every pixel is a pendulum released from rest there. It is colored by the magnet at which the
pendulum ends, darker if that takes longer. A pendulum is captured as soon as its energy, which only
decreases, is too low to cross the lines between the magnets.
"""

from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import mujoco
import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from mujoco.batch import Batch
from numpy.typing import NDArray
from support import run, save
from tqdm import tqdm

import magmotor as mm

Array = NDArray[np.float64]

COLORS = np.array([to_rgb(name) for name in ("C0", "C1", "C2")])  # safe for the color-blind
CHECK_INTERVAL = 10
"""steps between checks for capture"""


class Pendulum:
    """The model and the magnetic energy of its bob."""

    def __init__(self) -> None:
        self.model = mujoco.MjModel.from_xml_path(str(Path(__file__).with_suffix(".xml")))
        data = mujoco.MjData(self.model)
        mujoco.mj_kinematics(self.model, data)
        self.pivot = data.body("pendulum").xpos.copy()
        self.bob = self.model.site("bob").id
        self.length = self.pivot[2] - data.site("bob").xpos[2]
        magnets = [data.site(f"magnet {number}") for number in range(3)]
        self.magnets = np.array([site.xpos for site in magnets])
        self.moments = np.array(
            [site.xmat[2::3] * self.model.site(site.name).user[0] for site in magnets]
        )

    def magnetic_energy(self, bob: Array) -> Array:
        """Return the energy (J) of bobs at positions (n, 3), with moments along the rod."""
        moment = self.model.site("bob").user[0]
        return mm.dipoles.energy(
            bob, moment * (self.pivot - bob) / self.length, self.magnets, self.moments
        )

    def barrier(self) -> float:
        """Return the lowest energy (J) at rest on the line between two magnets."""
        r = np.linspace(0, 0.9 * self.length, 10_000)
        below = self.pivot[2] - np.sqrt(self.length**2 - r**2)
        bob = np.stack([-r, 0 * r, below], axis=-1)
        weight = self.model.body("pendulum").mass[0] * -self.model.opt.gravity[2]
        return float(np.min(self.magnetic_energy(bob) + weight * below))

    def orientations(self, x: Array, y: Array) -> Array:
        """Return quaternions (n, 4) that rotate the hanging rod until its bob is above (x, y)."""
        half = np.arcsin(np.hypot(x, y) / self.length) / 2
        sine = np.sin(half) / np.maximum(np.hypot(x, y), np.finfo(float).tiny)
        return np.stack([np.cos(half), sine * y, -sine * x, 0 * x], axis=-1)


@dataclass
class Ends:
    magnet: NDArray[np.int64]
    """index of the magnet at which each pendulum ends, or -1 if not within the duration"""
    time: Array
    """time of capture (s)"""
    steps: int = 0
    """number of steps of all pendulums together"""


def release(
    pendulum: Pendulum, x: Array, y: Array, *, threads: int = 0, duration: float = 60.0
) -> Ends:
    """Release pendulums from rest above (x, y), each of shape (n,) in meters."""
    ends = Ends(np.full(len(x), -1), np.full(len(x), np.nan))
    barrier = pendulum.barrier()
    batch = Batch(pendulum.model, len(x), threads)
    batch.qpos = pendulum.orientations(x, y)
    energy, sites = batch.energy, batch.site_xpos
    moving = np.arange(len(x))
    time = 0.0
    with (
        mm.magnetism(),
        tqdm(total=len(x), unit=" pendulums", leave=False, disable=None) as progress,
    ):
        while len(moving) and time < duration:
            batch.step(moving, nstep=CHECK_INTERVAL, stage=mujoco.mjtStage.mjSTAGE_VEL.value)
            ends.steps += CHECK_INTERVAL * len(moving)
            time += CHECK_INTERVAL * pendulum.model.opt.timestep
            bob = sites[moving, pendulum.bob]
            total = energy[moving].sum(axis=1) + pendulum.magnetic_energy(bob)
            captured = total < barrier
            offsets = bob[captured, None, :2] - pendulum.magnets[:, :2]
            ends.magnet[moving[captured]] = np.linalg.norm(offsets, axis=-1).argmin(axis=1)
            ends.time[moving[captured]] = time
            progress.update(int(np.count_nonzero(captured)))
            moving = moving[~captured]
    return ends


def grid(pixels: int, extent: float) -> tuple[Array, Array]:
    """Return the pixel centers x and y (m), shape (pixels²,), row by row from below."""
    centers = extent * ((2 * np.arange(pixels) + 1) / pixels - 1)
    x, y = np.meshgrid(centers, centers)
    return x.ravel(), y.ravel()


def picture(ends: Ends, pixels: int) -> Array:
    """Return colors, shape (pixels, pixels, 3); black for pendulums that still move."""
    late = np.nan_to_num(ends.time / np.nanmedian(ends.time))
    shade = np.where(ends.magnet < 0, 0, 1 / (1 + 0.25 * late**2))
    return (shade[:, None] * COLORS[ends.magnet]).reshape(pixels, pixels, 3)


def main(
    pixels: int = 200,
    extent: float = 0.3,
    threads: int = 0,
    out: Path = Path("out/magnetic_pendulum.png"),
) -> None:
    """Basins of attraction of a magnetic pendulum over three magnets.

    Parameters
    ----------
    pixels
        number of pixels along each side of the picture
    extent
        half the side of the picture (m)
    threads
        number of threads; 0 for the number of processors
    out
        file of the picture
    """
    pendulum = Pendulum()
    furthest = 0.6 * pendulum.length
    for name, value, low, high in (
        ("pixels", pixels, 2, 10_000),
        ("extent", extent, 0.01, furthest),
        ("threads", threads, 0, 10_000),
    ):
        if not low <= value <= high:
            raise ValueError(f"{name} = {value}: must be between {low:g} and {high:g}")
    began = perf_counter()
    ends = release(pendulum, *grid(pixels, extent), threads=threads)
    rate = ends.steps / (perf_counter() - began)
    for magnet in range(3):
        share = np.mean(ends.magnet == magnet)
        print(f"magnet {magnet}: {np.count_nonzero(ends.magnet == magnet)} ({100 * share:.1f} %)")
    print(f"still moving: {np.count_nonzero(ends.magnet < 0)}")
    print(f"{ends.steps:.2e} steps at {rate:.2e} per second")

    figure = Figure(figsize=(6, 6), layout="constrained")
    axes = figure.subplots()
    side = 100 * extent
    axes.imshow(picture(ends, pixels), origin="lower", extent=(-side, side, -side, side))
    axes.scatter(
        *(100 * pendulum.magnets[:, :2].T), c=COLORS, edgecolors="white", linewidths=1.5, s=60
    )
    axes.grid(visible=False)
    axes.set(
        xlabel="x (cm)",
        ylabel="y (cm)",
        title="Each point has the color of the magnet at which a pendulum\n"
        "released there ends; it is darker if that takes longer.",
    )
    save(figure, out)


if __name__ == "__main__":
    run(main)
