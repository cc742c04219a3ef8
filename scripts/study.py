"""Run two studies by parameter sweeps, and draw their results.

The first maps the top's largest spin over the height and tilt of the ring; the second counts the
motor's flights over the temperature. The sweeps are in `study_spin/` and `study_flights/` in the
folder `out`, with their datasets `.nc` and pictures `.png` beside them. After an interruption, the
same command resumes a study.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from command_line import MISTAKE, fail, parse, run_script, warn_in_one_line, written_whole
from sweep_run import SHOWN, RunOptions, beside, combined, print_status, run

import magmotor as mm
from magmotor.common.checks import check_integer, check_number
from magmotor.numerics.reproducible import geometric
from magmotor.sweep import Sweep


@dataclass
class Spin(RunOptions):
    """Map the top's spin over 21 tilts and 36 heights of the ring."""

    points: tuple[int, int] = (21, 36)
    """numbers of tilts and heights"""
    out: Path = Path("out")
    """folder to write to"""


@dataclass
class Flights(RunOptions):
    """Count the motor's flights at 8 temperatures with 8 seeds each."""

    points: int = 8
    """number of temperatures"""
    seeds: int = 8
    """number of runs at each"""
    duration: float = 1e5
    """of each run (s)"""
    out: Path = Path("out")
    """folder to write to"""


def main() -> None:
    warn_in_one_line()
    studies = {"spin": Spin, "flights": Flights}
    _, options = parse(studies, __doc__ or "", tuple(studies))
    try:
        if isinstance(options, Flights):
            flights(options)
        else:
            spin(options)
    except ValueError as error:
        fail(str(error), MISTAKE)


def spin(options: Spin) -> None:
    for number in options.points:
        check_integer("points", number, at_least=1)
    tilts, heights = options.points
    scene = mm.Top.paper(4)
    plan = Sweep(
        scene=scene,
        vary={
            "tilt": np.linspace(0, 0.2, tilts),
            "ring_height": np.linspace(0.1, 0.45, heights),
        },
        measure=["max_spin", "settling_radius"],
        duration=60.0,
    )
    folder = options.out / "study_spin"
    tally = run(plan, folder, options)
    data = combined(folder)
    with written_whole(beside(folder, ".png")) as part:
        mm.plots.spin_map(data, scene, part)
    print(f"wrote {beside(folder, '.png')}")
    if tally.failed:
        print_status(folder, SHOWN)


def flights(options: Flights) -> None:
    check_integer("points", options.points, at_least=1)
    check_number("duration", options.duration, above=0, unit="s")
    scene = mm.Motor()
    alphas = geometric(5e-4, 2e-3, options.points)
    plan = Sweep(
        scene=scene,
        vary={("alpha_ball", "alpha_ring"): alphas},
        seeds=options.seeds,
        measure=["flights", "revolutions_flown", "flying", "slip_temperature"],
        method="mujoco/baoab",
        timestep=0.1,
        duration=options.duration,
        record_interval=10,
    )
    folder = options.out / "study_flights"
    tally = run(plan, folder, options)
    data = over_temperature(combined(folder), scene)
    with written_whole(beside(folder, ".png")) as part:
        mm.plots.sweep(data, part)
    print(f"wrote {beside(folder, '.png')}")
    if tally.failed:
        print_status(folder, SHOWN)


def over_temperature(data: xr.Dataset, scene: mm.Motor) -> xr.Dataset:
    """Return the sweep over kT instead of alpha, with the slip's temperature relative to kT."""
    scenes = [scene.replace(alpha_ball=a, alpha_ring=a) for a in data.alpha_ball.values]
    attributes = {"units": "µJ", "long_name": "temperature kT"}
    data = data.assign_coords(kT=("alpha_ball", [1e6 * scene.kT for scene in scenes], attributes))
    data = data.swap_dims(alpha_ball="kT").drop_vars(["alpha_ball", "alpha_ring"])
    relative = (1e6 * data.slip_temperature / data.kT).assign_attrs(
        units="1", long_name="temperature of the slip over kT"
    )
    return data.assign(slip_temperature=relative).assign_attrs(axes='["kT"]')


if __name__ == "__main__":
    run_script(main)
