"""Applied fields: their wrenches on dipoles, and the reactions on the bodies to which they belong.

The force on a dipole is the gradient of m.B, as in `magmotor.mjcf.forces.applied_fields`.
"""

from typing import Any

import mujoco
import warp as wp

from magmotor.mjcf import declared
from magmotor.warp.bodies import wrench_on_dipole
from magmotor.warp.dipoles import Dipoles
from magmotor.warp.drives import drive_in
from magmotor.warp.field_values import flux_and_gradient
from magmotor.warp.per_world import PerWorld

wp.set_module_options({"enable_backward": False})


@wp.kernel
def _add_field_wrenches(
    numbers: wp.array2d[float],
    field_weld: int,
    driven: int,
    frame_type: int,
    frame: int,
    target: wp.array[int],
    slot: wp.array[int],
    weld: wp.array[int],
    drive: wp.array2d[float],
    place: wp.array2d[wp.vec3],
    moment: wp.array2d[wp.vec3],
    xpos: wp.array2d[wp.vec3],
    xmat: wp.array2d[wp.mat33],
    site_xpos: wp.array2d[wp.vec3],
    site_xmat: wp.array2d[wp.mat33],
    body: wp.array[int],
    xipos: wp.array2d[wp.vec3],
    wrench: wp.array2d[wp.spatial_vector],
):
    world, k = wp.tid()
    i = target[k]
    if weld[i] == field_weld:
        return
    x = place[world, i]
    a = moment[world, i]
    flux, gradient = flux_and_gradient(
        numbers, drive_in(drive, world, driven), frame_type, frame, world, x, xpos, xmat,
        site_xpos, site_xmat,
    )  # fmt: skip
    force = wp.transpose(gradient) * a
    center = xipos[world, body[slot[k]]]
    wrench[world, slot[k]] += wrench_on_dipole(x, a, force, flux, center)


@wp.kernel
def _set_reactions(
    numbers: wp.array2d[float],
    field_weld: int,
    driven: int,
    frame_type: int,
    frame: int,
    slot: int,
    weld: wp.array[int],
    drive: wp.array2d[float],
    place: wp.array2d[wp.vec3],
    moment: wp.array2d[wp.vec3],
    xpos: wp.array2d[wp.vec3],
    xmat: wp.array2d[wp.mat33],
    site_xpos: wp.array2d[wp.vec3],
    site_xmat: wp.array2d[wp.mat33],
    body: wp.array[int],
    xipos: wp.array2d[wp.vec3],
    wrench: wp.array2d[wp.spatial_vector],
):
    world = wp.tid()
    center = xipos[world, body[slot]]
    total = wp.spatial_vector()
    for i in range(weld.shape[0]):
        if weld[i] != field_weld:
            x = place[world, i]
            a = moment[world, i]
            flux, gradient = flux_and_gradient(
                numbers, drive_in(drive, world, driven), frame_type, frame, world, x, xpos, xmat,
                site_xpos, site_xmat,
            )  # fmt: skip
            total -= wrench_on_dipole(x, a, wp.transpose(gradient) * a, flux, center)
    wrench[world, slot] = total


class Field:
    """An applied field, by a row of the table of a model.

    Parameters
    ----------
    model : mujoco.MjModel
    row : record
    driven : int
        The row of its drive, or -1.

    Attributes
    ----------
    name : str
        The name of its numeric.
    numbers : wp.array, shape (1 or nworld, numbers)
        Those of the numeric, which may be set.
    owner : int
        The body to which it is fixed.
    reacts : bool
        Whether that can move, and so feels the reaction.
    slot : int
        The place of the reaction.
    """

    numbers, slot = PerWorld(), -1

    def __init__(self, model: mujoco.MjModel, row: Any, driven: int):
        first, size = model.numeric_adr[row.numeric], model.numeric_size[row.numeric]
        numbers = model.numeric_data[first : first + size][None]
        self.name = declared.name_of(model, "numeric", row.numeric)
        self.numbers = wp.array(numbers, dtype=float, ndim=2)
        self.owner, self.reacts = int(row.body), bool(row.freedoms > 0)
        self._where = int(row.weld), driven, int(row.frame_type), int(row.frame)

    def add_wrenches(self, d: Any, dipoles: Dipoles, body: Any) -> None:
        """Add the wrenches on the dipoles that can move, and write the reaction on the owner."""
        room = d.magmotor
        state = [
            dipoles.weld, room.drive, room.place, room.moment, d.xpos, d.xmat, d.site_xpos,
            d.site_xmat, body, d.xipos,
        ]  # fmt: skip
        if dipoles.target.size:
            wp.launch(
                _add_field_wrenches,
                dim=(d.nworld, dipoles.target.size),
                inputs=[self.numbers, *self._where, dipoles.target, dipoles.slot, *state],
                outputs=[room.wrench],
            )
        if self.reacts:
            wp.launch(
                _set_reactions,
                dim=d.nworld,
                inputs=[self.numbers, *self._where, self.slot, *state],
                outputs=[room.wrench],
            )

    @property
    def source(self) -> tuple[Any, ...]:
        """What a kernel needs to know of it: its numbers, its drive and its frame."""
        return self.numbers, *self._where[1:]
