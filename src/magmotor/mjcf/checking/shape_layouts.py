"""Magnets by their geom as layouts of dipoles, for what only needs to be about right."""

import math
from collections.abc import Iterator

import mujoco
import numpy as np

from magmotor.common.arrays import Array
from magmotor.mjcf.declarations.iron import BOX, CAPSULE, CYLINDER
from magmotor.mjcf.declarations.meshes import MESH
from magmotor.mjcf.declared import polarizations
from magmotor.mjcf.forces.iron_pieces import ellipsoid
from magmotor.mjcf.magnets.dipole_layout import contact_layout
from magmotor.mjcf.magnets.shapes import Cuboid, Tube
from magmotor.mjcf.unit_system import moment_scale
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY


def layouts_of_shapes(
    model: mujoco.MjModel, data: mujoco.MjData
) -> Iterator[tuple[int, Array, Array]]:
    """Yield the geoms that are magnets, with positions and moments along the axes of the world.

    Boxes and cylinders are those layouts of dipoles whose forces at contact are best. So are the
    cylinder with the volume of a capsule, and the box around a mesh. The polarization is in the
    units of the model, of which the scale of moments is the root.
    """
    scale = moment_scale(model)
    for geom, polarization in polarizations(model).items():
        body, center, volume, turn = _body_of(model, geom)
        frame, polarization = data.geom_xmat[geom].reshape(3, 3), turn @ polarization
        moment = frame @ polarization * volume / (VACUUM_PERMEABILITY * scale)
        points, parts = np.zeros((1, 3)), np.ones(1)
        if body is not None:
            x, y, z = (polarization / np.linalg.norm(polarization)).tolist()
            points, parts = contact_layout(body, (x, y, z))
        for point, part in zip(points, parts, strict=True):
            yield geom, data.geom_xpos[geom] + frame @ (center + point), part * moment


def _body_of(model: mujoco.MjModel, geom: int) -> tuple[Cuboid | Tube | None, Array, float, Array]:
    """Return what a geom is about, or None for a dipole; its center and volume; and a rotation.

    The rotation leads from the frame of the polarization to that of the geom.
    """
    kind, size = int(model.geom_type[geom]), model.geom_size[geom].tolist()
    if kind == MESH:
        return _mesh(model, geom)
    a, b, c = (2 * length for length in size)
    volume, body = ellipsoid(kind, *size)[3], None
    if kind == BOX:
        body = Cuboid(a, b, c)
    elif kind in (CAPSULE, CYLINDER):
        body = Tube(0.0, a, volume / (math.pi / 4 * a * a))
    return body, np.zeros(3), volume, np.eye(3)


def _mesh(model: mujoco.MjModel, geom: int) -> tuple[Cuboid, Array, float, Array]:
    """Return the box around a mesh, its center, the volume of the mesh, and the rotation."""
    mesh, turn = int(model.geom_dataid[geom]), np.empty(9)
    first, start = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
    faces = model.mesh_face[start : start + model.mesh_facenum[mesh]]
    corners = model.mesh_vert[first + faces].astype(float)
    mujoco.mju_quat2Mat(turn, model.mesh_quat[mesh])
    center, (a, b, c) = np.split(model.geom_aabb[geom], 2)
    volume = float(np.linalg.det(corners).sum() / 6)
    return Cuboid(2 * float(a), 2 * float(b), 2 * float(c)), center, volume, turn.reshape(3, 3).T
