"""A robot with magnetic wheels climbs a steel box, over its edge onto the top, and down again.

Each wheel is a disk that is magnetized along its axle, in a tire. On the side of the box, the robot
stays where it is if friction times pull exceeds its weight. At an edge, a wheel has iron only on
one side of it and loses half of its pull, so magnets that hold on the side may be too weak there.
"""

from collections.abc import Iterator
from pathlib import Path

import magmotor  # noqa: F401 -- the plugin of the model

# isort: split
# MuJoCo comes after magmotor, which selects the OpenGL backend that MuJoCo loads.
import mujoco
import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray
from support import FRAME_RATE, film, run, save, titled, views

WHEELS = "front left", "front right", "rear left", "rear right"
MAGNETS = {"neodymium": 1.3, "bonded neodymium": 0.65, "ferrite": 0.4}
"""polarizations (T)"""
SPEED, RAMP, DURATION = 5.0, 0.1, 2.1
"""speed of the wheels (rad/s), the time in which they reach it (s), and that of a run (s)"""
PERIOD = 0.01
"""time between two records (s)"""
SHOWN = [0.15, 0.8, 1.35]
"""times of the views (s)"""


def load(polarization: float = 1.3) -> mujoco.MjModel:
    """Return the robot with wheels of a polarization (T)."""
    model = mujoco.MjModel.from_xml_path(str(Path(__file__).with_suffix(".xml")))
    model.geom_user[model.geom_user.any(axis=1)] = 0, 0, polarization
    return model


def pull(model: mujoco.MjModel) -> float:
    """Return the force (N) by which the box attracts the robot at the start."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return data.qfrc_passive[0]


def needed(model: mujoco.MjModel) -> float:
    """Return the pull (N) with which friction just carries the robot's weight."""
    weight = -model.body("robot").subtreemass[0] * model.opt.gravity[2]
    return weight / model.geom("box").friction[0]


def normal_forces(model: mujoco.MjModel, data: mujoco.MjData) -> NDArray[np.float64]:
    """Return the force (N) by which each wheel presses on the box, shape (wheels,)."""
    found, force, box = np.zeros(model.ngeom), np.empty(6), model.geom("box").id
    for number, pair in enumerate(data.contact.geom):
        if box in pair:
            mujoco.mj_contactForce(model, data, number, force)
            found[pair.sum() - box] += force[0]
    return found[[model.geom(name).id for name in WHEELS]]


def on_floor(model: mujoco.MjModel, data: mujoco.MjData) -> bool:
    """Whether a front wheel is on the floor, since the robot has tipped over backward."""
    floor, front = model.geom("floor").id, [model.geom(name).id for name in WHEELS[:2]]
    return any(floor in pair and pair.sum() - floor in front for pair in data.contact.geom)


def drive(model: mujoco.MjModel) -> xr.Dataset:
    """Drive up the box, until the end of the way or until the robot falls."""
    data = mujoco.MjData(model)
    steps = round(PERIOD / model.opt.timestep)
    time, normal, qpos = [], [], []
    while data.time < DURATION and (data.time < RAMP or normal[-1].any()):
        mean = np.zeros(len(WHEELS))
        for _ in range(steps):
            data.ctrl[:] = SPEED * min(data.time / RAMP, 1)
            mujoco.mj_step(model, data)
            mean += normal_forces(model, data) / steps
        time.append(data.time)
        normal.append(mean)
        qpos.append(data.qpos.copy())
        if on_floor(model, data):
            break
    return xr.Dataset(
        {"normal": (("time", "wheel"), normal), "qpos": (("time", "nq"), qpos)},
        {"time": time, "wheel": list(WHEELS)},
    )


def outcome(motion: xr.Dataset) -> str:
    """Return how far the robot came, and the least normal force of each wheel if it did."""
    if motion.time[-1] < DURATION - PERIOD / 2:
        return f"falls off after {float(motion.time[-1]):.2f} s"
    if motion.qpos[-1, 0] < 0:
        return "stays on, but does not pass the edge"
    least = motion.normal.sel(time=slice(RAMP, None)).min("time")
    each = ", ".join(
        f"{value:.1f} N ({wheel})" for wheel, value in zip(WHEELS, least.values, strict=True)
    )
    return f"stays on; least normal forces: {each}"


def draw(model: mujoco.MjModel, runs: dict[str, xr.Dataset]) -> Figure:
    """Draw three views of the first run, and the normal forces of all."""
    figure = Figure(figsize=(14, 8), layout="constrained")
    axes = figure.subplot_mosaic("ABC;DEF", height_ratios=(1.3, 1))
    first = next(iter(runs.values()))
    shown = first.sel(time=SHOWN, method="nearest")
    for name, view, moment in zip(
        "ABC", views(model, shown.qpos, "scene", 640, 720), SHOWN, strict=True
    ):
        axes[name].imshow(view)
        axes[name].set_title(f"t = {moment:g} s")
        axes[name].axis("off")
    for name, (magnet, motion) in zip("DEF", runs.items(), strict=True):
        for axle in ("front", "rear"):
            pair = motion.normal.sel(wheel=[f"{axle} left", f"{axle} right"]).mean("wheel")
            axes[name].plot(motion.time, pair, label=f"{axle} wheels, mean")
        axes[name].set(xlabel="t (s)", ylabel="normal force (N)", xlim=(0, DURATION))
        axes[name].set(title=f"{magnet}, {MAGNETS[magnet]} T", ylim=(0, 25 if name == "D" else 10))
    axes["F"].legend()
    return figure


def frames(model: mujoco.MjModel, runs: dict[str, xr.Dataset]) -> Iterator[NDArray[np.uint8]]:
    """Yield pictures of the runs, one after another, at half speed."""
    for magnet, motion in runs.items():
        moments = motion.isel(time=slice(None, None, round(1 / (2 * FRAME_RATE * PERIOD))))
        yield from titled(
            views(model, moments.qpos, "scene", 480, 640), f"{magnet}, {MAGNETS[magnet]} T"
        )


def main(
    out: Path = Path("out/climbing_robot.png"), movie: Path = Path("out/climbing_robot.mp4")
) -> None:
    """Drive a robot with three kinds of magnets up a box, and make a picture and a movie.

    Parameters
    ----------
    out
        file of the picture
    movie
        file of the movie
    """
    runs = {}
    for magnet, polarization in MAGNETS.items():
        model = load(polarization)
        runs[magnet] = drive(model)
        print(f"{magnet}, {polarization} T: pulled with {pull(model):.1f} N, ", end="")
        print(f"needs {needed(model):.1f} N on the side; {outcome(runs[magnet])}")
    save(draw(load(), runs), out)
    film(frames(load(), runs), movie)


if __name__ == "__main__":
    run(main)
