"""Sweep parameters of a scene: every combination is a run, of which a few numbers are kept.

What is done stays done: stop it as you like, and the same command goes on. In the folder `out`,
`sweep/` holds a file for each case; `sweep.nc` is all of them as one dataset, with the sweep's
dimensions, and `sweep.png` the picture, of one or two dimensions.
"""

import signal
import sys
from dataclasses import dataclass, field
from ipaddress import ip_address
from pathlib import Path
from typing import Annotated, Any

import tyro
from command_line import DIVERGED, MISTAKE, fail, parse, run_script, warn_in_one_line, written_whole
from sweep_movie import film
from sweep_run import SHOWN, RunOptions, beside, combined, run, tell_status
from sweep_text import seeds, varied

import magmotor as mm
from magmotor.sweep import Sweep


@dataclass
class Options(RunOptions):
    vary: Annotated[list[str], tyro.conf.UseAppendAction] = field(default_factory=list)
    """what varies, once for each field: FIELD=START:STOP:COUNT (evenly spaced, both ends included),
    FIELD=START:STOP:COUNT:log, FIELD=VALUE,VALUE,..., or with --design FIELD=LOW:HIGH[:log];
    FIELD,FIELD=... take equal values; position_x is a component"""
    design: str | None = None
    """KIND:SIZE[:SEED] draws SIZE points in all ranges LOW:HIGH: random, latin or sobol"""
    seeds: str = "0:1"
    """FIRST:LAST (LAST excluded) or a list; of a top, which has no noise, one counts"""
    replicas: int | None = None
    """independent runs within a case"""
    measure: str = "max_spin,settling_radius"
    """names of what is kept, with commas between them, MODULE:FUNCTION for your own, or trajectory:
    the whole run"""
    method: str | None = None
    """engine/scheme; by default as recommended"""
    timestep: float | None = None
    """(s); by default the shortest that is recommended at the corners of the sweep"""
    duration: float = 60.0
    """of each run (s)"""
    record_interval: int = 1
    """every how many steps a run is looked at"""
    out: Path = Path("out/sweep")
    """folder of the sweep; dataset and picture are beside it"""


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
    """How far the sweep in a folder has come, and what failed in it."""

    folder: tyro.conf.Positional[Path]


@dataclass
class Combine:
    """Dataset and picture of what is there of a sweep."""

    folder: tyro.conf.Positional[Path]
    skip_damaged: bool = False
    """go on without files that are damaged"""


@dataclass
class Movie:
    """A movie of up to 30 of a sweep's tops or motors side by side."""

    folder: tyro.conf.Positional[Path]
    seconds_per_second: float | None = None
    """seconds of the runs in a second of the movie; by default, so many that it lasts some 20 s"""


@dataclass
class Cluster:
    """A Dask cluster on this machine, until Ctrl-C."""

    workers: int | None = None
    """processes; by default one for each core"""
    host: str = "127.0.0.1"
    """interface to listen on; whoever can reach another than this one can run code here"""


def main() -> None:
    warn_in_one_line()
    kinds = {"top": Options, "disk": DiskOptions, "motor": MotorOptions}
    commands = {"status": Status, "combine": Combine, "movie": Movie, "cluster": Cluster}
    scene, options = parse({**kinds, **commands}, __doc__ or "", (*kinds, *commands))
    try:
        match options:
            case Status():
                tell_status(options.folder)
            case Combine():
                combine(options.folder, options.skip_damaged)
            case Movie():
                plan = mm.sweep.sweep_of(options.folder)
                film(plan, beside(options.folder, ".mp4"), options.seconds_per_second)
            case Cluster():
                serve(options)
            case _:
                sweep(scene, options)
    except ValueError as error:
        fail(str(error), MISTAKE)


def sweep(scene: Any, options: Options) -> None:
    told, numbers = varied(options.vary, options.design), seeds(options.seeds)
    plan = Sweep(
        scene=scene,
        vary=told.vary,
        samples=told.samples,
        seeds=numbers,
        replicas=options.replicas,
        measure=options.measure.split(","),
        method=options.method,
        timestep=options.timestep,
        duration=options.duration,
        record_interval=options.record_interval,
    )
    if plan.shape[-1] < len(numbers):
        print("a top has no noise: of its seeds only the first counts")
    tally = run(plan, options.out, options)
    combine(options.out)
    if tally.failed:
        tell_status(options.out, SHOWN)
        fail(f"{tally.failed} cases failed; --retry runs them again", DIVERGED)


def combine(folder: Path, skip_damaged: bool = False) -> None:
    data = combined(folder, skip_damaged)
    picture = beside(folder, ".png")
    try:
        with written_whole(picture) as part:
            mm.plots.sweep(data, part)
    except ValueError as error:
        print(f"no picture: {error}")
    else:
        print(f"wrote {picture}")


def serve(options: Cluster) -> None:
    with mm.sweep.local_cluster(options.workers, options.host) as address:
        if not loopback(options.host):
            reach = f"whoever can reach {address} can run any code here, as you"
            print(f"sweep.py: {reach}: trust everyone on that network", file=sys.stderr)
        print(f"--scheduler {address}; Ctrl-C ends it", flush=True)
        signal.pause()


def loopback(host: str) -> bool:
    """Whether only this machine can reach an address."""
    try:
        return host == "localhost" or ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False  # the name of some machine


if __name__ == "__main__":
    run_script(main)
