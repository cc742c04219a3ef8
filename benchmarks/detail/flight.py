"""Runs of Hamel's top in any model, compared with the paper's ODE; and a plain model of it."""

import copy
import math
from functools import cache, partial
from typing import NamedTuple

import mujoco
import numpy as np
import xarray as xr
from numpy.typing import NDArray

import magmotor as mm
from benchmarks.accuracy.top import largest_error
from benchmarks.harness.timing import seconds_of

Array = NDArray[np.float64]
DURATION, INTERVAL = 60.0, 0.1
"""Duration and record interval of a run, in seconds; the interval is a multiple of the step."""

DEFAULT_TIMESTEP = 0.002
"""MuJoCo's default, in seconds."""

RK4, EULER = mujoco.mjtIntegrator.mjINT_RK4, mujoco.mjtIntegrator.mjINT_EULER


class Flight(NamedTuple):
    position: Array
    """In m, shape (T, 2)."""
    momentum: Array
    """J in kg m^2/s, shape (T,)."""
    seconds: float
    """Wall time per simulated second."""


def fly(
    model: mujoco.MjModel,
    scene: mm.Top,
    timestep: float = DEFAULT_TIMESTEP,
    integrator: mujoco.mjtIntegrator = RK4,
    duration: float = DURATION,
) -> Flight:
    """Run with the callback that is installed.

    Raises ArithmeticError if the ball is lost.
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
    """Solve the paper's ODE by DOP853, from the first record on."""
    run = mm.simulate(scene, method="scipy/dop853", timestep=INTERVAL, duration=DURATION)
    return run.isel(time=slice(1, None))


def momentum_error(momentum: Array, scene: mm.Top) -> float:
    """Return the largest error of J at the records, over the largest |J|."""
    true = truth(scene).momentum_map.values
    return largest_error(momentum, true[: len(momentum)], true)


def position_error(position: Array, scene: mm.Top) -> float:
    """Return the largest error of the position, in m."""
    true = truth(scene).position.values[: len(position), :2]
    return float(np.linalg.norm(position - true, axis=1).max())


def plain_top(scene: mm.Top, option: str = "", geom: str = "") -> mujoco.MjModel:
    """Build Hamel's top with MuJoCo's default options and contacts.

    A free ball lies on a floor, under dipoles; `option` and `geom` are MJCF attributes.
    """
    ring = "".join(
        f'<site pos="{_text(place)}" zaxis="{_text(moment)}" user="{scene.moment}"/>'
        for place, moment in zip(*scene.ring_sources(), strict=True)
    )
    return mujoco.MjModel.from_xml_string(f"""
<mujoco>
  <custom><text name="magmotor" data="dipoles"/></custom>
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
