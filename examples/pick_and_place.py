"""A robot's arm picks up a soft-iron pellet with an electromagnet, and drops it into a bowl.

The arm is dm_control's Kinova Jaco, with the velocity servos that dm_control gives it. Nothing but
magnetism holds the pellet: it leaps to the magnet when the current rises, follows the arm, and
falls when the current is off. With MuJoCo's default contacts, which are too soft for the attraction
of what touches, the pellet sinks into the magnet and is thrown away.
"""

import warnings
from collections.abc import Iterator
from importlib.resources import as_file, files
from pathlib import Path

import magmotor as mm

# isort: split
# MuJoCo comes after magmotor, which selects the OpenGL backend that MuJoCo loads.
import mujoco
import numpy as np
import scipy.linalg
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from support import FRAME_RATE, film, pixels, run, save, views

Array = NDArray[np.float64]

SERVOS = {1: (30.5, 36), 2: (30.5, 36), 3: (30.5, 36), 4: (6.8, 48), 5: (6.8, 48), 6: (6.8, 48)}
"""largest torque (N m) and speed (degrees/s) of each joint"""
KV = 500.0
"""gain of the servos (N m s/rad)"""
HOME = (0.17, 2.63, 5.08, 0.21, -0.8, 0)
"""angles of the joints at the start (rad)"""

PLAN = (
    (1.2, (0.38, -0.22, 0.18), 0),  # above the pellet
    (0.8, (0.38, -0.22, 0.124), 0),  # 8 mm above it
    (0.5, (0.38, -0.22, 0.124), 1),  # the pellet leaps
    (1.0, (0.38, -0.22, 0.22), 1),
    (3.8, (0.38, 0.19, 0.22), 1),
    (0.8, (0.38, 0.19, 0.12), 1),
    (0.8, (0.38, 0.19, 0.12), 0),  # it falls into the bowl
    (0.9, (0.38, 0.22, 0.22), 0),
)
"""how long (s), where the magnet's face goes (m), and the current"""

SHOWN = [2.06, 5.2, 9.7]
"""times of the views (s)"""

HELD = 2.4, 7.9
"""from when until when the pellet is carried (s)"""
BLUE, GREEN, ORANGE = "C0", "C2", "C1"

PERIOD = 0.005
"""time between two commands of the controller, which are recorded (s)"""
GAINS = 8.0, 4.0
"""rates at which errors of the place and of the direction vanish (1/s)"""
DAMPING = 1e-4
"""keeps the speeds small where the arm is stretched"""


def load() -> mujoco.MjModel:
    """Join the table, the arm and the electromagnet."""
    here = Path(__file__).parent
    spec = mujoco.MjSpec.from_file(str(here / "pick_and_place.xml"))
    magnet = mujoco.MjSpec.from_file(str(here / "electromagnet.xml"))
    with as_file(files("dm_control") / "third_party" / "kinova") as folder:
        arm = mujoco.MjSpec.from_file(str(folder / "jaco_arm.xml"))
        spec.attach(arm, frame="mount", prefix="arm/")
        spec.attach(magnet, site="arm/wristsite", prefix="hand/")
        for joint, (torque, speed) in SERVOS.items():
            servo = spec.add_actuator(name=f"servo {joint}", target=f"arm/joint_{joint}")
            servo.trntype = mujoco.mjtTrn.mjTRN_JOINT
            servo.set_to_velocity(kv=KV)
            servo.forcerange = np.array([-torque, torque])
            servo.ctrlrange = np.radians([-speed, speed])
        return spec.compile()


def start(model: mujoco.MjModel) -> mujoco.MjData:
    data = mujoco.MjData(model)
    data.qpos[-len(HOME) :] = HOME
    mujoco.mj_forward(model, data)
    return data


def commands(place: Array) -> Iterator[tuple[Array, Array, int]]:
    """Yield where the magnet's face should be (m), its velocity (m/s), and the current."""
    for duration, goal, current in PLAN:
        for t in np.arange(0, duration, PERIOD) / duration:
            way = t**3 * (10 - 15 * t + 6 * t * t)
            speed = 30 * (t * (1 - t)) ** 2 / duration
            yield place + way * (goal - place), speed * (goal - place), current
        place = np.array(goal)


def steer(model: mujoco.MjModel, data: mujoco.MjData, place: Array, velocity: Array) -> Array:
    """Return the speeds of the joints (rad/s) that move the magnet's face, pointing downwards."""
    jacobian = np.empty((6, model.nv))
    face = data.site("hand/face")
    mujoco.mj_jacSite(model, data, jacobian[:3], jacobian[3:], face.id)
    jacobian = jacobian[:, -len(HOME) :]
    to_place, to_down = GAINS
    axis = face.xmat[2::3]
    twist = np.concatenate(
        [velocity + to_place * (place - face.xpos), to_down * np.cross(axis, (0, 0, -1))]
    )
    square = jacobian.T @ jacobian + DAMPING * np.eye(len(HOME))
    return scipy.linalg.solve(square, jacobian.T @ twist, assume_a="pos")


