"""Magnetic beads on a shaken tray assemble into chains and rings.

Each bead carries a dipole that lies in the plane. Brownian motion brings the beads together, they
stick head to tail, the pieces grow, and some close into rings. The energy of a piece is compared
with the closed form of a straight chain and of a ring. In units of u = mu0 m²/(4 pi d³), where m is
the moment and d the diameter, n beads have the energy

    chain: -2u sum (n - k)/k³,
    ring: -(n u/2) sum (1 + cos²(pi k/n)) (sin(pi/n)/sin(pi k/n))³,

both summed over k from 1 to n - 1.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import magmotor as mm

# isort: split
# MuJoCo comes after magmotor, which selects the OpenGL backend that MuJoCo loads.
import mujoco
import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from support import film, pixels, run, save

Array = NDArray[np.float64]

COLDNESS = 20.0
"""energy of two beads that touch head to tail, over kT"""
RECORDS = 160
"""records of each replica, which are also frames of the movie"""
SHOWN = [0, 12, 40, 159]
"""records that the picture shows"""
LATE = 120
"""the first record whose pieces are measured"""
NEAR = 1.15
"""largest distance of two neighbors, in diameters"""
BLUE, GREEN, ORANGE, GRAY = "C0", "C2", "C1", "C5"


class Piece(NamedTuple):
    """Beads that are connected, with their magnetic energy (J)."""

    beads: NDArray[np.intp]
    closed: bool
    energy: float


def load() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(Path(__file__).with_suffix(".xml")))


def unit_energy(model: mujoco.MjModel) -> float:
    """Return u = mu0 m²/(4 pi d³) of two beads that touch (J)."""
    moment, diameter = model.site_user[0, 0], 2 * model.geom_size[-1, 0]
    return mm.dipoles.PERMEABILITY_OVER_4PI * moment**2 / diameter**3


def chain(n: int) -> float:
    """Return the energy of a straight chain of n beads, in units of u."""
    k = np.arange(1, n)
    return -2 * float(np.sum((n - k) / k**3))


def ring(n: int) -> float:
    """Return the energy of a ring of n beads, in units of u."""
    turn = np.pi * np.arange(1, n) / n
    return -n / 2 * float(np.sum((1 + np.cos(turn) ** 2) * (np.sin(np.pi / n) / np.sin(turn)) ** 3))


def assemble(model: mujoco.MjModel, duration: float, replicas: int) -> xr.Dataset:
    """Let beads that point anywhere go, in several replicas."""
    data = mujoco.MjData(model)
    data.qpos[2::3] = np.random.default_rng(1).uniform(-np.pi, np.pi, model.nq // 3)
    langevin = mm.Langevin(model, kT=2 * unit_energy(model) / COLDNESS)
    every = max(1, round(duration / RECORDS / model.opt.timestep))
    span = every * RECORDS * model.opt.timestep
    return langevin.sample(span, replicas=replicas, record_interval=every, initial=data)


def pieces(model: mujoco.MjModel, qpos: Array) -> Iterator[Piece]:
    """Yield the pieces of a state; a piece is closed if every bead has two neighbors."""
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    place, moment = data.site_xpos, data.site_xmat[:, 2::3] * model.site_user[:, :1]
    apart = np.linalg.norm(place[:, None] - place, axis=-1)
    near = (apart > 0) & (apart < NEAR * 2 * model.geom_size[-1, 0])
    count, names = connected_components(near)
    for name in range(count):
        beads = np.flatnonzero(names == name)
        energy = 0.0
        for bead in beads:
            others = beads[beads != bead]
            field_of = place[others], moment[others]
            energy += 0.5 * float(mm.dipoles.energy(place[bead], moment[bead], *field_of))
        yield Piece(beads, bool((near[beads].sum(axis=1) == 2).all()), energy)


def views(model: mujoco.MjModel, states: Array, size: int) -> Iterator[NDArray[np.uint8]]:
    """Yield pictures of states (n, nq)."""
    data = mujoco.MjData(model)
    with mujoco.Renderer(model, size, size) as renderer:
        for data.qpos[:] in states:
            mujoco.mj_kinematics(model, data)
            mujoco.mj_camlight(model, data)
            renderer.update_scene(data, "top")
            yield renderer.render()


def measure(model: mujoco.MjModel, motion: xr.Dataset) -> list[list[list[Piece]]]:
    """Return the pieces of each record of each replica."""
    return [[[*pieces(model, state)] for state in replica] for replica in motion.qpos.values]


def draw(model: mujoco.MjModel, motion: xr.Dataset, found: list[list[list[Piece]]]) -> Figure:
    """Draw how one replica assembles, the number of pieces, and their energies."""
    figure = Figure(figsize=(14, 7.6), layout="constrained")
    axes = figure.subplot_mosaic("AAABBBCCCDDD;EEEEFFFFGGGG", height_ratios=(1.1, 1))
    for name, record, view in zip(
        "ABCD", SHOWN, views(model, motion.qpos.values[0, SHOWN], 500), strict=True
    ):
        axes[name].imshow(view)
        axes[name].set_title(f"t = {motion.time.values[record]:.2f} s")
        axes[name].axis("off")
    beads, u = model.nq // 3, unit_energy(model)
    numbers = np.array([[len(each) for each in replica] for replica in found])
    energies = np.array([[sum(p.energy for p in each) for each in replica] for replica in found])
    laws = np.array(
        [
            [sum((ring if p.closed else chain)(len(p.beads)) for p in each) for each in replica]
            for replica in found
        ]
    )
    for values, name in ((numbers, "E"), (energies / u / beads, "F")):
        axes[name].plot(motion.time, values.T, color=GRAY, linewidth=0.8)
        axes[name].plot(motion.time, values.mean(axis=0), color=BLUE, label="mean of replicas")
        axes[name].set(xlabel="t (s)")
    axes["E"].set(ylabel="number of pieces", ylim=(0, None))
    axes["F"].plot(
        motion.time, laws.mean(axis=0) / beads, ":", color=ORANGE, label="chains and rings at rest"
    )
    axes["F"].set(ylabel="energy per bead (u)", ylim=(-2.6, 0))
    for closed, law, color in ((False, chain, BLUE), (True, ring, ORANGE)):
        sizes = range(4 if closed else 1, beads + 1)
        name = "ring" if closed else "chain"
        axes["G"].plot(
            sizes, [law(n) / n for n in sizes], color=color, label=f"{name}, closed form"
        )
        late = [p for replica in found for each in replica[LATE::8] for p in each]
        shown = [p for p in late if p.closed == closed]
        axes["G"].plot(
            [len(p.beads) for p in shown],
            [p.energy / u / len(p.beads) for p in shown],
            "o", color=color, alpha=0.3, markeredgewidth=0,
        )  # fmt: skip
    axes["G"].set(xlabel="beads of a piece", ylabel="energy per bead (u)", ylim=(-2.6, 0))
    for name in "EFG":
        axes[name].legend(loc="upper right")
    return figure


def frames(
    model: mujoco.MjModel, motion: xr.Dataset, found: list[list[Piece]]
) -> Iterator[NDArray[np.uint8]]:
    """Yield pictures of a replica, each beside the number of its pieces."""
    figure = Figure(figsize=(5.4, 5.4), dpi=100, layout="constrained")
    axes = figure.subplots()
    numbers = np.array([len(each) for each in found])
    axes.plot(motion.time, numbers, color=GRAY)
    axes.set(xlabel="t (s)", ylabel="number of pieces", ylim=(0, None))
    (past,) = axes.plot([], [], color=BLUE)
    for i, view in enumerate(views(model, motion.qpos.values, 540)):
        past.set_data(motion.time.values[: i + 1], numbers[: i + 1])
        rings = sum(p.closed for p in found[i])
        axes.set_title(f"{numbers[i]} pieces, {rings} of them rings")
        yield np.hstack([view, pixels(figure)])


def main(
    out: Path = Path("out/magnetic_assembly.png"),
    movie: Path = Path("out/magnetic_assembly.mp4"),
    duration: float = 4.0,
    replicas: int = 4,
) -> None:
    """Let magnetic beads assemble, and make a picture and a movie.

    Parameters
    ----------
    out
        file of the picture
    movie
        file of the movie
    duration
        duration of each replica (s)
    replicas
        number of replicas
    """
    if not 0.1 <= duration <= 3600:
        raise ValueError(f"duration = {duration}: must be between 0.1 and 3600 s")
    if not 1 <= replicas <= 1000:
        raise ValueError(f"replicas = {replicas}: must be between 1 and 1000")
    model = load()
    motion = assemble(model, duration, replicas)
    found = measure(model, motion)
    for number, replica in enumerate(found):
        sizes = sorted((len(p.beads) for p in replica[-1]), reverse=True)
        rings = [len(p.beads) for p in replica[-1] if p.closed]
        print(f"replica {number}: pieces of {sizes} beads; rings: {rings}")
    save(draw(model, motion, found), out)
    film(frames(model, motion.isel(replica=0), found[0]), movie)


if __name__ == "__main__":
    run(main)
