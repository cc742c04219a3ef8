"""What speed is charted against accuracy for: scenes, methods, and what a run's record says."""

import warnings
from collections.abc import Callable, Iterable
from typing import NamedTuple

import magmotor as mm
from benchmarks.harness.records import Record

SPIN = 5.0
"""Of the free top, in rad/s: so that it has a momentum map to keep."""


class Subject(NamedTuple):
    """A scene, and a step at which all its methods are stable."""

    scene: mm.Top | mm.Disk | mm.Motor
    timestep: float


DISK, MOTOR = mm.Disk(), mm.Motor()
SUBJECTS = {
    "top": Subject(mm.Top.paper(4), 1 / 64),
    "free top": Subject(mm.Top.paper(2, spin=SPIN), 1 / 64),
    "top on a plane": Subject(mm.Top.paper(4, surface="plane"), 1 / 64),
    "disk": Subject(DISK, 0.02),
    "motor": Subject(MOTOR, 0.1),
}


def stepping_methods(name: str) -> tuple[str, ...]:
    """Methods of a subject that have a timestep."""
    found = mm.methods(SUBJECTS[name].scene)
    return tuple(method for method in found if method != "scipy/dop853")


def record_of(
    name: str,
    method: str,
    timestep: float,
    quantities: Iterable[str],
    errors: Callable[[], dict[str, list[float]]],
) -> Record:
    """Record of a run: of each quantity the relative error, and what sampling leaves open of it.

    Where the run failed, the record says so instead.
    """
    told = {
        "subject": name, "method": method, "timestep": timestep, "quantities": [*quantities],
    }  # fmt: skip
    with warnings.catch_warnings():
        # Aliased flights are a part of what is measured.
        warnings.filterwarnings("ignore", message="timestep = .*: above", category=UserWarning)
        try:
            return {**told, "errors": errors()}
        except mm.SimulationStopped as failure:
            return {**told, "failed": failure.reason, "time": failure.time}
