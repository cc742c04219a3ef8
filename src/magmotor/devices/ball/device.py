"""The common base of the devices with a ball on a plane."""

from typing import Any, Generic, TypeVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common.checks import check_number
from magmotor.common.exceptions import ArgumentError
from magmotor.device.analysis import checked_run
from magmotor.device.device import Device
from magmotor.device.movie import between
from magmotor.device.readout import Readout
from magmotor.devices.ball.scene import BallScene

S = TypeVar("S", bound=BallScene)
T = TypeVar("T", bound=tuple[Any, ...])


class BallDevice(Device[S, T], Generic[S, T]):
    """A device with a ball, which is constrained to a plane or borne by it."""

    def check_field(self, scene: S, method: str, field: str, plain: S) -> None:
        """Check that a method that can integrate the scene `plain` can also have a field.

        Raises
        ------
        ValueError
            It cannot; the message names the field and the methods that can.
        """
        able = self.methods(scene)
        if method not in able and method in self.methods(plain):
            reason = f"cannot have {field} = {getattr(scene, field)}"
            raise ArgumentError("method", method, f"{reason}: must be one of {', '.join(able)}")

    def contact_limit(self, scene: S, method: str) -> float:
        """Return the timestep (s) at which the contact that bears the ball becomes unstable."""
        if scene.surface != "plane":
            return np.inf
        from magmotor.mjcf.viscous_contact import bearing_limit

        return bearing_limit(method.split("/")[1])

    def check_contact(self, scene: S, method: str, timestep: float) -> None:
        """Check that the contact that bears the ball, if any, is stable at a timestep.

        Raises
        ------
        ValueError
            The contact is unstable; the message names the timestep and the limit.
        """
        limit = self.contact_limit(scene, method)
        check_number("timestep", timestep, below=limit, unit="s on a plane that bears the ball")

    def joints(self, run: xr.Dataset, scene: S, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return MuJoCo's `qpos` at these times (s), shape (T, nq), with interpolated orientations.

        Raises
        ------
        ValueError
            The run has replicas, or no orientations, because its method computes the axis only.
        """
        from scipy.spatial.transform import Rotation, Slerp

        if "orientation" not in run:
            sentence = (
                "the dataset must also have orientation, as runs by mujoco/* and variational/* do"
            )
            raise ArgumentError("run", [*map(str, run.data_vars)], sentence)
        rotations = tuple(name for name in ("orientation", "ring_orientation") if name in run)
        run = checked_run("run", run, rotations, (type(scene),), replicas=False)
        linear = 2 if scene.surface == "planar" else 3
        columns = [between(run, column, times) for column in run.position.values.T[:linear]]
        for name in rotations:
            rotation = Slerp(run.time.values, Rotation.from_quat(run[name], scalar_first=True))
            columns += [*rotation(times).as_quat(scalar_first=True).T]
        return np.stack(columns, axis=1)

    def readouts(self, scene: S) -> dict[str, Readout]:
        """Return J, the spin about the ball's axis, and the azimuth of the ball."""
        return {
            "J": Readout("kg m^2/s", lambda now: now["momentum_map"]),
            "spin": Readout("rad/s", lambda now: now["angular_velocity"] @ now["axis"]),
            "azimuth": Readout(
                "rad", lambda now: np.arctan2(*now["position"][1::-1]), period=2 * np.pi
            ),
        }

    def why_lost(self, scene: S, model: Any, data: Any) -> str:
        """Return why the ball of a planar scene would leave its plane; empty if it would not."""
        lift = data.xfrc_applied[model.body("ball").id, 2]
        if scene.surface == "planar" and lift > scene.weight:
            return lifted(lift, scene.weight)
        return ""


LIFTED = "ball lifted"
"""The event that ends a run whose magnets lift a ball that the scene holds on its plane."""


def lifted(lift: Any, weight: float) -> str:
    """Return the reason for the event, from lift and weight in N."""
    return (
        f"the magnetic lift, {lift:.3g} N, exceeds the ball's weight, {weight:.3g} N, and the"
        " plane cannot hold it down: use a larger gravity or surface = 'plane'"
    )


ROLLED_OFF = "ball rolled off"
"""The event that ends a run whose ball is far from the rings, on a tilted floor or under a load."""


def rolled_off(apart: float, edge: float) -> str:
    """Return the reason for the event, from the distance and its bound in m."""
    return f"the ball is {apart:.4f} m from the center, beyond {edge:.4f} m, where no ring holds it"
