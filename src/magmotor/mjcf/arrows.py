"""Arrows for the moments and the field of any model's dipoles, in movies and in the viewer."""

from typing import Annotated

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor.common import style
from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import Points, Positive, numbers
from magmotor.dipoles import COINCIDENCE
from magmotor.mjcf.field_and_energy import dipole_sites, field

Limits = Annotated[ArrayLike, numbers(2, above=0)]

MOMENT = (0.8, 0.24, 0.11)
"""Color (RGB) of moments, as in the movies of the devices."""

COLORS = style.BLUE, style.GREEN, style.ORANGE
WEAK_TO_STRONG = np.array([[*bytes.fromhex(color[1:])] for color in COLORS]) / 255
"""Colors (RGB) of fields."""

MOMENT_LENGTHS, FIELD_LENGTH = (0.15, 0.25), 0.05
"""Default lengths of arrows in extents of the model; those of moments depend on the geoms."""

OUTSIDE = 3.0
"""Length of an arrow over the radius of a geom that would hide it."""

SLIMNESS = 15.0
"""Length of an arrow in radii of its shaft."""

BLANK = np.zeros(3), np.zeros(3), np.zeros(9)
"""Size, position and orientation that are set later."""


@checked
def draw_moments(
    view: mujoco.MjvScene,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    *,
    length: Positive | None = None,
) -> None:
    """Add a red arrow for each dipole of a model to a picture, centered at its site.

    The lengths are proportional to the cube roots of the moments, like the sizes of magnets of one
    material. A dipole that is farther from the model's center than MuJoCo draws (`visual/map/zfar`)
    has no arrow, such as one that represents the earth.

    Parameters
    ----------
    view : mujoco.MjvScene
        The `scene` of a `mujoco.Renderer`, after `update_scene`; or the `user_scn` of a passive
        viewer, whose `ngeom` the caller sets to 0 before each frame.
    model : mujoco.MjModel
    data : mujoco.MjData
        Its site positions and orientations must be up to date, as after `mj_step` or `mj_forward`.
    length : float, optional
        Length of the longest arrow in m. The default is 0.15 of `model.stat.extent`, or more, up to
        0.25, so that an arrow is longer than the geoms around its dipole.

    Raises
    ------
    ValueError
        The picture has no room for the arrows: its `maxgeom` is too small; or the data belong to
        another model.
    """
    positions, moments, bodies = dipole_sites(model, data)
    visible = model.vis.map.zfar * model.stat.extent
    near = np.linalg.norm(positions - model.stat.center, axis=1) < visible
    positions, moments, bodies = positions[near], moments[near], bodies[near]
    if len(moments):
        strengths = np.linalg.norm(moments, axis=1, keepdims=True)
        sizes = np.cbrt(strengths / strengths.max())
        longest = length or _moment_length(model, data, positions, bodies)
        colors = np.broadcast_to(MOMENT, moments.shape)
        _add_arrows(view, positions, longest * sizes * moments / strengths, colors)


@checked
def draw_field(
    view: mujoco.MjvScene,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    points: Points,
    *,
    length: Positive | None = None,
    limits: Limits | None = None,
) -> None:
    """Add an arrow along the magnetic field at each point to a picture, centered at the point.

    All arrows have the same length. Their color shows the logarithm of the flux density: blue at
    the lower limit and below, green at the geometric mean of both limits, orange at the upper limit
    and above. A point that coincides with a dipole, or where the field is zero, has no arrow.

    Parameters
    ----------
    view : mujoco.MjvScene
        As in `draw_moments`.
    model : mujoco.MjModel
    data : mujoco.MjData
        As in `draw_moments`.
    points : array_like, shape (..., 3)
        World coordinates in m.
    length : float, optional
        Length of the arrows in m; by default 0.05 of `model.stat.extent`.
    limits : array_like, shape (2,), optional
        Flux densities in T of the first and the last color; by default the 5th and 95th percentiles
        of those at the points. In a movie, set them, so that the colors keep their meaning.

    Raises
    ------
    ValueError
        The limits are not in ascending order; the picture has no room for the arrows: its `maxgeom`
        is too small; or the data belong to another model.
    """
    points = np.asarray(points).reshape(-1, 3)
    for position in dipole_sites(model, data)[0]:
        points = points[np.linalg.norm(points - position, axis=1) > COINCIDENCE]
    vectors = field(model, data, points)
    strengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    there = strengths[:, 0] > 0
    points, vectors, strengths = points[there], vectors[there], strengths[there]
    if limits is not None and np.diff(limits)[0] <= 0:
        raise ArgumentError("limits", limits, "must be in ascending order")
    if len(points):
        low, high = np.log(np.quantile(strengths, (0.05, 0.95)) if limits is None else limits)
        levels = (np.log(strengths[:, 0]) - low) / (high - low or 1.0)
        stops = np.linspace(0, 1, len(WEAK_TO_STRONG))
        colors = np.stack([np.interp(levels, stops, part) for part in WEAK_TO_STRONG.T], axis=1)
        length = length or FIELD_LENGTH * model.stat.extent
        _add_arrows(view, points, length * vectors / strengths, colors)


def _moment_length(
    model: mujoco.MjModel, data: mujoco.MjData, positions: Array, bodies: NDArray
) -> float:
    """Return a length at which the ends of arrows are outside the geoms around their dipoles."""
    radius = 0.0
    for position, body in zip(positions, bodies, strict=True):
        first = model.body_geomadr[body]
        geoms = slice(first, first + model.body_geomnum[body])
        radii = model.geom_rbound[geoms]
        around = np.linalg.norm(data.geom_xpos[geoms] - position, axis=1) < radii
        radius = max(radius, min(radii[around], default=0.0))
    shortest, longest = (share * model.stat.extent for share in MOMENT_LENGTHS)
    return max(shortest, min(OUTSIDE * radius, longest))


def _add_arrows(view: mujoco.MjvScene, centers: Array, arrows: Array, colors: Array) -> None:
    """Add arrows, all of shape (n, 3), with colors from 0 to 1; ValueError if there is no room."""
    needed = view.ngeom + len(arrows)
    if needed > view.maxgeom:
        sentence = f"must be at least {needed}: {view.ngeom} geoms and {len(arrows)} arrows"
        raise ArgumentError("view.maxgeom", view.maxgeom, sentence)
    for center, arrow, color in zip(centers, arrows, colors, strict=True):
        geom = view.geoms[view.ngeom]
        rgba = np.array([*color, 1.0], np.float32)
        mujoco.mjv_initGeom(geom, mujoco.mjtGeom.mjGEOM_ARROW, *BLANK, rgba)
        radius = np.linalg.norm(arrow) / SLIMNESS
        ends = center - 0.5 * arrow, center + 1.5 * arrow  # MuJoCo draws only half of it
        mujoco.mjv_connector(geom, mujoco.mjtGeom.mjGEOM_ARROW, radius, *ends)
        geom.emission = 0.5
        geom.category = mujoco.mjtCatBit.mjCAT_DECOR  # casts no shadow
        view.ngeom += 1
