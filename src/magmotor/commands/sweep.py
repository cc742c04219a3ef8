"""Sweep parameters of a scene: run every combination and record a few numbers of each.

Finished cases are kept, so the sweep can be stopped at any time, and the same command resumes it.
A sweep of the top over tilt and height has the folder `out/sweep_top_tilt_ring_height`, with one
file per case. Beside it are a dataset of all of them over the sweep's dimensions, `.nc`, and a
picture, `.png`, if there are one or two dimensions.
"""

import time
from dataclasses import dataclass, field
from functools import partial
from ipaddress import ip_address
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro
import xarray as xr

import magmotor as mm
from magmotor.commands.output import (
    DIVERGED,
    INTERRUPTED,
    MISTAKE,
    fail,
    report,
    warn_in_one_line,
)
from magmotor.commands.picture_options import PictureOptions
from magmotor.commands.scene_options import parse
from magmotor.commands.sweep_movie import film
from magmotor.commands.sweep_run import (
    SHOWN,
    RunOptions,
    beside,
    combined,
    print_plan,
    print_status,
    run,
    write_beside,
)
from magmotor.commands.sweep_text import seeds, varied
from magmotor.sweep import Sweep


@dataclass
class Options(PictureOptions, RunOptions):
    vary: Annotated[list[str], tyro.conf.UseAppendAction] = field(default_factory=list)
    """what varies (repeat for each field): FIELD=START:STOP:COUNT (evenly spaced, including both
    ends), FIELD=START:STOP:COUNT:log, FIELD=VALUE,VALUE,..., or with --design FIELD=LOW:HIGH[:log];
    FIELD,FIELD=... gives several fields equal values; position_x is the x component of position"""
    design: str | None = None
    """KIND:SIZE[:SEED] draws SIZE points in the ranges LOW:HIGH; KIND is random, latin or sobol"""
    seeds: str = "0:1"
    """FIRST:LAST (LAST excluded) or a list; a top has no noise and needs only one"""
    replicas: int | None = None
    """independent runs within a case"""
    measure: str = "max_spin,settling_radius"
    """what to record: names separated by commas, MODULE:FUNCTION for your own, or trajectory for
    the whole run"""
    method: str | None = None
    """engine/scheme; by default the recommended one"""
    timestep: float | None = None
    """timestep (s); by default the shortest one recommended at the corners of the sweep"""
    engine: Literal["mujoco", "any"] = "mujoco"
    """recommend MuJoCo's methods only, or those of any engine"""
    duration: float = 60.0
    """duration of each run (s)"""
    record_interval: int = 1
    """steps between the records of a run"""
    out: Path | None = None
    """folder of the sweep, by default out/sweep_SCENE_FIELDS; dataset and picture are beside it"""
    dry_run: bool = False
    """only print the number of cases, the first ones, the estimated time and size; write nothing"""


@dataclass
class DiskOptions(Options):
    measure: str = "square_displacement"
    duration: float = 1000.0


@dataclass
class MotorOptions(Options):
    measure: str = "flights,slip_temperature"
    duration: float = 10_000.0
    record_interval: int = 10


@dataclass
class Status:
    """Print the progress of the sweep in a folder and the errors of failed cases."""

    folder: tyro.conf.Positional[Path]


@dataclass
class Combine(PictureOptions):
    """Write dataset and picture of the results of a sweep so far."""

    folder: tyro.conf.Positional[Path]
    skip_damaged: bool = False
    """ignore damaged files"""


@dataclass
class Movie:
    """Render a movie of up to 30 tops or motors of a sweep side by side."""

    folder: tyro.conf.Positional[Path]
    speed: float | None = None
    """simulated seconds per second of the movie; by default, it lasts about 20 s"""


@dataclass
class Cluster:
    """Run a Dask cluster on this machine until Ctrl-C."""

    workers: int | None = None
    """number of processes; by default one per core"""
    host: str = "127.0.0.1"
    """interface to listen on; with any other, those who can reach it can run code here"""


def main() -> None:
    warn_in_one_line()
    kinds = {"top": Options, "disk": DiskOptions, "motor": MotorOptions}
    commands = {"status": Status, "combine": Combine, "movie": Movie, "cluster": Cluster}
    scene, options = parse({**kinds, **commands}, __doc__ or "", (*kinds, *commands))
    try:
        match options:
            case Status():
                print_status(options.folder)
            case Combine():
                options.check_pictures()
                data = mm.sweep.combine(options.folder, skip_damaged=options.skip_damaged)
                if any(variable.isnull().any() for variable in data.values()):
                    print_status(options.folder, SHOWN)
                draw(write_beside(options.folder, data), options.folder, options)
            case Movie():
                plan = mm.sweep.sweep_of(options.folder)
                film(plan, beside(options.folder, ".mp4"), options.speed)
            case Cluster():
                serve(options)
            case _:
                sweep(scene, options)
    except ValueError as error:
        fail(str(error), MISTAKE)


def sweep(scene: Any, options: Options) -> None:
    options.check_pictures()
    axes, numbers = varied(options.vary, options.design), seeds(options.seeds)
    plan = Sweep(
        scene=scene,
        vary=axes.vary,
        samples=axes.samples,
        seeds=numbers,
        replicas=options.replicas,
        measure=options.measure.split(","),
        method=options.method,
        timestep=options.timestep,
        engine=options.engine,
        duration=options.duration,
        record_interval=options.record_interval,
    )
    if plan.shape[-1] < len(numbers):
        print("a top has no noise, so only the first seed is used")
    names = [type(scene).__name__.lower(), *(axis.name for axis in plan.axes)]
    folder = options.out or Path("out", "_".join(["sweep", *names]))
    if options.dry_run:
        print_plan(plan, folder, options.workers)
        return
    tally = run(plan, folder, options)
    if tally.done:
        try:
            draw(combined(folder), folder, options)
        except KeyboardInterrupt:
            again = f"magmotor sweep combine {folder}"
            fail(f"interrupted after the last case; {again} writes its dataset", INTERRUPTED)
    if tally.failed:
        print_status(folder, SHOWN)
        count = f"{tally.failed} case{'s' * (tally.failed > 1)}" if tally.done else "every case"
        fail(f"{count} failed; run again with --retry to repeat", DIVERGED)


def draw(data: xr.Dataset, folder: Path, pictures: PictureOptions) -> None:
    try:
        written = pictures.draw(folder, partial(mm.plots.sweep, data))
    except ValueError as error:
        print(f"no picture: {error}")
    else:
        print(f"wrote {written}")


def serve(options: Cluster) -> None:
    with mm.sweep.local_cluster(options.workers, options.host) as address:
        if not loopback(options.host):
            reach = f"anyone who can reach {address} can run any code here with your permissions"
            report(f"{reach}; use trusted networks only")
        print(f"--scheduler {address}; Ctrl-C ends it", flush=True)
        wait()


def wait() -> None:
    """Wait for Ctrl-C; Windows has no signal.pause."""
    while True:
        time.sleep(1.0)


def loopback(host: str) -> bool:
    """Whether only this machine can reach an address."""
    try:
        return host == "localhost" or ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False  # a host name
