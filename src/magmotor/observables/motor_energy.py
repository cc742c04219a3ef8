"""The motor's energy, and the magnetic lift on its ball, by compiled loops over the states."""

from functools import cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from magmotor import dipoles, eights, rotations
from magmotor.code_version import code_version, specialised
from magmotor.dipoles import NOBODY
from magmotor.engines.variational import rigid_forces
from magmotor.engines.variational.motor import magnets
from magmotor.engines.variational.rigid_forces import force_and_field
from magmotor.rotations import columns, dot, place_dipoles
from magmotor.scenes import Motor
from magmotor.states.ball import axes
from magmotor.states.motor import MotorStates

Array = NDArray[np.float64]


class MotorEnergy(NamedTuple):
    """Energies in J and a force in N, each of shape (T, replicas).

    `ring` is the inner ring's own: its kinetic energy and its energy in the outer ring's field;
    `wobble` is that part of its kinetic energy which is not of the turning about its axis.
    """

    total: Array
    ring: Array
    wobble: Array
    lift: Array
    """Vertical magnetic force on the ball."""


def motor_energy(scene: Motor, states: MotorStates) -> MotorEnergy:
    """Total energy E, the inner ring's, and the lift; the paper's E with its Lagrangian's U.

    Ball and inner ring count `ball_ring_factor` times; gravity counts from the ball's height on
    the plane.
    """
    axis, ring_axis = axes(states.orientation), axes(states.ring_orientation)
    shape = states.position.shape[:-1]
    magnetic = np.empty((3, states.position[..., 0].size))
    evaluate = _compile_magnetic(code_version(dipoles, eights, rotations, rigid_forces))
    evaluate(
        magnetic,
        np.ascontiguousarray(states.position).reshape(-1, 3),
        scene.moment * axis.reshape(-1, 3),
        np.ascontiguousarray(states.ring_orientation).reshape(-1, 4),
        magnets(scene),
    )
    on_ball, on_ring, lift = magnetic.reshape(3, *shape)
    across, _, axial = scene.inner_moments
    spin = states.ring_angular_velocity
    about = np.sum(spin * ring_axis, axis=-1)
    wobble = 0.5 * across * (np.sum(spin**2, axis=-1) - about**2)
    ring = wobble + 0.5 * axial * about**2 + on_ring
    translation = scene.ball_mass * np.sum(states.velocity**2, axis=-1)
    rotation = scene.ball_inertia * np.sum(states.angular_velocity**2, axis=-1)
    height = states.position[..., 2] - scene.ball_radius
    ball = 0.5 * (translation + rotation) + scene.ball_mass * scene.gravity * height
    return MotorEnergy(ball + on_ball + ring, ring, wobble, lift)


@cache
def _compile_magnetic(checksum: int):
    """Compile the loop over states; `checksum` is a part of its cache's key."""

    @njit(cache=True, nogil=True, error_model="numpy")
    @specialised()
    def magnetic(out, position, moment, ring_orientation, magnets):
        _ = checksum
        fixed, factor = magnets.fixed, magnets.factor
        ring = magnets.frame.copy()
        for i in range(len(position)):
            w, x, y, z = ring_orientation[i]
            place_dipoles(ring, columns((w, x, y, z)), (0.0, 0.0, magnets.height), magnets.frame)
            place = position[i, 0], position[i, 1], position[i, 2]
            m = moment[i, 0], moment[i, 1], moment[i, 2]
            near, nearby = force_and_field(place, m, ring)
            far, far_field = force_and_field(place, m, fixed)
            out[0, i] = -factor * dot(m, nearby) - dot(m, far_field)
            out[1, i] = 0.0
            out[2, i] = factor * near[2] + far[2]
            for j in range(fixed.shape[1]):
                if fixed[6, j] != NOBODY:
                    x, y, z, mx, my, mz, _label = fixed[:, j]
                    _force, field = force_and_field((x, y, z), (mx, my, mz), ring)
                    out[1, i] -= dot((mx, my, mz), field)

    return magnetic
