"""The energy of dipoles, iron, fields and a mirror in plain NumPy, also of complex positions.

Complex arguments make derivatives exact: dE/dx = Im E(x + ih)/h. Nothing is shared with the
package; the moments of iron that does not saturate follow from one set of linear equations.
"""

from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

STEP = 1e-30


@dataclass
class Body:
    """A rigid body; all coordinates are the world's."""

    center: np.ndarray
    dipoles: list = field(default_factory=list)  # (position, moment)
    iron: list = field(default_factory=list)  # (position, volume, 3 x 3 chi/(1 + N chi))
    fields: list = field(default_factory=list)  # functions of (position, origin, axes)
    origin: np.ndarray = field(default_factory=lambda: np.zeros(3))
    axes: np.ndarray = field(default_factory=lambda: np.eye(3))


def moved(body, shift: Any = 0.0, turn: Any = (0.0, 0.0, 0.0)):
    """A body after an infinitesimal translation and rotation about its center."""
    x, y, z = turn
    turned = np.eye(3) + np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])

    def place(position):
        return body.center + turned @ (position - body.center) + shift

    return Body(
        body.center + shift,
        [(place(position), turned @ moment) for position, moment in body.dipoles],
        [(place(x), volume, turned @ chi @ turned.T) for x, volume, chi in body.iron],
        body.fields,
        place(body.origin),
        turned @ body.axes,
    )


def flux(point, position, moment):
    """The field of a dipole."""
    r = point - position
    square = r @ r
    return 1e-7 * (3 * (moment @ r) * r / square - moment) / square**1.5


def energy(bodies, mirror=None):
    """The energy of bodies, above a plane (point, normal, strength k) if there is one."""
    total = 0.0
    dipoles = [(number, *dipole) for number, body in enumerate(bodies) for dipole in body.dipoles]
    for number, position, moment in dipoles:
        for other, there, strength in dipoles:
            if number < other:
                total -= moment @ flux(position, there, strength)
            if mirror:
                total -= 0.5 * moment @ flux(position, *image(mirror, there, strength))
        for other, body in enumerate(bodies):
            for function in body.fields if other != number else ():
                total -= moment @ function(position, body.origin, body.axes)
    return total + energy_of_iron(bodies, dipoles, mirror)


def energy_of_iron(bodies, dipoles, mirror):
    """The least energy that the moments of iron can have."""
    pieces = [piece for body in bodies for piece in body.iron]
    outer = []
    for position, _, _ in pieces:
        there = sum((flux(position, x, m) for _, x, m in dipoles), np.zeros(3))
        for body in bodies:
            for function in body.fields:
                there = there + function(position, body.origin, body.axes)
        for _, x, m in dipoles if mirror else ():
            there = there + flux(position, *image(mirror, x, m))
        outer.append(there)
    b = np.ravel(outer)
    return -0.5 * b @ np.linalg.solve(matrix_of_iron(pieces, mirror), b) if pieces else 0.0


def matrix_of_iron(pieces, mirror=None):
    """The matrix of the energy as a quadratic form of the moments of iron."""
    matrix = np.zeros((3 * len(pieces),) * 2, complex)
    for i, (position, volume, susceptibility) in enumerate(pieces):
        own = 4e-7 * np.pi / volume * np.linalg.inv(susceptibility)
        for j, (other, _, _) in enumerate(pieces):
            block = own if i == j else -np.array([flux(position, other, e) for e in np.eye(3)]).T
            if mirror:
                images = partial(image, mirror, other)
                block = block - np.array([flux(position, *images(e)) for e in np.eye(3)]).T
            matrix[3 * i : 3 * i + 3, 3 * j : 3 * j + 3] = block
    return matrix


def image(mirror, position, moment):
    """The position and the moment of the image of a dipole."""
    point, normal, strength = mirror
    height = normal @ (position - point)
    return position - 2 * height * normal, strength * (2 * (moment @ normal) * normal - moment)


def wrench(bodies, number, mirror=None):
    """Force and torque about the center of a body, shape (6,)."""
    result = []
    for change in ("shift", "turn"):
        for axis in np.eye(3):
            others = [*bodies]
            others[number] = moved(bodies[number], **{change: 1j * STEP * axis})
            result.append(-energy(others, mirror).imag / STEP)
    return np.array(result)
