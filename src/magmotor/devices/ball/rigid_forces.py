"""Magnetic forces on a ball and a rotating ring, and the coefficients of a step."""

import math
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from magmotor.dipoles import NOBODY, sum_over_sources
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.rotations import columns, cross, place_dipoles, plus, scaled, third_axis
from magmotor.numerics.splittings import (
    DRIFTS,
    KICKS,
    O_PARTS,
    Scheme,
    carries_force,
    exchange,
    kicks_that_evaluate,
)


class Magnets(NamedTuple):
    """The dipoles of a scene, in arrays from `dipoles.pack_sources`.

    `fixed` are the dipoles at rest, and `frame` those of the ring in its own frame, whose origin is
    at `height` on the z axis. `moment` is that of the ball, in A m^2. The interaction of ring and
    ball is multiplied by `factor`. `background` is a uniform field in T.
    """

    moment: float
    fixed: NDArray[np.float64]
    frame: NDArray[np.float64]
    height: float
    factor: float
    background: tuple[float, float, float]


@subroutine(forceinline=True)
def force_and_field(position, moment, sources):
    """Return the force on a dipole in the field of sources, and this field."""
    x, y, z = position
    mx, my, mz = moment
    total = sum_over_sources((x, y, z, mx, my, mz), NOBODY, sources, sources.shape[1])
    return (total[0], total[1], total[2]), (total[3], total[4], total[5])


@subroutine(forceinline=True)
def torque_about(center, position, moment, force, field):
    """Return the torque about a point of the force and field on a dipole."""
    return plus(cross(plus(position, -1.0, center), force), 1.0, cross(moment, field))


@subroutine(forceinline=True)
def wrenches(position, ball, inner, ring, magnets):
    """Return force and torque on the ball, and the torque on the ring about its center.

    The torque on the ring follows from the reaction: about any point, the interaction of two bodies
    has no total torque.

    Parameters
    ----------
    position, ball, inner
        Position of the ball, its orientation and that of the ring.
    ring : ndarray, shape of `magnets.frame`
        Buffer for the ring's dipoles in the world frame; their labels must be set already.
    """
    moment = scaled(magnets.moment, third_axis(ball))
    force, field = force_and_field(position, moment, magnets.fixed)
    reaction = (0.0, 0.0, 0.0)
    if ring.shape[1]:
        center = (0.0, 0.0, magnets.height)
        place_dipoles(ring, columns(inner), center, magnets.frame)
        near, nearby = force_and_field(position, moment, ring)
        force, field = plus(force, magnets.factor, near), plus(field, magnets.factor, nearby)
        on_ball = torque_about(center, position, moment, near, nearby)
        reaction = scaled(magnets.factor, on_ball)
        for j in range(magnets.fixed.shape[1]):
            x, y, z, mx, my, mz, label = magnets.fixed[:, j]
            if label != NOBODY:
                pull, there = force_and_field((x, y, z), (mx, my, mz), ring)
                on_fixed = torque_about(center, (x, y, z), (mx, my, mz), pull, there)
                reaction = plus(reaction, 1.0, on_fixed)
    return force, cross(moment, field), scaled(-1.0, reaction)


Triple = tuple[float, float, float]
Numbers = TypeVar("Numbers", bound=tuple[Any, ...])


class Bodies(NamedTuple):
    """Masses, friction and noise of a ball of isotropic inertia and of a ring.

    Moments of inertia are in kg m^2; `across` and `axial` are those of the ring across and about
    its axis. Friction and noise of the slip are in kg/s and N sqrt(s), those of the ring in
    kg m^2/s and N m sqrt(s), and torsion, the friction of the ball's rotation about the vertical,
    in N m s. `downhill` is the weight of the ball along the floor, in N. The drag of the ball's
    translation and rotation and its noise have the units of the slip's and the ring's.
    `load_torque` on the ball's center, about the z axis, is in N m.
    """

    mass: float
    radius: float
    inertia: float
    across: float
    axial: float
    slip_friction: float
    slip_noise: float
    torsion: float
    ring_friction: float
    ring_noise: float
    downhill: tuple[float, float, float]
    drag: float
    rotational_drag: float
    drag_noise: float
    rotational_drag_noise: float
    load_torque: float = 0.0

    @property
    def slip_mass(self) -> float:
        """Effective mass 1/(1/m + r^2/I) of the slip, in kg."""
        return 1 / (1 / self.mass + self.radius**2 / self.inertia)


