"""Contact sheets: movies of many runs side by side."""

from collections.abc import Sequence
from typing import Annotated

import xarray as xr

from magmotor.analysis import checked_run, scene_of_run
from magmotor.arguments import Positive, checked, integer
from magmotor.checks import reject
from magmotor.render.encoder import Film, encode, frame_times, speed_in_words
from magmotor.render.sheet import Sheet
from magmotor.render.tile import GAUGES, Tile
from magmotor.scenes import Motor, Top

COLUMNS, ROWS = 8, 5
"""At most so many, to see something in each tile."""


@checked
def contact_sheet(
    runs: Sequence[xr.Dataset],
    scenes: Sequence[Top] | Sequence[Motor] | None,
    labels: Sequence[str],
    path: Film,
    *,
    columns: Annotated[int, integer(at_least=1, at_most=COLUMNS)],
    seconds_per_second: Positive = 1.0,
) -> None:
    """Write a movie of recorded runs side by side, each from above with the ball's trail.

    A bar in each tile shows the spin J/I_3 of the top (rad/s) or the azimuth of the motor's ball
    (revolutions), all on one scale; paler, what has been reached so far. A run that ends before
    the others then shows its last moment, faded.

    Parameters
    ----------
    runs : sequence of xarray.Dataset
        From `simulate` without replicas; of the top not by scipy/dop853, which has no orientation.
        Up to 40: 5 rows of 8.
    scenes : sequence of Top or of Motor, or None
        Their scenes, of one kind; None, those that the attributes of the runs tell.
    labels : sequence of str
        What is written in the corner of each tile, a line for each part between commas.
    path : str or Path
        The .mp4 file to write: H.264, 1280 x 720, 20 frames a second.
    columns : int
        How many tiles stand side by side, 1 to 8; they fill row by row.
    seconds_per_second : float
        Seconds of the runs in a second of the movie.

    Raises
    ------
    ValueError
        There are no runs, too many for the columns, or not as many as scenes and labels; one has
        replicas or no orientation; the scenes are not all tops or all motors; columns or speed are
        out of bounds.
    NoOpenGL
        No OpenGL context can be made; nothing is written.
    RuntimeError
        The encoder failed; its last words are in the message.
    """
    _check_lengths(runs, scenes, labels, columns)
    given = scenes or [None] * len(runs)
    kinds = tuple(GAUGES)
    scenes = [scene_of_run(run, scene, kinds) for run, scene in zip(runs, given, strict=True)]
    if len({type(scene) for scene in scenes}) > 1:
        raise reject("scenes", sorted({type(s).__name__ for s in scenes}), "all Top or all Motor")
    for i, (run, scene) in enumerate(zip(runs, scenes, strict=True)):
        checked_run(f"runs[{i}]", run, GAUGES[type(scene)].needs, kinds, replicas=False)
    start = min(float(run.time[0]) for run in runs)
    end = max(float(run.time[-1]) for run in runs)
    times = frame_times(start, end, seconds_per_second)
    shown = zip(runs, scenes, labels, strict=True)
    tiles = [Tile(run, scene, label, times) for run, scene, label in shown]
    with Sheet(tiles, times, columns, speed_in_words(seconds_per_second)) as sheet:
        encode(sheet.draw, len(times), path)


def _check_lengths(runs: Sequence, scenes: Sequence | None, labels: Sequence, columns: int) -> None:
    if not 1 <= len(runs) <= ROWS * columns:
        raise reject("len(runs)", len(runs), f"1 to {ROWS * columns}: {ROWS} rows of {columns}")
    for name, given in (("scenes", scenes), ("labels", labels)):
        if given is not None and len(given) != len(runs):
            raise reject(f"len({name})", len(given), f"that of runs: {len(runs)}")
