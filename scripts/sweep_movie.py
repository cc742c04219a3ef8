"""The movie of a sweep: some of its tops or motors side by side, run again for it."""

import math
from pathlib import Path

import numpy as np
from command_line import film_written
from tqdm import tqdm

import magmotor as mm
from magmotor.common.checks import reject
from magmotor.device.provenance import scene_from
from magmotor.render.encoder import FRAME_RATE
from magmotor.sweep import Sweep, Values
from magmotor.sweep.compute import ARGUMENTS

COLUMNS, ROWS = 6, 5
"""At most so many tiles."""

SECONDS = 20.0
"""How long the movie is by default, about."""


def film(sweep: Sweep, path: Path, speed: float | None) -> None:
    """Write a movie; each run is of the first seed."""
    if not isinstance(sweep.scene, mm.Top | mm.Motor):
        raise reject("scene", type(sweep.scene).__name__, "must be Top or Motor, to be filmed")
    if sweep.replicas is not None:
        raise reject("replicas", sweep.replicas, "must be None, to be filmed")
    places, columns = shown(sweep)
    speed = speed or max(1.0, math.ceil(sweep.duration / SECONDS))
    scenes, runs, labels = [], [], []
    for place in tqdm(places, "simulate", unit="run", disable=None):
        index = place * sweep.shape[-1]
        label = sweep.label(index)
        try:
            scene, run = again(sweep.case(index).spec, speed / FRAME_RATE)
        except ValueError as error:
            print(f"left out: {label}: {error}")
            continue
        scenes.append(scene)
        runs.append(run)
        labels.append(label.replace(" =", ""))
    with film_written(path) as part:
        mm.render.contact_sheet(
            runs, scenes, labels, part, columns=columns, seconds_per_second=speed
        )


def shown(sweep: Sweep) -> tuple[list[int], int]:
    """Points of the sweep that stand for it, evenly, and how many go into a row.

    Of two axes the first runs from left to right, the second upwards, as in the picture.
    """
    sizes = [len(axis) for axis in sweep.axes]
    if len(sizes) == 2 and all(isinstance(axis, Values) for axis in sweep.axes):
        right, up = evenly(sizes[0], COLUMNS), evenly(sizes[1], ROWS)
        return [x * sizes[1] + y for y in reversed(up) for x in right], len(right)
    points = evenly(math.prod(sizes), COLUMNS * ROWS)
    return points, min(COLUMNS, math.ceil(math.sqrt(len(points))))


def evenly(size: int, most: int) -> list[int]:
    """Places from the first to the last."""
    return np.unique(np.linspace(0, size - 1, min(size, most)).round().astype(int)).tolist()


def again(told: dict, seconds: float):
    """A case's scene, and its run with a record about every so many seconds."""
    scene = scene_from(told["scene"], told["scene_fields"])
    arguments = {name: told[name] for name in ARGUMENTS}
    arguments["record_interval"] = max(1, round(seconds / told["timestep"]))
    try:
        return scene, mm.simulate(scene, **arguments)
    except mm.SimulationStopped as stop:
        return scene, stop.dataset
