"""The guard of the top: it finds recorded states that no accurate solution can reach."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from magmotor.device.guard import ENERGY_GREW, LARGEST_ERROR, Fault, Guard
from magmotor.devices.ball.device import LIFTED, ROLLED_OFF, lifted, rolled_off
from magmotor.devices.ball.landscape import REACH
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
        """Yield the tests of energy, of distance on a tilted floor, and of lift."""
        found = ball_energy(self.scene, states)
        error = LARGEST_ERROR * _in_play(found)
        yield Fault(found.total > self.largest_energy + error, lambda _: ENERGY_GREW)
        if any(self.scene.floor_tilt):
            apart = np.hypot(*states.position[:, :2].T)
            edge = REACH * self.scene.ring_radius
            yield Fault(apart > edge, lambda row: rolled_off(apart[row], edge), ROLLED_OFF)
        if self.scene.surface == "planar":
            yield self._lift(states, found.lift)

    def _lift(self, states: BallStates, lift: NDArray) -> Fault:
        """Return the test of whether the plane would have to pull the ball."""
        weight = self.scene.weight
        if not self.scene.is_unbalanced:
            return Fault(lift > weight, lambda row: lifted(lift[row], weight), LIFTED)
        _, force, torque = magnetic_forces(self.scene, states)
        pull = lift - weight - unbalanced.vertical_momentum_rate(self.scene, states, force, torque)
        reason = (
            "the plane cannot hold the ball down, which its swinging mass and the magnets lift by"
        )
        return Fault(pull > 0, lambda row: f"{reason} {pull[row]:.3g} N", LIFTED)


def _in_play(energy: BallEnergy) -> NDArray:
    return energy.kinetic + abs(energy.magnetic)
