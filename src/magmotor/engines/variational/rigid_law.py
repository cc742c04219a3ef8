"""The numbers of a scene of rigid bodies, and of a scheme and a timestep, for the kernel."""

import math
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from magmotor.engines.variational.schemes import DRIFTS, KICKS, RUBS, Scheme, kicks_that_evaluate

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


class Law(NamedTuple):
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


def law(bodies: Bodies, scheme: Scheme, timestep: float) -> Law:
    """The numbers of a scheme."""
    velocities = (
        (bodies.slip_mass, bodies.slip_friction, bodies.slip_noise),
        (bodies.across, bodies.ring_friction, bodies.ring_noise),
        (bodies.axial, bodies.ring_friction, bodies.ring_noise),
    )
    anew = kicks_that_evaluate(scheme.parts)
    kinds = [
        (part in DRIFTS, part in KICKS, part in RUBS, new)
        for part, new in zip(scheme.parts, anew, strict=True)
    ]
    numbers = []
    for fraction in scheme.fractions:
        time = fraction * timestep
        triples = [_impulse(*velocity, time, scheme.exact) for velocity in velocities]
        numbers.append([time, *(number for triple in triples for number in triple)])
    carried = scheme.parts[0] in KICKS and not anew[0]
    return Law(float(timestep), -1 if carried else 0, np.array(kinds), np.array(numbers))


def _impulse(inertia: float, friction: float, noise: float, time: float, exact: bool) -> Triple:
    """The triple of one velocity; a negative time has no noise."""
    rate, spread = friction / inertia, noise * math.sqrt(max(time, 0.0))
    if not exact or rate == 0:
        return -friction * time, spread, 0.0
    lost = -math.expm1(-rate * time)
    spread *= math.sqrt(-math.expm1(-2 * rate * time) / (2 * rate * time))
    return -inertia * lost, spread, lost / rate - time