def floats(numbers: Numbers) -> Numbers:
    """Convert a named tuple's numbers to floats; integers would require another compilation."""
    values: list[Any] = [
        n
        if isinstance(n, np.ndarray)
        else tuple(map(float, n))
        if isinstance(n, tuple)
        else float(n)
        for n in numbers
    ]
    return type(numbers)(*values)


class StepCoefficients(NamedTuple):
    """A timestep, and the coefficients of the parts of a step.

    Each row of `flags` has four flags of a part: drift, kick, friction and noise, and new forces.
    If `before` is -1, the first kick uses the forces of the previous step; else it is 0.

    Each row of `numbers` has the duration of a part, then three triples (a, b, d): for the slip,
    and for the ring across and about its axis. The impulse of friction and noise is
    a u + b xi + d F, where u is the velocity before the part, xi a standard normal number, and F
    a force that acts at the same time; d is in s.

    Each row of `exchange` has what `exchanged_by_ball` and `exchanged_by_ring` read.
    """

    timestep: float
    before: int
    flags: NDArray[np.bool_]
    numbers: NDArray[np.float64]
    exchange: NDArray[np.float64]


def step_coefficients(bodies: Bodies, scheme: Scheme, timestep: float) -> StepCoefficients:
    """Return the coefficients of a scheme."""
    velocities = (
        (bodies.slip_mass, bodies.slip_friction, bodies.slip_noise),
        (bodies.across, bodies.ring_friction, bodies.ring_noise),
        (bodies.axial, bodies.ring_friction, bodies.ring_noise),
    )
    needs_force = kicks_that_evaluate(scheme.parts)
    flags = [
        (part in DRIFTS, part in KICKS, part in O_PARTS, new)
        for part, new in zip(scheme.parts, needs_force, strict=True)
    ]
    numbers = []
    for fraction in scheme.fractions:
        time = fraction * timestep
        triples = [_impulse(*velocity, time, scheme.exact) for velocity in velocities]
        numbers.append([time, *(number for triple in triples for number in triple)])
    kicks = [part in KICKS for part in scheme.parts]
    before = -1 if carries_force(kicks, needs_force) else 0
    exchanges = [_exchange_row(bodies, fraction * timestep) for fraction in scheme.fractions]
    return StepCoefficients(
        float(timestep), before, np.array(flags), np.array(numbers), np.array(exchanges)
    )


def _exchange_row(bodies: Bodies, time: float) -> list[float]:
    """Return the numbers of `Exchange` for the ball's motion in a plane and its turning about z.

    Those of the ring, across and about its axis, follow. Symmetric matrices have three numbers.
    """
    arm = np.array([[1.0], [bodies.radius]])
    drags = np.array([bodies.drag, bodies.rotational_drag])
    noises = np.diag([bodies.drag_noise, bodies.rotational_drag_noise])
    masses, noise = (bodies.mass, bodies.inertia), np.hstack([bodies.slip_noise * arm, noises])
    plane = exchange(masses, bodies.slip_friction * arm * arm.T + np.diag(drags), noise, time)
    spin = np.array([[bodies.rotational_drag + bodies.torsion]])
    about = exchange(masses[1:], spin, noises[1:, 1:], time)
    ring = np.array([[bodies.ring_friction]]), np.array([[bodies.ring_noise]])
    turning = [exchange([inertia], *ring, time) for inertia in (bodies.across, bodies.axial)]
    return [
        *plane.heat.ravel()[[0, 1, 3]], *plane.mean.ravel(), *plane.force.ravel()[[0, 1, 3]],
        *(each[0, 0] for one in (about, *turning) for each in (one.heat, one.mean, one.force)),
        2 * plane.unresolved + about.unresolved,
        2 * turning[0].unresolved + turning[1].unresolved,
    ]  # fmt: skip


def _impulse(inertia: float, friction: float, noise: float, time: float, exact: bool) -> Triple:
    """Return the triple of one velocity; there is no noise in a negative time."""
    rate, spread = friction / inertia, noise * math.sqrt(max(time, 0.0))
    if not exact or rate == 0:
        return -friction * time, spread, 0.0
    lost = -math.expm1(-rate * time)
    spread *= math.sqrt(-math.expm1(-2 * rate * time) / (2 * rate * time))
    return -inertia * lost, spread, lost / rate - time
