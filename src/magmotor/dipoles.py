"""Point dipoles: field, force, torque and energy.

One formula (`pair`) and one loop over sources (`sum_over_sources`) serve the array functions below
and MuJoCo's compiled callback. All quantities are SI: metres, A m^2, tesla, newton, joule.
"""

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from magmotor.checks import check_array

PERMEABILITY_OVER_4PI = 1e-7
"""mu0/(4 pi) in T m/A; its measured value differs by 1.3e-10, less than its own uncertainty."""

COINCIDENCE = 1e-9
"""Dipoles nearer to each other than this (metres) are taken to coincide."""

COINCIDENCE_SQUARED = COINCIDENCE**2

# Sums may be reordered and fused, which vectorises the loop; NaN and infinity keep their meaning.
# (A minimum over the loop would need the promise of no NaN: hence the count of coincidences.)
FASTMATH = {"reassoc", "contract", "nsz", "arcp"}


@njit(cache=True, fastmath=FASTMATH, inline="always")
def pair(x, y, z, ax, ay, az, bx, by, bz, inverse):
    """Force on dipole a in the field of b, and that field, without mu0/(4 pi).

    (x, y, z) points from b to a and `inverse` is one over its square.
    F = (3/r^5) [(a.r) b + (b.r) a + (a.b) r - 5 (a.r)(b.r) r/r^2],
    B = (1/r^5) [3 (b.r) r - r^2 b].
    """
    radial_a = ax * x + ay * y + az * z
    radial_b = bx * x + by * y + bz * z
    cubed = inverse * np.sqrt(inverse)
    scale = 3.0 * cubed * inverse
    along = ax * bx + ay * by + az * bz - 5.0 * radial_a * radial_b * inverse
    near = scale * radial_b
    return (
        scale * (radial_a * bx + radial_b * ax + along * x),
        scale * (radial_a * by + radial_b * ay + along * y),
        scale * (radial_a * bz + radial_b * az + along * z),
        near * x - cubed * bx,
        near * y - cubed * by,
        near * z - cubed * bz,
    )


@njit(cache=True, fastmath=FASTMATH, error_model="numpy")
def sum_over_sources(target, label, sources, count):
    """Force on one dipole and field at it, from the first `count` sources of other rigid bodies.

    `target` is the tuple (x, y, z, mx, my, mz); `sources` has rows x, y, z, mx, my, mz and the
    label of the rigid body; sources labelled as the target are left out. Returns the force, the
    field and how many of the sources taken coincide with the target.
    """
    x, y, z, mx, my, mz = target
    fx = fy = fz = bx = by = bz = 0.0
    coincident = 0
    for j in range(count):
        dx, dy, dz = x - sources[0, j], y - sources[1, j], z - sources[2, j]
        square = dx * dx + dy * dy + dz * dz
        own = sources[6, j] == label
        square = np.inf if own else square
        coincident += square < COINCIDENCE_SQUARED
        inverse = 1.0 / square
        px, py, pz, qx, qy, qz = pair(
            dx, dy, dz, mx, my, mz, sources[3, j], sources[4, j], sources[5, j], inverse
        )
        fx += px
        fy += py
        fz += pz
        bx += qx
        by += qy
        bz += qz
    k = PERMEABILITY_OVER_4PI
    return k * fx, k * fy, k * fz, k * bx, k * by, k * bz, coincident


@njit(cache=True, nogil=True)
def _force_and_field(targets, sources, out):
    for i in range(len(targets)):
        t = targets[i]
        total = sum_over_sources(
            (t[0], t[1], t[2], t[3], t[4], t[5]), -1.0, sources, sources.shape[1]
        )
        out[i, 0], out[i, 1], out[i, 2] = total[0], total[1], total[2]
        out[i, 3], out[i, 4], out[i, 5], out[i, 6] = total[3], total[4], total[5], total[6]


