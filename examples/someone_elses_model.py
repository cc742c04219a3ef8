"""Magnetize a model that somebody else wrote: dm_control's pendulum, whose file stays as it is.

Its pole stands on its hinge and falls over. Two sites make a magnet of its bob and put another
beside it: the pole stays up there, leaning, where the magnets' torque balances gravity's.
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
"""on the pole, which has all its mass there (m)"""
MAGNET = (0.3, 0, 1.1)
"""in the world (m)"""
MOMENT = 100.0
"""of each, along z (A m^2)"""
START = 0.5
"""angle from the upright, in radians, from where the pole is let go"""


def load(magnetized: bool = True) -> mujoco.MjModel:
    with as_file(files("dm_control") / "suite") as folder:
        spec = mujoco.MjSpec.from_file(str(folder / "pendulum.xml"))
    if magnetized:
        spec.body("pole").add_site(name="bob", pos=BOB, userdata=[MOMENT])
        spec.worldbody.add_site(name="magnet", pos=MAGNET, userdata=[MOMENT])
    return spec.compile()


def swing(model: mujoco.MjModel, duration: float) -> tuple[Array, Array]:
    """Times (s) and the pole's angles from the upright (radians), let go from rest at START."""
    data = mujoco.MjData(model)
    data.qpos[0] = START
    path = np.empty((round(duration / model.opt.timestep) + 1, 2))
    for row in path:
        row[:] = data.time, data.qpos[0]
        mujoco.mj_step(model, data)
    return path[:, 0], path[:, 1]


def torque(model: mujoco.MjModel, angle: float) -> float:
    """About the hinge, in N m, on the pole at rest: by the formula of two dipoles, and gravity."""
    direction = np.array([np.sin(angle), 0, np.cos(angle)])
    arm = BOB[2] * direction
    bob = model.body("pole").pos + arm
    force, couple = mm.dipoles.wrench(bob, MOMENT * direction, [MAGNET], [[0, 0, MOMENT]])
    weight = model.body("pole").mass[0] * model.opt.gravity
    return float((np.cross(arm, force + weight) + couple)[1])


def equilibrium(model: mujoco.MjModel) -> float:
    """Where the torque vanishes beside the magnet, in radians from the upright."""
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
    axes.axhline(np.degrees(expected), color="k", linestyle=":", label="theory: no torque")
    axes.set(
        xlabel="t (s)", ylabel="angle from the upright (degrees)", title="dm_control's pendulum"
    )
    axes.legend(loc="upper right")
    save(figure, out)


if __name__ == "__main__":
    run(main)
