"""How the motor's ball goes round, and how its inner ring is turned."""

import math

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common.checks import reject
from magmotor.device.analysis import analysis
from magmotor.devices.ball.scene import BallScene
from magmotor.devices.motor.scene import Motor

LARGEST_TURN = math.pi / 2
"""By how much (rad) the ball may go round between two records, for its turns to be counted."""


@analysis("position", of=BallScene)
def azimuth(run: xr.Dataset) -> xr.DataArray:
    """Angle theta in rad by which the ball has gone round the center, from the x axis, unwrapped.

    Parameters
    ----------
    run : xarray.Dataset
        Of a `Motor`, with the ball moving by much less than half a turn between records.

    Raises
    ------
    ValueError
        It turns by more than a quarter between two records: which way round is then uncertain.
    """
    x, y = run.position.sel(space="x"), run.position.sel(space="y")
    theta = np.unwrap(np.arctan2(y.values, x.values))
    _check_turns(theta, "or the ball went through the center")
    return _angle(theta, x, "azimuth of the ball, unwrapped")


@analysis("ring_axis", "ring_orientation", of=Motor)
def ring_attitude(run: xr.Dataset) -> xr.Dataset:
    """Tilt and yaw of the inner ring, in rad.

    The ring's rotation is a turn by `yaw` about the vertical, followed by the smallest turn that
    brings e_z to zeta_3, which is by `tilt`: its decomposition into twist and swing.

    Returns
    -------
    xarray.Dataset
        `tilt`, the angle between zeta_3 and the vertical, and `yaw` = 2 atan2(q_z, q_w), unwrapped.

    Raises
    ------
    ValueError
        The ring turns by more than a quarter between two records.
    """
    x, y, z = np.moveaxis(run.ring_axis.values, -1, 0)
    twist = run.ring_orientation.values[..., [0, 3]]
    yaw = np.unwrap(2 * np.arctan2(twist[..., 1], twist[..., 0]))
    _check_turns(yaw, "or the ring is upside down")
    like = run.ring_axis.isel(space=0)
    return xr.Dataset(
        {
            "tilt": _angle(np.arctan2(np.hypot(x, y), z), like, "tilt of the inner ring"),
            "yaw": _angle(yaw, like, "yaw of the inner ring, unwrapped"),
        }
    )


def _check_turns(angle: NDArray[np.float64], other: str) -> None:
    turn = float(np.abs(np.diff(angle)).max(initial=0.0))
    if turn > LARGEST_TURN:
        sentence = f"must be at most 1.57 rad: record more often, {other}"
        raise reject("largest turn between two records", round(turn, 2), sentence)


def _angle(values, like: xr.DataArray, label: str) -> xr.DataArray:
    bare = like.reset_coords(drop=True)
    return bare.copy(data=values).assign_attrs(units="rad", long_name=label)
