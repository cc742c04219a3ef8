"""Reproduce the paper's figures of its sliding disks, with theory, and print the numbers.

Three systems are disks on different potentials, and the fourth is a control particle.

Each system runs twice: from rest, as in the paper, and from its stationary state, for the
correlation of increments "for t large" and the flights. With flat U the stationary state has
d = -v + sigma omega = 0, as at rest, since nothing changes d there.

The large ensembles come from a reference integrator, which is much faster than MuJoCo.
MuJoCo simulates fewer replicas of the disks, which the figures show on top, in white. It has no
model of the control particle.

Files in the folder `out`: `disk_SYSTEM.nc` and `disk_SYSTEM_stationary.nc` (the ensembles),
`disk_mujoco_SYSTEM.nc` and `disk_mujoco_SYSTEM_stationary.nc` (MuJoCo's), `disk.png` (an overview)
and `disk_FIGURE.png`: mean, mean_square, msd, slope, correlation, diffusion, histogram, flights.
"""

import os
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import xarray as xr

import magmotor as mm
from magmotor.commands.output import (
    DIVERGED,
    INTERRUPTED,
    MISTAKE,
    fail,
    make_folder,
    warn_in_one_line,
    write_netcdf,
)
from magmotor.commands.picture_options import PictureOptions
from magmotor.common.checks import check_choice, check_integer, check_number
from magmotor.noise import check_seed
from paper.disk.pictures import FIGURES, disk_figure, disk_overview
from paper.disk.system import System
from paper.disk.systems import BESIDE, FULL, Scene, disk_scenes, simulate_system
from paper.options import parse_fields

RATES = {"variational": 3e8, "mujoco": 2.5e6}
"""Approximate number of trajectory-steps per second and core, by engine."""

WEAK = 0.1
"""The theory of the disk on a potential requires beta U well below this."""


@dataclass
class Options(PictureOptions):
    duration: float | None = None
    """duration T of each run, dimensionless; by default 5000, with --full 50000"""
    replicas: int | None = None
    """number of replicas of each system; by default 8192, with --full 10000"""
    timestep: float = 0.01
    """timestep h, dimensionless; by default the paper's"""
    method: str = FULL["method"]
    """the paper's, or for example variational/baoab, which has weak order two"""
    mujoco_replicas: int = BESIDE["replicas"]
    """number of replicas of each disk that MuJoCo simulates, by mujoco/baoab"""
    seed: int = 0
    """seed of the Brownian paths"""
    full: bool = False
    """use the paper's T = 50000, and 10000 replicas: 12 times as many steps"""
    threads: int | None = None
    """number of threads; by default, one per processor"""
    checkpoint: Path | None = None
    """folder for checkpoints, from which the same command resumes; by default that of --out"""
    out: Path = Path("out")
    """folder to write to"""


@dataclass
class Plan:
    """Settings that all ensembles share, and their running cost."""

    numerics: dict[str, Any]
    mujoco: dict[str, Any]
    checkpoints: Path
    out: Path
    steps: float = 0.0
    seconds: float = 0.0
    resumable: list[Path] = field(default_factory=list)


def main() -> None:
    warn_in_one_line()
    began = time.perf_counter()
    disk, options = parse_fields(mm.Disk(), ("sigma", "friction", "noise"), Options, __doc__ or "")
    try:
        check_choice("method", options.method, mm.methods(disk))
        plan = plan_of(options)
        for folder in (plan.checkpoints, plan.out):
            make_folder(folder)
        print(*announcement(plan, disk), sep="\n", flush=True)
        systems, mujoco = (
            [
                simulate(plan, numerics, name, scene, 16 * options.seed + first + 2 * number)
                for number, (name, scene) in enumerate(disk_scenes(disk).items())
                if numerics["method"] in mm.methods(scene)
            ]
            for numerics, first in ((plan.numerics, 0), (plan.mujoco, 8))  # all are independent
        )
    except ValueError as error:
        hint = "; finish that run, or delete the file" if "checkpoint" in str(error) else ""
        fail(f"{error}{hint}", MISTAKE)
    draw(systems, mujoco, options)
    for path in plan.resumable:
        path.unlink(missing_ok=True)
    rate = f" at {plan.steps / plan.seconds:.1e} trajectory-steps/s" if plan.steps else ""
    total = time.perf_counter() - began
    print(f"wall time: {total:.0f} s, including {plan.seconds:.0f} s for ensembles{rate}")


def plan_of(options: Options) -> Plan:
    full = FULL["duration"], 2 * FULL["replicas"]
    duration, replicas = full if options.full else (5000.0, 8192)
    numerics: dict[str, Any] = {
        "method": options.method,
        "timestep": options.timestep,
        "duration": duration if options.duration is None else options.duration,
        "replicas": replicas if options.replicas is None else options.replicas,
        "threads": options.threads,
    }
    check_number("timestep", numerics["timestep"], above=0)
    # A shorter run would have too few lags in its second half.
    check_number("duration", numerics["duration"], at_least=20 * max(1, options.timestep))
    check_integer("replicas", numerics["replicas"], at_least=2)  # for a standard error
    check_seed(options.seed)
    options.check_pictures()
    if options.threads is not None:
        check_integer("threads", options.threads, at_least=1)
    check_integer("mujoco_replicas", options.mujoco_replicas, at_least=2)
    mujoco = BESIDE | {"duration": numerics["duration"], "replicas": options.mujoco_replicas}
    return Plan(numerics, mujoco, options.checkpoint or options.out, options.out)


