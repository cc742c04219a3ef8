"""The guard of the motor: it finds recorded states that the model does not describe."""

import math
from collections.abc import Iterator

import numpy as np

from magmotor.device.guard import (
    ENERGY_GREW,
    LARGEST_ERROR,
    LARGEST_FLUCTUATION,
    Fault,
    Guard,
)
from magmotor.devices.ball.device import LIFTED, ROLLED_OFF, lifted, rolled_off
from magmotor.devices.ball.landscape import REACH
from magmotor.devices.ball.states import axes
from magmotor.devices.motor.energy import motor_energy
from magmotor.devices.motor.parameters import LARGEST_TILT
from magmotor.devices.motor.scene import Motor
from magmotor.devices.motor.states import MotorStates

ROUNDING = 1e-9
"""Relative rounding error of energies over a long run."""

TIPPED = "ring tipped"
"""Name of the event that ends a run whose inner ring has tipped over."""


class MotorGuard(Guard):
    """Finds the first invalid row among the recorded states of a scene.

    Parameters
    ----------
    scene : Motor
    first : MotorStates
        The initial state, which bounds the energy of the motion.
    """

    def __init__(self, scene: Motor, first: MotorStates):
        self.scene = scene
        start = motor_energy(scene, first)
        self.start, self.ring = start.total[0], start.ring[0]
        warm = scene.temperature == "uniform"
        self.largest_fluctuation = LARGEST_FLUCTUATION * scene.kT if warm else 0.0
        # At nonuniform temperature the noise heats the motion; at uniform, friction balances it.
        self.heated = scene.is_noisy and not warm
        # The states do not contain the work of a load.
        self.isolated = not scene.load_torque

    def faults(self, states: MotorStates) -> Iterator[Fault]:
        """Yield the tests of energy, tilt, distance from the rings, and lift."""
        found = motor_energy(self.scene, states)
        work = states.ball_work + states.ring_work if self.heated else 0.0
        # No method changes the energy of a ring that only rotates about its axis.
        ring = np.abs(found.ring - self.ring) + found.wobble
        in_play = np.abs(found.total - found.ring) + ring
        allowed = np.maximum(self.largest_fluctuation, LARGEST_ERROR * in_play)
        allowed += ROUNDING * np.abs(found.total)
        grew = self.isolated & np.any(found.total > self.start + work + allowed, axis=1)
        upright = axes(states.ring_orientation)[..., 2]
        lost = np.any(upright < math.cos(LARGEST_TILT), axis=1)
        yield Fault(grew & ~lost, lambda _: ENERGY_GREW)
        # A ring that tips between two records may also have driven the method unstable.
        also = f"; {ENERGY_GREW}"
        yield Fault(lost, lambda row: _tipped(upright[row]) + also * bool(grew[row]), TIPPED)
        if self.scene.load_torque or any(self.scene.floor_tilt):
            apart = np.hypot(states.position[..., 0], states.position[..., 1]).max(axis=1)
            edge = REACH * max(self.scene.inner_radius, self.scene.outer_radius)
            yield Fault(apart > edge, lambda row: rolled_off(apart[row], edge), ROLLED_OFF)
        if self.scene.surface == "planar":
            weight = self.scene.weight
            lift = found.lift.max(axis=1)
            yield Fault(lift > weight, lambda row: lifted(lift[row], weight), LIFTED)


def _tipped(upright) -> str:
    tilt = math.degrees(math.acos(max(-1.0, upright.min())))
    limit = math.degrees(LARGEST_TILT)
    return f"the inner ring is lost: it is tilted by {tilt:.1f} degrees, beyond {limit:g}"
