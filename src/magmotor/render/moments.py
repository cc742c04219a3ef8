"""Moments: the states at a movie's times, between those that were recorded."""

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation, Slerp

from magmotor.devices.ball import states_of
from magmotor.states.ball import BallStates


def moments(run: xr.Dataset, times: ArrayLike) -> BallStates:
    """Interpolate a run: vectors linearly, orientations along the shortest turn.

    Parameters
    ----------
    run : xarray.Dataset
        With `orientation`, as from MuJoCo.
    times : array_like, shape (T,)
        In seconds, within the run.

    Raises
    ------
    ValueError
        The run has no orientation: its method follows the axis alone.
    """
    states, times = states_of(run), np.asarray(times, dtype=float)
    if states.orientation is None:
        method = run.attrs.get("method")
        raise ValueError(f"method = {method!r}: must be one of mujoco/* to draw the ball's spin")
    turns = Slerp(states.time, Rotation.from_quat(states.orientation, scalar_first=True))
    columns = {
        name: np.stack([np.interp(times, states.time, x) for x in getattr(states, name).T], axis=1)
        for name in ("position", "velocity", "axis", "angular_velocity")
    }
    return BallStates(time=times, **columns, orientation=turns(times).as_quat(scalar_first=True))
