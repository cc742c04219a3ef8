"""A magnetic screw swims in water at room temperature, turned by a rotating field.

The screw follows the field up to the step-out frequency, where the torque of the field is no longer
sufficient. Thermal motion smears this: now and then it kicks the screw over the barrier, and the
screw loses a turn. The mean rotation is that of Brownian motion in a tilted washboard, which
Stratonovich solved. The units are µm, ms and pg, so that energies are in zJ; see the model.
"""

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import magmotor as mm

# isort: split
# MuJoCo comes after magmotor, which selects the OpenGL backend that MuJoCo loads.
import mujoco
import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from mujoco.batch import Batch
from numpy.typing import NDArray
from support import film, pixels, run, save

Array = NDArray[np.float64]

KT = 4.11
"""temperature (zJ): 298 K"""
FREQUENCIES = np.concatenate([np.arange(0.1, 0.7, 0.1), np.arange(0.7, 1.3, 0.05), [1.4, 1.6, 2]])
"""of the field, over that of step-out"""
SETTLE = 10.0
"""time before the records, times the step-out frequency"""
SHOWN, IN_PICTURE = {0.7: "C0", 0.95: "C2", 1.3: "C1"}, 8
"""frequencies of the tracks in the picture, and their number"""
IN_MOVIE, FRAMES, EVERY = 0.95, 300, 8
"""frequency of the movie, number of its frames, and steps between two of them"""
RADIUS, PITCH, TURNS, THICKNESS = 0.5, 2.0, 4, 0.1
"""shape of the screw (µm)"""


def load(kT: float = KT, drawn: bool = False) -> mujoco.MjModel:
    """Return the model with Brownian forces that suit its resistances, perhaps with its shape."""
    spec = mujoco.MjSpec.from_file(str(Path(__file__).with_suffix(".xml")))
    screw, plain = spec.body("screw"), spec.compile()
    slip, turn = plain.tendon_damping[0], plain.dof_damping[1]
    of_slip = np.sqrt(2 * kT * slip) * np.array([1, 0, 0, -advance(plain), 0, 0])
    of_turn = np.sqrt(2 * kT * turn) * np.array([0, 0, 0, 1, 0, 0])
    screw.userdata = [*of_slip, *of_turn]
    if drawn:
        s = np.linspace(0, TURNS, 16 * TURNS + 1)
        y, z = RADIUS * np.cos(2 * np.pi * s), RADIUS * np.sin(2 * np.pi * s)
        helix = np.stack([PITCH * (s - TURNS / 2), y, z], axis=1)
        for begin, end in pairwise(helix):
            capsule = mujoco.mjtGeom.mjGEOM_CAPSULE
            screw.add_geom(type=capsule, fromto=[*begin, *end], size=[THICKNESS, 0, 0])
    return spec.compile()


def advance(model: mujoco.MjModel) -> float:
    """Return how far a screw swims in a radian (µm)."""
    return -model.wrap_prm[1]


def step_out(model: mujoco.MjModel) -> float:
    """Return the largest angular frequency (1/ms) that the screw can follow: mB/resistance."""
    return model.site("magnet").user[0] * model.numeric("field_y").data[1] / model.dof_damping[1]


def swim(model: mujoco.MjModel, frequencies: Array, duration: float, seed: int = 1) -> xr.Dataset:
    """Record screws in fields that turn at angular frequencies (n,), for a duration (ms)."""
    batch = Batch(model, len(frequencies))
    batch.userdata[:, 0], batch.userdata[:, 1] = seed, np.arange(len(frequencies))
    h = model.opt.timestep
    settle, count = (round(t / h) for t in (SETTLE / step_out(model), duration))
    qpos = np.empty((count + 1, len(frequencies), 2))
    for k in range(settle + count + 1):
        if k >= settle:
            qpos[k - settle] = batch.qpos
        batch.ctrl = np.stack([np.cos(k * h * frequencies), np.sin(k * h * frequencies)], axis=1)
        batch.step()
    start = qpos[:1].copy()
    start[:, :, 1] = 0
    dims, time = ("time", "screw"), h * np.arange(count + 1)
    return xr.Dataset(
        {"along": (dims, (qpos - start)[:, :, 0]), "turn": (dims, qpos[:, :, 1])},
        {"time": time, "frequency": ("screw", frequencies)},
        {"settled": settle * h},
    )


