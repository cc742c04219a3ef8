"""The barriers between neighboring wells under an inner ring that leans.

The ball is in the valley, with its axis along the field. Only the lean of the ring counts: a
rotation about its own axis changes a barrier by 1e-4.
"""

import numpy as np

from magmotor import dipoles
from magmotor.common.arrays import Array
from magmotor.devices.ball.landscape import valley_radius
from magmotor.devices.motor.ring_stability import ring_stiffness
from magmotor.devices.motor.scene import Motor

STEPS = 20
"""Azimuths per sector; the barrier is accurate to 1 % of kT."""

RADII = np.linspace(-0.15, 0.15, 31)
"""Distances in m from the valley under the level ring, between which a parabola is fitted."""

DEVIATIONS = np.linspace(-5, 5, 51)
"""Leans of the ring over which Gibbs' law is summed, in standard deviations without the ball."""


class Valley:
    """The valley from half a sector behind a well, at azimuth 0, to the end of the next sector.

    Parameters
    ----------
    motor : Motor
    """

    def __init__(self, motor: Motor) -> None:
        self.motor = motor
        self.sector = 2 * np.pi / motor.outer_dipoles
        self.azimuths = self.sector * np.arange(-STEPS // 2, 3 * STEPS // 2 + 1) / STEPS
        around = np.stack([np.cos(self.azimuths), np.sin(self.azimuths)], axis=-1)
        radii = valley_radius(motor) + RADII
        plane = radii[:, np.newaxis] * around[:, np.newaxis]
        height = np.full((*plane.shape[:-1], 1), motor.ball_radius)
        self.points = np.concatenate([plane, height], axis=-1)
        self.outer_field = dipoles.field(self.points, *motor.outer_sources())

    def energies(self, leans: Array) -> Array:
        """Return V_e along the valley in J for each lean of the ring, (n, 2) -> (n, azimuths)."""
        return np.array([self._energy(lean) for lean in leans])

    def _energy(self, lean: Array) -> Array:
        x, y = lean
        upright = np.sqrt(1 - x * x - y * y)
        # The smallest rotation from e_z to the axis, by the formula of Rodrigues.
        turn = np.array(
            [
                [1 - x * x / (1 + upright), -x * y / (1 + upright), x],
                [-x * y / (1 + upright), 1 - y * y / (1 + upright), y],
                [-x, -y, upright],
            ]
        )
        positions, outward = (vectors @ turn.T for vectors in self.motor.inner_dipole_frame())
        positions[:, 2] += self.motor.inner_height
        moments = self.motor.ball_ring_factor * self.motor.moment * outward
        field = self.outer_field + dipoles.field(self.points, positions, moments)
        energy = -self.motor.moment * np.linalg.norm(field, axis=-1)
        middle = np.clip(energy.argmin(axis=1), 1, len(RADII) - 2)
        row = np.arange(len(energy))
        before, lowest, after = (energy[row, middle + k] for k in (-1, 0, 1))
        return lowest - (before - after) ** 2 / (8 * (before + after - 2 * lowest))

    def ahead(self, energies: Array) -> Array:
        """Return the barriers from the well to the next one in J, (n, azimuths) -> (n,)."""
        index = np.arange(2 * STEPS + 1)
        here, there = (
            np.where(part, energies, np.inf).argmin(axis=1)[:, np.newaxis]
            for part in (index <= STEPS, index >= STEPS)
        )
        between = (index >= here) & (index <= there)
        highest = np.where(between, energies, -np.inf).max(axis=1)
        return highest - np.take_along_axis(energies, here, axis=1)[:, 0]


def gibbs_barriers(valley: Valley, *places: tuple[float, float]) -> list[float]:
    """Return the mean barriers ahead, in J, that Gibbs' law gives while the ball is at some places.

    The law of the lean is exp(-k lean^2/2 kT - V_e/kT), with V_e of the ball at its place.

    Parameters
    ----------
    valley : Valley
    *places : tuple of float
        The ball's azimuth is between these two, in sectors from its well.
    """
    motor = valley.motor
    leans = np.stack(np.meshgrid(DEVIATIONS, DEVIATIONS), axis=-1).reshape(-1, 2)
    energies = valley.energies(leans * np.sqrt(motor.kT / ring_stiffness(motor)))
    weights = np.exp(-(energies - energies.min()) / motor.kT)
    weights *= np.exp(-np.sum(leans**2, axis=1) / 2)[:, np.newaxis]
    azimuths, ahead = valley.azimuths / valley.sector, valley.ahead(energies)
    inside = [(azimuths > low - 1e-9) & (azimuths < high + 1e-9) for low, high in places]
    return [float(np.average(ahead, weights=weights[:, part].sum(axis=1))) for part in inside]
