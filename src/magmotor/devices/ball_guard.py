"""The guard on a run: which recorded states no accurate solution can have."""

from collections.abc import Iterator

import numpy as np

from magmotor.devices.first_failure import ENERGY_GREW, Fault, FirstFailure
from magmotor.observables.motion import energy_and_lift, kinetic_energy, magnetic_energy
from magmotor.scenes import Top
from magmotor.states.ball import BallStates


class Guard(FirstFailure):
    """Finds the first wrong row among recorded states of a scene.

    Parameters
    ----------
    scene : Top
    first : BallStates
        The initial state; it sets the energy that the motion may have.
    """

    def __init__(self, scene: Top, first: BallStates):
        self.scene = scene
        # A ring at rest does no work, so the energy cannot grow; a moving one does not do much.
        scale = kinetic_energy(scene, first) + np.abs(magnetic_energy(scene, first))
        allowance = 10 if scene.ring_script else 1
        self.largest_energy = float((energy_and_lift(scene, first)[0] + allowance * scale)[0])

    def _faults(self, states: BallStates) -> Iterator[Fault]:
        energy, lift = energy_and_lift(self.scene, states)
        yield energy > self.largest_energy, lambda _: ENERGY_GREW
        if self.scene.surface == "planar":
            weight = self.scene.ball_mass * self.scene.gravity
            yield lift > weight, lambda row: lifted(lift[row], weight)


def lifted(lift: float, weight: float) -> str:
    """What to say of a lift and a weight, both in N."""
    return (
        f"the magnetic lift, {lift:.3g} N, exceeds the ball's weight, {weight:.3g} N, and the"
        " plane cannot hold it down: use a larger gravity or surface = 'plane'"
    )
