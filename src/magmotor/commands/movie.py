"""Run a scene and render a movie of it, with its dataset, plots and key numbers.

Files in the folder `out` for the top: `top.nc` (the run, an xarray dataset), `top.png` (path, J and
energy against theory) and `top.mp4`. For the motor, a flight is found in a long run and replayed in
detail along the same Brownian path: `motor_flight.nc` and `motor_flight.mp4`; `motor_flight.png`
shows the whole run.
"""

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import magmotor as mm
from magmotor.commands.output import (
    DIVERGED,
    INTERRUPTED,
    MISTAKE,
    UNWRITTEN,
    fail,
    film_written,
    make_folder,
    write_netcdf,
    writes,
)
from magmotor.commands.picture_options import PictureOptions
from magmotor.commands.scene_options import parse
from magmotor.common.checks import check_number
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import STILLS
from magmotor.devices.motor.flights import CORE
from magmotor.numerics.compilation_notice import COMPILATION
from magmotor.render.encoder import check_fps, check_size
from magmotor.render.frames import SIZE
from magmotor.render.movie import plan

PAPER = "the paper's parameters give 1.858e-04 kg m^2/s at 21.6 s"

MOVIE_SECONDS = 27.0
"""Default length of the movie of a flight."""

LEAD = 0.1
"""Time filmed before and after a flight, as a fraction of its duration."""


@dataclass
class FilmOptions(PictureOptions):
    speed: float | None = None
    """simulated seconds per second of the movie; by default 1 for the top, and such that a flight
    of the motor lasts about 27 s"""
    fps: int | None = None
    """frames per second; by default 30, in a GIF 15"""
    size: tuple[int, int] | None = None
    """width and height in pixels; by default 1280 720, in a GIF 640 360"""
    gif: bool = False
    """write a .gif instead of the .mp4"""
    webm: bool = False
    """write a .webm instead of the .mp4"""
    still: tuple[float, Path] | None = None
    """time (s) and file of a single frame, to be drawn instead of the movie; for the motor, within
    the flight"""
    out: Path = Path("out")
    """folder to write to"""

    def suffixes(self) -> list[str]:
        """Return the endings of the movies to write."""
        return [".gif"] * self.gif + [".webm"] * self.webm or [".mp4"]


@dataclass
class Options(FilmOptions):
    method: str = "mujoco/rk4"
    """engine/scheme; scipy/dop853 computes only the axis, so there is no spin to film"""
    timestep: float = 0.0125
    """timestep (s)"""
    duration: float = 30.0
    """duration of the run (s)"""


@dataclass
class FlightOptions(FilmOptions):
    method: str = "mujoco/baoab"
    """engine/scheme"""
    timestep: float = 0.1
    """timestep (s)"""
    duration: float = 1e5
    """duration (s) of the run in which to look for a flight"""
    seed: int = 1
    """seed of the Brownian path"""


def main() -> None:
    kinds = {"top": Options, "motor": FlightOptions}
    scene, options = parse(kinds, __doc__ or "", tuple(kinds))
    seconds: dict[str, float] = {}
    try:
        check(options)
        if isinstance(options, FlightOptions):
            film_flight(scene, options, seconds)
        else:
            film_top(scene, options, seconds)
    except ValueError as error:
        fail(str(error), MISTAKE)
    print(f"wall time: {', '.join(f'{name} {spent:.1f} s' for name, spent in seconds.items())}")


def check(options: Options | FlightOptions) -> None:
    """Check what would otherwise fail only after the run."""
    options.check_pictures()
    check_number("duration", options.duration, above=0)
    if options.speed is not None:
        check_number("speed", options.speed, above=0)
    if options.fps is not None:
        check_fps("fps", options.fps)
    if options.size is not None:
        check_size("size", options.size)
    if options.still is None:
        check_length(options)
    if options.still:
        moment, path = options.still
        if not 0 <= moment <= options.duration:
            raise ArgumentError(
                "still", moment, f"must be within the run: 0 to {options.duration:g} s"
            )
        if path.suffix.lower() not in STILLS:
            raise ArgumentError("still", str(path), f"must end in {' or '.join(STILLS)}")
        make_folder(path.parent)
    make_folder(options.out)


def check_length(options: Options | FlightOptions) -> None:
    """Check that a movie has not too many frames, if its length is known before the run."""
    if isinstance(options, FlightOptions):
        if options.speed is not None:
            return
        duration, speed = MOVIE_SECONDS, 1.0
    else:
        duration, speed = options.duration, options.speed or 1.0
    for suffix in options.suffixes():
        plan(options.out / f"movie{suffix}", 0.0, duration, speed, options.fps, options.size)


@contextmanager
def timed(seconds: dict[str, float], name: str) -> Iterator[None]:
    start, compiled = time.perf_counter(), COMPILATION.seconds
    yield
    compiled = COMPILATION.seconds - compiled
    seconds[name] = time.perf_counter() - start - compiled
    if compiled:
        seconds["compile"] = seconds.get("compile", 0.0) + compiled


