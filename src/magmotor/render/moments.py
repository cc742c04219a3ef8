"""Moments: what a run shows at a movie's times, between those that were recorded."""

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from magmotor.analysis import checked_run
from magmotor.checks import reject
from magmotor.scenes import Motor, Top

Array = NDArray[np.float64]


def joints(run: xr.Dataset, scene: Top | Motor, times: Array) -> Array:
    """MuJoCo's joint coordinates at some times (s), shape (T, nq): orientations turn evenly.

    Raises
    ------
    ValueError
        The run has replicas, or no orientation: its method follows the axis alone.
    """
    if "orientation" not in run:
        method = run.attrs.get("method")
        raise reject("method", method, "mujoco/* or variational/* to draw the ball's spin")
    turning = tuple(name for name in ("orientation", "ring_orientation") if name in run)
    run = checked_run("run", run, turning, (type(scene),), replicas=False)
    linear = 2 if scene.surface == "planar" else 3
    columns = [between(run, column, times) for column in run.position.values.T[:linear]]
    for name in turning:
        turns = Slerp(run.time.values, Rotation.from_quat(run[name], scalar_first=True))
        columns += [*turns(times).as_quat(scalar_first=True).T]
    return np.stack(columns, axis=1)


def between(run: xr.Dataset, values: Array, times: Array) -> Array:
    """Values of a run's records at other times (s), by linear interpolation."""
    return np.interp(times, run.time.values, values)
