"""Scenes and methods of the charts of speed against accuracy, and the record of a run."""

import warnings
from collections.abc import Callable, Iterable
from typing import NamedTuple

import magmotor as mm
from benchmarks.harness.records import Record

SPIN = 5.0
"""Spin of the free top, in rad/s, so that its momentum map is not zero."""


class ChartedScene(NamedTuple):
    """A scene, and a timestep at which all its methods are stable."""

    scene: mm.Top | mm.Disk | mm.Motor
    timestep: float


DISK, MOTOR = mm.Disk(), mm.Motor()
SCENES = {
    "top": ChartedScene(mm.Top.paper(4), 1 / 64),
    "free top": ChartedScene(mm.Top.paper(2, spin=SPIN), 1 / 64),
    "top on a plane": ChartedScene(mm.Top.paper(4, surface="plane"), 1 / 64),
    "disk": ChartedScene(DISK, 0.02),
    "motor": ChartedScene(MOTOR, 0.1),
}


def stepping_methods(name: str) -> tuple[str, ...]:
    """Return the methods of a scene that have a timestep."""
    found = mm.methods(SCENES[name].scene)
    return tuple(method for method in found if method != "scipy/dop853")


def record_of(
    name: str,
    method: str,
    timestep: float,
    quantities: Iterable[str],
    errors: Callable[[], dict[str, list[float]]],
) -> Record:
    """Return the record of a run: the relative error and the sampling error of each quantity.

    The record of a failed run contains the reason instead.
    """
    settings = {
        "scene": name, "method": method, "timestep": timestep, "quantities": [*quantities],
    }  # fmt: skip
    with warnings.catch_warnings():
        # Aliased flights are measured, too.
        warnings.filterwarnings("ignore", message="timestep = .*: above", category=UserWarning)
        try:
            return {**settings, "errors": errors()}
        except mm.SimulationStopped as failure:
            return {**settings, "failed": failure.reason, "time": failure.time}
