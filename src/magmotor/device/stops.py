"""How a run may end early; nothing that it recorded is lost."""

from typing import Any

import xarray as xr


class SimulationStopped(RuntimeError):
    """A run ended before its time: `SimulationDiverged` or `PhysicalEvent`.

    Attributes
    ----------
    reason : str
    time : float
        When, in seconds: the first recorded time that is not in `dataset`.
    method : str
    timestep : float
    dataset : xarray.Dataset
        What was recorded until then.
    """

    def __init__(self, reason: str, time: float, dataset: xr.Dataset):
        self.reason, self.time, self.dataset = reason, time, dataset
        self.method, self.timestep = dataset.attrs["method"], dataset.attrs["timestep"]
        super().__init__(
            f"{self.method} with timestep {self.timestep:g} s stopped at t = {time:g} s: {reason}"
        )

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle whole, as worker processes need."""
        return type(self), (self.reason, self.time, self.dataset)


class SimulationDiverged(SimulationStopped):
    """The method failed: a value is not finite, or the energy grew beyond what the motion can have.

    The attributes are those of `SimulationStopped`.
    """


class PhysicalEvent(SimulationStopped):
    """Something happened that the scene does not describe, though the method followed it.

    The attributes are those of `SimulationStopped`, and

    Attributes
    ----------
    event : str
        `ball lifted`: the magnets lift a ball that the scene holds on its plane. `ring tipped`: the
        motor's inner ring is tilted by more than 20 degrees.
    """

    def __init__(self, reason: str, time: float, dataset: xr.Dataset, event: str):
        super().__init__(reason, time, dataset)
        self.event = event

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle whole, as worker processes need."""
        return type(self), (self.reason, self.time, self.dataset, self.event)


class SimulationInterrupted(KeyboardInterrupt):
    """Ctrl-C during a run; `dataset` holds what was recorded until then."""

    def __init__(self, dataset: xr.Dataset):
        super().__init__("simulation interrupted")
        self.dataset = dataset


def stopped(failure: tuple[str, str], time: float, dataset: xr.Dataset) -> SimulationStopped:
    """The error of a reason and an event, which is empty if the method failed."""
    reason, event = failure
    if event:
        return PhysicalEvent(reason, time, dataset, event)
    return SimulationDiverged(reason, time, dataset)
