"""Movies of a recorded run, and single frames of one."""

import xarray as xr

from magmotor.common.checks import reject
from magmotor.common.hints import Picture, Positive
from magmotor.common.optional import extra
from magmotor.device.analysis import analysis
from magmotor.device.device import Scene
from magmotor.render.encoder import Film, encode, frame_times, speed_in_words
from magmotor.render.frames import Frames, checked_movie_run


@analysis(of=Scene, records=2, replicas=False)
def movie(
    run: xr.Dataset,
    scene: Scene | None,
    path: Film,
    *,
    seconds_per_second: Positive = 1.0,
) -> None:
    """Write a movie of a recorded run: the scene, the ball's trail, and a growing curve.

    The curve is J(t) for the top and the azimuth theta(t) of the ball for the motor.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate` without replicas; for the top not by scipy/dop853, which has no orientation.
    scene : Top, Motor or None
        Its scene; None takes it from the attributes of the run.
    path : str or Path
        The .mp4 file to write: H.264, 1280 x 720, 20 frames per second.
    seconds_per_second : float
        Simulated seconds per second of the movie.

    Raises
    ------
    ValueError
        The run has replicas or no orientation, the scene's class has no movies, or the speed is not
        positive.
    NoOpenGL
        No OpenGL context can be created; nothing is written.
    RuntimeError
        The encoder failed; the message includes its last output.
    """
    assert scene is not None  # `analysis` has filled it in
    run = checked_movie_run(run, scene)
    start, end = run.time.values[[0, -1]]
    times = frame_times(start, end, seconds_per_second)
    with Frames(run, scene, times, speed_in_words(seconds_per_second)) as frames:
        encode(frames.draw, len(frames), path)


@analysis(of=Scene, records=2, replicas=False)
def still(run: xr.Dataset, scene: Scene | None, path: Picture, time: float) -> None:
    """Write one frame of the movie, at a time in seconds; other arguments as in `movie`."""
    assert scene is not None  # `analysis` has filled it in
    run = checked_movie_run(run, scene)
    start, end = run.time.values[[0, -1]]
    if not start <= time <= end:
        raise reject("time", time, f"must be within the run: {start:g} to {end:g} s")
    with extra("movies"):
        from PIL import Image

    with Frames(run, scene, [time]) as frames:
        Image.fromarray(frames.draw(0)).save(path, optimize=True)
