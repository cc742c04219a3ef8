"""Reproduce the paper's figures of its seven motors, print the numbers, and draw an overview.

Three motors have noise on the inner ring only (nonuniform temperature) and end when it tips over;
four have a uniform temperature. The paper does not state its durations; the default is long enough
for flights.

Files in the folder `out`: `motor_RUN.nc` (the runs, with about one record per second; vectors are
in single precision, and the attributes suffice to reproduce a run bit for bit), `motor.png` (an
overview of the run with the longest flight) and `motor_FIGURE.png`: energy, injected, path, xy,
theta.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

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
from magmotor.common.checks import check_choice, check_number
from magmotor.devices.motor.scene import PAPER
from magmotor.noise import check_seed
from paper.motor.pictures import FIGURES, motor_figure
from paper.motor.runs import METHOD, RECORDS, simulate_run
from paper.options import parse_fields


@dataclass
class Options(PictureOptions):
    runs: tuple[str, ...] = tuple(PAPER)
    """which of the paper's runs"""
    method: str = METHOD
    """engine/scheme"""
    timestep: float = 0.1
    """timestep (s)"""
    duration: float = 1e5
    """duration of the run (s)"""
    seed: int = 0
    """seed of the Brownian paths"""
    checkpoint: Path | None = None
    """folder for checkpoints, from which the same command resumes; by default that of --out"""
    out: Path = Path("out")
    """folder to write to"""

    @property
    def record_interval(self) -> int:
        return max(1, round(1 / self.timestep))

    def checkpoint_of(self, name: str) -> Path:
        return (self.checkpoint or self.out) / f"motor_{name}.checkpoint"


def main() -> None:
    warn_in_one_line()
    began = time.perf_counter()
    names = ("ball_ring_factor", "coupling")
    motor, options = parse_fields(mm.Motor(), names, Options, __doc__ or "")
    try:
        check(options)
        for folder in (options.checkpoint or options.out, options.out):
            make_folder(folder)
        print(*announcement(options), sep="\n", flush=True)
        runs = [
            simulate(name, mm.Motor.paper(name, **{k: getattr(motor, k) for k in names}), options)
            for name in options.runs
        ]
    except ValueError as error:
        hint = "; finish that run, or delete the file" if "checkpoint" in str(error) else ""
        fail(f"{error}{hint}", MISTAKE)
    draw(runs, options)
    for name in options.runs:
        options.checkpoint_of(name).unlink(missing_ok=True)
    print(f"wall time: {time.perf_counter() - began:.0f} s")


def check(options: Options) -> None:
    for name in options.runs:
        check_choice("runs", name, tuple(PAPER))
    check_number("timestep", options.timestep, above=0, unit="s")
    least = RECORDS * options.record_interval * options.timestep
    check_number("duration", options.duration, at_least=least, unit=f"s, {RECORDS} records")
    check_seed(options.seed)
    options.check_pictures()


def announcement(options: Options) -> Iterator[str]:
    steps = len(options.runs) * options.duration / options.timestep
    yield (
        f"{len(options.runs)} runs by {options.method}: T = {options.duration:g} s,"
        f" h = {options.timestep:g} s, {steps:.1g} steps; the first run also compiles the kernels"
    )
    yield "± is one standard error; in a flight the ball circles at least once without reversing"
    yield "efficiencies are medians over the second half, since a tipping ring distorts the end"
    yield "rolling and spin are so slow that the errors of their temperatures are rough estimates"


def simulate(name: str, scene: mm.Motor, options: Options) -> mm.plots.MotorRun:
    checkpoint = options.checkpoint_of(name)
    try:
        run = simulate_run(
            name,
            scene,
            method=options.method,
            timestep=options.timestep,
            duration=options.duration,
            record_interval=options.record_interval,
            seed=len(PAPER) * options.seed + PAPER[name][2],
            checkpoint=checkpoint,
        )
    except mm.SimulationStopped as stop:
        fail(f"{name}: {stop}", DIVERGED)
    except mm.SimulationInterrupted as stop:
        before = options.runs[: options.runs.index(name)]
        done = ", ".join(f"motor_{run}.nc" for run in before) or "nothing"
        fail(
            f"{name}: interrupted at t = {stop.time:g} s; the same command resumes from"
            f" {checkpoint}; written: {done}",
            INTERRUPTED,
        )
    save(run.data, options.out / f"motor_{name}.nc")
    print(*summary(run), sep="\n", flush=True)
    return run


def save(data: xr.Dataset, path: Path) -> None:
    encoding = {
        name: {"zlib": True, "complevel": 1, "dtype": "float32" if values.ndim > 1 else "float64"}
        for name, values in data.data_vars.items()
    }
    write_netcdf(data, path, encoding)


def summary(run: mm.plots.MotorRun) -> Iterator[str]:
    scene, stopped = run.scene, run.data.attrs.get("stopped")
    uniform = scene.temperature == "uniform"
    kT = f", kT = {scene.kT:.3g} J" if uniform else ""
    yield f"{run.name}: alpha = {scene.noises[-1]:g}{kT}; {run.flights_in_words}; {mean_dwell(run)}"
    if stopped:
        yield f"  ended {stopped}"
    balance = run.balance.isel(time=-1)
    ratios = mm.observables.efficiency(run.data, scene).isel(time=run.data.time > run.middle)
    yield (
        f"  energy: work of the noise {float(balance.work):.3g} J (expected mean:"
        f" {float(balance.injected):.3g} J), heat {float(balance.heat):.3g} J, residual"
        f" {run.residual:.1e} of the mean work; efficiency {float(ratios.efficiency.median()):.2g},"
        f" including the ball's heat {float(ratios.share.median()):.2g}"
    )
    if uniform:
        found = run.temperatures / scene.kT
        values = zip(found.mode.values, found.temperature, found.temperature_error, strict=True)
        shown = ", ".join(f"{mode} {float(t):.3f} ± {float(e):.3f}" for mode, t, e in values)
        yield f"  temperatures over kT, second half: {shown}"


def mean_dwell(run: mm.plots.MotorRun) -> str:
    found = run.dwell_times
    mean = mm.observables.censored_mean(found.end - found.begin, found.censored)
    return (
        f"mean dwell time {mean.mean:.0f} ± {mean.error:.0f} s" if mean.completed else "one dwell"
    )


def draw(runs: list[mm.plots.MotorRun], options: Options) -> None:
    out, suffix = options.out, options.pictures
    shown = max(runs, key=lambda run: (run.scene.temperature == "uniform", run.longest_turns))
    others = [run for run in runs if run is not shown]
    written = options.draw(out / "motor", partial(mm.plots.motor_overview, shown, others=others))
    for name in FIGURES:
        options.draw(out / f"motor_{name}", partial(motor_figure, runs, name))
    print(f"wrote {written}, {out}/motor_{{{','.join(FIGURES)}}}.{suffix} and motor_RUN.nc")