def film_top(scene: mm.Top, options: Options, seconds: dict[str, float]) -> None:
    ending: tuple[str, int] | None = None
    stem = "top"
    with timed(seconds, "simulate"):
        try:
            run = mm.simulate(
                scene, method=options.method, timestep=options.timestep, duration=options.duration
            )
        except mm.SimulationStopped as stop:
            run, ending = stop.dataset, (str(stop), DIVERGED)
        except mm.SimulationInterrupted as stop:
            run, ending = stop.dataset, (f"interrupted at t = {stop.time:g} s", INTERRUPTED)
            stem = "top_interrupted"  # so that a whole run is not replaced
    if run.sizes["time"] > 1:
        print(*summary(run, scene), sep="\n")
        with timed(seconds, "plots"):
            save(run, scene, options, stem)
    if ending:
        fail(*ending)
    with timed(seconds, "render"):
        render(run, scene, options.out / "top.mp4", options, options.speed or 1.0)


def summary(run: xr.Dataset, scene: mm.Top) -> Iterator[str]:
    momentum = run.momentum_map.values
    at = int(np.abs(momentum).argmax())
    largest, spin = abs(momentum[at]), abs(momentum[at]) / scene.inertia[2]
    yield (
        f"maximum spin: |J| = {largest:.3e} kg m^2/s, {spin:.2f} rad/s, at t = {run.time[at]:.2f} s"
        + (f" ({PAPER})" if scene == mm.Top.paper(4) and run.time[-1] > 21.6 else "")
    )
    residual = np.abs(mm.observables.momentum_balance(run, scene).residual.values).max()
    relative = f", {residual / largest:.1e} of max |J|" if largest > 0 else ""
    yield f"balance of J: differs from the integral of theory by at most {residual:.1e}{relative}"


def save(run: xr.Dataset, scene: mm.Top, options: Options, stem: str) -> None:
    dataset = options.out / f"{stem}.nc"
    verb = writes(dataset)
    write_netcdf(run, dataset)
    written = options.draw(options.out / stem, partial(mm.plots.overview, run, scene))
    print(f"{verb} {dataset} and {written}")


def film_flight(scene: mm.Motor, options: FlightOptions, seconds: dict[str, float]) -> None:
    numerics = {"method": options.method, "timestep": options.timestep, "seed": options.seed}
    with timed(seconds, "simulate"):
        whole = long_run(scene, options, numerics)
    shown = mm.plots.MotorRun("the whole run", whole)
    begin, end = window(shown)
    flight = f"{shown.flights_in_words}; filmed from t = {begin:g} to {end:g} s"
    print(flight)
    before = whole.sel(time=slice(None, begin))
    replay = mm.simulate(
        scene,
        duration=end - begin,
        record_interval=records_per(0.5, options.timestep),
        initial=before,
        **numerics,
    ).assign_attrs(found=flight, revolutions_before=revolutions_before(shown, begin))
    out = options.out
    with timed(seconds, "plots"):
        verb = writes(out / "motor_flight.nc")
        write_netcdf(replay, out / "motor_flight.nc")
        written = options.draw(out / "motor_flight", partial(mm.plots.motor_overview, shown))
    print(f"{verb} {out / 'motor_flight.nc'} and {written}")
    speed = options.speed or math.ceil((end - begin) / MOVIE_SECONDS)
    timely = replay.assign_coords(time=replay.time + begin)
    with timed(seconds, "render"):
        render(timely, scene, out / "motor_flight.mp4", options, speed)


def long_run(scene: mm.Motor, options: FlightOptions, numerics: dict[str, Any]) -> xr.Dataset:
    interval = records_per(1.0, options.timestep)
    try:
        return mm.simulate(scene, duration=options.duration, record_interval=interval, **numerics)
    except mm.SimulationStopped as stop:
        print(stop)  # the ball may have flown before the ring was lost
        return stop.dataset.assign_attrs(stopped=str(stop))
    except mm.SimulationInterrupted as stop:
        fail(f"interrupted at t = {stop.time:g} s", INTERRUPTED)


def records_per(seconds: float, timestep: float) -> int:
    return max(1, round(seconds / timestep))


def window(run: mm.plots.MotorRun) -> tuple[float, float]:
    """Return start and end times, from before the longest flight until after its end."""
    if run.longest is None:
        reached = run.data.time[-1]
        fail(f"no movie: no flight in {reached:g} s; try another seed or a longer run", UNWRITTEN)
    times, begin, end = run.data.time.values, float(run.longest.begin), float(run.longest.end)
    lead = LEAD * (end - begin)
    # The end is one of a flight only after the ball has moved back by a quarter of a sector.
    back = np.abs(run.revolutions - run.revolutions[times == end]) > CORE / run.scene.outer_dipoles
    returned = float(next(iter(times[back & (times > end)]), times[-1]))
    first = times[np.searchsorted(times, begin - lead)]
    last = times[min(np.searchsorted(times, max(end + lead, returned)), len(times) - 1)]
    return float(first), float(last)


def revolutions_before(run: mm.plots.MotorRun, begin: float) -> int:
    """Return the whole revolutions of the ball until a recorded time (s)."""
    return round(float(run.revolutions[run.data.time.values == begin][0]))


def render(
    run: xr.Dataset, scene: mm.Top | mm.Motor, path: Path, options: FilmOptions, speed: float
) -> None:
    if options.still:
        moment, picture = options.still
        with film_written(picture) as part:
            mm.render.still(run, scene, part, moment, size=options.size or SIZE)
        return
    for suffix in options.suffixes():
        with film_written(path.with_suffix(suffix)) as part:
            mm.render.movie(run, scene, part, speed=speed, fps=options.fps, size=options.size)
