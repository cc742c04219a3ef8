"""A hanging chain at finite temperature: one line makes the thermostat, two more check it.

Eight links of a ball joint each hang in a viscous fluid. The distribution of their directions is
Boltzmann's law. Without the factor sqrt(det M) of the inertia M, each link would obey Langevin's
law of paramagnetism on its own: with x = (weight from this link on) (length)/kT, the density of the
cosine c to the vertical would be proportional to exp(x c). The run follows the law with the factor,
as the Metropolis algorithm draws it.
"""

from pathlib import Path

import magmotor as mm

# isort: split
# MuJoCo comes after magmotor, which selects the OpenGL backend that MuJoCo loads.
import mujoco
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from support import film, run, save

Array = NDArray[np.float64]

KT = 0.03
"""temperature (J)"""
REPLICAS = 16
FRAME = 0.05
"""time between two records, which are also frames of the movie (s)"""
BURN_IN = 5.0
"""time before the first record (s)"""
FRAMES, IN_MOVIE = 100, 6
"""largest number of frames, and of replicas in each"""
GHOSTS = 0.12
"""opacity of all replicas but one"""
LINKS = {0: "C0", 5: "C2", 7: "C1"}
"""the links that are shown, and their colors"""


def load() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(Path(__file__).with_suffix(".xml")))


def sample(model: mujoco.MjModel, duration: float) -> xr.Dataset:
    """Run replicas at the temperature, and record them."""
    every = round(FRAME / model.opt.timestep)
    langevin = mm.Langevin(model, kT=KT)
    return langevin.sample(duration, replicas=REPLICAS, record_interval=every, burn_in=BURN_IN)


def directions(model: mujoco.MjModel, positions: Array) -> Array:
    """Return unit vectors along the links, shape (replicas, times, links, 3)."""
    data = mujoco.MjData(model)
    found = np.empty((*positions.shape[:2], model.njnt, 3))
    for at in np.ndindex(positions.shape[:2]):
        data.qpos[:] = positions[at]
        mujoco.mj_kinematics(model, data)
        found[at] = -data.xmat[1:, 2::3]
    return found


def weights(model: mujoco.MjModel) -> Array:
    """Return x = (weight from this link on) (length)/kT of each link."""
    length = -model.body("link 2").pos[2]
    return model.body_subtreemass[1:] * -model.opt.gravity[2] * length / KT


def compare(axes: Axes, run: Array, law: Array, edges: Array, color: str, names: bool = False):
    """Draw the densities of values (replicas, times) of a run and of a law."""
    width = np.diff(edges)
    for values, kind in ((run, "run"), (law, "Metropolis")):
        each = np.array([np.histogram(v, edges)[0] / (len(v) * width) for v in values])
        mean, error = each.mean(axis=0), each.std(axis=0, ddof=1) / np.sqrt(len(each))
        label = kind if names else None
        if kind == "run":
            middle = (edges[1:] + edges[:-1]) / 2
            axes.errorbar(middle, mean, 2 * error, fmt="o", ms=3, color=color, label=label)
        else:
            axes.stairs(mean, edges, baseline=None, color=color, label=label)


def freely_jointed(x: Array, count: int) -> Array:
    """Draw directions of links that obey Langevin's law on their own, shape (links, count, 3)."""
    random = np.random.default_rng(1)
    turn = random.uniform(0, 2 * np.pi, (len(x), count))
    cosine = 1 + np.log1p(random.random(turn.shape) * np.expm1(-2 * x)[:, None]) / x[:, None]
    sine = np.sqrt(1 - cosine**2)
    return np.stack([sine * np.cos(turn), sine * np.sin(turn), -cosine], axis=-1)


def views(model: mujoco.MjModel, positions: Array, height: int = 720, width: int = 620):
    """Yield pictures of all replicas over each other, for positions (replicas, times, nq)."""
    data = mujoco.MjData(model)
    option, nothing = mujoco.MjvOption(), mujoco.MjvPerturb()
    moving = int(mujoco.mjtCatBit.mjCAT_DYNAMIC)
    with mujoco.Renderer(model, height, width) as renderer:
        scene = renderer.scene
        for now in positions.swapaxes(0, 1):
            for replica, data.qpos[:] in enumerate(now):
                mujoco.mj_forward(model, data)
                if replica == 0:
                    renderer.update_scene(data, "front")
                    continue
                first = scene.ngeom
                mujoco.mjv_addGeoms(model, data, option, nothing, moving, scene)
                for geom in scene.geoms[first : scene.ngeom]:
                    geom.rgba[3], geom.transparent = GHOSTS, 1
            yield renderer.render()


