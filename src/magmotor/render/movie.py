"""Movies: frames drawn by several processes, and put in order into one file."""

import atexit
import os
import pickle
import signal
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from itertools import chain
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import current_thread, main_thread
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from tqdm import tqdm

from magmotor.render.frames import HEIGHT, WIDTH, Frames
from magmotor.scenes import Top
from magmotor.scenes.fields import check_number, reject

if TYPE_CHECKING:
    from mediapy import VideoWriter

FRAME_RATE = 25
"""Frames a second."""

ENCODING = (
    "-preset veryfast -movflags +faststart -vf scale=out_color_matrix=bt709"
    " -colorspace bt709 -color_primaries bt709 -color_trc bt709"
)
"""Quick to write and to start in a browser, with the colours of high-definition video."""


def movie(
    run: xr.Dataset, scene: Top, path: str | Path, *, seconds_per_second: float = 1.0
) -> None:
    """Write the movie of a recorded run: ball, ring, trail of the path, and J(t) as it happens.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate` with a MuJoCo method.
    scene : Top
        Its scene.
    path : str or Path
        The .mp4 file to write: H.264, 1280 x 720, 25 frames a second.
    seconds_per_second : float
        Seconds of the run in a second of the movie.

    Raises
    ------
    ValueError
        The run has no orientation, or a speed that is not positive.
    NoOpenGL
        No OpenGL context can be made; nothing is written.
    """
    check_number("seconds_per_second", seconds_per_second, above=0)
    start, end = run.time.values[[0, -1]]
    times = np.arange(start, end + 1e-9, seconds_per_second / FRAME_RATE)
    note = "" if seconds_per_second == 1 else f"{seconds_per_second:g} × real time"
    frames = Frames(run, scene, times, note)
    with frames:
        first = frames.draw(0)  # here, so that an error needs no other process and no file
    # Starting a process costs as much as some 20 frames.
    workers = min(len(frames) // 50 + 1, os.cpu_count() or 1, 4)
    with ExitStack() as stack:
        parcel = Path(stack.enter_context(TemporaryDirectory())) / "frames"
        parcel.write_bytes(pickle.dumps(frames))
        with _interrupts_ignored():
            writer = stack.enter_context(_writer(path))
            pool = ProcessPoolExecutor(workers, get_context("spawn"), _open_parcel, (parcel,))
            stack.callback(pool.shutdown, cancel_futures=True)
            others = pool.map(_draw, range(1, len(frames)))
        in_order = chain([first], others)
        for frame in tqdm(in_order, "render", len(frames), unit="frame", disable=None):
            writer.add_image(frame)


def still(run: xr.Dataset, scene: Top, path: str | Path, time: float) -> None:
    """Write one frame of the movie, at a time in seconds; arguments and errors as in `movie`."""
    start, end = run.time.values[[0, -1]]
    if not start <= time <= end:
        raise reject("time", time, f"within the run: {start:g} to {end:g} s")
    from PIL import Image

    with Frames(run, scene, [time]) as frames:
        Image.fromarray(frames.draw(0)).save(path, optimize=True)


def _writer(path: str | Path) -> "VideoWriter":
    import imageio_ffmpeg
    import mediapy

    mediapy.set_ffmpeg(imageio_ffmpeg.get_ffmpeg_exe())
    return mediapy.VideoWriter(
        path, (HEIGHT, WIDTH), fps=FRAME_RATE, crf=20, encoded_format="yuv420p", ffmpeg_args=ENCODING
    )


@contextmanager
def _interrupts_ignored() -> Iterator[None]:
    """Start processes that Ctrl-C does not reach; it ends their work through this one.

    Python's processes inherit that the signal is ignored, ffmpeg only that it is blocked. For as
    long as this takes, some milliseconds, Ctrl-C is lost here too.
    """
    if os.name != "posix" or current_thread() is not main_thread():
        yield
        return
    handler = signal.signal(signal.SIGINT, signal.SIG_IGN)
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        signal.signal(signal.SIGINT, handler)


_frames: Frames
_open = False


def _open_parcel(parcel: Path) -> None:
    global _frames
    _frames = pickle.loads(parcel.read_bytes())


def _draw(i: int) -> NDArray[np.uint8]:
    global _open
    if not _open:
        _frames.__enter__()
        atexit.register(_frames.__exit__)
        _open = True
    return _frames.draw(i)
