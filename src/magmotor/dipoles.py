"""Point dipoles: field, force, torque and energy.

One loop over sources (`sum_over_sources`) serves the array functions below, the compiled kernels
and MuJoCo's compiled callback. Its sums have the same bits on every processor; see
`magmotor.numerics.simd`. All quantities are in SI units: m, A m^2, T, N, J.
"""

from typing import NewType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor.common.arguments import checked
from magmotor.common.checks import check_array
from magmotor.common.exceptions import ArgumentError, InputError
from magmotor.common.hints import Points
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.constants import COUNT
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.simd import (
    broadcast,
    fused,
    lane_numbers,
    load,
    minimum,
    square_root,
    total,
    where_equal,
    where_less,
)

__all__ = [
    "COINCIDENCE",
    "PERMEABILITY_OVER_4PI",
    "energy",
    "field",
    "force_and_field",
    "wrench",
]

PERMEABILITY_OVER_4PI = 1e-7
"""mu0/(4 pi) in T m/A; the measured value differs by 1.3e-10, less than its own uncertainty."""

COINCIDENCE = 1e-9
"""Distance (m) below which two dipoles coincide."""

COINCIDENCE_SQUARED = COINCIDENCE**2

NOBODY = -1.0
"""Label of the dipoles that pad the sources to a multiple of eight; no rigid body has it."""


@subroutine(forceinline=True)
def inner(ax, ay, az, bx, by, bz):
    """Return the scalar product of two vectors, whose components are doubles or Eights."""
    return fused(ax, bx, fused(ay, by, az * bz))


@subroutine
def sum_over_sources(target, label, sources, count):
    """Sum the force on a dipole, and the field at it, over sources on other rigid bodies.

    `target` is the tuple (x, y, z, mx, my, mz). `sources` has rows x, y, z, mx, my, mz and the
    label of the rigid body; the number of its columns is a multiple of eight. The sum is over the
    first `count` columns whose label differs from the target's. Returns the force, the field and
    whether one of these sources coincides with the target.

    With r from a source of moment b to the target of moment a,
    F = mu0/(4 pi) (3/r^5) [(a.r) b + (b.r) a + (a.b) r - 5 (a.r)(b.r) r/r^2],
    B = mu0/(4 pi) (1/r^5) [3 (b.r) r - r^2 b].
    The loop handles eight sources at a time, with a partial sum in each lane.
    """
    tx, ty, tz = broadcast(target[0]), broadcast(target[1]), broadcast(target[2])
    ax, ay, az = broadcast(target[3]), broadcast(target[4]), broadcast(target[5])
    own, end = broadcast(label), broadcast(float(count))
    one, three, five = broadcast(1.0), broadcast(3.0), broadcast(-5.0)
    zero, far, step = broadcast(0.0), broadcast(np.inf), broadcast(float(COUNT))
    fx = fy = fz = bx = by = bz = along = zero
    nearest, number = far, lane_numbers()
    for j in range(0, count, COUNT):
        x, y, z = tx - load(sources, 0, j), ty - load(sources, 1, j), tz - load(sources, 2, j)
        mx, my, mz = load(sources, 3, j), load(sources, 4, j), load(sources, 5, j)
        # At an infinite distance, all terms of the own rigid body are zero, without a branch.
        square = where_equal(load(sources, 6, j), own, far, inner(x, y, z, x, y, z))
        square = where_less(number, end, square, far)
        number = number + step
        # Coincidence is judged once, after the loop, where the sums are infinite or NaN.
        nearest = where_less(square, nearest, square, nearest)
        inverse = one / square
        cubed = inverse * square_root(inverse)
        scale = three * cubed * inverse
        radial_a, radial_b = inner(ax, ay, az, x, y, z), inner(mx, my, mz, x, y, z)
        near, cross = scale * radial_b, scale * radial_a
        both = scale * fused(five * radial_a * inverse, radial_b, inner(ax, ay, az, mx, my, mz))
        less = zero - cubed
        # Of (b.r) a, the target's a is a factor common to all sources: it multiplies the sum.
        along = along + near
        fx = fused(both, x, fused(cross, mx, fx))
        fy = fused(both, y, fused(cross, my, fy))
        fz = fused(both, z, fused(cross, mz, fz))
        bx = fused(near, x, fused(less, mx, bx))
        by = fused(near, y, fused(less, my, by))
        bz = fused(near, z, fused(less, mz, bz))
    k, coincident = PERMEABILITY_OVER_4PI, minimum(nearest) < COINCIDENCE_SQUARED
    return (
        k * total(fused(along, ax, fx)),
        k * total(fused(along, ay, fy)),
        k * total(fused(along, az, fz)),
        k * total(bx),
        k * total(by),
        k * total(bz),
        coincident,
    )


@compiled_once(nogil=True)
def _compiled_force_and_field(checksum: int):
    """Define the loop over target dipoles."""

    def force_and_field(targets, sources, out):
        _ = checksum
        for i in range(len(targets)):
            t = targets[i]
            both = sum_over_sources(
                (t[0], t[1], t[2], t[3], t[4], t[5]), NOBODY, sources, sources.shape[1]
            )
            out[i, 0], out[i, 1], out[i, 2] = both[0], both[1], both[2]
            out[i, 3], out[i, 4], out[i, 5], out[i, 6] = both[3], both[4], both[5], both[6]

    return force_and_field


