"""Magnetic forces and torques on a ball, and on a ring that turns above it."""

import math
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

from magmotor.dipoles import NOBODY, sum_over_sources
from magmotor.numerics.rotations import columns, cross, place_dipoles, plus, scaled, third_axis
from magmotor.numerics.splittings import DRIFTS, KICKS, O_PARTS, Scheme, kicks_that_evaluate


class Magnets(NamedTuple):
    """The dipoles of a scene; arrays as `dipoles.pack_sources` makes them.

    `fixed` are those at rest, `frame` those of the ring in its own frame, whose origin is at
    `height` on the axis z; the ball has one, `moment` in A m^2. The interaction of ring and ball
    counts `factor` times.
    """

    moment: float
    fixed: NDArray[np.float64]
    frame: NDArray[np.float64]
    height: float
    factor: float


@njit(inline="always")
def force_and_field(position, moment, sources):
    """Force on a dipole in the field of sources, and that field."""
    x, y, z = position
    mx, my, mz = moment
    total = sum_over_sources((x, y, z, mx, my, mz), NOBODY, sources, sources.shape[1])
    return (total[0], total[1], total[2]), (total[3], total[4], total[5])


@njit(inline="always")
def torque_about(center, position, moment, force, field):
    """Torque about a point of what acts on a dipole."""
    return plus(cross(plus(position, -1.0, center), force), 1.0, cross(moment, field))


@njit(inline="always")
def wrenches(place, ball, inner, ring, magnets):
    """Force and torque on the ball, and torque on the ring about its center.

    Parameters
    ----------
    place, ball, inner
        Where the ball is, its orientation and that of the ring.
    ring : ndarray, shape of `magnets.frame`
        Room for the ring's dipoles in the world frame; their labels are there already.

    The torque on the ring is a reaction: about any point, what two bodies do to one another has no
    torque in total.
    """
    moment = scaled(magnets.moment, third_axis(ball))
    force, field = force_and_field(place, moment, magnets.fixed)
    reaction = (0.0, 0.0, 0.0)
    if ring.shape[1]:
        center = (0.0, 0.0, magnets.height)
        place_dipoles(ring, columns(inner), center, magnets.frame)
        near, nearby = force_and_field(place, moment, ring)
        force, field = plus(force, magnets.factor, near), plus(field, magnets.factor, nearby)
        on_ball = torque_about(center, place, moment, near, nearby)
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

    Moments of inertia are in kg m^2, the ring's across its axis and about it; friction and noise
    are those along the slip, in kg/s and N sqrt(s), and the ring's, in kg m^2/s and N m sqrt(s).
    """

    mass: float
    radius: float
    inertia: float
    across: float
    axial: float
    slip_friction: float
    slip_noise: float
    ring_friction: float
    ring_noise: float

    @property
    def slip_mass(self) -> float:
        """What a force at the contact point accelerates along the slip: 1/(1/m + r^2/I) in kg."""
        return 1 / (1 / self.mass + self.radius**2 / self.inertia)


def floats(numbers: Numbers) -> Numbers:
    """A named tuple with its numbers as floats: for integers, code would be compiled anew."""
    values: list[Any] = [n if isinstance(n, np.ndarray) else float(n) for n in numbers]
    return type(numbers)(*values)


class StepCoefficients(NamedTuple):
    """A timestep, and what happens in the parts of a step.

    The rows of `kinds` say what a part of the scheme does: drift, kick, rub (friction and noise),
    and whether it needs the forces anew. The first part has those of the step before if `before`
    is -1, else 0.

    The rows of `numbers` hold for how long a part acts, then three triples (a, b, d): along the
    slip, and of the ring across its axis and about it. The impulse of friction and noise is
    a u + b xi + d F, where u is the velocity before it, xi a standard normal number, and F a force
    that acts meanwhile, d in s.
    """

    timestep: float
    before: int
    kinds: NDArray[np.bool_]
    numbers: NDArray[np.float64]


def step_coefficients(bodies: Bodies, scheme: Scheme, timestep: float) -> StepCoefficients:
    """The numbers of a scheme."""
    velocities = (
        (bodies.slip_mass, bodies.slip_friction, bodies.slip_noise),
        (bodies.across, bodies.ring_friction, bodies.ring_noise),
        (bodies.axial, bodies.ring_friction, bodies.ring_noise),
    )
    anew = kicks_that_evaluate(scheme.parts)
    kinds = [
        (part in DRIFTS, part in KICKS, part in O_PARTS, new)
        for part, new in zip(scheme.parts, anew, strict=True)
    ]
    numbers = []
    for fraction in scheme.fractions:
        time = fraction * timestep
        triples = [_impulse(*velocity, time, scheme.exact) for velocity in velocities]
        numbers.append([time, *(number for triple in triples for number in triple)])
    carried = scheme.parts[0] in KICKS and not anew[0]
    return StepCoefficients(
        float(timestep), -1 if carried else 0, np.array(kinds), np.array(numbers)
    )


def _impulse(inertia: float, friction: float, noise: float, time: float, exact: bool) -> Triple:
    """The triple of one velocity; a negative time has no noise."""
    rate, spread = friction / inertia, noise * math.sqrt(max(time, 0.0))
    if not exact or rate == 0:
        return -friction * time, spread, 0.0
    lost = -math.expm1(-rate * time)
    spread *= math.sqrt(-math.expm1(-2 * rate * time) / (2 * rate * time))
    return -inertia * lost, spread, lost / rate - time
