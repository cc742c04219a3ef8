"""A magnet floats below a coil, whose current follows what a magnetometer measures.

No constant current can hold it. The program finds the instability by `mjd_transitionFD`, which
knows the magnets, computes a controller and a Kalman filter from the same matrices, and lets them
hold the ball: at set points that jump, and against a push. They know only two noisy sensors.
"""

from collections.abc import Iterator
from pathlib import Path

import magmotor as mm

# isort: split
# MuJoCo comes after magmotor, which selects the OpenGL backend that MuJoCo loads.
import mujoco
import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_are
from support import film, pixels, run, save

Array = NDArray[np.float64]

MODEL = Path(__file__).parents[1] / "models" / "levitation.xml"
HEIGHT, VELOCITY, CURRENT = STATES = [2, 8, 12]
"""what the controller estimates, among positions, velocities and activations"""
SET_POINTS = {0.0: 0.0, 0.3: 4e-3, 0.9: -3e-3}
"""heights (m), each from a time (s) on"""
PUSH, PUSH_BEGIN, PUSH_END = (0.01, 0.0, -0.08), 1.5, 1.52
"""force (N) and times (s)"""
TOLERATED, AVAILABLE = 1e-3, 2.0
"""errors of the height (m) and the current (A) that count the same"""
KICKS = (0.0, 0.02, 0.0)
"""standard deviations of disturbances in each step: m, m/s, A"""
EVERY = 6
"""steps between two frames of the movie"""
BLUE, ORANGE, GREEN = "C0", "C1", "C2"


def load() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(MODEL))


def holding_current(model: mujoco.MjModel, height: float) -> float:
    """Return the current (A) whose force, 3 mu0 m m'/(2 pi d^4), is the weight."""
    moments = model.site("coil").user[0] * model.site("ball").user[0]
    weight = -model.opt.gravity[2] * model.body("ball").mass[0]
    return weight * (model.site("coil").pos[2] - height) ** 4 / (6e-7 * moments)


def linearize(model: mujoco.MjModel) -> tuple[Array, Array, Array]:
    """Return the matrices of a step around the middle: A, B, and C of all sensors."""
    data = mujoco.MjData(model)
    data.act[:] = data.ctrl[:] = holding_current(model, 0.0)
    n = 2 * model.nv + model.na
    A, B, C = np.empty((n, n)), np.empty((n, 1)), np.empty((model.nsensordata, n))
    mujoco.mjd_transitionFD(model, data, 1e-6, True, A, B, C, None)
    return A, B, C


class Controller:
    """Estimates height, velocity and current from the sensors, and returns what to apply."""

    def __init__(self, model: mujoco.MjModel):
        A, B, C = linearize(model)
        self.A, self.B = A[np.ix_(STATES, STATES)], B[STATES]
        self.C = np.array([[1.0, 0, 0], [0, 0, 1]])
        cost = np.diag([TOLERATED**-2, 0, 0]), np.array([[AVAILABLE**-2]])
        self.gain = optimal_gain(self.A, self.B, *cost)
        # The magnetometer shows heights, and what the coil adds to it is known.
        field, current = model.numeric("noise").data
        self.noise = np.array([field / abs(C[2, HEIGHT]), current])
        kicks = np.diag(np.square(KICKS))
        self.filter = optimal_gain(self.A.T, self.C.T, kicks, np.diag(self.noise**2)).T
        self.limit = model.actuator_ctrlrange[0, 1]
        self.model = model
        self.state: Array | None = None
        self.command = 0.0

    def height(self, field: float, current: float) -> float:
        """Return the height (m) of a ball whose field, with that of the coil, is measured."""
        probe, coil = self.model.site("probe").pos[2], self.model.site("coil")
        own = 2e-7 * coil.user[0] * current / (coil.pos[2] - probe) ** 3
        moment = self.model.site("ball").user[0]
        return probe + np.cbrt(2e-7 * moment / max(field - own, 1e-5))

    def __call__(self, field: float, current: float, target: float) -> float:
        """Return the control (A) after a step in which the sensors measured field and current."""
        measured = np.array([self.height(field, current), current])
        if self.state is None:
            self.state, self.command = np.array([measured[0], 0, current]), current
        rest = np.array([target, 0, holding_current(self.model, target)])
        surprise = self.filter @ (measured - self.C @ self.state)
        error = self.A @ (self.state - rest) + self.B[:, 0] * (self.command - rest[2]) + surprise
        self.state = rest + error
        self.command = float(np.clip(rest[2] - self.gain[0] @ error, -self.limit, self.limit))
        return self.command


