"""Checksums of runs by every kind of compiled code, and processors to compile it for.

`python -m trials.bits --record` writes those of all processors to `bits.json`, if they agree;
`python -m trials.bits [CASE ...]` prints those of this process as JSON.
"""

import argparse
import json
import os
import platform
import subprocess
import sys
import zlib
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import mujoco
import numpy as np
import xarray as xr

import magmotor as mm
from magmotor.noise import normal
from magmotor.sweep import Samples, Sweep

RECORD = Path(__file__).with_suffix(".json")

FOUND = np.show_config(mode="dicts")["SIMD Extensions"]["found"]  # type: ignore[index]
WIDE = [name for name in FOUND if "512" in name or name == "X86_V4"]
NARROW = {
    "NPY_DISABLE_CPU_FEATURES": " ".join(WIDE),
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX512F,-AVX512VL,-AVX512BW,-AVX512DQ,-AVX512CD",
}
PROCESSORS = {
    "haswell": {"OPENBLAS_CORETYPE": "Haswell", **NARROW},
    "znver3": {"OPENBLAS_CORETYPE": "Zen", **NARROW},
    "skylake-avx512": {"OPENBLAS_CORETYPE": "SkylakeX"},
}
"""Settings that make Numba, NumPy, OpenBLAS and the C library use other processors' code."""

MODEL = """
<mujoco><size nuser_body="6" nuserdata="5" nuser_site="1" nuser_jnt="2"/><option gravity="0 0 0"/>
<custom><text name="magmotor" data="all"/></custom>
<worldbody><site name="fixed" pos="0.4 0 0.1" user="3"/>
<body name="wheel" user="0 0 0 0 0 0.1"><joint type="hinge" axis="0 0 1" damping="0.2"
 user="0.3 0.1"/><geom size="0.1" contype="0" conaffinity="0"/>
<site name="a" pos="0.1 0 0" user="2"/><site name="b" pos="-0.1 0 0.02" user="1"/></body>
<body name="stone" pos="0 0.5 0"><joint type="ball" damping="0.01"/>
<inertial pos="0 0 0" mass="1" diaginertia="0.01 0.02 0.025"/>
<site name="c" pos="0 0 0.1" user="2"/></body></worldbody></mujoco>
"""
"""A wheel in a potential, and a stone with three different moments of inertia."""

TOP = mm.Top(axis=(0.1, 0.2, 0.9), spin=1.0, tilt_azimuth=0.3)
DISK = mm.Disk(potential=((1.0, 0.2), (0.4, 0.0)), friction_ratio=0.5)

Result = xr.Dataset | np.ndarray


def simulated(scene: Any, method: str, **arguments: Any) -> Callable[[], Result]:
    timestep = 0.002 if isinstance(scene, mm.Top) else 0.04
    numerics = {"timestep": timestep, "duration": 300 * timestep, "record_interval": 100}
    return lambda: mm.simulate(scene, method=method, **{**numerics, **arguments})


def own_model() -> Result:
    model = mujoco.MjModel.from_xml_string(MODEL)
    model.opt.timestep = 0.01
    data = mujoco.MjData(model)
    mm.Langevin(model).step(data, 300)
    return np.concatenate([data.qpos, data.qvel])


