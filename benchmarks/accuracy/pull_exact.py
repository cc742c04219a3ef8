"""The pull of one magnet on another like it, on its axis, by closed forms and one quadrature.

It shares no code with the package. The charges J of a face, in T, pull those of another face with
f(z), and a magnet of height h has opposite charges on two faces: f(g) - 2 f(g + h) + f(g + 2 h) at
the gap g. In front of thick steel, the other magnet is the image of the first.
"""

import math
from collections.abc import Callable, Sequence

from scipy.integrate import quad

MU0 = 4e-7 * math.pi


def pull_of_twin(shape: str, size: Sequence[float], remanence: float, gap: float) -> float:
    """Return the force in N on a magnet that is magnetized along z; sizes are those of `magnet`."""
    if shape == "sphere":
        moment = remanence * math.pi / 6 * size[0] ** 3 / MU0
        return 3 * MU0 * moment**2 / (2 * math.pi * (size[0] + gap) ** 4)
    force, height = _between_faces(shape, size), size[-1]
    at_once = force(gap) - 2 * force(gap + height) + force(gap + 2 * height)
    return remanence**2 / MU0 * at_once


def pull_on_steel(
    shape: str, size: Sequence[float], remanence: float, gap: float, susceptibility: float
) -> float:
    """Return the force in N on a magnet at a gap from a half-space of steel."""
    strength = susceptibility / (susceptibility + 2)
    return strength * pull_of_twin(shape, size, remanence, 2 * gap)


def _between_faces(shape: str, size: Sequence[float]) -> Callable[[float], float]:
    """Return the force between two faces at a distance, in units of J^2/mu0."""
    if shape == "cuboid":
        return lambda z: _between_rectangles(size[0], size[1], z)
    disks = {"cylinder": [(size[0], 1)], "ring": [(size[0], -1), (size[1], 1)]}[shape]
    return lambda z: sum(
        s * t * _between_disks(a / 2, b / 2, z) for a, s in disks for b, t in disks
    )


def _between_disks(a: float, b: float, z: float) -> float:
    """Return pi a b times the integral of J1(ka) J1(kb) exp(-kz)/k, as one over an angle."""

    def part(angle: float) -> float:
        square = a * a + b * b - 2 * a * b * math.cos(angle)
        return -math.cos(angle) * math.log(z + math.sqrt(z * z + square))

    return a * b * quad(part, 0, math.pi, epsrel=1e-10, limit=200)[0]


def _between_rectangles(a: float, b: float, z: float) -> float:
    """Return the integral of z/r^3 over both faces, over 4 pi: along a, a closed form."""
    if z == 0:
        return a * b / 2

    def part(v: float) -> float:
        square = v * v + z * z
        return (b - v) * z * (math.sqrt(a * a + square) / square - 1 / math.sqrt(square))

    return quad(part, 0, b, epsrel=1e-10, limit=200)[0] / math.pi