def rotation(path: xr.Dataset) -> Array:
    """Return the mean angular velocity (1/ms) of each screw."""
    return ((path.turn[-1] - path.turn[0]) / path.time[-1]).values


def rotation_in_theory(frequency: float, limit: float, diffusion: float) -> float:
    """Return the mean angular velocity with a rotational diffusion, all in 1/ms.

    The moments <exp(-i n lag)> obey a recursion, whose continued fraction converges.
    """
    fraction = 0j
    for n in range(200 + int(4 * limit / diffusion), 0, -1):
        fraction = limit / 2 / (1j * frequency + n * diffusion + limit / 2 * fraction)
    return -limit * fraction.imag


def views(model: mujoco.MjModel, path: xr.Dataset, height: int, width: int):
    """Yield pictures of the first screw, with the field that turns it as an arrow."""
    data = mujoco.MjData(model)
    field = float(path.frequency[0]) * (path.time.values + path.settled)
    with mujoco.Renderer(model, height, width) as renderer:
        for along, turn, angle in zip(path.along[:, 0], path.turn[:, 0], field, strict=True):
            data.qpos[:] = along, turn
            mujoco.mj_forward(model, data)
            renderer.update_scene(data, "side")
            arrow = renderer.scene.geoms[renderer.scene.ngeom]
            kind, color = mujoco.mjtGeom.mjGEOM_ARROW, np.array([0.2, 0.6, 0.4, 1], np.float32)
            mujoco.mjv_initGeom(arrow, kind, np.zeros(3), np.zeros(3), np.zeros(9), color)
            start = data.site("magnet").xpos + np.array([1.2, 0, 0])
            end = start + 2 * np.array([0, np.cos(angle), np.sin(angle)])
            mujoco.mjv_connector(arrow, kind, 0.12, start, end)
            renderer.scene.ngeom += 1
            yield renderer.render()


def turns_lost(path: xr.Dataset) -> Array:
    """Return by how many turns the first screw lags behind the field."""
    field = float(path.frequency[0]) * (path.time.values + path.settled)
    lag = (field - path.turn.values[:, 0]) / (2 * np.pi)
    return lag - np.round(lag[0])


def draw_rotation(axes, model: mujoco.MjModel, mean: Array) -> None:
    """Draw the rotation at all frequencies, shape (frequencies, screws), and what theory says."""
    limit, diffusion = step_out(model), KT / model.dof_damping[1]
    hertz = 1e3 * limit / (2 * np.pi)
    error = mean.std(axis=1, ddof=1) / np.sqrt(mean.shape[1])
    axes.errorbar(
        hertz * FREQUENCIES, hertz * mean.mean(axis=1) / limit, 2 * hertz * error / limit, fmt="o",
        ms=4, color="C0", label=f"{mean.shape[1]} screws each",
    )  # fmt: skip
    f = np.linspace(1e-3, 2.1, 400)
    warm = [rotation_in_theory(x * limit, limit, diffusion) / limit for x in f]
    cold = f - np.sqrt(np.maximum(f**2 - 1, 0))
    axes.plot(hertz * f, hertz * np.array(warm), color="C0", label="theory, 298 K")
    axes.plot(hertz * f, hertz * cold, ":", color="C4", label="theory, 0 K")
    axes.set(xlabel="rotation of the field (turns/s)", ylabel="rotation of the screw (turns/s)")
    axes.legend(loc="lower right")
    per_turn = 2 * np.pi * advance(model)
    other = axes.secondary_yaxis(
        "right", functions=(lambda y: per_turn * y, lambda v: v / per_turn)
    )
    other.set_ylabel("swimming speed (µm/s)")


