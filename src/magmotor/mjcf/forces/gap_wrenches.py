"""Forces and torques by the fluxes through narrow gaps; see `gaps.py`."""

from magmotor.mjcf.forces.applied_fields import MOVES as OWNER_MOVES
from magmotor.mjcf.forces.applied_fields import OWNER, acts_on
from magmotor.mjcf.forces.gap_paths import FLUX, ONE, OTHER, PERMEANCE, set_potentials
from magmotor.mjcf.forces.gap_permeances import wrench_of_gap
from magmotor.mjcf.forces.gaps import ends_of
from magmotor.mjcf.forces.iron_pieces import BODY, MOVES, WELD, center_of
from magmotor.mjcf.forces.iron_potentials import field_along_line
from magmotor.mjcf.forces.mirror import NO_MIRROR
from magmotor.mjcf.forces.shape_wrenches import add_both
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY


@subroutine
def add_gap_wrenches(state, m, offsets, center, applied):
    """Add the derivatives of this energy to the wrenches on pieces, and on the owners of fields."""
    for k in range(len(state.gaps)):
        gap = state.gaps[k]
        if gap[FLUX] != 0.0:
            _add_gap(state, gap, center, applied)
            for number in range(len(state.fields)):
                _add_field(state, gap, state.fields[number], m, offsets, center, applied)


@subroutine
def _add_gap(state, gap, center, applied):
    """Add the wrenches on both sides of a gap."""
    one, other = state.pieces[int(gap[ONE])], int(gap[OTHER])
    body, moves, weld = -1, False, -1.0
    if other >= 0:
        second = state.pieces[other]
        body, moves, weld = int(second[BODY]), second[MOVES] > 0.0, second[WELD]
    if one[WELD] == weld or not (moves or one[MOVES] > 0.0):
        return
    set_potentials(state, gap)
    drop, flux = gap[FLUX] / gap[PERMEANCE], gap[FLUX] / VACUUM_PERMEABILITY
    found = wrench_of_gap(state, gap, -0.5 * drop * drop / VACUUM_PERMEABILITY, flux)
    add_both(
        int(one[BODY]), one[MOVES] > 0.0, body, moves, (*center_of(one), 0.0, 0.0, 0.0),
        (*found, 0.0), NO_MIRROR, 1.0, center, applied,
    )  # fmt: skip


@subroutine
def _add_field(state, gap, row, m, offsets, center, applied):
    """Add the forces of a field on the net charges at both centers."""
    start, end = ends_of(state, gap)
    f = field_along_line(start, end, row, m, offsets)
    owner, moves, target = int(row[OWNER]), row[OWNER_MOVES] > 0.0, (*start, 0.0, 0.0, 0.0)
    flux, one = gap[FLUX] / VACUUM_PERMEABILITY, state.pieces[int(gap[ONE])]
    u, v, w = flux * f[4], flux * f[5], flux * f[6]
    x, y, z = flux * f[1], flux * f[2], flux * f[3]
    if gap[OTHER] < 0.0:
        # The foot moves along the plane with the center.
        _, nx, ny, nz, _ = state.mirror
        along = x * nx + y * ny + z * nz
        u, v, w = u + x - along * nx, v + y - along * ny, w + z - along * nz
    if acts_on(row, one[WELD], one[MOVES]):
        add_both(
            int(one[BODY]), one[MOVES] > 0.0, owner, moves, target,
            (u, v, w, 0.0, 0.0, 0.0, 0.0), NO_MIRROR, 1.0, center, applied,
        )  # fmt: skip
    if gap[OTHER] >= 0.0:
        other = state.pieces[int(gap[OTHER])]
        if acts_on(row, other[WELD], other[MOVES]):
            add_both(
                int(other[BODY]), other[MOVES] > 0.0, owner, moves, (*end, 0.0, 0.0, 0.0),
                (x, y, z, 0.0, 0.0, 0.0, 0.0), NO_MIRROR, 1.0, center, applied,
            )  # fmt: skip
