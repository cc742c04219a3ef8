"""The answer of `recommend` and `advise`: a method and timestep, with their error and cost."""

import math
from dataclasses import dataclass


@dataclass(kw_only=True)
class Recommendation:
    """The cheapest method and timestep that reach an error.

    Attributes
    ----------
    quantity : str
        What the errors refer to.
    error : float
        The error asked for, relative.
    method : str
        One of `methods`; from `advise`, an integrator of MuJoCo or, at a temperature, a splitting
        of `Langevin`. Empty if nothing reaches the error.
    timestep : float
        In units of `time_unit`; NaN without a method.
    promised : float
        The largest error that the method should have, in a run up to the horizon; infinite without
        a method.
    seconds : float
        Wall time per simulated second (for the disk, per unit of time) on one core; NaN without a
        method.
    horizon : float
        Length of the run along which errors were measured, in units of `time_unit`; 0 if only
        statistics have errors.
    basis : str
        What error and cost rest on: charts, with where and by which MuJoCo they were measured, or a
        measurement on this machine, with the element that errs most over its own range.
    charted : str
        How the scene of the charts differs; then the error of this scene is unknown. Empty if it
        does not differ, or was measured.
    uncharted : str
        What the scene also has, and whose error is unknown: the heat between the temperatures of a
        motor. Empty if there is none.
    time_unit : str
        "s", or "1" for the disk.
    """

    quantity: str
    error: float
    method: str = ""
    timestep: float = math.nan
    promised: float = math.inf
    seconds: float = math.nan
    horizon: float = 0.0
    basis: str = ""
    charted: str = ""
    uncharted: str = ""
    time_unit: str = "s"

    def __repr__(self) -> str:
        """Return a one-line summary."""
        unknown = f"; the error of {self.uncharted} is unknown" if self.uncharted else ""
        return f"{self._sentence()} ({self.basis}){unknown}"

    def _sentence(self) -> str:
        """Return method, timestep, error and cost."""
        unit, each = ("", "unit of time") if self.time_unit == "1" else (" s", "simulated second")
        error = f"up to {percent(self.promised)} over {self.horizon:.4g}{unit or ' units of time'}"
        if self.charted:
            error = f"unknown for this scene ({error} for {self.charted})"
        return (
            f"{self.method} at a timestep of {self.timestep:g}{unit}: error of {self.quantity}"
            f" {error}, {self.seconds:.2g} s per {each}"
        )


def percent(error: float) -> str:
    """Format a relative error in percent."""
    if not math.isfinite(error):
        return "diverged"
    return f"{100 * error:.2g} %"
