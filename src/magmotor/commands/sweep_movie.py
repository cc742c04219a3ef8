"""The movie of a sweep: some of its tops or motors, run again and shown side by side."""

import math
from pathlib import Path

import numpy as np
from tqdm import tqdm

import magmotor as mm
from magmotor.commands.output import film_written
from magmotor.common.exceptions import ArgumentError
from magmotor.device.provenance import scene_from
from magmotor.render.contact_sheet import FRAME_RATE
from magmotor.sweep import Sweep, Values
from magmotor.sweep.compute import ARGUMENTS

COLUMNS, ROWS = 6, 5
"""Largest numbers of tiles per row and column."""

SECONDS = 20.0
"""Approximate default length of the movie."""


def film(sweep: Sweep, path: Path, speed: float | None) -> None:
    """Write a movie of runs with the first seed."""
    if not isinstance(sweep.scene, mm.Top | mm.Motor):
        raise ArgumentError(
            "scene", type(sweep.scene).__name__, "movies show only a Top or a Motor"
        )
    if sweep.replicas is not None:
        raise ArgumentError("replicas", sweep.replicas, "movies show only sweeps without replicas")
    points, columns = shown(sweep)
    speed = speed or max(1.0, math.ceil(sweep.duration / SECONDS))
    scenes, runs, labels = [], [], []
    for point in tqdm(points, "simulate", unit="run", disable=None):
        index = point * sweep.shape[-1]
        label = sweep.label(index)
        try:
            scene, run = simulate_case(sweep.case(index).spec, speed / FRAME_RATE)
        except ValueError as error:
            print(f"left out: {label}: {error}")
            continue
        scenes.append(scene)
        runs.append(run)
        labels.append(label.replace(" =", ""))
    with film_written(path) as part:
        mm.render.contact_sheet(runs, scenes, labels, part, columns=columns, speed=speed)


def shown(sweep: Sweep) -> tuple[list[int], int]:
    """Select evenly spaced points of the sweep, and the number of columns to show them in.

    With two axes, the first runs from left to right and the second upwards, as in the picture.
    """
    sizes = [len(axis) for axis in sweep.axes]
    if len(sizes) == 2 and all(isinstance(axis, Values) for axis in sweep.axes):
        right, up = evenly(sizes[0], COLUMNS), evenly(sizes[1], ROWS)
        return [x * sizes[1] + y for y in reversed(up) for x in right], len(right)
    points = evenly(math.prod(sizes), COLUMNS * ROWS)
    return points, min(COLUMNS, math.ceil(math.sqrt(len(points))))


def evenly(size: int, most: int) -> list[int]:
    """Return at most `most` evenly spaced indices, including both ends."""
    return np.unique(np.linspace(0, size - 1, min(size, most)).round().astype(int)).tolist()


def simulate_case(spec: dict, seconds: float):
    """Return a case's scene and its run, recorded about every `seconds`."""
    scene = scene_from(spec["scene"], spec["scene_fields"])
    arguments = {name: spec[name] for name in ARGUMENTS}
    arguments["record_interval"] = max(1, round(seconds / spec["timestep"]))
    try:
        return scene, mm.simulate(scene, **arguments)
    except mm.SimulationStopped as stop:
        return scene, stop.dataset
