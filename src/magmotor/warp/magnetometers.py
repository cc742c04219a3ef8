"""Magnetometers: the field at a site, along the site's axes, as sensor data."""

from typing import Any

import mujoco
import numpy as np
import warp as wp

from magmotor.warp.dipoles import Dipoles, force_and_flux
from magmotor.warp.drives import drive_in
from magmotor.warp.field_values import flux_and_gradient
from magmotor.warp.fields import Field
from magmotor.warp.mirrors import Mirror, images_at

wp.set_module_options({"enable_backward": False})


@wp.kernel
def _measure_dipoles(
    site: wp.array[int],
    address: wp.array[int],
    permeability: float,
    plane: int,
    strength: float,
    place: wp.array2d[wp.vec3],
    moment: wp.array2d[wp.vec3],
    geom_xpos: wp.array2d[wp.vec3],
    geom_xmat: wp.array2d[wp.mat33],
    site_xpos: wp.array2d[wp.vec3],
    site_xmat: wp.array2d[wp.mat33],
    sensordata: wp.array2d[float],
):
    world, k = wp.tid()
    x = site_xpos[world, site[k]]
    flux = wp.vec3(0.0)
    for j in range(place.shape[1]):
        _, b = force_and_flux(wp.vec3(0.0), moment[world, j], x - place[world, j])
        flux += b
    if plane >= 0:
        _, b = images_at(
            x, wp.vec3(0.0), plane, strength, world, place, moment, geom_xpos, geom_xmat
        )
        flux += b
    along = permeability * (wp.transpose(site_xmat[world, site[k]]) * flux)
    for axis in range(3):
        sensordata[world, address[k] + axis] = along[axis]


@wp.kernel
def _add_field(
    site: wp.array[int],
    address: wp.array[int],
    numbers: wp.array2d[float],
    driven: int,
    frame_type: int,
    frame: int,
    drive: wp.array2d[float],
    xpos: wp.array2d[wp.vec3],
    xmat: wp.array2d[wp.mat33],
    site_xpos: wp.array2d[wp.vec3],
    site_xmat: wp.array2d[wp.mat33],
    sensordata: wp.array2d[float],
):
    world, k = wp.tid()
    flux, _ = flux_and_gradient(
        numbers, drive_in(drive, world, driven), frame_type, frame, world,
        site_xpos[world, site[k]], xpos, xmat, site_xpos, site_xmat,
    )  # fmt: skip
    along = wp.transpose(site_xmat[world, site[k]]) * flux
    for axis in range(3):
        sensordata[world, address[k] + axis] += along[axis]


@wp.kernel
def _cut_off(address: wp.array[int], cutoff: wp.array[float], sensordata: wp.array2d[float]):
    world, k, axis = wp.tid()
    value = sensordata[world, address[k] + axis]
    if cutoff[k] > 0.0 and wp.abs(value) > cutoff[k]:
        sensordata[world, address[k] + axis] = wp.sign(value) * cutoff[k]


class Magnetometers:
    """The magnetometers of a model, by the rows of its table."""

    def __init__(self, model: mujoco.MjModel, rows: Any):
        cutoff = np.array([model.sensor_cutoff[row.sensor] for row in rows])
        self.count = len(rows)
        self._site, self._address = (
            wp.array([getattr(row, name) for row in rows], dtype=int)
            for name in ("site", "address")
        )
        self._cutoff = wp.array(cutoff, dtype=float)

    def measure(
        self, d: Any, dipoles: Dipoles, mirror: Mirror | None, fields: dict[str, Field]
    ) -> None:
        """Write the sensor data."""
        room, dim, where = d.magmotor, (d.nworld, self.count), [self._site, self._address]
        plane = (mirror.plane, mirror.strength) if mirror else (-1, 0.0)
        wp.launch(
            _measure_dipoles,
            dim=dim,
            inputs=[
                *where, dipoles.permeability, *plane, room.place, room.moment, d.geom_xpos,
                d.geom_xmat, d.site_xpos, d.site_xmat,
            ],
            outputs=[d.sensordata],
        )  # fmt: skip
        for field in fields.values():
            wp.launch(
                _add_field,
                dim=dim,
                inputs=[
                    *where, *field.source, room.drive, d.xpos, d.xmat, d.site_xpos, d.site_xmat,
                ],
                outputs=[d.sensordata],
            )  # fmt: skip
        wp.launch(
            _cut_off, dim=(*dim, 3), inputs=[self._address, self._cutoff], outputs=[d.sensordata]
        )