def draw(model: mujoco.MjModel, paths: xr.Dataset, view: Array) -> Figure:
    """Draw a screw, the mean rotation, and tracks."""
    figure = Figure(figsize=(12, 6.5), layout="constrained")
    axes = figure.subplot_mosaic("AA;BC", height_ratios=(0.4, 1))
    axes["A"].imshow(view)
    axes["A"].axis("off")
    limit, diffusion = step_out(model), KT / model.dof_damping[1]
    draw_rotation(axes["B"], model, rotation(paths).reshape(len(FREQUENCIES), -1))
    for frequency, color in SHOWN.items():
        tracks = paths.along.values[:, np.isclose(paths.frequency, frequency * limit)]
        axes["C"].plot(1e-3 * paths.time, tracks[:, :IN_PICTURE], color=color, lw=0.6, alpha=0.6)
        speed = advance(model) * rotation_in_theory(frequency * limit, limit, diffusion)
        turns = 1e3 * frequency * limit / (2 * np.pi)
        axes["C"].plot(1e-3 * paths.time, speed * paths.time, color=color, label=f"{turns:.2f}")
    axes["C"].set(xlabel="t (s)", ylabel="position (µm)", xlim=(0, 1e-3 * paths.time[-1]))
    axes["C"].legend(title="field (turns/s)", loc="upper left")
    return figure


def frames(model: mujoco.MjModel, path: xr.Dataset) -> Iterator[NDArray[np.uint8]]:
    """Yield pictures of a screw, each above the number of turns that it has lost."""
    figure = Figure(figsize=(9.6, 3.2), dpi=100, layout="constrained")
    axes = figure.subplots()
    lost, time = turns_lost(path), 1e-3 * path.time.values
    axes.plot(time, lost, color="C5")
    (past,) = axes.plot([], [], color="C0")
    (now,) = axes.plot([], [], "o", ms=12, color="C1")
    axes.set(xlabel="t (s)", ylabel="turns lost", xlim=(0, time[-1]))
    for i, view in enumerate(views(model, path, 200, 960)):
        past.set_data(time[: i + 1], lost[: i + 1])
        now.set_data(time[i : i + 1], lost[i : i + 1])
        yield np.vstack([view, pixels(figure)])


def main(
    out: Path = Path("out/micro_swimmer.png"),
    movie: Path = Path("out/micro_swimmer.mp4"),
    duration: float = 50.0,
    replicas: int = 12,
) -> None:
    """Let magnetic screws swim in a rotating field, and make a picture and a movie.

    Parameters
    ----------
    out
        file of the picture
    movie
        file of the movie
    duration
        duration of the run (s)
    replicas
        number of screws at each frequency
    """
    if not 1 <= duration <= 3600:
        raise ValueError(f"duration = {duration}: must be between 1 and 3600 s")
    if not 2 <= replicas <= 10_000:
        raise ValueError(f"replicas = {replicas}: must be between 2 and 10000")
    model, drawn = load(), load(drawn=True)
    print(mm.describe(model))
    limit = step_out(model)
    paths = swim(model, np.repeat(FREQUENCIES * limit, replicas), 1e3 * duration)
    mean = rotation(paths).reshape(-1, replicas)
    hertz = 1e3 / (2 * np.pi)
    print(f"step-out at {hertz * limit:.3f} turns/s")
    for frequency in SHOWN:
        (measured,) = mean[np.isclose(FREQUENCIES, frequency)]
        error = hertz * measured.std(ddof=1) / np.sqrt(replicas)
        theory = hertz * rotation_in_theory(frequency * limit, limit, KT / model.dof_damping[1])
        print(f"field {hertz * frequency * limit:.3f}/s: screw "
              f"{hertz * measured.mean():.3f}({error:.3f})/s (theory: {theory:.3f}/s)")  # fmt: skip
    one = paths.isel(screw=[np.flatnonzero(np.isclose(paths.frequency, IN_MOVIE * limit))[0]])
    one = one.isel(time=slice(0, FRAMES * EVERY, EVERY))
    save(draw(model, paths, next(views(drawn, one, 250, 1200))), out)
    film(frames(drawn, one), movie)


if __name__ == "__main__":
    run(main)
