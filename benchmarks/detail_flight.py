"""Flights of Hamel's top in any model of it, against the paper's ODE."""

import copy
import math
import time
from functools import cache
from typing import NamedTuple

import mujoco
import numpy as np
import xarray as xr
from numpy.typing import NDArray

import magmotor as mm

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
    position, momentum, wall = [], [], 0.0
    for n in range(1, round(duration / INTERVAL) + 1):
        begin = time.perf_counter()
        mujoco.mj_step(model, data, nstep=round(INTERVAL / timestep))
        wall += time.perf_counter() - begin
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
