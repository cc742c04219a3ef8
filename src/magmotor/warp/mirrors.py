"""A plane of soft iron, which acts on dipoles as their mirror images do.

See `magmotor.mjcf.forces.mirror`: the force and the field of all images at a dipole follow from
those of the dipoles themselves at the mirrored place.
"""

from typing import Any

import mujoco
import warp as wp

from magmotor.warp.bodies import wrench_on_dipole
from magmotor.warp.dipoles import Dipoles, force_and_flux

wp.set_module_options({"enable_backward": False})


@wp.func
def _reflected(n: wp.vec3, v: wp.vec3):
    return v - 2.0 * wp.dot(n, v) * n


@wp.func
def images_at(
    x: wp.vec3,
    a: wp.vec3,
    plane: int,
    strength: float,
    world: int,
    place: wp.array2d[wp.vec3],
    moment: wp.array2d[wp.vec3],
    geom_xpos: wp.array2d[wp.vec3],
    geom_xmat: wp.array2d[wp.mat33],
):
    """Return the force of all images on a dipole a at x, and their field, over mu0/(4 pi).

    Both are NaN if that or any dipole is below the plane.
    """
    frame = geom_xmat[world, plane]
    n = wp.vec3(frame[0, 2], frame[1, 2], frame[2, 2])
    origin = geom_xpos[world, plane]
    height = wp.dot(n, x - origin)
    lowest = height
    there = x - 2.0 * height * n
    turned = _reflected(n, a)
    force = wp.vec3(0.0)
    flux = wp.vec3(0.0)
    for j in range(place.shape[1]):
        lowest = wp.min(lowest, wp.dot(n, place[world, j] - origin))
        f, b = force_and_flux(turned, moment[world, j], there - place[world, j])
        force += f
        flux += b
    k = wp.where(lowest > 0.0, -strength, wp.NAN)
    return k * _reflected(n, force), k * _reflected(n, flux)


@wp.kernel
def _add_image_wrenches(
    target: wp.array[int],
    slot: wp.array[int],
    plane: int,
    strength: float,
    permeability: float,
    place: wp.array2d[wp.vec3],
    moment: wp.array2d[wp.vec3],
    geom_xpos: wp.array2d[wp.vec3],
    geom_xmat: wp.array2d[wp.mat33],
    body: wp.array[int],
    xipos: wp.array2d[wp.vec3],
    wrench: wp.array2d[wp.spatial_vector],
):
    world, k = wp.tid()
    x = place[world, target[k]]
    a = moment[world, target[k]]
    force, flux = images_at(x, a, plane, strength, world, place, moment, geom_xpos, geom_xmat)
    center = xipos[world, body[slot[k]]]
    wrench[world, slot[k]] += permeability * wrench_on_dipole(x, a, force, flux, center)


class Mirror:
    """A plane of iron, by a row of the table of a model.

    Attributes
    ----------
    plane : int
        Its geom.
    strength : float
        Moments of images over those of the dipoles, chi/(chi + 2).
    """

    def __init__(self, model: mujoco.MjModel, row: Any):
        susceptibility = float(model.numeric_data[model.numeric_adr[row.material]])
        self.plane = int(row.geom)
        self.strength = susceptibility / (susceptibility + 2.0)

    def add_wrenches(self, d: Any, dipoles: Dipoles, body: Any) -> None:
        """Add the wrenches of the images on the dipoles that can move."""
        room = d.magmotor
        wp.launch(
            _add_image_wrenches,
            dim=(d.nworld, dipoles.target.size),
            inputs=[
                dipoles.target, dipoles.slot, self.plane, self.strength, dipoles.permeability,
                room.place, room.moment, d.geom_xpos, d.geom_xmat, body, d.xipos,
            ],
            outputs=[room.wrench],
        )  # fmt: skip
