"""A magnetic gripper lifts a steel plate near its edge, carries it, and sets it down.

The magnet slides in a housing that is not magnetic. When the magnet is down, it pulls the plate
against the housing; when it slides back, the plate stays where it was set down. The plate hangs by
friction alone against sideways forces: with a pull F, it holds up to an acceleration of
mu (F/m - g), and slips or falls above it.
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

Array = NDArray[np.float64]

GAPS = 1e-3 * np.array([1, 1.5, 2, 3, 4, 6, 10, 20])
"""distances of the magnet from the plate (m)"""
FRACTIONS = 0.98, 1.02, 1.3
"""accelerations, over the largest one in theory"""
AWAY, ACROSS, UP = 0.03, 0.3, 0.1
"""how far the magnet slides back, and how far the hand moves sideways and up (m)"""
LIFTED, LOWERED = 0.98, -1.2
"""when the plate hangs, from the start and from the end (s)"""
SHOWN = [0.6, 1.18, 2.3]
"""times of the views (s)"""
PERIOD = 0.005
"""time between two records (s)"""


def load() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(Path(__file__).with_suffix(".xml")))


def pulls(model: mujoco.MjModel, gaps: Array) -> Array:
    """Return the pull (N) on the plate at gaps (m) between it and the magnet."""
    data, found = mujoco.MjData(model), []
    mujoco.mj_kinematics(model, data)
    wall = data.body("magnet").xpos[2] - data.body("plate").xpos[2] - model.geom("plate").size[2]
    for gap in gaps:
        data.joint("retract").qpos = gap - wall
        mujoco.mj_forward(model, data)
        found.append(data.qfrc_passive[2])  # on the plate's free joint
    return np.array(found)


def largest_acceleration(model: mujoco.MjModel, pull: float) -> float:
    """Return at which acceleration (m/s²) friction no longer holds the plate, in theory."""
    mass, friction = model.body("plate").mass[0], model.geom("plate").friction[0]
    return friction * (pull / mass + model.opt.gravity[2])


def commands(acceleration: float, timestep: float) -> Iterator[Array]:
    """Yield where hand and magnet should be: x, z, and how far the magnet is back (m).

    Each move speeds up, and then brakes.
    """
    place = np.array([0, UP, AWAY])
    for duration, *goal in (
        (0.4, 0, 0, AWAY),
        (0.2, 0, 0, 0),  # the magnet comes down and holds the plate
        (0.4, 0, UP, 0),
        (2 * np.sqrt(ACROSS / acceleration), ACROSS, UP, 0),
        (0.6, ACROSS, 0, 0),
        (0.2, ACROSS, 0, AWAY),  # the magnet slides back and lets go
        (0.4, ACROSS, UP, AWAY),
    ):
        for t in np.arange(0, duration, timestep) / duration:
            way = 2 * t * t if t < 0.5 else 1 - 2 * (1 - t) ** 2
            yield place + way * (goal - place)
        place = np.array(goal)


def carry(model: mujoco.MjModel, acceleration: float) -> xr.Dataset:
    """Pick up the plate, move it sideways at an acceleration (m/s²), and set it down."""
    data = mujoco.MjData(model)
    data.qpos[-3:] = 0, UP, AWAY
    plate, hand, rows, qpos = data.body("plate"), data.body("hand"), [], []
    offset = model.body("plate").pos[0] - model.body("hand").pos[0]
    every = round(PERIOD / model.opt.timestep)
    for step, data.ctrl[:] in enumerate(commands(acceleration, model.opt.timestep), 1):
        mujoco.mj_step(model, data)
        if step % every == 0:
            slip = plate.xpos[0] - hand.xpos[0] - offset
            rows.append((data.time, slip, plate.xpos[2], data.qfrc_passive[2]))
            qpos.append(data.qpos.copy())
    columns = dict(zip(("time", "slip", "height", "pull"), np.array(rows).T, strict=True))
    time = columns.pop("time")
    variables = {name: ("time", column) for name, column in columns.items()}
    return xr.Dataset({**variables, "qpos": (("time", "nq"), np.array(qpos))}, {"time": time})


def hanging(motion: xr.Dataset) -> xr.Dataset:
    """Return the part of a run in which the hand carries the plate."""
    return motion.sel(time=slice(LIFTED, motion.time.values[-1] + LOWERED))


def outcome(motion: xr.Dataset) -> str:
    """Return what became of the plate."""
    part = hanging(motion)
    if part.height[-1] < 0.5 * part.height[0]:
        return "falls"
    return f"slips by {1e3 * abs(part.slip - part.slip[0]).max():.2f} mm"


def draw(model: mujoco.MjModel, runs: dict[float, xr.Dataset]) -> Figure:
    """Draw three views, the pull against the gap, and the runs over time."""
    figure = Figure(figsize=(14, 8), layout="constrained")
    axes = figure.subplot_mosaic("AABBCC;DDEEFF", height_ratios=(1.2, 1))
    first = next(iter(runs.values()))
    shown = first.sel(time=SHOWN, method="nearest")
    scenes = views(model, shown.qpos, "scene", 560, 760)
    details = views(model, shown.qpos, "close", 280, 280)
    titles = "the magnet comes down", "the plate is carried", "the magnet is back"
    for name, scene, detail, title in zip("ABC", scenes, details, titles, strict=True):
        axes[name].imshow(scene)
        axes[name].set_title(title)
        axes[name].axis("off")
        axes[name].inset_axes((0.01, 0.58, 0.3, 0.41), xticks=[], yticks=[]).imshow(detail)
    weight = -model.body("plate").mass[0] * model.opt.gravity[2]
    gaps = np.geomspace(GAPS[0], GAPS[-1], 60)
    axes["D"].loglog(1e3 * gaps, pulls(model, gaps), label="pull")
    axes["D"].axhline(weight, color="C4", linestyle=":", label="weight of the plate")
    axes["D"].set(xlabel="gap of magnet and plate (mm)", ylabel="force (N)")
    axes["E"].plot(first.time, first.pull, label="pull")
    axes["E"].axhline(weight, color="C4", linestyle=":", label="weight of the plate")
    axes["E"].set(xlabel="t (s)", ylabel="force (N)", ylim=(-0.2, 13))
    for acceleration, motion in runs.items():
        part = hanging(motion)
        slip = 1e3 * (part.slip - part.slip[0])
        axes["F"].plot(part.time, slip, label=f"{acceleration:.1f} m/s²")
    axes["F"].set(xlabel="t (s)", ylabel="slip of the plate in the hand (mm)", ylim=(-4, 4))
    for name in "DEF":
        axes[name].legend()
    return figure


def frames(model: mujoco.MjModel, runs: dict[float, xr.Dataset]) -> Iterator[NDArray[np.uint8]]:
    """Yield pictures of the slowest and of the fastest run, at half speed."""
    for acceleration in (min(runs), max(runs)):
        motion = runs[acceleration]
        moments = motion.isel(time=slice(None, None, round(1 / (2 * FRAME_RATE * PERIOD))))
        pictures = views(model, moments.qpos, "scene", 480, 640)
        yield from titled(pictures, f"moved at {acceleration:.1f} m/s²")


def main(
    out: Path = Path("out/magnetic_gripper.png"), movie: Path = Path("out/magnetic_gripper.mp4")
) -> None:
    """Carry a steel plate at three accelerations, and make a picture and a movie.

    Parameters
    ----------
    out
        file of the picture
    movie
        file of the movie
    """
    model = load()
    weight = -model.body("plate").mass[0] * model.opt.gravity[2]
    print(f"the plate weighs {weight:.2f} N")
    for gap, pull in zip(GAPS, pulls(model, GAPS), strict=True):
        print(f"gap {1e3 * gap:4.1f} mm: pull {pull:.3f} N, {pull / weight:.3f} times the weight")
    pull = hanging(carry(model, 5.0)).pull.values[0]
    limit = largest_acceleration(model, pull)
    print(f"held with {pull:.2f} N; in theory, it slips above {limit:.2f} m/s²")
    runs = {fraction * limit: carry(model, fraction * limit) for fraction in FRACTIONS}
    for acceleration, motion in runs.items():
        print(f"at {acceleration:.2f} m/s², it {outcome(motion)}")
    save(draw(model, runs), out)
    film(frames(model, runs), movie)


if __name__ == "__main__":
    run(main)
