"""Run three studies by parameter sweeps, and draw their results.

The first maps the top's largest spin over the height and tilt of the ring; the second counts the
motor's flights over the temperature; the third finds where wells, flights and a stable inner ring
are over the motor's geometry. The sweeps are in `study_spin/`, `study_flights/`, `study_geometry/`
and `study_geometry_dipoles/` in the folder `out`, with their datasets `.nc` and pictures `.png`
beside them. After an interruption, the same command resumes a study.
"""

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import magmotor as mm
from magmotor.commands.output import MISTAKE, fail, run_program, warn_in_one_line, written_whole
from magmotor.commands.scene_options import parse
from magmotor.commands.sweep_run import SHOWN, RunOptions, beside, combined, print_status, run
from magmotor.common.checks import check_integer, check_number
from magmotor.numerics.reproducible import geometric
from magmotor.sweep import Sweep

sys.path.insert(0, str(Path(__file__).parents[1]))  # where the folder paper is
from paper.motor.geometry import statics
from paper.motor.geometry_picture import geometry_map
from paper.top.spin_map import spin_map


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


@dataclass
class Geometry(RunOptions):
    """Map the motor's wells, flights and stability over radius, height and numbers of dipoles."""

    points: tuple[int, int] = (9, 7)
    """numbers of radii of the outer ring and of heights"""
    seeds: int = 4
    """number of runs at each"""
    duration: float = 1e5
    """of each run (s)"""
    out: Path = Path("out")
    """folder to write to"""


INNER_DIPOLES, OUTER_DIPOLES = (6, 8, 10, 12, 15, 20, 30, 40), (3, 4, 5, 6, 8)

FINENESS = 4
"""Ratio of the numbers of points per axis without and with runs."""


def main() -> None:
    warn_in_one_line()
    studies = {"spin": Spin, "flights": Flights, "geometry": Geometry}
    _, options = parse(studies, __doc__ or "", tuple(studies))
    try:
        if isinstance(options, Geometry):
            geometry(options)
        elif isinstance(options, Flights):
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
        spin_map(data, scene, part)
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


def geometry(options: Geometry) -> None:
    for number in options.points:
        check_integer("points", number, at_least=1)
    check_number("duration", options.duration, above=0, unit="s")
    scene = mm.Motor()
    radii, heights = options.points
    heights_of_both = ("inner_height", "outer_height")

    def radius_and_height(fineness: int) -> dict[Any, Any]:
        return {
            "outer_radius": np.linspace(0.84, 1.2, fineness * radii),
            heights_of_both: np.linspace(0.36, 0.66, fineness * heights),
        }

    numbers: dict[Any, Any] = {"inner_dipoles": INNER_DIPOLES, "outer_dipoles": OUTER_DIPOLES}
    rings = _flown(scene, radius_and_height(1), options.out / "study_geometry", options)
    dipoles = _flown(scene, numbers, options.out / "study_geometry_dipoles", options)
    finely = radius_and_height(FINENESS)
    offset = {
        "outer_radius": finely["outer_radius"],
        "outer_height": np.linspace(0.3, 0.66, FINENESS * heights),
    }
    static = {
        "rings": statics(scene, finely),
        "offset": statics(scene, offset),
        "dipoles": statics(scene, numbers),
    }
    picture = options.out / "study_geometry.png"
    with written_whole(picture) as part:
        geometry_map(rings, dipoles, static, scene, part)
    print(f"wrote {picture}")
    print(longest(rings))
    print(longest(dipoles))


def _flown(scene: mm.Motor, vary: Any, folder: Path, options: Geometry) -> xr.Dataset:
    plan = Sweep(
        scene=scene,
        vary=vary,
        seeds=options.seeds,
        measure=["flights", "flying", "longest_flight", "transitions"],
        method="variational/middle",
        timestep=0.25,
        duration=options.duration,
        record_interval=20,
    )
    tally = run(plan, folder, options)
    if tally.failed:
        print_status(folder, SHOWN)
    return combined(folder)


def longest(data: xr.Dataset) -> str:
    """Return where the longest flight of a sweep is, as text."""
    flight = data.longest_flight
    where = flight.fillna(0).argmax(...)
    there = flight.isel(where)
    fields = json.loads(data.attrs["axes"])
    place = ", ".join(f"{name} = {float(there[name]):.3g}" for name in fields)
    return f"longest flight: {float(there):.0f} revolutions at {place}"


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
    run_program(main)
