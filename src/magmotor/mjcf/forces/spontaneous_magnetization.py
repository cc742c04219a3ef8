"""Whether pieces of iron magnetize each other without any field, which they must not.

Without saturation, the energy of `induction.py` is half the quadratic form of the matrix A, whose
diagonal blocks are a piece's inverse polarizability, mu0/V (1/chi + N), and whose others are minus
the fields B_ij of unit moments. If A is not positive definite, nothing but saturation bounds the
moments. Soft iron does not do that: one dipole each does not describe long pieces so close. The
diagonal blocks of diamagnets are negative definite, so that A must be negative definite. No
diamagnet magnetizes itself either, but the dipole of a thin disc of chi = -1 does, by its image in
a plane nearer than a fifth of its diameter.

The Gauss-Seidel method without fields and without saturation takes any moments to zero if A is
definite, and lets almost all grow if it is not. It need not be tried if at each piece the
fields of all others' unit moments cannot exceed its inverse polarizability (Gershgorin's theorem),
as is so for pieces that do not nearly touch.
"""

import math

from magmotor.dipoles import PERMEABILITY_OVER_4PI, inner
from magmotor.mjcf.forces.dipole_table import NOBODY
from magmotor.mjcf.forces.induction import (
    COINCIDENT,
    FINE,
    MOST_SWEEPS,
    TOLERANCE,
    UNSTABLE,
    update_moment,
)
from magmotor.mjcf.forces.iron_pieces import FACTORS, SUSCEPTIBILITY, VOLUME
from magmotor.mjcf.forces.mirror import mirrored
from magmotor.numerics.constants import COUNT
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY
from magmotor.numerics.simd import (
    broadcast,
    lane_numbers,
    load,
    square_root,
    total,
    where_equal,
    where_less,
)

GOLDEN_RATIO = 0.5 * (math.sqrt(5.0) - 1.0)
"""Its multiples, less integers, are the magnetizations in A/m from which to start."""


@subroutine
def find_instability(iron, pieces, mirror, frames) -> tuple[int, int]:
    """Test whether pieces magnetize by themselves; return how it went, and the piece that failed.

    The arguments are those of `magnetize_pieces`, and the moments are zero before and after a test
    that passes. It does if they fall by the square root of `TOLERANCE` in half of `MOST_SWEEPS`:
    the rate at which moments without saturation are found in time.
    """
    count, worst = len(pieces), -1
    if _are_far_apart(iron, pieces, mirror):
        return FINE, -1
    for i in range(count):
        for k in range(3):
            iron[3 + k, i] = pieces[i, VOLUME] * ((3 * i + k) * GOLDEN_RATIO % 1.0 - 0.5)
    for _ in range(MOST_SWEEPS // 2):
        largest = 0.0
        for i in range(count):
            square, _, coincident = update_moment(iron, pieces, i, mirror, frames, False)
            if coincident:
                return COINCIDENT, i
            square /= pieces[i, VOLUME] * pieces[i, VOLUME]
            if not square <= largest:
                largest, worst = square, i
        if largest <= TOLERANCE:
            iron[3:6, :count] = 0.0
            return FINE, -1
        if not largest < math.inf:
            break
    return UNSTABLE, worst


@subroutine
def _are_far_apart(iron, pieces, mirror):
    """Whether Gershgorin's theorem shows that no pieces magnetize by themselves."""
    count = len(pieces)
    for i in range(count):
        x, y, z = iron[0, i], iron[1, i], iron[2, i]
        couplings = _sum_of_inverse_cubes(x, y, z, iron[6, i], iron, count)
        if mirror[0] != 0.0:
            x, y, z, _, _, _ = mirrored(mirror, (x, y, z, 0.0, 0.0, 0.0))
            images = _sum_of_inverse_cubes(x, y, z, NOBODY, iron, count)
            couplings += abs(mirror[0]) * images
        row = pieces[i]
        least = math.inf
        for k in range(3):
            least = min(least, abs(1.0 / row[SUSCEPTIBILITY] + row[FACTORS + k]))
        stiffness = VACUUM_PERMEABILITY / row[VOLUME] * least
        if not 2.0 * PERMEABILITY_OVER_4PI * couplings < stiffness:
            return False
    return True


@subroutine
def _sum_of_inverse_cubes(x, y, z, label, iron, count):
    """Return the sum of 1/r^3 over the pieces with other labels, eight at a time."""
    tx, ty, tz, own = broadcast(x), broadcast(y), broadcast(z), broadcast(label)
    end, far, one = broadcast(float(count)), broadcast(math.inf), broadcast(1.0)
    number, step, result = lane_numbers(), broadcast(float(COUNT)), broadcast(0.0)
    for j in range(0, count, COUNT):
        dx, dy, dz = tx - load(iron, 0, j), ty - load(iron, 1, j), tz - load(iron, 2, j)
        square = where_equal(load(iron, 6, j), own, far, inner(dx, dy, dz, dx, dy, dz))
        inverse = one / where_less(number, end, square, far)
        result = result + inverse * square_root(inverse)
        number = number + step
    return total(result)
