"""Flights of Hamel's top in any model of it, against the paper's ODE; and a plain model of it."""

import copy
import math
from functools import cache, partial
from typing import NamedTuple

import mujoco
import numpy as np
import xarray as xr
from numpy.typing import NDArray

import magmotor as mm
from benchmarks.harness.timing import seconds_of

Array = NDArray[np.float64]
DURATION, INTERVAL = 60.0, 0.1
"""Of a flight, and between what is recorded of it, in seconds; steps divide the interval."""

DEFAULT_TIMESTEP = 0.002
"""MuJoCo's."""

RK4, EULER = mujoco.mjtIntegrator.mjINT_RK4, mujoco.mjtIntegrator.mjINT_EULER


class Flight(NamedTuple):
    position: Array
    """In m, shape (T, 2)."""
    momentum: Array
    """J in kg m^2/s, shape (T,)."""
    seconds: float
    """Wall time of a simulated second."""


def fly(
    model: mujoco.MjModel,
    scene: mm.Top,
    timestep: float = DEFAULT_TIMESTEP,
    integrator: mujoco.mjtIntegrator = RK4,
    duration: float = DURATION,
) -> Flight:
    """Run under whatever callback is installed.

    Raises ArithmeticError, which says when and how, if the ball is lost.
    """
    model = copy.copy(model)
    model.opt.timestep, model.opt.integrator = timestep, integrator
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    data.qvel[-1] = scene.spin
    ball = model.body("ball").id
    steps = partial(mujoco.mj_step, model, data, nstep=round(INTERVAL / timestep))
    position, momentum, wall = [], [], 0.0
    for n in range(1, round(duration / INTERVAL) + 1):
        wall += seconds_of(steps)
        mujoco.mj_kinematics(model, data)
        x, y, z = data.xpos[ball]
        if not (math.isclose(data.time, n * INTERVAL) and abs(z - scene.ball_radius) < 0.01):
            raise ArithmeticError(f"the ball is lost at t = {n * INTERVAL:.1f} s")
        position.append((x, y))
        momentum.append(scene.inertia[2] * data.qvel[-1])
    return Flight(np.array(position), np.array(momentum), wall / duration)


@cache
def truth(scene: mm.Top) -> xr.Dataset:
    """The paper's ODE by DOP853, from the first record on."""
    run = mm.simulate(scene, method="scipy/dop853", timestep=INTERVAL, duration=DURATION)
    return run.isel(time=slice(1, None))


def momentum_error(momentum: Array, scene: mm.Top) -> float:
    """Of J at recorded times from the first on, at the most; over the largest |J| there is."""
    true = truth(scene).momentum_map.values
    return float(np.abs(momentum - true[: len(momentum)]).max() / np.abs(true).max())


def position_error(position: Array, scene: mm.Top) -> float:
    """In m, at the most."""
    true = truth(scene).position.values[: len(position), :2]
    return float(np.linalg.norm(position - true, axis=1).max())


def plain_top(scene: mm.Top, option: str = "", geom: str = "") -> mujoco.MjModel:
    """Hamel's top as one writes it who leaves MuJoCo's options and contacts as they are.

    A free ball on a floor, under dipoles; `option` and `geom` are MJCF attributes of both.
    """
    ring = "".join(
        f'<site pos="{_text(place)}" zaxis="{_text(moment)}" user="{scene.moment}"/>'
        for place, moment in zip(*scene.ring_sources(), strict=True)
    )
    return mujoco.MjModel.from_xml_string(f"""
<mujoco>
  <option {option}/>
  <default>
    <geom {geom}/>
  </default>
  <worldbody>
    <geom type="plane" size="1 1 0.1"/>
    {ring}
    <body name="ball" pos="{_text([*scene.position, scene.ball_radius])}">
      <freejoint/>
      <geom type="sphere" size="{scene.ball_radius}" mass="{scene.ball_mass}"/>
      <site zaxis="{_text(scene.axis)}" user="{scene.moment}"/>
    </body>
  </worldbody>
</mujoco>
""")


def _text(vector) -> str:
    return " ".join(f"{number:.17g}" for number in vector)