def many_magnets() -> Result:
    """Wrenches of free magnets, exact and within a tolerance that clusters need."""
    rng = np.random.default_rng(2)
    body = '<body><freejoint/><geom size="0.01"/><site user="1"/></body>' * 1000
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><option timestep="1e-5"><flag contact="disable"/></option><custom>
        <text name="magmotor" data="dipoles"/><numeric name="magnetic_tolerance" data="0"/>
        </custom><worldbody>{body}</worldbody></mujoco>"""
    )
    data, found = mujoco.MjData(model), []
    data.qpos[:] = rng.uniform(-1, 1, model.nq)
    data.qpos[2::7] *= 0.01  # a sheet
    with mm.magnetism():
        for tolerance in (0.0, 0.01):
            model.numeric("magnetic_tolerance").data[:] = tolerance
            mujoco.mj_forward(model, data)
            found.append(data.xfrc_applied.copy())
    assert not np.array_equal(*found)
    return np.stack(found)


def dipoles() -> Result:
    """Sums over 1 to 17 sources, which include every remainder of eight."""
    points, places, moments = np.random.default_rng(1).normal(size=(3, 17, 3))
    fields = [mm.dipoles.field(points, places[:n], moments[:n]) for n in range(1, 18)]
    return np.stack([*fields, *mm.dipoles.wrench(points, moments, places + 0.1, moments)])


def sampled() -> Result:
    """Keys of the cases of a sweep over a hundred points, uniform in the logarithm."""
    ranges = {"noise": (0.1, 4.0, True), "friction": (1e-3, 0.7, True)}
    numerics = {"method": "variational/baoab", "timestep": 0.05, "duration": 1.0, "versions": {}}
    samples = Samples(ranges, 100, "random", seed=1)
    cases = Sweep(scene=DISK, measure=["temperature"], samples=samples, **numerics)
    return np.array([int(case.key[:15], 16) for case in cases])


def noise() -> Result:
    return np.array(
        [normal(7, 1, step, 0, *view) for step in range(200) for view in ((1, 0), (1, 3), (3, 0))]
    )


QUICK: dict[str, Callable[[], Result]] = {
    "dipoles": dipoles,
    "noise": noise,
    "sampled": sampled,
    "gibbs": lambda: mm.theory.gibbs(DISK, 1000)["x"],
    "disk": simulated(DISK, "variational/baoab", replicas=3),
    "particle": simulated(mm.LangevinParticle(), "variational/baoab", replicas=3),
    "ensemble": lambda: mm.ensemble(
        DISK, method="variational/baoab", timestep=0.04, duration=40.0, replicas=37
    ),
    "motor": simulated(mm.Motor(), "variational/baoab", replicas=2),
    "top, variational/baoab": simulated(TOP, "variational/baoab"),
}
SLOW: dict[str, Callable[[], Result]] = {
    **{
        f"top, {method}": simulated(TOP, method)
        for method in mm.methods(TOP)
        if method not in ("variational/baoab", "scipy/dop853")
    },
    "motor in mujoco": simulated(mm.Motor(), "mujoco/euler", replicas=2),
    "disk in mujoco": simulated(DISK, "mujoco/euler", replicas=2),
    "motor, mujoco/baoab": simulated(mm.Motor(), "mujoco/baoab", replicas=2),
    "own model": own_model,
    "many magnets": many_magnets,
}
"""Cases whose code takes long to compile."""

CASES = {**QUICK, **SLOW}
SUMS = ("dipoles", "gibbs", "disk", "ensemble", "top, variational/baoab", "motor")
"""Quick cases that add in eights, draw noise or call NumPy, and so cover the others' code."""


def checksum(result: Result) -> int:
    """Checksum of all numbers."""
    arrays = (
        [result]
        if isinstance(result, np.ndarray)
        else [v.values for v in result.variables.values()]
    )
    return zlib.crc32(b"".join(array.tobytes() for array in arrays if array.dtype.kind in "fiu"))


def checksums(*names: str) -> dict[str, int]:
    return {name: checksum(CASES[name]()) for name in names}


def start(processor: str, *names: str) -> subprocess.Popen:
    """Start a process that prints the checksums of cases, by Numba's code for another processor.

    In Numba's cache this code has indexes of its own, see `magmotor.numerics.numba_cache`.
    """
    target = {"NUMBA_CPU_NAME": processor, "NUMBA_CPU_FEATURES": "", "MAGMOTOR_LIBRARY": "0"}
    return subprocess.Popen(
        [sys.executable, "-m", "trials.bits", *names],
        cwd=RECORD.parents[1],
        env={**os.environ, **PROCESSORS[processor], **target},
        stdout=subprocess.PIPE,
        text=True,
    )


def finish(process: subprocess.Popen) -> dict[str, int]:
    said, _ = process.communicate()
    assert process.returncode == 0
    return json.loads(said)


def runs_here(processor: str) -> bool:
    """Whether this machine can run code for a processor."""
    needed = ["fma", "avx2"] + (["avx512f", "avx512vl"] if "512" in processor else [])
    features = llvm.get_host_cpu_features()
    return platform.machine() == "x86_64" and all(features.get(name) for name in needed)


def versions() -> dict[str, str]:
    """Versions of everything that affects the bits, except magmotor itself."""
    names = ("llvmlite", "mujoco", "numba", "numpy", "scipy")
    return {name: version(name) for name in names} | {"libc": " ".join(platform.libc_ver())}


def record() -> None:
    started = {name: start(name, *CASES) for name in PROCESSORS if runs_here(name)}
    found = {name: finish(process) for name, process in started.items()}
    own = checksums(*CASES)
    for name, theirs in found.items():
        differ = [case for case in CASES if theirs[case] != own[case]]
        print(f"{name}: {len(theirs)} checksums, {len(differ)} differ from this machine's", *differ)
    if all(theirs == own for theirs in found.values()):
        RECORD.write_text(json.dumps({"versions": versions(), "checksums": own}, indent=1) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", nargs="*", metavar="CASE", help=f"of {'; '.join(CASES)}")
    parser.add_argument("--record", action="store_true", help="for all processors, to bits.json")
    options = parser.parse_args()
    for name in options.cases:
        if name not in CASES:
            parser.error(f"unknown case {name!r}: known are {'; '.join(CASES)}")
    if options.record:
        record()
    else:
        print(json.dumps(checksums(*(options.cases or CASES))))


if __name__ == "__main__":
    main()
