"""Exceptions for runs that end early; they keep everything that was recorded."""

from typing import Any

import xarray as xr


class SimulationStopped(RuntimeError):
    """A run has ended early: `SimulationDiverged` or `PhysicalEvent`.

    Attributes
    ----------
    reason : str
    time : float
        The first recorded time that is not in `dataset`, in seconds.
    method : str
    timestep : float
    dataset : xarray.Dataset
        The records before that time.
    """

    def __init__(self, reason: str, time: float, dataset: xr.Dataset):
        self.reason, self.time, self.dataset = reason, time, dataset
        self.method, self.timestep = dataset.attrs["method"], dataset.attrs["timestep"]
        super().__init__(
            f"{self.method} with timestep {self.timestep:g} s stopped at t = {time:g} s: {reason}"
        )

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle all arguments, as worker processes require."""
        return type(self), (self.reason, self.time, self.dataset)


class SimulationDiverged(SimulationStopped):
    """The method has failed: a value is not finite, or the energy has grown unphysically.

    It has the attributes of `SimulationStopped`.
    """


class PhysicalEvent(SimulationStopped):
    """The motion has left the range that the scene describes; the method is still accurate.

    In addition to those of `SimulationStopped`, it has the

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
    """Ctrl-C was pressed during a run; `dataset` holds everything that was recorded before."""

    def __init__(self, dataset: xr.Dataset):
        super().__init__("simulation interrupted")
        self.dataset = dataset


def stopped(failure: tuple[str, str], time: float, dataset: xr.Dataset) -> SimulationStopped:
    """Return the exception for a reason and an event, which is empty if the method has failed."""
    reason, event = failure
    if event:
        return PhysicalEvent(reason, time, dataset, event)
    return SimulationDiverged(reason, time, dataset)
