"""Exceptions for runs that end early; they keep everything that was recorded."""

from pathlib import Path
from typing import Any

import xarray as xr

from magmotor.common.exceptions import MagmotorError


class SimulationStopped(MagmotorError, RuntimeError):
    """A run has ended early: `SimulationDiverged` or `PhysicalEvent`.

    Attributes
    ----------
    reason : str
    time : float
        The first recorded time that is not in `dataset`.
    method : str
    timestep : float
    dataset : xarray.Dataset
        The records before that time.
    """

    def __init__(self, reason: str, time: float, dataset: xr.Dataset):
        self.reason, self.time, self.dataset = reason, time, dataset
        self.method, self.timestep = dataset.attrs["method"], dataset.attrs["timestep"]
        timestep, after = (_with_unit(each, dataset) for each in (self.timestep, time))
        super().__init__(f"{self.method} with timestep {timestep} stopped at t = {after}: {reason}")

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle all arguments, as worker processes require."""
        return type(self), (self.reason, self.time, self.dataset)


class SimulationDiverged(SimulationStopped):
    """The method has failed: a value is not finite, or the energy has grown unphysically.

    It has the attributes of `SimulationStopped`.
    """


class PhysicalEvent(SimulationStopped):
    """The motion has left the range that the scene describes; the method is still accurate.

    It has the attributes of `SimulationStopped` and one more.

    Attributes
    ----------
    event : str
        `ball lifted`: the magnets lift a ball that the scene holds on its plane. `ball rolled off`:
        on a tilted floor or under a load, the ball is more than 1.5 radii of the outermost ring
        from the center. `ring tipped`: the motor's inner ring is tilted by more than 20 degrees.
    """

    def __init__(self, reason: str, time: float, dataset: xr.Dataset, event: str):
        super().__init__(reason, time, dataset)
        self.event = event

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle all arguments, as worker processes require."""
        return type(self), (self.reason, self.time, self.dataset, self.event)


class SimulationInterrupted(KeyboardInterrupt):
    """Ctrl-C was pressed during a run.

    Attributes
    ----------
    time : float
        The last recorded time.
    dataset : xarray.Dataset
        Everything that was recorded up to then.
    checkpoint : Path or None
        The file from which the same call continues, if it was given one.
    """

    def __init__(self, dataset: xr.Dataset, checkpoint: str | Path | None = None):
        self.dataset, self.time = dataset, float(dataset.time.values[-1])
        self.checkpoint = None if checkpoint is None else Path(checkpoint)
        how = "the attribute `dataset` has the records; with a checkpoint, runs can be resumed"
        if self.checkpoint is not None:
            how = f"the same call resumes from the checkpoint {self.checkpoint}"
        super().__init__(f"interrupted at t = {_with_unit(self.time, dataset)}: {how}")

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle all arguments, as worker processes require."""
        return type(self), (self.dataset, self.checkpoint)


def _with_unit(time: float, dataset: xr.Dataset) -> str:
    """Return a time as text, with its unit in a dataset unless that is 1."""
    unit = str(dataset.time.attrs.get("units", "1")).removeprefix("1")
    return f"{time:g} {unit}".rstrip()


def stopped(failure: tuple[str, str], time: float, dataset: xr.Dataset) -> SimulationStopped:
    """Return the exception for a reason and an event, which is empty if the method has failed."""
    reason, event = failure
    if event:
        return PhysicalEvent(reason, time, dataset, event)
    return SimulationDiverged(reason, time, dataset)
