"""The encoder: writes frames to a movie as they are drawn."""

import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from magmotor.common.checks import check_integer
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import Described, integer, output
from magmotor.common.optional import extra

if TYPE_CHECKING:
    from mediapy import VideoWriter

COLOR = (
    "scale=out_color_matrix=bt709 -colorspace bt709 -color_primaries bt709 -color_trc bt709"
    " -color_range tv"
)
"""Options for ffmpeg: a video filter and marks of the color space of HD."""

PALETTE = "split[a][b];[a]palettegen=stats_mode=diff[p];[b][p]paletteuse=dither=none"
"""A video filter for ffmpeg: one palette for the whole GIF. It keeps all frames in memory."""


class Format(NamedTuple):
    """How a movie is encoded, and its default frame rate and size (width, height)."""

    fps: int
    size: tuple[int, int]
    options: dict[str, Any]
    """Arguments of `mediapy.VideoWriter`."""


FORMATS = {
    ".mp4": Format(
        30,
        (1280, 720),
        {
            "codec": "h264",
            "crf": 20,
            "ffmpeg_args": f"-preset veryfast -movflags +faststart -vf {COLOR}",
        },
    ),
    ".webm": Format(
        30,
        (1280, 720),
        {
            "codec": "libvpx-vp9",
            "crf": 32,
            "ffmpeg_args": f"-deadline realtime -cpu-used 8 -row-mt 1 -vf {COLOR}",
        },
    ),
    ".gif": Format(15, (640, 360), {"codec": "gif", "ffmpeg_args": f"-filter:v {PALETTE} -loop 0"}),
}
"""Formats by the suffix of the file: fast encoding, and a quick start in a browser."""

Film = Annotated[str | Path, output(*FORMATS)]
"""The file of a movie."""

check_fps = integer(at_least=1, at_most=100)
FrameRate = Annotated[int, check_fps]
"""Frames per second."""

SMALLEST, LARGEST = (320, 180), (3840, 2160)
"""Bounds of the size of a movie in pixels."""

MOST_FRAMES = 200_000
"""Largest number of frames: nearly two hours."""

GIF_MEMORY = 2**30
"""Largest number of bytes for the frames of a GIF, of which the encoder keeps all."""


def check_size(name: str, value: Any) -> tuple[int, int]:
    """Return the size (width, height) of a movie if both are even and inside their bounds."""
    allowed = "must be (width, height), even numbers from {} x {} to {} x {}"
    error = ArgumentError(name, value, allowed.format(*SMALLEST, *LARGEST))
    try:
        width, height = (check_integer(name, length) for length in value)
    except (TypeError, ValueError):
        raise error from None
    inside = SMALLEST[0] <= width <= LARGEST[0] and SMALLEST[1] <= height <= LARGEST[1]
    if not inside or width % 2 or height % 2:
        raise error
    return width, height


Size = Annotated[tuple[int, int], Described("(width, height)", check_size)]
"""Width and height of a movie in pixels."""


def frame_times(start: float, end: float, speed: float, fps: int) -> NDArray[np.float64]:
    """Return the times of a movie's frames (s), shape (T,).

    Raises
    ------
    ValueError
        The movie is so slow that it has too many frames.
    """
    if (end - start) * fps > MOST_FRAMES * speed:
        sentence = f"must be large enough for a movie of at most {MOST_FRAMES} frames"
        raise ArgumentError("speed", speed, sentence)
    times = np.arange(start, end + 1e-9, speed / fps)
    return np.minimum(times, end)  # rounding


def check_memory(path: Path, count: int, size: tuple[int, int]) -> None:
    """Check that the frames of a GIF fit into the memory set aside for them."""
    most = GIF_MEMORY // (4 * math.prod(size))
    if path.suffix.lower() == ".gif" and count > most:
        sentence = (
            f"a GIF of {size[0]} x {size[1]} pixels can have {most} frames, and this one has"
            f" {count}: choose a higher speed, a lower fps, a smaller size, or .mp4"
        )
        raise ArgumentError("path", str(path), sentence)


def speed_in_words(speed: float) -> str:
    """Return the speed of a movie as text, empty for real time."""
    return "" if speed == 1 else f"{speed:g} × real time"


def encode(
    frames: Iterable[NDArray[np.uint8]], count: int, path: Path, fps: int, size: tuple[int, int]
) -> None:
    """Write frames, each of shape (height, width, 3), to a movie.

    Parameters
    ----------
    frames : iterable of ndarray
        Drawn as they are needed.
    count : int
        Their number.
    path : Path
        Its suffix is one of those in `FORMATS`.
    fps : int
    size : (int, int)
        Width and height in pixels.

    Raises
    ------
    RuntimeError
        The encoder failed; the message includes its last output.
    """
    with _unmasked_interrupt(), _writer(path, fps, size) as writer:
        for frame in tqdm(frames, "render", count, unit="frame", disable=None):
            writer.add_image(frame)


@contextmanager
def _unmasked_interrupt() -> Iterator[None]:
    """Reraise Ctrl-C, which the writer's error about the end of ffmpeg would hide."""
    try:
        yield
    except RuntimeError as error:
        if isinstance(error.__context__, KeyboardInterrupt):
            raise error.__context__ from None
        raise


def _writer(path: Path, fps: int, size: tuple[int, int]) -> "VideoWriter":
    with extra("movies"):
        import imageio_ffmpeg
        import mediapy

    mediapy.set_ffmpeg(imageio_ffmpeg.get_ffmpeg_exe())
    options, (width, height) = FORMATS[path.suffix.lower()].options, size
    shape = height, width
    return mediapy.VideoWriter(path, shape, fps=fps, encoded_format="yuv420p", **options)