def perform(model: mujoco.MjModel) -> xr.Dataset:
    """Run the plan, until its end or until the pellet is faster than anything that works."""
    data = start(model)
    pellet, face = data.body("pellet"), data.site("hand/face")
    radius = model.geom("pellet").size[0]
    steps = round(PERIOD / model.opt.timestep)
    rows, qpos = [], []
    for place, velocity, current in commands(face.xpos.copy()):
        # The servos also carry the arm's weight.
        speeds = steer(model, data, place, velocity) + data.qfrc_bias[-len(HOME) :] / KV
        data.ctrl[:] = current, *speeds
        mujoco.mj_step(model, data, steps)
        force = data.qfrc_passive[:3]  # on the free joint of the pellet
        gap = (pellet.xpos - face.xpos) @ face.xmat[2::3] - radius
        speed = np.linalg.norm(data.qvel[:3])
        rows.append((data.time, pellet.xpos[2], gap, *data.act, np.linalg.norm(force), speed))
        qpos.append(data.qpos.copy())
        if not speed < 10:
            break
    columns = dict(
        zip(("time", "height", "gap", "current", "force", "speed"), np.array(rows).T, strict=True)
    )
    time = columns.pop("time")
    variables = {name: ("time", column) for name, column in columns.items()}
    return xr.Dataset({**variables, "qpos": (("time", "nq"), np.array(qpos))}, {"time": time})


def trace(axes: Axes, motion: xr.Dataset, name: str, color: str, label: str | None = None):
    axes.plot(motion.time, motion[name], color=color, label=label)
    axes.set(xlabel="t (s)")


def draw(model: mujoco.MjModel, carried: xr.Dataset, thrown: xr.Dataset) -> Figure:
    """Draw three views, the run over time, and the moment of touch with both contacts."""
    figure = Figure(figsize=(12.6, 7.2), layout="constrained")
    axes = figure.subplot_mosaic("AAAABBBBCCCC;DDDEEEFFFGGG", height_ratios=(1.35, 1))
    shown = carried.sel(time=SHOWN, method="nearest")
    scenes = views(model, shown.qpos, "scene", 600, 760)
    details = views(model, shown.qpos, "close", 300, 300)
    for name, scene, detail, moment in zip("ABC", scenes, details, SHOWN, strict=True):
        axes[name].imshow(scene)
        axes[name].set_title(f"t = {moment:g} s")
        axes[name].axis("off")
        inset = axes[name].inset_axes((0.7, 0.62, 0.28, 0.36), xticks=[], yticks=[])
        inset.imshow(detail)
    radius = 1e3 * model.geom("pellet").size[0]
    carried = carried.assign(height=1e3 * carried.height, gap=1e3 * carried.gap)
    face = carried.assign(height=carried.height + radius + carried.gap)
    trace(axes["D"], face, "height", "C5", "magnet's face")
    trace(axes["D"], carried, "height", BLUE, "pellet's center")
    axes["D"].set(ylabel="height (mm)", ylim=(0, 420))
    trace(axes["E"], carried, "force", ORANGE, "magnetic force (N)")
    trace(axes["E"], carried, "current", GREEN, "current / largest current")
    axes["E"].set(ylim=(-0.2, 11))
    trace(axes["F"], carried, "gap", BLUE, "gap of magnet and pellet")
    bound = 0.05 * radius
    axes["F"].axhspan(-bound, bound, color=GREEN, alpha=0.25, label="5 % of the radius")
    axes["F"].set(ylabel="gap (mm)", ylim=(-2, 12))
    touch = slice(thrown.time.values[-1] - 0.1, thrown.time.values[-1] + 0.1)
    trace(axes["G"], carried.sel(time=touch), "speed", BLUE, "set by mm.check")
    trace(axes["G"], thrown.sel(time=touch), "speed", ORANGE, "MuJoCo's default")
    axes["G"].set(ylabel="speed (m/s)", yscale="log", ylim=(1e-3, 1e6), title="Contacts")
    for name, place in zip(
        "DEFG", ("upper left", "upper left", "center", "upper left"), strict=True
    ):
        axes[name].legend(loc=place)
    return figure


def frames(model: mujoco.MjModel, carried: xr.Dataset) -> Iterator[NDArray[np.uint8]]:
    """Yield pictures of the arm, beside a view that follows the pellet, and the force."""
    moments = carried.isel(time=slice(None, None, round(1 / FRAME_RATE / PERIOD)))
    figure = Figure(figsize=(4.8, 3.6), dpi=100, layout="constrained")
    axes = figure.subplots()
    axes.plot(carried.time, carried.force, color="C5")
    axes.set(xlabel="t (s)", ylabel="magnetic force (N)")
    (past,) = axes.plot([], [], color=ORANGE)
    far = views(model, moments.qpos, "scene", 720, 720)
    close = views(model, moments.qpos, "close", 360, 480)
    for i, (scene, pellet) in enumerate(zip(far, close, strict=True)):
        past.set_data(moments.time.values[: i + 1], moments.force.values[: i + 1])
        axes.set_title(f"current: {100 * float(moments.current[i]):.0f} %")
        yield np.hstack([scene, np.vstack([pellet, pixels(figure)])])


def main(
    out: Path = Path("out/pick_and_place.png"), movie: Path = Path("out/pick_and_place.mp4")
) -> None:
    """Pick up a pellet and drop it into a bowl, and make a picture and a movie.

    Parameters
    ----------
    out
        file of the picture
    movie
        file of the movie
    """
    model = load()
    with warnings.catch_warnings(record=True, action="always") as said:
        thrown = perform(model)
    last = thrown.isel(time=-1)
    print(
        f"MuJoCo's default contacts: {last.speed:.0f} m/s at t = {last.time:.2f} s, and a warning:"
    )
    print(*(warning.message for warning in said), sep="\n")
    print("mm.check, before the next run:")
    print(mm.check(model, start(model), fix=True))
    carried = perform(model)
    held = carried.sel(time=slice(*HELD))
    depth = -held.gap.min() / model.geom("pellet").size[0]
    print(f"carried with {held.force.mean():.2f} N, {100 * depth:.1f} % of the radius deep")
    print(f"in the bowl: {1e3 * carried.height[-1]:.1f} mm above the table")
    save(draw(model, carried, thrown), out)
    film(frames(model, carried), movie)


if __name__ == "__main__":
    run(main)
