"""The devices of the sliding disk and of the Langevin particle beside it."""

import math
import warnings
from collections.abc import Callable, Mapping
from typing import Any, Generic, TypeVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common.checks import check_array, check_integer, reject
from magmotor.device.device import Device, Engine, Equation, MujocoAdapter, register
from magmotor.device.initial import as_given, last_record
from magmotor.device.job import METHODS as MUJOCO
from magmotor.device.job import PLANAR as MUJOCO_PLANAR
from magmotor.device.job import Job
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
    """See `magmotor.device.device.Device`; of the particle, and what the disk shares with it."""

    time_unit = "1"
    measures = OF_LANGEVIN

    def methods(self, scene: S) -> tuple[str, ...]:
        """Names of the methods that the scene takes."""
        return splittings.methods(splittings.DISK, noise=scene.noise > 0)

    def check_run(
        self,
        scene: S,
        method: str,
        timestep: float,
        replicas: int | None,
        allow_unstable: bool = False,
    ) -> None:
        """Check what depends on the scene; of the timestep nothing if it may be unstable.

        Raises
        ------
        ValueError
            A timestep at which the method is linearly unstable.
        """
        if replicas is not None:
            check_integer("replicas", replicas, at_least=1)
        if allow_unstable or method == "scipy/dop853":
            return
        check_step_limit(scene, method, timestep)

    def initial_state(
        self, scene: S, initial: Mapping[str, Any] | xr.Dataset | None, replicas: int | None
    ) -> DiskStates:
        """The state that a run starts from, one row of all replicas; see `simulate` for `initial`.

        Raises
        ------
        ValueError
            Names the part, its value and the bound.
        """
        count = replicas or 1
        state = start_disk(scene, count)
        parts = [name for name in DiskStates._fields[1:] if getattr(state, name) is not None]
        if isinstance(initial, xr.Dataset):
            given = last_record(initial, parts)
        else:
            given = as_given(initial, parts)
        return state._replace(**{name: _row(name, value, count) for name, value in given.items()})

    def guard(self, scene: S, first: DiskStates) -> DiskGuard:
        """See `DiskGuard`."""
        return DiskGuard(scene, first)

    def columns(self, scene: S, states: DiskStates, replicas: int | None) -> dict[str, Column]:
        """The variables of a run's dataset."""
        values = {name: column for name, column in states._asdict().items() if column is not None}
        del values["time"]
        values["energy"] = energy(scene, states.x, states.v, states.omega)
        if replicas is None:
            return {k: Column(("time",), v[:, 0], "1", LABELS[k]) for k, v in values.items()}
        return {k: Column(("replica", "time"), v.T, "1", LABELS[k]) for k, v in values.items()}

    def energy_balance(self, run: xr.Dataset, scene: S) -> xr.Dataset:
        """Energy of a run against heat and work."""
        return disk_energy_balance(run, scene)

    @property
    def variational(self) -> Engine:
        """The reference integrators."""
        from magmotor.devices.disk import variational

        return variational

    def ensemble(self, scene: S) -> Callable[..., xr.Dataset]:
        """Of disk and particle, with statistics of their own."""
        from magmotor.devices.disk.ensemble.run import ensemble

        return ensemble

    def small_motion(self, scene: S) -> SmallMotion:
        """The disk where U is steepest."""
        return timesteps.small_motion(scene)

    @property
    def charted(self) -> Disk:
        """The paper's disk, for the particle, too."""
        return Disk()

    def rates(self, scene: S) -> tuple[float, ...]:
        """Of swing and friction, of the swing as temperature samples it, and of flights."""
        motion = small_motion(scene)
        decay = float(motion.decay.max())
        return motion.frequency, decay, _thermal_swing(scene), self._flights(scene)

    def _flights(self, scene: S) -> float:
        return 0.0

    def quantities(self, scene: S) -> tuple[str, ...]:
        """With noise temperature, without the path."""
        return ("temperature",) if scene.noise > 0 else ("position", "path")


class DiskDevice(LangevinDevice[Disk]):
    """See `magmotor.device.device.Device`."""

    measures = OF_DISK

    def methods(self, scene: Disk) -> tuple[str, ...]:
        """Names of the methods that the scene takes."""
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
        """Check what depends on the scene; of the timestep nothing if it may be unstable.

        Raises
        ------
        ValueError
            A timestep at which the method is linearly unstable.

        Warns
        -----
        UserWarning
            A timestep at which the flights that the temperature allows are aliased.
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
        """Equation (slidingdisk) without noise."""
        from magmotor.devices.disk import ode

        return ode

    def compose(self, scene: Disk, *, visual: bool) -> Any:
        """The disk as a PyMJCF tree."""
        from magmotor.devices.disk.mjcf import compose_disk

        return compose_disk(scene, visual=visual)

    def mujoco(self, job: Job) -> MujocoAdapter:
        """What is particular to a run in MuJoCo."""
        from magmotor.devices.disk.mjcf import DiskAdapter

        return DiskAdapter(job)

    def _flights(self, scene: Disk) -> float:
        return 1 / timesteps.largest_timestep(scene)

    def sliders(self, scene: Disk) -> dict[str, Slider]:
        """Friction and temperature."""
        return {
            "friction": positive(scene.friction, Disk().friction),
            "temperature": positive(1 / scene.beta, 1 / Disk().beta),
        }

    def scene_at(self, scene: Disk, values: Mapping[str, float]) -> Disk:
        """The scene with its sliders at these values."""
        friction = values["friction"]
        return scene.replace(friction=friction, noise=noise_at(friction, values["temperature"]))


DISK = DiskDevice()
LANGEVIN: LangevinDevice[LangevinParticle] = LangevinDevice()
register(DISK, Disk)
register(LANGEVIN, LangevinParticle)


def _row(name: str, value: Any, replicas: int) -> NDArray[np.float64]:
    label = f"initial[{name!r}]"
    row = check_array(label, value)
    if row.shape not in {(), (replicas,)}:
        raise reject(label, value, f"must be a finite number or {replicas} of them")
    return np.broadcast_to(row, (1, replicas)).copy()


def _thermal_swing(scene: Disk | LangevinParticle) -> float:
    """Root of <U''> = beta <U'^2> under Gibbs' measure: (h times it)^2 is how temperatures err."""
    if not (scene.noise and scene.coefficients):
        return 0.0
    x = np.linspace(0, 2 * np.pi, 4096, endpoint=False)
    squares = derivative(scene.coefficients, x, 1) ** 2
    return math.sqrt(scene.beta * np.average(squares, weights=position_density(scene, x)))
