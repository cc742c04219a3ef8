"""What the devices with a ball on a plane share."""

from typing import Any, Generic, TypeVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from magmotor.common.checks import check_number, reject
from magmotor.device.analysis import checked_run
from magmotor.device.device import Device
from magmotor.device.movie import between
from magmotor.devices.ball.scene import BallScene

S = TypeVar("S", bound=BallScene)
T = TypeVar("T", bound=tuple[Any, ...])


class BallDevice(Device[S, T], Generic[S, T]):
    """A device with a ball, held on its plane or borne by it."""

    def contact_limit(self, scene: S, method: str) -> float:
        """Timestep (s) at which the contact that bears the ball is unstable, if one does."""
        if scene.surface != "plane":
            return np.inf
        from magmotor.mjcf.viscous_contact import bearing_limit

        return bearing_limit(method.split("/")[1])

    def check_contact(self, scene: S, method: str, timestep: float) -> None:
        """Check a timestep against the contact that bears the ball, if one does.

        Raises
        ------
        ValueError
            Names the timestep and the limit.
        """
        limit = self.contact_limit(scene, method)
        check_number("timestep", timestep, below=limit, unit="s on a plane that bears the ball")

    def joints(self, run: xr.Dataset, scene: S, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """MuJoCo's joint coordinates at some times (s), shape (T, nq): orientations turn evenly.

        Raises
        ------
        ValueError
            The run has replicas, or no orientation: its method follows the axis alone.
        """
        if "orientation" not in run:
            method = run.attrs.get("method")
            raise reject(
                "method", method, "must be mujoco/* or variational/* to draw the ball's spin"
            )
        turning = tuple(name for name in ("orientation", "ring_orientation") if name in run)
        run = checked_run("run", run, turning, (type(scene),), replicas=False)
        linear = 2 if scene.surface == "planar" else 3
        columns = [between(run, column, times) for column in run.position.values.T[:linear]]
        for name in turning:
            turns = Slerp(run.time.values, Rotation.from_quat(run[name], scalar_first=True))
            columns += [*turns(times).as_quat(scalar_first=True).T]
        return np.stack(columns, axis=1)

    def why_lost(self, scene: S, model: Any, data: Any) -> str:
        """Why a planar scene's ball would not stay on its plane; empty if it does."""
        lift = data.xfrc_applied[model.body("ball").id, 2]
        if scene.surface == "planar" and lift > scene.weight:
            return lifted(lift, scene.weight)
        return ""


LIFTED = "ball lifted"
"""The event that ends a run whose magnets lift a ball that the scene holds on its plane."""


def lifted(lift: Any, weight: float) -> str:
    """What to say of a lift and a weight, both in N."""
    return (
        f"the magnetic lift, {lift:.3g} N, exceeds the ball's weight, {weight:.3g} N, and the"
        " plane cannot hold it down: use a larger gravity or surface = 'plane'"
    )
