"""Movies of a recorded run, and single frames of them."""

import xarray as xr

from magmotor.common.checks import reject
from magmotor.common.hints import Picture, Positive
from magmotor.device.analysis import analysis
from magmotor.device.device import Scene
from magmotor.render.encoder import Film, encode, frame_times, speed_in_words
from magmotor.render.frames import Frames, filmed


@analysis(of=Scene, records=2, replicas=False)
def movie(
    run: xr.Dataset,
    scene: Scene | None,
    path: Film,
    *,
    seconds_per_second: Positive = 1.0,
) -> None:
    """Write the movie of a recorded run: the scene, the ball's trail, and a curve as it happens.

    The curve is J(t) of the top, the azimuth theta(t) of the motor's ball.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate` without replicas; of the top not by scipy/dop853, which has no orientation.
    scene : Top, Motor or None
        Its scene; None, the one that the attributes of the run tell.
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
    assert scene is not None  # the run's own by now
    run = filmed(run, scene)
    start, end = run.time.values[[0, -1]]
    times = frame_times(start, end, seconds_per_second)
    with Frames(run, scene, times, speed_in_words(seconds_per_second)) as frames:
        encode(frames.draw, len(frames), path)


@analysis(of=Scene, records=2, replicas=False)
def still(run: xr.Dataset, scene: Scene | None, path: Picture, time: float) -> None:
    """Write one frame of the movie, at a time in seconds; arguments and errors as in `movie`."""
    assert scene is not None  # the run's own by now
    run = filmed(run, scene)
    start, end = run.time.values[[0, -1]]
    if not start <= time <= end:
        raise reject("time", time, f"must be within the run: {start:g} to {end:g} s")
    from PIL import Image

    with Frames(run, scene, [time]) as frames:
        Image.fromarray(frames.draw(0)).save(path, optimize=True)
