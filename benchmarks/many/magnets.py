"""Free magnets in a box or in a sheet, and the times of their forces and steps."""

import ctypes
from collections.abc import Callable
from functools import cache

import mujoco
import numpy as np
from numba import njit

import magmotor as mm
from benchmarks.harness.records import Record
from benchmarks.harness.timing import in_turns, seconds_of
from magmotor.dipoles import pack_sources, sum_over_sources

SPACING = 0.05
"""Distance (m) of neighbors in a grid, from which each magnet is displaced by up to a quarter."""

TOLERANCE = 1e-3
THREADS = 1
"""Threads in MuJoCo's pool, besides the one that steps."""

PROTOTYPE = ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_int64)


def places(count: int, dimensions: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions and orientations of magnets in a box (3) or in a sheet (2)."""
    rng = np.random.default_rng(count)
    side = int(np.ceil(count ** (1 / dimensions)))
    points = np.zeros((side**dimensions, 3))
    axes = np.meshgrid(*[np.arange(side)] * dimensions, indexing="ij")
    points[:, :dimensions] = np.stack(axes, -1).reshape(-1, dimensions)
    points = points[:count] + rng.uniform(-0.25, 0.25, (count, 3))
    return SPACING * points, rng.normal(size=(count, 4))


@cache
def model_of(count: int) -> mujoco.MjModel:
    """Free bodies with a dipole of 0.1 A m^2 each, without contacts."""
    body = '<body><freejoint/><geom size="0.005" mass="1e-3"/><site user="0.1"/></body>'
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco><size memory="64M"/>
        <option gravity="0 0 0" timestep="1e-5"><flag contact="disable"/></option>
        <custom><text name="magmotor" data="dipoles"/>
        <numeric name="magnetic_tolerance" data="0"/></custom>
        <worldbody>{body * count}</worldbody></mujoco>"""
    )


def state_of(count: int, dimensions: int) -> mujoco.MjData:
    """Return an mjData with the magnets in their places."""
    data = mujoco.MjData(model_of(count))
    state = data.qpos.reshape(count, 7)
    state[:, :3], state[:, 3:] = places(count, dimensions)
    mujoco.mj_forward(model_of(count), data)
    return data


def dipoles_of(data: mujoco.MjData) -> tuple[np.ndarray, np.ndarray]:
    """Positions and moments."""
    return data.site_xpos, 0.1 * data.site_xmat.reshape(-1, 3, 3)[..., 2]


def times(count: int, turns: int) -> Record:
    """Return the least seconds of forces and of steps by all methods, measured in turns."""
    box, sheet = (state_of(count, dimensions) for dimensions in (3, 2))
    calls = max(1, int(2e6 / count**2))
    steps = max(1, calls // 10)
    with mm.magnetism():
        force = ctypes.cast(mujoco.get_mjcb_control(), PROTOTYPE)

        def forces(data: mujoco.MjData, tolerance: float = 0.0) -> Callable[[], float]:
            model = model_of(count)

            def case() -> float:
                model.numeric("magnetic_tolerance").data[:] = tolerance
                run = (force, model._address, data._address, calls)
                return seconds_of(lambda: _call_often(*run)) / calls

            return case

        def stepped(tolerance: float = 0.0, magnetic: bool = True) -> Callable[[], float]:
            model, data = model_of(count), state_of(count, 3)
            start = data.qpos.copy(), data.qvel.copy()

            def case() -> float:
                model.numeric("magnetic_tolerance").data[:] = tolerance
                model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
                if not magnetic:
                    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
                data.qpos[:], data.qvel[:] = start
                return seconds_of(lambda: mujoco.mj_step(model, data, nstep=steps)) / steps

            return case

        def threaded(data: mujoco.MjData, case: Callable[[], float]) -> Callable[[], float]:
            def run() -> float:
                mujoco.mju_threadpool(data, THREADS)
                try:
                    case()  # wakes the threads up
                    return case()
                finally:
                    mujoco.mju_threadpool(data, 0)

            return run

        cases = {
            "before": _one_loop_each(box, calls),
            "forces": forces(box),
            "forces, 2 threads": threaded(box, forces(box)),
            "forces, box": forces(box, TOLERANCE),
            "forces, sheet": forces(sheet, TOLERANCE),
            "bare step": stepped(magnetic=False),
            "step": stepped(),
            "step, box": stepped(TOLERANCE),
        }
        return {name: min(found) for name, found in in_turns(cases, turns).items()}


def _one_loop_each(data: mujoco.MjData, calls: int) -> Callable[[], float]:
    """Each pair computed twice, in one loop for each dipole, as for fewer than 256 dipoles."""
    sources = pack_sources(*dipoles_of(data))
    sources[6] = np.arange(sources.shape[1])
    found = np.empty((sources.shape[1], 6))
    run = (sources, len(data.site_xpos), found, calls)
    return lambda: seconds_of(lambda: _sum_often(*run)) / calls


@njit
def _call_often(call, model, data, count):
    for _ in range(count):
        call(model, data)


@njit
def _sum_often(sources, count, found, calls):
    for _ in range(calls):
        for i in range(count):
            target = (
                sources[0, i], sources[1, i], sources[2, i],
                sources[3, i], sources[4, i], sources[5, i],
            )  # fmt: skip
            fx, fy, fz, bx, by, bz, _ = sum_over_sources(
                target, sources[6, i], sources, sources.shape[1]
            )
            found[i] = fx, fy, fz, bx, by, bz
