"""Movies: frames drawn one after another, and encoded as they come."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from tqdm import tqdm

from magmotor.checks import check_number, reject
from magmotor.render.frames import HEIGHT, WIDTH, Frames
from magmotor.scenes import Motor, Top

if TYPE_CHECKING:
    from mediapy import VideoWriter

FRAME_RATE = 20
"""Frames a second."""

ENCODING = (
    "-preset veryfast -movflags +faststart -vf scale=out_color_matrix=bt709"
    " -colorspace bt709 -color_primaries bt709 -color_trc bt709"
)
"""Quick to write and to start in a browser, with the colours of high-definition video."""


def movie(
    run: xr.Dataset, scene: Top | Motor, path: str | Path, *, seconds_per_second: float = 1.0
) -> None:
    """Write the movie of a recorded run: the scene, the ball's trail, and a curve as it happens.

    The curve is J(t) of the top, the azimuth theta(t) of the motor's ball.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate` without replicas; of the top not by scipy/dop853, which has no orientation.
    scene : Top or Motor
        Its scene.
    path : str or Path
        The .mp4 file to write: H.264, 1280 x 720, 20 frames a second.
    seconds_per_second : float
        Seconds of the run in a second of the movie.

    Raises
    ------
    ValueError
        The run has replicas or no orientation, there are no movies of such a scene, or the speed is
        not positive.
    NoOpenGL
        No OpenGL context can be made; nothing is written.
    RuntimeError
        The encoder failed; its last words are in the message.
    """
    check_number("seconds_per_second", seconds_per_second, above=0)
    start, end = run.time.values[[0, -1]]
    times = np.arange(start, end + 1e-9, seconds_per_second / FRAME_RATE)
    times = np.minimum(times, end)  # rounding
    note = "" if seconds_per_second == 1 else f"{seconds_per_second:g} × real time"
    # In one process: software OpenGL has threads of its own for every core.
    with Frames(run, scene, times, note) as frames, _unmasked_interrupt(), _writer(path) as writer:
        for i in tqdm(range(len(frames)), "render", unit="frame", disable=None):
            writer.add_image(frames.draw(i))


def still(run: xr.Dataset, scene: Top | Motor, path: str | Path, time: float) -> None:
    """Write one frame of the movie, at a time in seconds; arguments and errors as in `movie`."""
    start, end = run.time.values[[0, -1]]
    if not start <= time <= end:
        raise reject("time", time, f"within the run: {start:g} to {end:g} s")
    from PIL import Image

    with Frames(run, scene, [time]) as frames:
        Image.fromarray(frames.draw(0)).save(path, optimize=True)


@contextmanager
def _unmasked_interrupt() -> Iterator[None]:
    """Ctrl-C ends ffmpeg too, and the writer's complaint of that would hide the interrupt."""
    try:
        yield
    except RuntimeError as complaint:
        if isinstance(complaint.__context__, KeyboardInterrupt):
            raise complaint.__context__ from None
        raise


def _writer(path: str | Path) -> "VideoWriter":
    import imageio_ffmpeg
    import mediapy

    mediapy.set_ffmpeg(imageio_ffmpeg.get_ffmpeg_exe())
    return mediapy.VideoWriter(
        path,
        (HEIGHT, WIDTH),
        fps=FRAME_RATE,
        crf=20,
        encoded_format="yuv420p",
        ffmpeg_args=ENCODING,
    )
