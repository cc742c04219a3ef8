"""Azimuth of the motor's ball, and tilt and yaw of its inner ring."""

import math

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common.exceptions import ArgumentError
from magmotor.device.analysis import analysis
from magmotor.device.observable import Observable, labeled
from magmotor.devices.ball.scene import BallScene
from magmotor.devices.motor.scene import Motor

LARGEST_STEP = math.pi / 2
"""Largest rotation (rad) between two records whose direction is unambiguous."""


def _azimuth(run: xr.Dataset, scene: BallScene | None) -> xr.DataArray:
    x, y = run.position.sel(space="x"), run.position.sel(space="y")
    theta = np.unwrap(np.arctan2(y.values, x.values))
    _check_steps(theta, "or the ball went through the center")
    return x.reset_coords(drop=True).copy(data=theta)


AZIMUTH = Observable(_azimuth, "rad", "azimuth of the ball, unwrapped")


@analysis("position", of=BallScene)
def azimuth(run: xr.Dataset) -> xr.DataArray:
    """Compute the azimuth of the ball from the x axis in rad, unwrapped.

    Parameters
    ----------
    run : xarray.Dataset
        A run in which the ball goes around by much less than half a revolution between records.

    Raises
    ------
    ValueError
        The azimuth changes by more than a quarter revolution between two records, so that its
        direction is ambiguous.
    """
    return AZIMUTH(run, None)


@analysis("ring_axis", "ring_orientation", of=Motor)
def ring_attitude(run: xr.Dataset) -> xr.Dataset:
    """Compute tilt and yaw of the inner ring in rad.

    They are the swing-twist decomposition of the ring's rotation: a rotation by `yaw` about the
    vertical, followed by the smallest rotation from e_z to zeta_3, whose angle is `tilt`.

    Returns
    -------
    xarray.Dataset
        `tilt`, the angle between zeta_3 and the vertical, and `yaw` = 2 atan2(q_z, q_w), unwrapped.

    Raises
    ------
    ValueError
        The yaw changes by more than a quarter revolution between two records.
    """
    x, y, z = np.moveaxis(run.ring_axis.values, -1, 0)
    twist = run.ring_orientation.values[..., [0, 3]]
    yaw = np.unwrap(2 * np.arctan2(twist[..., 1], twist[..., 0]))
    _check_steps(yaw, "or the ring is upside down")
    like = run.ring_axis.isel(space=0).reset_coords(drop=True)
    data = {"tilt": like.copy(data=np.arctan2(np.hypot(x, y), z)), "yaw": like.copy(data=yaw)}
    labels = {
        "tilt": ("rad", "tilt of the inner ring"),
        "yaw": ("rad", "yaw of the inner ring, unwrapped"),
    }
    return labeled(xr.Dataset(data), labels)


def _check_steps(angle: NDArray[np.float64], other: str) -> None:
    step = float(np.abs(np.diff(angle)).max(initial=0.0))
    if step > LARGEST_STEP:
        sentence = f"must be at most 1.57 rad: record more often, {other}"
        raise ArgumentError("largest rotation between two records", round(step, 2), sentence)
