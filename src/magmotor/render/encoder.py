"""The encoder: pictures that are drawn one after another, written to a movie as they come."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from magmotor.common.checks import reject
from magmotor.common.hints import output
from magmotor.render.frames import HEIGHT, WIDTH

if TYPE_CHECKING:
    from mediapy import VideoWriter

Film = Annotated[str | Path, output(".mp4")]
"""A file that a movie is written to."""

FRAME_RATE = 20
"""Frames a second."""

MOST_FRAMES = 200_000
"""Frames of a movie of nearly three hours."""

ENCODING = (
    "-preset veryfast -movflags +faststart -vf scale=out_color_matrix=bt709"
    " -colorspace bt709 -color_primaries bt709 -color_trc bt709"
)
"""Quick to write and to start in a browser, with the colors of high-definition video."""


def frame_times(start: float, end: float, seconds_per_second: float) -> NDArray[np.float64]:
    """Times (s) of a movie's frames, shape (T,).

    Raises
    ------
    ValueError
        The speed is so low that there are too many frames.
    """
    if (end - start) * FRAME_RATE > MOST_FRAMES * seconds_per_second:
        sentence = f"must be so large that there are at most {MOST_FRAMES} frames"
        raise reject("seconds_per_second", seconds_per_second, sentence)
    times = np.arange(start, end + 1e-9, seconds_per_second / FRAME_RATE)
    return np.minimum(times, end)  # rounding


def speed_in_words(seconds_per_second: float) -> str:
    """How fast a movie is, empty if it is as fast as reality."""
    return "" if seconds_per_second == 1 else f"{seconds_per_second:g} × real time"


def encode(draw: Callable[[int], NDArray[np.uint8]], count: int, path: str | Path) -> None:
    """Write the frames `draw(0)` to `draw(count - 1)`, each of shape (720, 1280, 3), to a movie.

    Raises
    ------
    RuntimeError
        The encoder failed; its last words are in the message.
    """
    # In one process: software OpenGL has threads of its own for every core.
    with _unmasked_interrupt(), _writer(path) as writer:
        for i in tqdm(range(count), "render", unit="frame", disable=None):
            writer.add_image(draw(i))


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
