"""The guard of the top: it finds recorded states that no accurate solution can reach."""

from collections.abc import Iterator

from numpy.typing import NDArray

from magmotor.device.guard import ENERGY_GREW, LARGEST_ERROR, Fault, Guard
from magmotor.devices.ball.device import LIFTED, lifted
from magmotor.devices.top import unbalanced
from magmotor.devices.top.observables import BallEnergy, ball_energy, magnetic_forces
from magmotor.devices.top.scene import Top
from magmotor.devices.top.states import BallStates

LARGEST_WORK = 10.0
"""Bound on the work of a moving ring, in units of the energy in play at the start."""


class TopGuard(Guard):
    """Finds the first invalid row among the recorded states of a scene.

    Parameters
    ----------
    scene : Top
    first : BallStates
        The initial state, which bounds the energy of the motion.
    """

    def __init__(self, scene: Top, first: BallStates):
        self.scene = scene
        start = ball_energy(scene, first)
        # A ring at rest does no work, and friction only dissipates.
        work = LARGEST_WORK if scene.ring_script else 0.0
        self.largest_energy = float((start.total + work * _in_play(start))[0])

    def faults(self, states: BallStates) -> Iterator[Fault]:
        """Yield the tests of energy and lift."""
        found = ball_energy(self.scene, states)
        error = LARGEST_ERROR * _in_play(found)
        yield Fault(found.total > self.largest_energy + error, lambda _: ENERGY_GREW)
        if self.scene.surface == "planar":
            weight, lift = self.scene.weight, found.lift
            if self.scene.is_unbalanced:
                _, force, torque = magnetic_forces(self.scene, states)
                rate = unbalanced.vertical_momentum_rate(self.scene, states, force, torque)
                lift = lift - rate
            yield Fault(lift > weight, lambda row: lifted(lift[row], weight), LIFTED)


def _in_play(energy: BallEnergy) -> NDArray:
    return energy.kinetic + abs(energy.magnetic)
