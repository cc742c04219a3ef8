"""Run a scene and film it: the movie, the run itself, its plots, and its numbers.

In the folder `out`: `top.nc` (the run, an xarray dataset), `top.png` (path, J and energy against
theory) and `top.mp4`.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from command_line import (
    DIVERGED,
    INTERRUPTED,
    MISTAKE,
    NO_OPENGL,
    UNWRITTEN,
    fail,
    parse,
    run_script,
    written_whole,
)

import magmotor as mm
from magmotor.gl import PACKAGES

PAPER = "the paper's parameters give 1.858e-04 kg m^2/s at 21.6 s"


@dataclass
class Options:
    method: str = "mujoco/rk4"
    """engine/scheme; scipy/dop853 follows the axis alone and has no spin to film"""
    timestep: float = 0.0125
    """(s)"""
    duration: float = 30.0
    """(s)"""
    seconds_per_second: float = 1.0
    """seconds of the run in a second of the movie"""
    still: tuple[float, Path] | None = None
    """time (s) and file of a single frame, to be drawn instead of the movie"""
    out: Path = Path("out")
    """folder to write to"""


def main() -> None:
    scene, options = parse(Options, __doc__ or "")
    seconds: dict[str, float] = {}
    ending: tuple[str, int] | None = None
    with timed(seconds, "simulate"):
        try:
            run = mm.simulate(
                scene, method=options.method, timestep=options.timestep, duration=options.duration
            )
        except ValueError as error:
            fail(str(error), MISTAKE)
        except mm.SimulationDiverged as stop:
            run, ending = stop.dataset, (str(stop), DIVERGED)
        except mm.SimulationInterrupted as stop:
            run, ending = stop.dataset, (f"{stop} at t = {stop.dataset.time[-1]:g} s", INTERRUPTED)
    print(*summary(run, scene), sep="\n")
    with timed(seconds, "plots"):
        save(run, scene, options.out)
    if ending:
        fail(*ending)
    with timed(seconds, "render"):
        film(run, scene, options)
    print("wall time:", ", ".join(f"{name} {spent:.1f} s" for name, spent in seconds.items()))


@contextmanager
def timed(seconds: dict[str, float], name: str) -> Iterator[None]:
    start = time.perf_counter()
    yield
    seconds[name] = time.perf_counter() - start


def summary(run, scene: mm.Top) -> Iterator[str]:
    momentum = run.momentum_map.values
    at = int(np.abs(momentum).argmax())
    largest, spin = abs(momentum[at]), abs(momentum[at]) / scene.inertia[2]
    yield (
        f"maximum spin: |J| = {largest:.3e} kg m^2/s, {spin:.2f} rad/s, at t = {run.time[at]:.2f} s"
        + (f" ({PAPER})" if scene == mm.Top.paper(4) and run.time[-1] > 21.6 else "")
    )
    residual = np.abs(mm.observables.momentum_balance(run, scene).residual.values).max()
    relative = f", {residual / largest:.1e} of max |J|" if largest > 0 else ""
    yield f"balance of J: it differs from theory's integral by at most {residual:.1e}{relative}"


def save(run, scene: mm.Top, out: Path) -> None:
    with written_whole(out / "top.nc") as part:
        run.to_netcdf(part)
    with written_whole(out / "top.png") as part:
        mm.plots.overview(run, scene, part)
    print(f"wrote {out / 'top.nc'} and {out / 'top.png'}")


def film(run, scene: mm.Top, options: Options) -> None:
    path = options.still[1] if options.still else options.out / "top.mp4"
    try:
        with written_whole(path) as part:
            if options.still:
                mm.render.still(run, scene, part, options.still[0])
            else:
                speed = options.seconds_per_second
                mm.render.movie(run, scene, part, seconds_per_second=speed)
    except ValueError as error:
        fail(str(error), MISTAKE)
    except mm.render.NoOpenGL as error:
        packages = "".join(f"\n  {system}: {command}" for system, command in PACKAGES.items())
        fail(f"no movie: {error}; install OpenGL and run again{packages}", NO_OPENGL)
    except RuntimeError as error:
        fail(f"no movie: {' '.join(str(error).split())}", UNWRITTEN)
    print(f"wrote {path}")


if __name__ == "__main__":
    run_script(main)
