"""The energy of dipoles, iron, fields and a mirror in plain NumPy, also of complex positions.

Complex arguments make derivatives exact: dE/dx = Im E(x + ih)/h. Nothing is shared with the
package but how a piece of iron alone responds to potentials at its nodes, which has tests of its
own; the charges of several pieces that do not saturate follow from one set of linear equations.
"""

from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.linalg import block_diag

MU0 = 4e-7 * np.pi
STEP = 1e-30


@dataclass
class Piece:
    """A piece of iron: nodes, their response, the radius of balls of charge, and a bounding sphere."""

    points: np.ndarray
    matrix: np.ndarray
    radius: float
    center: np.ndarray
    extent: float


@dataclass
class Body:
    """A rigid body; all coordinates are the world's."""

    center: np.ndarray
    dipoles: list = field(default_factory=list)  # (position, moment)
    iron: list = field(default_factory=list)  # of `Piece`
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
        [
            replace(each, points=np.array([*map(place, each.points)]), center=place(each.center))
            for each in body.iron
        ],
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
    """The energy at which the charges of iron make it stationary: half of theirs in outer fields."""
    pieces = [piece for body in bodies for piece in body.iron]
    if not pieces:
        return 0.0
    outer = []
    for piece in pieces:
        there = np.zeros(len(piece.points), complex)
        for _, x, m in dipoles:
            there = there + potential(piece.points, x, m)
            if mirror:
                there = there + potential(piece.points, *image(mirror, x, m))
        for body in bodies:
            for function in body.fields:
                there = there + along_lines(
                    piece, partial(function, origin=body.origin, axes=body.axes)
                )
        outer.append(there)
    phi, responses = np.concatenate(outer), block_diag(*(piece.matrix for piece in pieces))
    rows = [[between(i, j, i is not j, mirror) for j in pieces] for i in pieces]
    charges = np.linalg.solve(np.eye(len(phi)) + responses @ np.block(rows), -responses @ phi)
    return 0.5 * charges @ phi / MU0


def potential(points, position, moment):
    """The potential in T m of a dipole."""
    r = points - position
    return 1e-7 * (r @ moment) / np.sum(r * r, axis=1) ** 1.5


def along_lines(piece, function):
    """Minus the integral of a field from the center to nodes, exact for quadratic fields."""
    found = []
    for point in piece.points:
        line = point - piece.center
        places = (piece.center + t * line for t in (0.5 - 12**-0.5, 0.5 + 12**-0.5))
        found.append(-0.5 * sum(function(place) @ line for place in places))
    return np.array(found)


def between(piece, other, real, mirror):
    """The potential at the nodes of a piece of unit charges at those of another, and at images.

    Pieces with a gap of three times the larger radius are dipoles.
    """
    total = np.zeros((len(piece.points), len(other.points)), complex)
    if real:
        total = total + of_charges(piece, piece.points, piece.center, other)
    if mirror:
        point, normal, strength = mirror
        points = piece.points - 2 * ((piece.points - point) @ normal)[:, None] * normal
        center = piece.center - 2 * normal @ (piece.center - point) * normal
        total = total - strength * of_charges(piece, points, center, other)
    return total


def of_charges(piece, points, center, other):
    """The potential of a piece's unit charges at points about a center."""
    apart = np.sqrt((center - other.center) @ (center - other.center))
    if (apart - piece.extent - other.extent).real > 3 * max(piece.extent, other.extent):
        moments = (other.points - other.center) / MU0
        fields = np.array([flux(center, other.center, moment) for moment in moments])
        return -(points - center) @ fields.T
    to = points[:, None] - other.points
    r = np.sqrt(np.sum(to * to, axis=-1))
    radius = np.sqrt((piece.radius**2 + other.radius**2) / 2)
    s = r / radius
    ball = (1.2 - s**2 / 2 + 3 * s**3 / 16 - s**5 / 160) / radius
    return np.where(s.real < 2, ball, 1 / np.where(s.real < 2, 1, r)) / (4 * np.pi)


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