def optimal_gain(A: Array, B: Array, state_cost: Array, control_cost: Array) -> Array:
    """Return the gain of the linear-quadratic regulator."""
    P = solve_discrete_are(A, B, state_cost, control_cost)
    return np.linalg.solve(control_cost + B.T @ P @ B, B.T @ P @ A)


def closed_loop(model: mujoco.MjModel) -> Array:
    """Return the matrix of a step of the ball and its controller together."""
    A, B, C = linearize(model)
    held = Controller(model)
    field, current = C[2], C[3]
    seen = np.array([(field - field[CURRENT] * current) / field[HEIGHT], current])
    inside = held.A - held.B @ held.gain - held.filter @ held.C
    return np.block([[A, -B @ held.gain], [held.filter @ seen, inside]])


def rates(step: Array, timestep: float) -> NDArray[np.complex128]:
    """Return the exponents (1/s) at which the solutions grow and swing."""
    found = np.log(np.linalg.eigvals(step).astype(complex)) / timestep
    return np.asarray(found, np.complex128)


def hold(model: mujoco.MjModel, duration: float, seed: int = 1) -> xr.Dataset:
    """Let the controller hold the ball, and record it."""
    data, controller = mujoco.MjData(model), Controller(model)
    random = np.random.default_rng(seed)
    data.act[:] = data.ctrl[:] = holding_current(model, 0.0)
    count = round(duration / model.opt.timestep)
    qpos, table = np.empty((count, model.nq)), np.empty((count, 4))
    for k in range(count):
        target = [height for begin, height in SET_POINTS.items() if data.time >= begin - 1e-9][-1]
        pushed = PUSH_BEGIN <= data.time < PUSH_END
        data.body("ball").xfrc_applied[:3] = PUSH if pushed else (0, 0, 0)
        mujoco.mj_step(model, data)
        noise = model.numeric("noise").data * random.standard_normal(2)
        field, current = data.sensordata[2:] + noise
        data.ctrl[:] = controller(field, current, target)
        assert controller.state is not None
        qpos[k], table[k] = data.qpos, (target, controller.state[0], data.act[0], field)
    time = model.opt.timestep * np.arange(1, count + 1)
    names = ("target", "estimate", "current", "field")
    columns = {name: ("time", table[:, i]) for i, name in enumerate(names)}
    return xr.Dataset({"qpos": (("time", "nq"), qpos), **columns}, {"time": time})


def views(model: mujoco.MjModel, positions: Array, size: int) -> Iterator[NDArray[np.uint8]]:
    """Yield pictures of the ball at positions (n, nq)."""
    data = mujoco.MjData(model)
    with mujoco.Renderer(model, size, size) as renderer:
        for data.qpos[:] in positions:
            mujoco.mj_forward(model, data)
            renderer.update_scene(data, "front")
            yield renderer.render()


def draw_rates(axes, model: mujoco.MjModel) -> None:
    """Draw the exponents of the ball alone and with its controller."""
    h = model.opt.timestep
    alone, together = rates(linearize(model)[0], h), rates(closed_loop(model), h)
    axes.axvspan(0, 60, color=ORANGE, alpha=0.25, linewidth=0, label="unstable")
    axes.plot(together.real, together.imag, "o", color=BLUE, label="with the controller")
    axes.plot(alone.real, alone.imag, "x", color=ORANGE, label="with a constant current")
    axes.set(xlabel="growth (1/s)", ylabel="angular frequency (1/s)", xlim=(-260, 60))
    axes.set(ylim=(-130, 130), title="Exponents of small motions")
    axes.legend(loc="upper left")


