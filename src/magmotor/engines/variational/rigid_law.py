"""The numbers of a scene of rigid bodies, and of a scheme and a timestep, for the kernel."""

from typing import Any, NamedTuple, TypeVar

import numpy as np

from magmotor.engines.friction import friction_and_noise

Pair = tuple[float, float]
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
    """The impulse of friction and noise in a step, as pairs (a, b): a u + b xi.

    u is the velocity before it and xi a standard normal number: along the slip, and of the ring
    across its axis and about it.
    """

    timestep: float
    slip: Pair
    across: Pair
    axial: Pair


def law(bodies: Bodies, timestep: float, *, exact: bool) -> Law:
    """The numbers of a scheme: with `exact` friction's and noise's exact flow, else Euler's."""

    def impulse(inertia: float, friction: float, noise: float) -> Pair:
        strengths = np.array([[friction]]), np.array([[noise]])
        decrement, increment = friction_and_noise([inertia], *strengths, timestep, exact=exact)
        return inertia * decrement.item(), inertia * increment.item()

    return Law(
        float(timestep),
        impulse(bodies.slip_mass, bodies.slip_friction, bodies.slip_noise),
        impulse(bodies.across, bodies.ring_friction, bodies.ring_noise),
        impulse(bodies.axial, bodies.ring_friction, bodies.ring_noise),
    )
