"""Runs of the reference: which scene has which integrator."""

from collections.abc import Generator
from typing import Any

from magmotor.engines.job import Job
from magmotor.engines.variational import disk, motor, top
from magmotor.scenes import Disk, LangevinParticle, Motor, Top

INTEGRATORS = {Disk: disk, LangevinParticle: disk, Motor: motor, Top: top}


def run(job: Job) -> Generator[tuple[Any, Any]]:
    """Yield the recorded states that follow the initial one, in chunks; see `Job`."""
    return INTEGRATORS[type(job.scene)].run(job)
