"""The devices of the sliding disk and of the Langevin particle."""

import math
import warnings
from collections.abc import Callable, Mapping
from typing import Any, Generic, TypeVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common.checks import check_integer
from magmotor.device.device import Device, register
from magmotor.device.engine import Engine, Equation, MujocoAdapter
from magmotor.device.initial import initial_parts, initial_row
from magmotor.device.job import METHODS as MUJOCO
from magmotor.device.job import PLANAR as MUJOCO_PLANAR
from magmotor.device.job import Job
from magmotor.device.readout import Readout
from magmotor.device.sliders import Slider, noise_at, positive
from magmotor.device.states import Column
from magmotor.device.step_limits import check_step_limit, small_motion
from magmotor.devices.disk.energy_balance import disk_energy_balance
from magmotor.devices.disk.guard import DiskGuard
from magmotor.devices.disk.measures import OF_DISK, OF_LANGEVIN
from magmotor.devices.disk.observables import energy
from magmotor.devices.disk.scene import Disk, LangevinParticle, derivative
from magmotor.devices.disk.states import DiskStates, start_disk
from magmotor.devices.disk.theory import timesteps
from magmotor.devices.disk.theory.stationary import position_density
from magmotor.numerics import splittings
from magmotor.numerics.linear_stability import SmallMotion

S = TypeVar("S", Disk, LangevinParticle)

LABELS = {
    "x": "displacement",
    "v": "velocity",
    "theta": "angle",
    "omega": "angular velocity",
    "energy": "total energy E = v^2/2 + sigma omega^2/2 + U(x)",
}


class LangevinDevice(Device[S, DiskStates], Generic[S]):
    """The device of the Langevin particle, and the base of the disk's; see `Device`."""

    time_unit = "1"
    measures = OF_LANGEVIN
    ensemble_dimensions = frozenset(
        ("lag", "x_bin", "v_bin", "omega_bin", "flight_duration", "path_replica")
    )

    def methods(self, scene: S) -> tuple[str, ...]:
        """Return the names of the methods that can integrate the scene."""
        return splittings.methods(splittings.DISK, noise=scene.noise > 0)

    def check_run(
        self,
        scene: S,
        method: str,
        timestep: float,
        replicas: int | None,
        allow_unstable: bool = False,
    ) -> None:
        """Check the replicas, and unless `allow_unstable` the timestep.

        Raises
        ------
        ValueError
            The method is linearly unstable at this timestep.
        """
        if replicas is not None:
            check_integer("replicas", replicas, at_least=1)
        if allow_unstable or method == "scipy/dop853":
            return
        check_step_limit(scene, method, timestep)

    def initial_state(
        self, scene: S, initial: Mapping[str, Any] | xr.Dataset | None, replicas: int | None
    ) -> DiskStates:
        """Return the initial state of all replicas, as one row; see `simulate` for `initial`.

        Raises
        ------
        ValueError
            A part is unknown or invalid; the message names the part, its value and the bound.
        """
        count = replicas or 1
        state = start_disk(scene, count)
        names = [name for name in DiskStates._fields[1:] if getattr(state, name) is not None]
        given = initial_parts(initial, names)
        rows = {name: initial_row(name, value, count) for name, value in given.items()}
        return state._replace(**rows)

    def guard(self, scene: S, first: DiskStates) -> DiskGuard:
        """Return the guard of a run; see `DiskGuard`."""
        return DiskGuard(scene, first)

    def columns(self, scene: S, states: DiskStates, replicas: int | None) -> dict[str, Column]:
        """Return the variables of a run's dataset."""
        values = {name: column for name, column in states._asdict().items() if column is not None}
        del values["time"]
        values["energy"] = energy(scene, states.x, states.v, states.omega)
        if replicas is None:
            return {k: Column(("time",), v[:, 0], "1", LABELS[k]) for k, v in values.items()}
        return {k: Column(("replica", "time"), v.T, "1", LABELS[k]) for k, v in values.items()}

    def energy_balance(self, run: xr.Dataset, scene: S) -> xr.Dataset:
        """Return the energy balance of a run."""
        return disk_energy_balance(run, scene)

    @property
    def variational(self) -> Engine:
        """The reference integrators."""
        from magmotor.devices.disk import variational

        return variational

    def ensemble(self, scene: S) -> Callable[..., xr.Dataset]:
        """Return the function for ensembles of disk and particle, which have more statistics."""
        from magmotor.devices.disk.ensemble.run import ensemble

        return ensemble

    def ensemble_times(
        self, scene: S, timestep: float, duration: float, sample_interval: int, burn_in: float
    ) -> NDArray[np.float64]:
        """Return the times of an ensemble's records, with logarithmic and with even spacing."""
        from magmotor.devices.disk.ensemble.result import plan

        return plan(timestep, duration, sample_interval, burn_in).times(timestep)

    def small_motion(self, scene: S) -> SmallMotion:
        """Linearize the motion where |U''| is largest."""
        return timesteps.small_motion(scene)

    @property
    def charted(self) -> Disk:
        """The paper's disk, also for the particle."""
        return Disk()

    def rates(self, scene: S) -> tuple[float, ...]:
        """Return the rates of swing, friction, thermal swing and flights."""
        motion = small_motion(scene)
        decay = float(motion.decay.max())
        return motion.frequency, decay, _thermal_swing(scene), self._flight_rate(scene)

    def _flight_rate(self, scene: S) -> float:
        return 0.0

    def quantities(self, scene: S) -> tuple[str, ...]:
        """Return temperature with noise, position and path without."""
        return ("temperature",) if scene.noise > 0 else ("position", "path")