def announcement(plan: Plan, disk: mm.Disk) -> Iterator[str]:
    duration, timestep, replicas = (
        plan.numerics[name] for name in ("duration", "timestep", "replicas")
    )
    cores = min(plan.numerics["threads"] or os.cpu_count() or 1, os.cpu_count() or 1)
    seconds = sum(
        2 * count * _steps(numerics) / RATES[numerics["method"].split("/")[0]] / cores
        for count, numerics in ((4, plan.numerics), (3, plan.mujoco))
    )
    yield (
        f"four systems, from rest and stationary: T = {duration:g}, h = {timestep:g},"
        f" {replicas} replicas each by {plan.numerics['method']}, and of the three disks"
        f" {plan.mujoco['replicas']} by {plan.mujoco['method']} at h = {plan.mujoco['timestep']:g}"
    )
    yield (
        f"{8 * _steps(plan.numerics):.1e} trajectory-steps and {6 * _steps(plan.mujoco):.1e} by"
        f" MuJoCo, about {_duration(seconds)} in all; the first run also compiles the kernels"
    )
    yield (
        "± is one standard error over the replicas, for a Gaussian mean square"
        f" {100 * (2 / replicas) ** 0.5:.1f} %; the figures show two"
    )
    if disk.beta > WEAK:
        yield f"beta = {disk.beta:.2g}: the theory, for beta U << 1, does not apply here"


def _steps(numerics: dict[str, Any]) -> float:
    return numerics["replicas"] * numerics["duration"] / numerics["timestep"]


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} minutes"


def simulate(plan: Plan, numerics: dict[str, Any], name: str, scene: Scene, seed: int) -> System:
    kind = "mujoco_" if numerics is plan.mujoco else ""

    def ensemble(suffix: str, scene: Scene, **special: Any) -> xr.Dataset:
        return run(plan, f"disk_{kind}{name}{suffix}", scene, **numerics, **special)

    duration, replicas = numerics["duration"], numerics["replicas"]
    system = simulate_system(ensemble, name, scene, duration=duration, replicas=replicas, seed=seed)
    print(*summary(system), sep="\n", flush=True)
    return system


def run(plan: Plan, stem: str, scene: Scene, **arguments: Any) -> xr.Dataset:
    checkpoint = plan.checkpoints / f"{stem}.checkpoint"
    resumed = checkpoint.exists()
    plan.resumable.append(checkpoint)
    began = time.perf_counter()
    try:
        data = mm.ensemble(scene, checkpoint=checkpoint, **arguments)
    except mm.SimulationStopped as stop:
        fail(f"{stem}: {stop}", DIVERGED)
    except mm.SimulationInterrupted as stop:
        done = ", ".join(f"{path.stem}.nc" for path in plan.resumable[:-1]) or "nothing"
        fail(
            f"{stem}: interrupted at t = {stop.time:g}; the same command resumes from {checkpoint};"
            f" written: {done}",
            INTERRUPTED,
        )
    spent = time.perf_counter() - began
    if not resumed and arguments["method"] == plan.numerics["method"]:
        plan.steps += _steps(arguments)
        plan.seconds += spent
    write_netcdf(data, plan.out / f"{stem}.nc")
    return data


def summary(system: System) -> Iterator[str]:
    t, theory, slope = system.end, system.theory, system.last_slope
    square, error = system.x("mean_square")[-1], system.x("mean_square_error")[-1]
    method = system.rest.attrs["method"]
    yield (
        f"{system.name} ({method}): E x² = {square:.4g} ± {error:.2g} (theory:"
        f" {theory.mean_square(t):.4g}), slope over t = {slope.begin:g} to {slope.end:g}:"
        f" {slope.slope:.3f} ± {slope.error:.3f} (theory: {slope.expected:.3f})"
    )
    scene = theory.scene
    if not isinstance(scene, mm.Disk):
        return
    rate, error = system.rate("y")
    both = mm.theory.flat_variance_from_rest(scene, t, (1, 1)) / t
    yield (
        f"  var(x + theta)/t = {rate:.4g} ± {error:.2g} (theory: {both:.4g}, in the limit"
        f" {mm.theory.y_diffusion(scene):.4g})"
    )
    if not scene.coefficients:
        rate, error = system.rate("x")
        yield (
            f"  var(x)/t = {rate:.4g} ± {error:.2g}"
            f" (theory: {theory.variance(t) / t:.4g}, in the limit"
            f" {mm.theory.flat_x_diffusion(scene):.4g})"
        )


def draw(systems: list[System], mujoco: list[System], options: Options) -> None:
    out, suffix = options.out, options.pictures
    overview = partial(disk_overview, systems, beside=mujoco)
    written = options.draw(out / "disk", overview)
    for name in FIGURES:
        options.draw(out / f"disk_{name}", partial(disk_figure, systems, name, beside=mujoco))
    print(f"wrote {written}, {out}/disk_{{{','.join(FIGURES)}}}.{suffix} and disk_*.nc")
