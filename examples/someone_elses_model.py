"""Magnetize someone else's model, dm_control's pendulum, without changing its file.

Its pole stands upright on a hinge and falls over. Two sites turn its bob into a magnet and place
another beside it: the pole now stays up, leaning, where the magnetic torque balances gravity.
"""

from importlib.resources import as_file, files
from pathlib import Path

import mujoco
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.optimize import root_scalar
from support import run, save

import magmotor as mm

Array = NDArray[np.float64]

BOB = (0, 0, 0.5)
"""position on the pole, which has all its mass there (m)"""
MAGNET = (0.3, 0, 1.1)
"""position in the world (m)"""
MOMENT = 100.0
"""moment of each magnet, along z (A m^2)"""
START = 0.5
"""initial angle of the pole from the upright (rad)"""


def load(magnetized: bool = True) -> mujoco.MjModel:
    with as_file(files("dm_control") / "suite") as folder:
        spec = mujoco.MjSpec.from_file(str(folder / "pendulum.xml"))
    if magnetized:
        spec.body("pole").add_site(name="bob", pos=BOB, userdata=[MOMENT])
        spec.worldbody.add_site(name="magnet", pos=MAGNET, userdata=[MOMENT])
        spec.add_text(name="magmotor", data="dipoles")
    return spec.compile()


def swing(model: mujoco.MjModel, duration: float) -> tuple[Array, Array]:
    """Return times (s) and angles from the upright (rad) of the pole, released at START."""
    data = mujoco.MjData(model)
    data.qpos[0] = START
    path = np.empty((round(duration / model.opt.timestep) + 1, 2))
    for row in path:
        row[:] = data.time, data.qpos[0]
        mujoco.mj_step(model, data)
    return path[:, 0], path[:, 1]


def torque(model: mujoco.MjModel, angle: float) -> float:
    """Return the torque (N m) of dipole and gravity about the hinge on the pole at rest."""
    direction = np.array([np.sin(angle), 0, np.cos(angle)])
    arm = BOB[2] * direction
    bob = model.body("pole").pos + arm
    force, couple = mm.dipoles.wrench(bob, MOMENT * direction, [MAGNET], [[0, 0, MOMENT]])
    weight = model.body("pole").mass[0] * model.opt.gravity
    return float((np.cross(arm, force + weight) + couple)[1])


def equilibrium(model: mujoco.MjModel) -> float:
    """Return the angle (rad) from the upright, beside the magnet, at which the torque vanishes."""
    return root_scalar(lambda angle: torque(model, angle), bracket=(0.5, 0.65)).root


def main(out: Path = Path("out/someone_elses_model.png"), duration: float = 30.0) -> None:
    if not 1 <= duration <= 3600:
        raise ValueError(f"duration = {duration}: must be between 1 and 3600 s")
    model = load()
    expected = equilibrium(model)
    figure = Figure(figsize=(8, 4), layout="constrained")
    axes = figure.subplots()
    swings = {"as it comes": swing(load(magnetized=False), duration)}
    with mm.magnetism():
        swings["magnetized"] = swing(model, duration)
    for name, (time, angle) in swings.items():
        axes.plot(time, np.degrees(angle), label=name)
        print(f"{name}: {np.degrees(angle[-1]):.3f} degrees from the upright", end=" ")
        print(f"after {time[-1]:g} s")
    print(f"theory: {np.degrees(expected):.3f} degrees, magnetized")
    axes.axhline(np.degrees(expected), color="C4", linestyle=":", label="theory: no torque")
    axes.set(
        xlabel="t (s)", ylabel="angle from the upright (degrees)", title="dm_control's pendulum"
    )
    axes.legend(loc="upper right")
    save(figure, out)


if __name__ == "__main__":
    run(main)
