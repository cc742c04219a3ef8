"""Movies of a recorded run, and single frames of one."""

from collections.abc import Iterator
from itertools import chain, repeat
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import Positive, Still
from magmotor.common.optional import extra
from magmotor.device.analysis import analysis
from magmotor.device.device import Scene
from magmotor.render.encoder import (
    FORMATS,
    Film,
    FrameRate,
    Size,
    check_memory,
    encode,
    frame_times,
    speed_in_words,
)
from magmotor.render.frames import SIZE, Frames, checked_movie_run

HOLD = 2.0
"""Time (s) for which a movie shows its last frame, with the result in words."""


@analysis(of=Scene, records=2, replicas=False)
def movie(
    run: xr.Dataset,
    scene: Scene | None,
    path: Film,
    *,
    speed: Positive = 1.0,
    fps: FrameRate | None = None,
    size: Size | None = None,
) -> None:
    """Write a movie of a recorded run: the scene, the ball's trail, and a growing curve.

    The curve is the spin of the top, without its sign, or the azimuth theta(t) of the motor's ball.
    The last frame stays for two seconds, with the result in words.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate` without replicas; for the top not by scipy/dop853, which has no orientation.
    scene : Top, Motor or None
        Its scene; None takes it from the attributes of the run.
    path : str or Path
        The file to write, whose suffix determines the format: .mp4 (H.264), .webm (VP9) or .gif.
    speed : float
        Simulated seconds per second of the movie.
    fps : int, optional
        Frames per second, 1 to 100; by default 30, in a GIF 15.
    size : (int, int), optional
        Width and height in pixels; by default 1280 x 720, in a GIF 640 x 360.

    Raises
    ------
    ValueError
        The run has replicas or no orientation, the scene's class has no movies, the speed is not
        positive, or a GIF would have too many frames.
    NoOpenGL
        No OpenGL context can be created; nothing is written.
    RuntimeError
        The encoder failed; the message includes its last output.
    """
    assert scene is not None  # `analysis` has filled it in
    run, path = checked_movie_run(run, scene), Path(path)
    start, end = run.time.values[[0, -1]]
    planned = plan(path, start, end, speed, fps, size)
    times, held = planned.times, planned.held
    with Frames(run, scene, times, speed_in_words(speed), planned.size) as frames:
        shown = chain(frames, _held(frames, held))
        encode(shown, len(times) + held, path, planned.fps, planned.size)


class Plan(NamedTuple):
    """The frames of a movie: their times (s), how many repeat the last, their rate and size."""

    times: NDArray[np.float64]
    held: int
    fps: int
    size: tuple[int, int]


def plan(
    path: Path,
    start: float,
    end: float,
    speed: float,
    fps: int | None,
    size: tuple[int, int] | None,
) -> Plan:
    """Plan the frames of a movie from a start time to an end time (s); see `movie`.

    Raises
    ------
    ValueError
        The movie would have too many frames.
    """
    usual = FORMATS[path.suffix.lower()]
    fps, size = fps or usual.fps, size or usual.size
    times, held = frame_times(start, end, speed, fps), round(HOLD * fps)
    check_memory(path, len(times) + held, size)
    return Plan(times, held, fps, size)


def _held(frames: Frames, count: int) -> Iterator[NDArray[np.uint8]]:
    """Yield the last frame, which is drawn once, several times."""
    yield from repeat(frames.draw_end(), count)


@analysis(of=Scene, records=2, replicas=False)
def still(
    run: xr.Dataset, scene: Scene | None, path: Still, time: float, *, size: Size = SIZE
) -> None:
    """Write one frame of the movie, at a time in seconds; other arguments as in `movie`."""
    assert scene is not None  # `analysis` has filled it in
    run = checked_movie_run(run, scene)
    start, end = run.time.values[[0, -1]]
    if not start <= time <= end:
        raise ArgumentError("time", time, f"must be within the run: {start:g} to {end:g} s")
    with extra("movies"):
        from PIL import Image

    with Frames(run, scene, [time], size=size) as frames:
        Image.fromarray(frames.draw(0)).save(path, optimize=True)
