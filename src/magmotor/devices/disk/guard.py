"""The guard of disk and particle: a test of the energy of recorded states."""

from collections.abc import Iterator

import numpy as np

from magmotor.device.guard import (
    ENERGY_GREW,
    LARGEST_ERROR,
    LARGEST_FLUCTUATION,
    Fault,
    Guard,
)
from magmotor.devices.disk.observables import energy
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.devices.disk.states import DiskStates
from magmotor.devices.disk.theory.stationary import hottest


class DiskGuard(Guard):
    """Find the first row whose energy no accurate solution can have.

    Parameters
    ----------
    scene : Disk or LangevinParticle
    first : DiskStates
        The initial state, whose energy sets the limit.
    """

    def __init__(self, scene: Disk | LangevinParticle, first: DiskStates):
        self.scene = scene
        self.depth = sum(abs(a) + abs(b) for a, b in scene.coefficients)
        self.start = energy(scene, first.x, first.v, first.omega).max()
        self.largest_fluctuation = LARGEST_FLUCTUATION * hottest(scene)

    def faults(self, states: DiskStates) -> Iterator[Fault]:
        """Yield the test of energy."""
        found = energy(self.scene, states.x, states.v, states.omega)
        in_play = found + 2 * self.depth  # at least the kinetic energy and the well's depth
        allowed = np.maximum(self.largest_fluctuation, LARGEST_ERROR * in_play)
        yield Fault((found > self.start + allowed).any(axis=1), lambda _: ENERGY_GREW)
