"""Checksums of runs by every kind of compiled code, as JSON; `test_bits` compares processors."""

import json
import sys
import time
import zlib
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
import xarray as xr

import magmotor as mm

CHAIN = """
<mujoco><size nuser_body="6" nuserdata="5" nuser_site="1" nuser_jnt="2"/><option gravity="0 0 0"/>
<worldbody><site name="fixed" pos="0.4 0 0.1" user="3"/>
<body name="wheel" user="0 0 0 0 0 0.1"><joint type="hinge" axis="0 0 1" damping="0.2"
 user="0.3 0.1"/><geom size="0.1" contype="0" conaffinity="0"/>
<site name="a" pos="0.1 0 0" user="2"/><site name="b" pos="-0.1 0 0.02" user="1"/></body>
<body name="stone" pos="0 0.5 0" user="0 0 0 0 0 0"><joint type="ball" damping="0.01"/>
<inertial pos="0 0 0" mass="1" diaginertia="0.01 0.02 0.025"/>
<site name="c" pos="0 0 0.1" user="2"/></body></worldbody></mujoco>
"""


def checksum(result: xr.Dataset | np.ndarray) -> int:
    """Of all numbers."""
    arrays = [result] if isinstance(result, np.ndarray) else [v.values for v in result.values()]
    return zlib.crc32(b"".join(array.tobytes() for array in arrays if array.dtype.kind in "fiu"))


def simulated(scene: Any, method: str, **arguments: Any) -> Callable[[], xr.Dataset]:
    timestep = 0.002 if isinstance(scene, mm.Top) else 0.04
    numerics = {"timestep": timestep, "duration": 300 * timestep, "record_interval": 100}
    return lambda: mm.simulate(scene, method=method, **{**numerics, **arguments})


def own_model() -> np.ndarray:
    """A wheel with a potential and a stone of three moments of inertia, by the thermostat."""
    model = mujoco.MjModel.from_xml_string(CHAIN)
    model.opt.timestep = 0.01
    data = mujoco.MjData(model)
    mm.Baoab(model).step(data, 300)
    return np.concatenate([data.qpos, data.qvel])


def dipoles() -> np.ndarray:
    """Fields of 1 to 17 dipoles, so that every remainder of eight comes."""
    numbers = np.random.default_rng(1).normal(size=(3, 17, 3))
    points, places, moments = numbers
    fields = [mm.dipoles.field(points, places[:n], moments[:n]) for n in range(1, 18)]
    return np.stack([*fields, *mm.dipoles.wrench(points, moments, places + 0.1, moments)])


TOP = mm.Top(axis=(0.1, 0.2, 0.9), spin=1.0, tilt_azimuth=0.3)
QUIET = mm.Motor(alpha_ball=0.0, alpha_ring=0.0, velocity=(0.01, 0.02))
DISK = mm.Disk(potential=((1.0, 0.2), (0.4, 0.0)), friction_ratio=0.5)

CASES: dict[str, Callable[[], xr.Dataset | np.ndarray]] = {
    "dipoles": dipoles,
    "noise": lambda: mm.noise.BrownianPath(7, 0.1).refined(4).increments(1000),
    "gibbs": lambda: mm.gibbs(DISK, 1000)["x"],
    "disk": simulated(DISK, "variational/baoab", replicas=3),
    "disk in scipy": simulated(
        mm.Disk(noise=0.0, v=1.0), "scipy/dop853", duration=0.4, record_interval=10
    ),
    "ensemble": lambda: mm.ensemble(
        DISK, method="variational/baoab", timestep=0.04, duration=40.0, replicas=37
    ),
    "top, euler": simulated(TOP, "variational/euler"),
    "top": simulated(TOP, "variational/baoab"),
    "motor": simulated(mm.Motor(), "variational/baoab", replicas=2),
    "top in mujoco": simulated(TOP, "mujoco/rk4"),
    "motor in mujoco": simulated(mm.Motor(), "mujoco/euler", replicas=2),
    "disk in mujoco": simulated(DISK, "mujoco/euler", replicas=2),
    "top in scipy": simulated(TOP, "scipy/dop853", duration=0.02, record_interval=5),
    "motor in scipy": simulated(QUIET, "scipy/dop853", duration=0.4, record_interval=5),
    "motor, mujoco/baoab": simulated(mm.Motor(), "mujoco/baoab", replicas=2),
    "own model": own_model,
}

if __name__ == "__main__":
    told = {}
    for name in sys.argv[1:] or CASES:
        begin = time.process_time()
        told[name] = checksum(CASES[name]())
        print(f"{name}: {time.process_time() - begin:.1f} s", file=sys.stderr)
    print(json.dumps(told))
