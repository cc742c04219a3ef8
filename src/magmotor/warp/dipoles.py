"""Dipoles: what they are in each world now, and their wrenches on one another.

The formulas are those of `magmotor.dipoles`, in single precision.
"""

from typing import Any

import mujoco
import numpy as np
import warp as wp

from magmotor.common.arrays import Array
from magmotor.dipoles import COINCIDENCE_SQUARED
from magmotor.mjcf import declared
from magmotor.mjcf.declarations import table
from magmotor.mjcf.declarations.marks import COILS, COUPLINGS, DIPOLES
from magmotor.warp.bodies import wrench_on_dipole
from magmotor.warp.drives import drive_in
from magmotor.warp.per_world import PerWorld

wp.set_module_options({"enable_backward": False})

CLOSEST = wp.constant(COINCIDENCE_SQUARED)


@wp.func
def force_and_flux(a: wp.vec3, b: wp.vec3, r: wp.vec3):
    """Return the force of dipole b on dipole a, at r from it, and its field, over mu0/(4 pi).

    Both are NaN where the dipoles coincide. Powers of the distance up to the fourth are finite in
    single precision beyond that, while its fifth power would not be.
    """
    square = wp.dot(r, r)
    inverse = 1.0 / wp.sqrt(wp.where(square < CLOSEST, wp.NAN, square))
    n = inverse * r
    cubed = inverse * inverse * inverse
    an = wp.dot(a, n)
    bn = wp.dot(b, n)
    force = (3.0 * cubed * inverse) * (an * b + bn * a + (wp.dot(a, b) - 5.0 * an * bn) * n)
    return force, cubed * (3.0 * bn * n - b)


@wp.kernel
def _gather(
    site: wp.array[int],
    coil: wp.array[int],
    strength: wp.array2d[float],
    drive: wp.array2d[float],
    site_xpos: wp.array2d[wp.vec3],
    site_xmat: wp.array2d[wp.mat33],
    place: wp.array2d[wp.vec3],
    moment: wp.array2d[wp.vec3],
):
    world, i = wp.tid()
    k = site[i]
    frame = site_xmat[world, k]
    axis = wp.vec3(frame[0, 2], frame[1, 2], frame[2, 2])
    place[world, i] = site_xpos[world, k]
    size = strength[world % strength.shape[0], i] * drive_in(drive, world, coil[i])
    moment[world, i] = size * axis


@wp.kernel
def _set_mutual_wrenches(
    target: wp.array[int],
    slot: wp.array[int],
    weld: wp.array[int],
    after: wp.array[int],
    magnet: wp.array[int],
    factor: wp.array2d[float],
    permeability: float,
    place: wp.array2d[wp.vec3],
    moment: wp.array2d[wp.vec3],
    body: wp.array[int],
    xipos: wp.array2d[wp.vec3],
    wrench: wp.array2d[wp.spatial_vector],
):
    world, k = wp.tid()
    i = target[k]
    x = place[world, i]
    a = moment[world, i]
    force = wp.vec3(0.0)
    flux = wp.vec3(0.0)
    j = int(0)
    while j < weld.shape[0]:
        if weld[j] == weld[i]:
            j = after[j]
            continue
        scale = float(1.0)
        if factor.shape[0] > 0:
            scale = factor[magnet[i], magnet[j]]
        if scale != 0.0:  # else they may coincide
            f, b = force_and_flux(a, moment[world, j], x - place[world, j])
            force += scale * f
            flux += scale * b
        j += 1
    center = xipos[world, body[slot[k]]]
    wrench[world, slot[k]] = permeability * wrench_on_dipole(x, a, force, flux, center)


class Dipoles:
    """The dipoles of a model, in the order of their sites.

    Parameters
    ----------
    model : mujoco.MjModel
    kinds : int
        The bits of what acts.
    permeability : float
        mu0/(4 pi) in the units of the model.

    Attributes
    ----------
    sites : ndarray of int, shape (n,)
        Those of the model with a moment.
    owner : ndarray of int, shape (targets,)
        The bodies of the dipoles that can move.
    weld : wp.array, shape (n,)
        The rigid body of each dipole, on which the others of it do not act.
    target : wp.array, shape (targets,)
        Which of the dipoles can move.
    slot : wp.array, shape (targets,)
        The places of the wrenches on them.
    moments : wp.array, shape (1 or nworld, n)
        Their moments in A m^2, which may be set; those of coils are multiplied by their drives.
    """

    moments, slot = PerWorld(), None

    def __init__(self, model: mujoco.MjModel, kinds: int, permeability: float):
        rows = declared.rows(model, table.MAGNETS) if kinds & DIPOLES else []
        moments, of_site = declared.site_moments(model), declared.coil_of_sites(model)
        found = [
            (site, row.body, row.weld, number, of_site[site] if kinds & COILS else -1)
            for number, row in enumerate(rows)
            for site in range(row.first_site, row.end_site)
            if moments[site] != 0.0
        ]
        self.sites, owner, weld, magnet, coil = np.array(found, np.int32).reshape(-1, 5).T
        moves = [k for k, row in enumerate(found) if rows[row[3]].freedoms > 0]
        self.owner, self.permeability = owner[moves], permeability
        self.target = wp.array(np.array(moves, np.int32), dtype=int)
        self.weld = wp.array(weld, dtype=int)
        self.moments = wp.array(moments[self.sites][None], dtype=float, ndim=2)
        # Past the dipoles that follow on the same rigid body, which do not act on each other.
        ends = np.append(np.flatnonzero(np.diff(weld)) + 1, len(weld))
        after = ends[np.searchsorted(ends, np.arange(len(weld)), side="right")]
        self._site, self._after, self._magnet, self._coil = (
            wp.array(column, dtype=int) for column in (self.sites, after, magnet, coil)
        )
        factors = _factors(model, rows) if kinds & COUPLINGS else np.empty((0, 0))
        self._factor = wp.array(factors, dtype=float, ndim=2)

    def gather(self, d: Any) -> None:
        """Write the places and the moments of all dipoles."""
        room = d.magmotor
        wp.launch(
            _gather,
            dim=room.place.shape,
            inputs=[self._site, self._coil, self.moments, room.drive, d.site_xpos, d.site_xmat],
            outputs=[room.place, room.moment],
        )

    def set_wrenches(self, d: Any, body: Any) -> None:
        """Write the wrench of all others on each dipole that can move."""
        room = d.magmotor
        wp.launch(
            _set_mutual_wrenches,
            dim=(d.nworld, self.target.size),
            inputs=[
                self.target, self.slot, self.weld, self._after, self._magnet, self._factor,
                self.permeability, room.place, room.moment, body, d.xipos,
            ],
            outputs=[room.wrench],
        )  # fmt: skip


def _factors(model: mujoco.MjModel, rows: Any) -> Array:
    """Return the factors of couplings between any two magnets, or none if there are none."""
    couplings, number = declared.couplings(model), {row.body: k for k, row in enumerate(rows)}
    factors = np.ones((len(rows), len(rows)) if couplings else (0, 0))
    for pair, factor in couplings.items():
        if pair <= number.keys():
            i, j = number[min(pair)], number[max(pair)]
            factors[i, j] = factors[j, i] = factor
    return factors
