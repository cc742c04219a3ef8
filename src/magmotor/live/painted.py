"""Spheres in the colors of their textures, which mjviser draws in one color."""

from itertools import islice
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array

Images = NDArray[np.uint8]

MOST = 20
"""Largest number of painted spheres; any more are drawn in one color."""

SECTIONS = 32, 64
"""Parts of a sphere from pole to pole and around, so that edges are on the coordinate planes."""

ACROSS = np.array([[0, 0, -1], [0, 0, 1], [1, 0, 0], [1, 0, 0], [1, 0, 0], [-1, 0, 0]])
DOWN = np.array([[0, -1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [0, -1, 0], [0, -1, 0]])
"""Directions of the columns and rows of a cube texture's images, in the order +x, -x, +y, ..."""


def painted_spheres(model: mujoco.MjModel) -> dict[int, Any]:
    """Return opaque spheres whose material has a cube texture, as meshes with colors, by geom."""
    spheres = model.geom_type == mujoco.mjtGeom.mjGEOM_SPHERE
    seen = spheres & (model.geom_rgba[:, 3] > 0) & (model.geom_group < 3) & (model.geom_matid >= 0)
    found = ((geom, _images(model, model.geom_matid[geom])) for geom in np.flatnonzero(seen))
    textured = ((int(geom), images) for geom, images in found if images is not None)
    return {
        geom: _painted(model.geom_size[geom, 0], images) for geom, images in islice(textured, MOST)
    }


def colors(images: Images, directions: Array) -> Images:
    """Return the colors, shape (n, 3), of a cube texture in directions, shape (n, 3)."""
    width, largest = images.shape[1], np.abs(directions).max(axis=1)
    axis = np.abs(directions).argmax(axis=1)
    image = 2 * axis + (directions[np.arange(len(axis)), axis] < 0)

    def index(along: NDArray[np.int64]) -> NDArray[np.int64]:
        place = 0.5 + 0.5 * (directions * along[image]).sum(axis=1) / largest
        return np.minimum(width * place, width - 1).astype(int)

    return images[image, index(DOWN), index(ACROSS)]


def _images(model: mujoco.MjModel, material: int) -> Images | None:
    """Return the images of a cube texture in its material's color, shape (6, n, n, 3), or None."""
    texture = model.mat_texid[material, mujoco.mjtTextureRole.mjTEXROLE_RGB]
    *color, opacity = model.mat_rgba[material]
    if texture < 0 or opacity < 1 or model.tex_type[texture] != mujoco.mjtTexture.mjTEXTURE_CUBE:
        return None
    start, width = model.tex_adr[texture], int(model.tex_width[texture])
    channels = int(model.tex_nchannel[texture])
    if channels < 3:
        return None
    images = model.tex_data[start : start + width * model.tex_height[texture] * channels]
    images = images.reshape(-1, width, width, channels)[..., :3] * np.array(color)
    # A single image is repeated on all sides.
    return np.broadcast_to(images.round().astype(np.uint8), (6, width, width, 3))


def _painted(radius: float, images: Images) -> Any:
    """Return the mesh of a sphere, each of whose faces has one color of a cube texture."""
    import trimesh

    angles = np.linspace(0, np.pi, SECTIONS[0] + 1)
    meridian = radius * np.column_stack([np.sin(angles), -np.cos(angles)])
    sphere = trimesh.creation.revolve(meridian, sections=SECTIONS[1])
    points = sphere.triangles.reshape(-1, 3)
    return trimesh.Trimesh(
        points,
        np.arange(len(points)).reshape(-1, 3),
        vertex_normals=points / radius,
        vertex_colors=np.repeat(colors(images, sphere.triangles_center), 3, axis=0),
        process=False,
    )
