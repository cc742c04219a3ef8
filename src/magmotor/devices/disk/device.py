"""What the front door knows of the sliding disk and of the Langevin particle."""

import warnings
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common.checks import check_array, check_integer, reject
from magmotor.device.guard import ENERGY_GREW, LARGEST_ERROR, Fault, FirstFailure
from magmotor.device.initial import as_given, last_record
from magmotor.device.job import METHODS as MUJOCO
from magmotor.device.job import PLANAR as MUJOCO_PLANAR
from magmotor.device.states import Column
from magmotor.devices.disk.observables import energy
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.devices.disk.states import DiskStates, start_disk
from magmotor.devices.disk.theory.stationary import temperature
from magmotor.devices.disk.theory.steps import largest_timestep
from magmotor.numerics import splittings as schemes
from magmotor.run.step_limits import check_step_limit

LARGEST_FLUCTUATION = 200.0
"""Energy, in kT, that the noise never gives: the probability is e^-200 a sample."""


class Guard(FirstFailure):
    """Finds the first wrong row among recorded states of a scene.

    Parameters
    ----------
    scene : Disk or LangevinParticle
    first : DiskStates
        The initial state; it sets the energy that the motion may have.
    """

    def __init__(self, scene: Disk | LangevinParticle, first: DiskStates):
        self.scene = scene
        self.depth = sum(abs(a) + abs(b) for a, b in scene.coefficients)
        self.start = energy(scene, first.x, first.v, first.omega).max()
        self.largest_fluctuation = LARGEST_FLUCTUATION * temperature(scene)

    def _faults(self, states: DiskStates) -> Iterator[Fault]:
        found = energy(self.scene, states.x, states.v, states.omega)
        in_play = found + 2 * self.depth  # at least the kinetic energy and the well's depth
        allowed = np.maximum(self.largest_fluctuation, LARGEST_ERROR * in_play)
        yield (found > self.start + allowed).any(axis=1), lambda _: ENERGY_GREW


guard = Guard

__all__ = ["check_run", "columns", "guard", "initial_state", "methods"]

Scene = Disk | LangevinParticle

TIME_UNIT = "1"

LABELS = {
    "x": "displacement",
    "v": "velocity",
    "theta": "angle",
    "omega": "angular velocity",
    "energy": "total energy E = v^2/2 + sigma omega^2/2 + U(x)",
}


def methods(scene: Scene) -> tuple[str, ...]:
    """Names of the methods that the scene takes."""
    variational = schemes.methods(schemes.DISK, noise=scene.noise > 0)
    if isinstance(scene, LangevinParticle):
        return variational
    if scene.surface == "plane":
        return MUJOCO
    return (*variational, *MUJOCO_PLANAR, *(() if scene.noise else ("scipy/dop853",)))


def check_run(
    scene: Scene,
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
    if replicas is not None:
        check_integer("replicas", replicas, at_least=1)
    if allow_unstable or method == "scipy/dop853":
        return
    check_step_limit(scene, method, timestep)
    if isinstance(scene, Disk) and scene.coefficients and scene.noise:
        largest = largest_timestep(scene)
        if timestep > largest:
            warnings.warn(
                f"timestep = {timestep:g}: above {largest:.3g} = (pi/6) sqrt((1 + sigma) beta), the"
                " largest safe one; long flights are aliased, since a step in which x moves by a"
                " period of U looks like rest",
                stacklevel=5,
            )


def initial_state(
    scene: Scene, initial: Mapping[str, Any] | xr.Dataset | None, replicas: int | None
) -> DiskStates:
    """The state that a run starts from, as one row of all replicas; see `simulate` for `initial`.

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


def _row(name: str, value: Any, replicas: int) -> NDArray[np.float64]:
    label = f"initial[{name!r}]"
    row = check_array(label, value)
    if row.shape not in {(), (replicas,)}:
        raise reject(label, value, f"a finite number or {replicas} of them")
    return np.broadcast_to(row, (1, replicas)).copy()


def columns(scene: Scene, states: DiskStates, replicas: int | None) -> dict[str, Column]:
    """The variables of a run's dataset."""
    values = {name: column for name, column in states._asdict().items() if column is not None}
    del values["time"]
    values["energy"] = energy(scene, states.x, states.v, states.omega)
    if replicas is None:
        return {k: Column(("time",), v[:, 0], "1", LABELS[k]) for k, v in values.items()}
    return {k: Column(("replica", "time"), v.T, "1", LABELS[k]) for k, v in values.items()}