def field(points: ArrayLike, positions: ArrayLike, moments: ArrayLike) -> NDArray[np.float64]:
    """Magnetic field of point dipoles, paper's equation (magneticfield).

    Parameters
    ----------
    points : array_like, shape (P, 3) or (3,)
        Where the field is wanted, in metres.
    positions, moments : array_like, shape (N, 3)
        The dipoles' positions in metres and moments in A m^2.

    Returns
    -------
    ndarray, shape of `points`
        Magnetic flux density in tesla.

    Raises
    ------
    ValueError
        Wrong shape, a value that is not finite or exceeds 1e30, or a point that coincides with a
        dipole.

    Examples
    --------
    >>> import magmotor as mm
    >>> mm.dipoles.field([0, 0, 0.1], positions=[[0, 0, 0]], moments=[[0, 0, 1]])
    array([0.    , 0.    , 0.0002])
    """
    points = _vectors("points", points)
    return _evaluate("point", points, np.zeros_like(points), positions, moments)[..., 3:6]


def wrench(
    position: ArrayLike, moment: ArrayLike, positions: ArrayLike, moments: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Force grad(m.B) on a dipole and torque m x B about it, in the field of other dipoles.

    Parameters
    ----------
    position, moment : array_like, shape (..., 3)
        The dipole (or several, each taken alone) in metres and A m^2.
    positions, moments : array_like, shape (N, 3)
        The sources of the field.

    Returns
    -------
    force, torque : ndarray, shape (..., 3)
        In N and N m; the torque is about the dipole's own position.

    Raises
    ------
    ValueError
        Wrong shape, a value that is not finite or exceeds 1e30, or a dipole that coincides with a
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


def force_and_field(
    position: ArrayLike, moment: ArrayLike, positions: ArrayLike, moments: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Force grad(m.B) on a dipole, in N, and the others' field B at it, in T; see `wrench`."""
    position, moment = np.broadcast_arrays(
        _vectors("position", position), _vectors("moment", moment)
    )
    both = _evaluate("position", position, moment, positions, moments)
    return both[..., 0:3], both[..., 3:6]


def energy(
    position: ArrayLike, moment: ArrayLike, positions: ArrayLike, moments: ArrayLike
) -> NDArray[np.float64]:
    """Energy -m.B of a dipole in the field of other dipoles.

    Parameters and errors are those of `wrench`.

    Returns
    -------
    ndarray, shape (...)
        In joule.
    """
    moment = _vectors("moment", moment)
    return -np.sum(moment * field(position, positions, moments), axis=-1)


def pack_sources(positions: ArrayLike, moments: ArrayLike) -> NDArray[np.float64]:
    """Sources as `sum_over_sources` reads them: shape (7, N), no rigid body's label among them."""
    positions = _vectors("positions", positions)
    moments = _vectors("moments", moments)
    if positions.ndim != 2 or positions.shape != moments.shape:
        raise ValueError(
            f"positions and moments have shapes {positions.shape} and {moments.shape}:"
            " both must be (N, 3)"
        )
    return np.vstack([positions.T, moments.T, np.zeros(len(positions))])


def _evaluate(name, position, moment, positions, moments):
    sources = pack_sources(positions, moments)
    targets = np.concatenate([position, moment], axis=-1).reshape(-1, 6)
    out = np.empty((len(targets), 7))
    _force_and_field(targets, sources, out)
    coincident = np.flatnonzero(out[:, 6])
    if coincident.size:
        first = coincident[0]
        distance = np.linalg.norm(sources[:3].T - targets[first, :3], axis=1)
        raise ValueError(
            f"{name} {first} coincides with dipole {distance.argmin()}"
            f" (distance {distance.min():.3g} m: must be at least {COINCIDENCE:g} m)"
        )
    return out.reshape(*position.shape[:-1], 7)


def _vectors(name: str, value: ArrayLike) -> NDArray[np.float64]:
    return check_array(name, value, ..., 3)
