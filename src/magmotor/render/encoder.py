"""The encoder: writes frames to a movie as they are drawn."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from magmotor.common.checks import reject
from magmotor.common.hints import output
from magmotor.common.optional import extra
from magmotor.render.frames import HEIGHT, WIDTH

if TYPE_CHECKING:
    from mediapy import VideoWriter

Film = Annotated[str | Path, output(".mp4")]
"""The file of a movie."""

FRAME_RATE = 20
"""Frames per second."""

MOST_FRAMES = 200_000
"""Largest number of frames: nearly three hours."""

ENCODING = (
    "-preset veryfast -movflags +faststart -vf scale=out_color_matrix=bt709"
    " -colorspace bt709 -color_primaries bt709 -color_trc bt709"
)
"""Options for ffmpeg: fast encoding, quick start in a browser, and HD color space."""


def frame_times(start: float, end: float, seconds_per_second: float) -> NDArray[np.float64]:
    """Return the times of a movie's frames (s), shape (T,).

    Raises
    ------
    ValueError
        The movie is so slow that it has too many frames.
    """
    if (end - start) * FRAME_RATE > MOST_FRAMES * seconds_per_second:
        sentence = f"must be large enough for a movie of at most {MOST_FRAMES} frames"
        raise reject("seconds_per_second", seconds_per_second, sentence)
    times = np.arange(start, end + 1e-9, seconds_per_second / FRAME_RATE)
    return np.minimum(times, end)  # rounding


def speed_in_words(seconds_per_second: float) -> str:
    """Return the speed of a movie as text, empty for real time."""
    return "" if seconds_per_second == 1 else f"{seconds_per_second:g} × real time"


def encode(draw: Callable[[int], NDArray[np.uint8]], count: int, path: str | Path) -> None:
    """Write the frames `draw(0)` to `draw(count - 1)`, each of shape (720, 1280, 3), to a movie.

    Raises
    ------
    RuntimeError
        The encoder failed; the message includes its last output.
    """
    # One process is enough: software OpenGL uses one thread per core.
    with _unmasked_interrupt(), _writer(path) as writer:
        for i in tqdm(range(count), "render", unit="frame", disable=None):
            writer.add_image(draw(i))


@contextmanager
def _unmasked_interrupt() -> Iterator[None]:
    """Reraise Ctrl-C, which the writer's error about the end of ffmpeg would hide."""
    try:
        yield
    except RuntimeError as error:
        if isinstance(error.__context__, KeyboardInterrupt):
            raise error.__context__ from None
        raise


def _writer(path: str | Path) -> "VideoWriter":
    with extra("movies"):
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
