"""Runs of the reference: which scene has which integrator."""

from collections.abc import Generator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magmotor.device.job import Job
from magmotor.devices.disk import reference as disk
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.devices.motor import reference as motor
from magmotor.devices.motor.scene import Motor
from magmotor.devices.top import reference as top
from magmotor.devices.top.scene import Top

INTEGRATORS = {Disk: disk, LangevinParticle: disk, Motor: motor, Top: top}


def start(job: Job) -> NDArray[np.float64]:
    """The state that a run begins with; see `Job`."""
    return INTEGRATORS[type(job.scene)].pack(job.initial)


def run(job: Job) -> Generator[tuple[Any, Any]]:
    """Yield the recorded states that follow the initial one, in chunks; see `Job`."""
    return INTEGRATORS[type(job.scene)].run(job)