def draw(model: mujoco.MjModel, path: xr.Dataset, truth: xr.Dataset, view: Array) -> Figure:
    """Draw the chain, its distributions, and the temperature of each joint."""
    figure = Figure(figsize=(12, 7), layout="constrained")
    axes = figure.subplot_mosaic("ABB;ACD", width_ratios=(1.1, 1, 1))
    axes["A"].imshow(view)
    axes["A"].set_title(f"{REPLICAS} replicas at one time")
    axes["A"].axis("off")

    of_run, of_law = (directions(model, each.qpos.values) for each in (path, truth))
    edges = np.linspace(-1, 1, 21)
    middle = (edges[1:] + edges[:-1]) / 2
    x = weights(model)
    for link, color in LINKS.items():
        compare(axes["B"], -of_run[:, :, link, 2], -of_law[:, :, link, 2], edges, color)
        alone = x[link] * np.exp(x[link] * (middle - 1)) / (1 - np.exp(-2 * x[link]))
        axes["B"].plot(middle, alone, ":", color=color)
        axes["B"].plot([], [], color=color, linewidth=4, label=f"link {link + 1}")
    axes["B"].plot([], [], ":", color="C4", label="without sqrt(det M)")
    axes["B"].set(
        xlabel="cosine of the angle to the vertical", ylabel="density", yscale="log", ylim=(5e-3, 9)
    )
    axes["B"].legend(loc="upper left")

    bend, true_bend = [
        np.sum(links[:, :, -2] * links[:, :, -1], axis=-1) for links in (of_run, of_law)
    ]
    wide = edges[::2]
    compare(axes["C"], bend, true_bend, wide, "C4", names=True)
    one, other = freely_jointed(x[-2:], 400_000)
    density, _ = np.histogram(np.sum(one * other, axis=-1), wide, density=True)
    axes["C"].plot(
        (wide[1:] + wide[:-1]) / 2, density, ":", color="C4", label="without sqrt(det M)"
    )
    axes["C"].set(
        xlabel="cosine of the angle of the last two links", ylabel="density", ylim=(0, None)
    )
    axes["C"].legend(loc="lower right")

    kinetic = mm.kinetic_temperature(model, path)
    joints = np.arange(model.njnt) + 1
    axes["D"].errorbar(joints, kinetic.temperature / KT, 2 * kinetic.error / KT, fmt="o")
    axes["D"].axhline(1, color="C4", linestyle=":")
    axes["D"].set(xlabel="joint", ylabel="kinetic temperature / kT", xticks=joints)
    print(f"kinetic temperature: {kinetic.total / KT:.4f}({kinetic.total_error / KT:.4f}) kT")
    return figure


def main(
    out: Path = Path("out/thermal_chain.png"),
    movie: Path = Path("out/thermal_chain.mp4"),
    duration: float = 30.0,
) -> None:
    """Sample a hanging chain at a temperature, check it, and make a picture and a movie.

    Parameters
    ----------
    out
        file of the picture
    movie
        file of the movie
    duration
        duration of each replica (s)
    """
    if not 1 <= duration <= 3600:
        raise ValueError(f"duration = {duration}: must be between 1 and 3600 s")
    model = load()
    path = sample(model, duration)
    truth = mm.metropolis(
        model, KT, replicas=REPLICAS, samples=path.time.size, record_interval=5, seed=1
    )
    at = mm.configurational_temperature(model, path)
    print(f"configurational temperature: {at.temperature / KT:.4f}({at.error / KT:.4f}) kT")
    frames = path.qpos.values[:, -FRAMES:]
    save(draw(model, path, truth, next(views(model, frames[:, -1:]))), out)
    film(views(model, frames[:IN_MOVIE]), movie)


if __name__ == "__main__":
    run(main)