class DiskDevice(LangevinDevice[Disk]):
    """The device of the disk; see `Device`."""

    measures = OF_DISK

    def methods(self, scene: Disk) -> tuple[str, ...]:
        """Return the names of the methods that can integrate the scene."""
        if scene.surface == "plane":
            return MUJOCO
        exact = () if scene.noise else ("scipy/dop853",)
        return (*super().methods(scene), *MUJOCO_PLANAR, *exact)

    def check_run(
        self,
        scene: Disk,
        method: str,
        timestep: float,
        replicas: int | None,
        allow_unstable: bool = False,
    ) -> None:
        """Check the replicas, and unless `allow_unstable` the timestep.

        Raises
        ------
        ValueError
            The method is linearly unstable at this timestep.

        Warns
        -----
        UserWarning
            At this timestep, thermal flights are aliased.
        """
        super().check_run(scene, method, timestep, replicas, allow_unstable)
        if allow_unstable or method == "scipy/dop853" or not (scene.coefficients and scene.noise):
            return
        largest = timesteps.largest_timestep(scene)
        if timestep > largest:
            warnings.warn(
                f"timestep = {timestep:g}: above {largest:.3g} = (pi/6) sqrt((1 + sigma) beta), the"
                " largest safe one; long flights are aliased, since a step in which x moves by a"
                " period of U looks like rest",
                stacklevel=5,
            )

    @property
    def ode(self) -> Equation:
        """The equation (slidingdisk) without noise."""
        from magmotor.devices.disk import ode

        return ode

    def compose(self, scene: Disk, *, visual: bool) -> Any:
        """Return the disk as a PyMJCF tree."""
        from magmotor.devices.disk.mjcf import compose_disk

        return compose_disk(scene, visual=visual)

    def mujoco(self, job: Job) -> MujocoAdapter:
        """Return the adapter of a run in MuJoCo."""
        from magmotor.devices.disk.mjcf import DiskAdapter

        return DiskAdapter(job)

    def _flight_rate(self, scene: Disk) -> float:
        return 1 / timesteps.largest_timestep(scene)

    def sliders(self, scene: Disk) -> dict[str, Slider]:
        """Return the sliders of friction and temperature."""
        return {
            "friction": positive(scene.friction, Disk().friction, "1"),
            "temperature": positive(1 / scene.beta, 1 / Disk().beta, "1"),
        }

    def readouts(self, scene: Disk) -> dict[str, Readout]:
        """Return the displacement and d = -v + sigma omega, which friction does not damp."""
        return {
            "x": Readout("1", lambda now: now["x"]),
            "d": Readout("1", lambda now: scene.sigma * now["omega"] - now["v"]),
        }

    def scene_at(self, scene: Disk, values: Mapping[str, float]) -> Disk:
        """Return the scene with its sliders at these values."""
        friction = values["friction"]
        return scene.replace(friction=friction, noise=noise_at(friction, values["temperature"]))


DISK = DiskDevice()
LANGEVIN: LangevinDevice[LangevinParticle] = LangevinDevice()
register(DISK, Disk)
register(LANGEVIN, LangevinParticle)


def _thermal_swing(scene: Disk | LangevinParticle) -> float:
    """Return sqrt <U''> = sqrt(beta <U'^2>) in the Gibbs measure.

    The relative error of temperatures is the square of this rate times the timestep.
    """
    if not (scene.noise and scene.coefficients):
        return 0.0
    if isinstance(scene, Disk):
        scene = scene.replace(drag_temperature=None)
    x = np.linspace(0, 2 * np.pi, 4096, endpoint=False)
    squares = derivative(scene.coefficients, x, 1) ** 2
    return math.sqrt(scene.beta * np.average(squares, weights=position_density(scene, x)))
