"""Two compass needles side by side, where the earth's field is horizontal.

When released, they settle between the head-to-tail direction, which their mutual force favors, and
north. Pushed from there by half a degree, they swing in step or against each other at frequencies
known from theory: with moments m, distance d, inertia I, the earth's field B and
k = mu0 m²/(4 pi d³), they rest at the angle a towards north with sin a = m B/(3k), and swing with
I w² = 3k cos² a in step and I w² = k (1 + 3 sin² a) against each other.
"""

from pathlib import Path

import mujoco
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray
from support import run, save

import magmotor as mm

Array = NDArray[np.float64]

MODES = {"in step": (1, 1), "against each other": (1, -1)}


def load() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(Path(__file__).with_suffix(".xml")))


def swing(model: mujoco.MjModel, angles: ArrayLike, duration: float) -> tuple[Array, Array]:
    """Return times (s) and angles (rad north of east, shape (times, 2)) after a start at rest."""
    data = mujoco.MjData(model)
    data.qpos[:] = angles
    steps = round(duration / model.opt.timestep)
    path = np.empty((steps + 1, 3))
    with mm.magnetism():
        for row in path:
            row[:] = data.time, *data.qpos
            mujoco.mj_step(model, data)
    return path[:, 0], path[:, 1:]


def rest_angle_and_frequencies(model: mujoco.MjModel) -> tuple[float, tuple[float, float]]:
    """Return the theoretical rest angle (rad) and angular frequencies of the modes (rad/s)."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    moment = model.site("east").user[0]
    earth = data.site("earth")
    earth_moment = earth.xmat.reshape(3, 3)[:, 2] * model.site("earth").user[0]
    _, north, _ = mm.dipoles.field(np.zeros(3), earth.xpos[None], earth_moment[None])
    distance = data.site("east").xpos[0] - data.site("west").xpos[0]
    k = mm.dipoles.PERMEABILITY_OVER_4PI * moment**2 / distance**3
    sine = moment * north / (3 * k)
    if sine >= 1:
        raise ValueError(f"m B/(3k) = {sine:.3g}: must be less than 1, or both needles point north")
    inertia, damping = model.dof_M0[0], model.dof_damping[0]
    stiffness = np.array([3 * k * (1 - sine**2), k * (1 + 3 * sine**2)])
    in_step, against = np.sqrt(stiffness / inertia - (damping / (2 * inertia)) ** 2)
    return float(np.arcsin(sine)), (float(in_step), float(against))


def frequency(time: Array, swings: Array) -> float:
    """Return the angular frequency from zero crossings, which are half a period apart."""
    before = np.flatnonzero(swings[:-1] * swings[1:] < 0)
    part = swings[before] / (swings[before] - swings[before + 1])
    crossings = time[before] + part * (time[1] - time[0])
    return np.pi * (len(crossings) - 1) / (crossings[-1] - crossings[0])


def main(out: Path = Path("out/compass_needles.png"), duration: float = 10.0) -> None:
    if not 2 <= duration <= 3600:
        raise ValueError(f"duration = {duration}: must be between 2 and 3600 s")
    model = load()
    rest, frequencies = rest_angle_and_frequencies(model)
    figure = Figure(figsize=(8, 6), layout="constrained")
    let_go, pushed = figure.subplots(2, 1)

    time, path = swing(model, np.radians((75, -60)), duration)
    let_go.plot(time, np.degrees(path), label=["west needle", "east needle"])
    let_go.axhline(np.degrees(rest), color="C4", linestyle=":", label="theory: sin a = m B/(3k)")
    let_go.set(xlabel="t (s)", ylabel="north of east (degrees)", title="Let go")
    print(f"at rest: {np.degrees(path[-1].mean()):.2f} degrees north of east", end="")
    print(f" (theory: {np.degrees(rest):.2f})")

    decay = model.dof_damping[0] / (2 * model.dof_M0[0])
    for (mode, signs), omega in zip(MODES.items(), frequencies, strict=True):
        push = np.radians(0.5) * np.array(signs)
        time, path = swing(model, rest + push, duration)
        swings = path[:, 0] - rest
        print(f"{mode}: {frequency(time, swings):.4f} rad/s (theory: {omega:.4f})")
        pushed.plot(time, np.degrees(swings), label=mode)
        phase = omega * time
        theory = 0.5 * np.exp(-decay * time) * (np.cos(phase) + decay / omega * np.sin(phase))
        pushed.plot(time, theory, ":", color="C4", label="theory" if mode == "in step" else None)
    pushed.set(
        xlabel="t (s)",
        ylabel="west needle, from rest (degrees)",
        title="Pushed by half a degree",
        xlim=(0, min(duration, 5)),
    )
    for axes in (let_go, pushed):
        axes.legend(loc="upper right")
    save(figure, out)


if __name__ == "__main__":
    run(main)