def draw_height(axes, path: xr.Dataset) -> None:
    """Draw the set point, the height and the push."""
    axes.axvspan(PUSH_BEGIN, PUSH_END, color=ORANGE, alpha=0.25, linewidth=0, label="push")
    axes.plot(path.time, 1e3 * path.target, ":", color="C4", label="set point")
    axes.plot(path.time, 1e3 * path.qpos[:, HEIGHT], color=BLUE, label="height")
    axes.set(xlim=(0, path.time[-1]), ylim=(-9, 7), ylabel="position (mm)")


def draw(model: mujoco.MjModel, path: xr.Dataset) -> Figure:
    """Draw the ball, its motion, what was measured and applied, and the exponents."""
    figure = Figure(figsize=(12, 7.5), layout="constrained")
    axes = figure.subplot_mosaic("ABB;ACC;DEE", width_ratios=(1, 0.8, 0.8))
    pushed = path.qpos.sel(time=[PUSH_END + 0.02], method="nearest").values
    axes["A"].imshow(next(views(model, pushed, 640)))
    axes["A"].set_title("Just after the push")
    axes["A"].axis("off")
    draw_height(axes["B"], path)
    axes["B"].plot(path.time, 1e3 * path.qpos[:, 0], color=GREEN, label="to the side")
    axes["B"].legend(loc="lower left", ncols=2)
    axes["C"].plot(path.time, path.current, color=ORANGE)
    axes["C"].set(xlim=(0, path.time[-1]), ylabel="current (A)")
    axes["E"].plot(path.time, 1e3 * path.field, color="C4")
    axes["E"].set(xlim=(0, path.time[-1]), xlabel="t (s)", ylabel="measured field (mT)")
    draw_rates(axes["D"], model)
    return figure


def frames(model: mujoco.MjModel, path: xr.Dataset) -> Iterator[NDArray[np.uint8]]:
    """Yield pictures of the ball, slowed down, each beside its height so far."""
    figure = Figure(figsize=(5.4, 5.4), dpi=100, layout="constrained")
    axes = figure.subplots()
    draw_height(axes, path)
    axes.lines[1].set_alpha(0.25)
    (past,) = axes.plot([], [], color=BLUE)
    (now,) = axes.plot([], [], "o", ms=12, color=ORANGE)
    axes.set(xlabel="t (s)", ylabel="height (mm)")
    axes.legend(loc="lower left")
    shown = path.isel(time=slice(None, None, EVERY))
    for i, view in enumerate(views(model, shown.qpos.values, 540)):
        time, height = shown.time.values, 1e3 * shown.qpos.values[:, HEIGHT]
        past.set_data(time[: i + 1], height[: i + 1])
        now.set_data(time[i : i + 1], height[i : i + 1])
        yield np.hstack([view, pixels(figure)])


def main(
    out: Path = Path("out/levitation.png"),
    movie: Path = Path("out/levitation.mp4"),
    duration: float = 2.2,
) -> None:
    """Hold a magnet below a coil, and make a picture and a movie.

    Parameters
    ----------
    out
        file of the picture
    movie
        file of the movie
    duration
        duration of the run (s)
    """
    if not 1.6 <= duration <= 60:
        raise ValueError(f"duration = {duration}: must be between 1.6 and 60 s")
    model = load()
    print(mm.describe(model))
    h = model.opt.timestep
    growth = rates(linearize(model)[0], h).real.max()
    distance = model.site("coil").pos[2]
    theory = 2 * np.arcsinh(h * np.sqrt(-model.opt.gravity[2] / distance)) / h
    print(f"with a constant current, it leaves at {growth:.4f}/s (theory: {theory:.4f}/s)")
    together = rates(closed_loop(model), h)
    slowest = together[abs(together.real) > 1e-6].real.max()
    print(f"with the controller, it returns at {-slowest:.1f}/s")
    path = hold(model, duration)
    quiet = path.sel(time=slice(0.1, 0.29))
    jitter = quiet.qpos.values[:, HEIGHT].std()
    print(f"noise of the sensors moves it by {1e6 * jitter:.0f} µm")
    save(draw(model, path), out)
    film(frames(model, path), movie)


if __name__ == "__main__":
    run(main)