_force_and_field = _compiled_force_and_field()


def field(points: ArrayLike, positions: ArrayLike, moments: ArrayLike) -> NDArray[np.float64]:
    """Compute the magnetic field of point dipoles, the paper's equation (magneticfield).

    Parameters
    ----------
    points : array_like, shape (P, 3) or (3,)
        Points at which to compute the field, in m.
    positions, moments : array_like, shape (N, 3)
        The dipoles' positions in m and moments in A m^2.

    Returns
    -------
    ndarray, same shape as `points`
        Magnetic flux density in T.

    Raises
    ------
    ValueError
        A shape is wrong, a value is not finite or exceeds 1e30, or a point coincides with a
        dipole.

    Examples
    --------
    >>> import magmotor as mm
    >>> mm.dipoles.field([0, 0, 0.1], positions=[[0, 0, 0]], moments=[[0, 0, 1]])
    array([0.    , 0.    , 0.0002])
    """
    points = _vectors("points", points)
    return field_of(points, pack_sources(positions, moments))


def wrench(
    position: ArrayLike, moment: ArrayLike, positions: ArrayLike, moments: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Compute the force grad(m.B) on a dipole and the torque m x B in the field of other dipoles.

    Parameters
    ----------
    position, moment : array_like, shape (..., 3)
        Position in m and moment in A m^2 of the dipole. Several dipoles do not act on each other.
    positions, moments : array_like, shape (N, 3)
        Positions in m and moments in A m^2 of the sources of the field.

    Returns
    -------
    force, torque : ndarray, shape (..., 3)
        In N and N m; the torque is about the dipole's position.

    Raises
    ------
    ValueError
        A shape is wrong, a value is not finite or exceeds 1e30, or the dipole coincides with a
        source.

    Examples
    --------
    >>> import magmotor as mm
    >>> force, torque = mm.dipoles.wrench([0, 0, 0.1], [1, 0, 0], [[0, 0, 0]], [[0, 0, 1]])
    >>> print(force.round(6), torque.round(6))
    [0.003 0.    0.   ] [ 0.     -0.0002  0.    ]
    """
    force, field = force_and_field(position, moment, positions, moments)
    return force, np.cross(np.asarray(moment), field)


@checked
def force_and_field(
    position: Points, moment: Points, positions: ArrayLike, moments: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Compute the force grad(m.B) on a dipole, in N, and the field B at it, in T; see `wrench`."""
    position, moment = np.broadcast_arrays(position, moment)
    both = _evaluate(position, moment, pack_sources(positions, moments), "position")
    return both[..., 0:3], both[..., 3:6]


@checked
def energy(
    position: Points, moment: Points, positions: ArrayLike, moments: ArrayLike
) -> NDArray[np.float64]:
    """Compute the energy -m.B of a dipole in the field of other dipoles.

    The parameters and errors are those of `wrench`.

    Returns
    -------
    ndarray, shape (...)
        In J.
    """
    magnetic_field = field(position, positions, moments)
    return -np.sum(np.multiply(moment, magnetic_field), axis=-1)


Packed = NewType("Packed", np.ndarray)
"""Dipoles in the layout of `sum_over_sources`, from `pack_sources`."""


def pack_sources(positions: ArrayLike, moments: ArrayLike) -> Packed:
    """Return sources in the layout of `sum_over_sources`: (7, N), N padded to whole eights."""
    positions = _vectors("positions", positions)
    moments = _vectors("moments", moments)
    if positions.ndim != 2 or positions.shape != moments.shape:
        raise InputError(
            f"positions and moments have shapes {positions.shape} and {moments.shape}:"
            " both must be (N, 3)"
        )
    count = len(positions)
    sources = np.zeros((7, -(-count // COUNT) * COUNT))
    sources[:3, :count], sources[3:6, :count], sources[6, count:] = positions.T, moments.T, NOBODY
    return Packed(sources)


def field_of(points: NDArray[np.float64], sources: Packed) -> NDArray[np.float64]:
    """Return the field (..., 3) in T of dipoles at points (..., 3) in m, without checks.

    ValueError is raised only if a point coincides with a dipole.
    """
    return _evaluate(points, np.zeros_like(points), sources, "points")[..., 3:6]


def force_of(
    position: NDArray[np.float64], moment: NDArray[np.float64], sources: Packed
) -> NDArray[np.float64]:
    """Return the force (..., 3) in N of dipoles on others, without checks.

    The others have positions (..., 3) in m and moments (..., 3) in A m^2. ValueError is raised only
    if one coincides with a source.
    """
    return _evaluate(position, moment, sources, "position")[..., 0:3]


def _evaluate(position, moment, sources, name):
    targets = np.concatenate([position, moment], axis=-1).reshape(-1, 6)
    out = np.empty((len(targets), 7))
    _force_and_field(targets, sources, out)
    if out[:, 6].any():
        first = np.flatnonzero(out[:, 6])[0]
        separation = sources[:3, sources[6] != NOBODY].T - targets[first, :3]
        distance = np.linalg.norm(separation, axis=1)
        sentence = f"must not coincide with dipole {distance.argmin()} (within {COINCIDENCE:g} m)"
        raise ArgumentError(name, targets[first, :3], sentence)
    return out.reshape(*position.shape[:-1], 7)


def _vectors(name: str, value: ArrayLike) -> NDArray[np.float64]:
    return check_array(name, value, ..., 3)
