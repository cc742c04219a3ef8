"""A string of magnetic beads folds as it cools.

Twelve beads, each magnetized across the string, float in a viscous fluid. Hot, the string is an
open coil. As the temperature is lowered in stages, the beads collapse into rows and rings, head to
tail; heated again, the string opens. The picture shows its radius of gyration and its magnetic
energy against the temperature, of several replicas, as it cools and as it is heated.
"""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
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
from support import film, pixels, run, save

Array = NDArray[np.float64]

COOLING = np.geomspace(6e-3, 5e-4, 10)
"""temperatures kT (J)"""
STAGES = np.append(COOLING, COOLING[-2::-1])
RECORDS = 16
"""records of each stage"""
SETTLED = 6
"""the first of them that counts"""
COLUMNS, SHOWN, SIZE = 4, [0, 5, 9], 300
"""replicas, stages and pixels of the snapshots"""
TICKS = [0.5, 1, 2, 5]
BRANCHES = {"cooling": (slice(10), "C0"), "heating": (slice(9, None), "C1")}


def load() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(Path(__file__).with_suffix(".xml")))


def follow(model: mujoco.MjModel, duration: float, seed: int) -> xr.Dataset:
    """Cool and heat one string, with this duration (s) of each stage."""
    data = mujoco.MjData(model)
    steps = round(duration / RECORDS / model.opt.timestep)
    shape = len(STAGES), RECORDS
    radius, energy, qpos = np.empty(shape), np.empty(shape), np.empty((*shape, model.nq))
    for stage, kT in enumerate(STAGES):
        langevin = mm.Langevin(model, kT=kT, seed=seed)
        for record in range(RECORDS):
            langevin.step(data, steps)
            at = stage, record
            radius[at] = np.sqrt(data.xpos[1:].var(axis=0).sum())
            energy[at] = mm.magnetic_energy(model, data)
            qpos[at] = data.qpos
    dims = "stage", "record"
    return xr.Dataset(
        {"radius": (dims, radius), "energy": (dims, energy), "qpos": ((*dims, "nq"), qpos)}
    )


def fold(model: mujoco.MjModel, duration: float, replicas: int) -> xr.Dataset:
    """Cool and heat several strings, each with its own noise, on all cores."""
    with ThreadPoolExecutor() as pool:
        strings = pool.map(partial(follow, model, duration), range(replicas))
        return xr.concat(strings, "replica")


def views(
    model: mujoco.MjModel, positions: Array, camera: str, size: int
) -> Iterator[NDArray[np.uint8]]:
    """Yield pictures of the string at positions (n, nq)."""
    data = mujoco.MjData(model)
    with mujoco.Renderer(model, size, size) as renderer:
        for data.qpos[:] in positions:
            mujoco.mj_forward(model, data)
            renderer.update_scene(data, camera)
            yield renderer.render()


def curves(axes: Axes, values: xr.DataArray) -> None:
    """Draw means over time, with errors from replicas, against the temperature."""
    each = values.isel(record=slice(SETTLED, None)).mean("record")
    error = each.std("replica", ddof=1) / np.sqrt(each.sizes["replica"])
    for name, (stages, color) in BRANCHES.items():
        mean, spread = (part.isel(stage=stages) for part in (each.mean("replica"), error))
        axes.errorbar(1e3 * STAGES[stages], mean, 2 * spread, color=color, capsize=2, label=name)
    label_temperature(axes)


def label_temperature(axes: Axes) -> None:
    axes.set(xlabel="kT (mJ)", xscale="log", xticks=TICKS, xticklabels=TICKS)
    axes.minorticks_off()


def draw(model: mujoco.MjModel, strings: xr.Dataset) -> Figure:
    """Draw strings at some temperatures, as they cool, and both curves."""
    figure = Figure(figsize=(12, 6), layout="constrained")
    axes = figure.subplot_mosaic("AB;AC", width_ratios=(1.7, 1))
    last = strings.qpos.values[:COLUMNS, SHOWN, -1]
    pictures = list(views(model, last.reshape(-1, model.nq), "near", SIZE))
    count = len(last)
    rows = [np.vstack(pictures[column * len(SHOWN) :][: len(SHOWN)]) for column in range(count)]
    axes["A"].imshow(np.hstack(rows))
    middle = SIZE * (np.arange(len(SHOWN)) + 0.5)
    labels = [f"kT = {1e3 * STAGES[stage]:.1f} mJ" for stage in SHOWN]
    axes["A"].set_yticks(middle, labels, rotation=90, va="center")
    axes["A"].set(xticks=[], title=f"{count} replicas as they cool")
    axes["A"].tick_params(length=0)
    axes["A"].grid(visible=False)
    axes["A"].spines[:].set_visible(False)
    curves(axes["B"], 1e3 * strings.radius)
    axes["B"].set(ylabel="radius of gyration (mm)", ylim=(0, None))
    axes["B"].legend(loc="lower right")
    curves(axes["C"], 1e3 * strings.energy)
    axes["C"].set(ylabel="magnetic energy (mJ)")
    return figure


def frames(model: mujoco.MjModel, string: xr.Dataset) -> Iterator[NDArray[np.uint8]]:
    """Yield pictures of a string that cools, each beside its radius and temperature."""
    figure = Figure(figsize=(5.4, 5.4), dpi=100, layout="constrained")
    axes = figure.subplots()
    label_temperature(axes)
    axes.set(ylabel="radius of gyration (mm)", ylim=(0, 80))
    kT = 1e3 * np.repeat(COOLING, RECORDS)
    radius = 1e3 * string.radius.values[: len(COOLING)].ravel()
    axes.plot(kT, radius, ".", color="C5")
    (past,) = axes.plot([], [], ".", color=BRANCHES["cooling"][1])
    (now,) = axes.plot([], [], "o", ms=12, color=BRANCHES["heating"][1])
    positions = string.qpos.values[: len(COOLING)].reshape(-1, model.nq)
    for i, view in enumerate(views(model, positions, "far", 540)):
        past.set_data(kT[: i + 1], radius[: i + 1])
        now.set_data(kT[i : i + 1], radius[i : i + 1])
        axes.set_title(f"kT = {kT[i]:.2f} mJ")
        yield np.hstack([view, pixels(figure)])


def main(
    out: Path = Path("out/magnetic_beads.png"),
    movie: Path = Path("out/magnetic_beads.mp4"),
    duration: float = 1.2,
    replicas: int = 6,
) -> None:
    """Cool and heat a string of magnetic beads, and make a picture and a movie.

    Parameters
    ----------
    out
        file of the picture
    movie
        file of the movie
    duration
        duration of each stage (s)
    replicas
        number of strings
    """
    if not 0.01 <= duration <= 3600:
        raise ValueError(f"duration = {duration}: must be between 0.01 and 3600 s")
    if not 2 <= replicas <= 10_000:
        raise ValueError(f"replicas = {replicas}: must be between 2 and 10000")
    model = load()
    strings = fold(model, duration, replicas)
    for stage in (0, 9, 18):
        radius = 1e3 * strings.radius.isel(stage=stage, record=slice(SETTLED, None)).mean()
        print(f"kT = {1e3 * STAGES[stage]:.1f} mJ: radius of gyration {radius:.1f} mm")
    save(draw(model, strings), out)
    film(frames(model, strings.isel(replica=0)), movie)


if __name__ == "__main__":
    run(main)
