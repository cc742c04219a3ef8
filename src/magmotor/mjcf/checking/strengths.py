"""The magnets of a model, rigid bodies with dipoles or iron, and how strong they can become.

A plane of iron is one more magnet, without dipoles: its partners' images are its dipoles. A magnet
by its geom is the dipole in its center; where it touches something, `true_pull.py` has its force.
All moments are scaled so that mu0 is that of SI, whatever the units of the model are.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.declarations import table as of_table
from magmotor.mjcf.declarations.iron import PLANE
from magmotor.mjcf.declarations.marks import COILS, DIPOLES, IRON, SHAPES
from magmotor.mjcf.declarations.meshes import MESH
from magmotor.mjcf.declared import coil_of_geoms, coil_of_sites, polarizations, rows
from magmotor.mjcf.forces.iron_pieces import ellipsoid
from magmotor.mjcf.lookup import control_of, disabled, given_name, label
from magmotor.mjcf.unit_system import moment_scale
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY, demagnetizing_factors

FOLLOWING = [int(getattr(mujoco.mjtDyn, f"mjDYN_{x}")) for x in ("NONE", "FILTER", "FILTEREXACT")]
"""Dynamics of actuators whose output stays within the range of their control."""


class Magnet(NamedTuple):
    """The dipoles and the pieces of iron of one rigid body, in this order; or a plane of iron."""

    body: int
    positions: Array
    """In m, shape (n, 3)."""
    axes: Array
    """Directions of the dipoles, at drive 1; zero for iron."""
    strengths: Array
    """Largest moments in A m^2 that actuators can give; zero for iron."""
    bodies: NDArray[np.int64]
    responses: Array
    """Largest moment of iron per flux density, in A m^2/T; zero for dipoles."""
    saturations: Array
    """Largest moment of iron in A m^2."""
    depths: Array
    """How deep the centers of iron are below their surfaces, in m; zero for dipoles."""
    extents: Array
    """Of magnets by their geom, in m: dipoles that are nearer than the mean of two of them attract
    each other more than the shapes can; zero for others."""
    elements: NDArray[np.int64]
    """Numbers of sites; those of geoms come after all sites."""
    unbounded: int
    """An actuator that drives some dipoles and that nothing bounds, or -1."""
    coils: frozenset[int] = frozenset()
    """The actuators that drive its dipoles; -1 for those that none drives."""
    images: float = 0.0
    """Strength of the images in a plane of iron, at most 1 in size; 0 for others."""

    @property
    def shaped(self) -> bool:
        """Whether it has magnets by their geom."""
        return bool(self.extents.any())

    def name(self, model: mujoco.MjModel, dipole: int = 0) -> str:
        """Return the name of a dipole's body, of what that is fixed to, its site or a geom."""
        element, body = int(self.elements[dipole]), int(self.bodies[dipole])
        kind, number = "site", element
        if element >= model.nsite:
            kind, number = "geom", element - model.nsite
        while body and not self.images:
            if given_name(model, "body", body):
                return label(model, "body", body)
            body = int(model.body_parentid[body]) if model.body_weldid[body] != body else 0
        if not given_name(model, kind, number) and not self.images:
            if self.bodies[dipole]:
                return label(model, "body", self.bodies[dipole])
            solid = (model.geom_bodyid == 0) & (model.geom_type != PLANE)
            if solid.any():
                away = np.linalg.norm(model.geom_pos - self.positions[dipole], axis=1)
                return label(model, "geom", np.where(solid, away, np.inf).argmin())
        return label(model, kind, number)


def magnets_of(model: mujoco.MjModel, data: mujoco.MjData) -> list[Magnet]:
    """Return the magnets of a model, whose positions in `data` are up to date."""
    kinds = acting_forces(model)
    moments, (drives, unbounded, coils) = np.zeros(model.nsite), _drives(model, kinds)
    if kinds & DIPOLES and model.nuser_site:
        moments = moment_scale(model) * model.site_user[:, 0] * drives[: model.nsite]
    strengths, sites = abs(moments), np.flatnonzero(moments)
    pieces = [*_pieces(model)] if kinds & IRON else []
    shapes = [*_shapes(model, data)] if kinds & SHAPES else []
    geoms = np.array([geom for geom, *_ in (*shapes, *pieces)], int)
    iron = np.array([(0.0, 0.0, 0.0)] * len(shapes) + [numbers for _, *numbers in pieces])
    iron = iron.reshape(-1, 3)
    others = np.zeros(len(sites))
    bodies = np.concatenate([model.site_bodyid[sites], model.geom_bodyid[geoms]]).astype(int)
    places = np.array([place for _, place, *_ in shapes]).reshape(-1, 3)
    positions = np.vstack([data.site_xpos[sites], places, data.geom_xpos[geoms[len(shapes) :]]])
    axes = np.sign(moments[sites, np.newaxis]) * data.site_xmat[sites, 2::3]
    own = np.array([moment for *_, moment, _ in shapes]).reshape(-1, 3)
    largest, without = np.linalg.norm(own, axis=1), np.zeros(len(pieces))
    axes = np.vstack([axes, own / largest[:, np.newaxis], np.zeros((len(pieces), 3))])
    elements = np.concatenate([sites, model.nsite + geoms])
    strengths = np.concatenate([strengths[sites], largest, without]) * np.where(
        elements < model.nsite, 1.0, drives[elements]
    )
    extents = np.concatenate([others, [extent for *_, extent in shapes], without])
    coils, unbounded = coils[elements], unbounded[elements]
    magnetic = np.arange(len(elements)) < len(sites) + len(shapes)
    responses, saturations, depths = (np.concatenate([others, column]) for column in iron.T)
    welds = model.body_weldid[bodies]
    return [
        Magnet(
            int(weld), positions[own], axes[own], strengths[own], bodies[own], responses[own],
            saturations[own], depths[own], extents[own], elements[own],
            int(unbounded[own].max()),
            frozenset(coils[own & magnetic].tolist()),
        )
        for weld in np.unique(welds)
        for own in [welds == weld]
    ] + [_plane(model, data, *found) for found in _planes(model, kinds)]  # fmt: skip


def _shapes(
    model: mujoco.MjModel, data: mujoco.MjData
) -> Iterator[tuple[int, Array, Array, float]]:
    """Yield the geoms that are magnets, with their centers, moments and extents.

    Two magnets of area A and polarization J attract each other with at most J^2 A/2 mu0, which are
    dipoles at the distance (3 A t^2/pi)^(1/4) for magnets of thickness t.
    """
    scale = moment_scale(model)
    for geom, polarization in polarizations(model).items():
        frame, center, turn = data.geom_xmat[geom].reshape(3, 3), np.zeros(3), np.eye(3)
        if model.geom_type[geom] == MESH:
            center, volume, turn = _mesh(model, int(model.geom_dataid[geom]))
        else:
            volume = ellipsoid(int(model.geom_type[geom]), *model.geom_size[geom])[3]
        moment = frame @ turn @ polarization * volume / (VACUUM_PERMEABILITY * scale)
        thickness = 2 * float(model.geom_aabb[geom, 3:].min())
        extent = (3 * volume * thickness / math.pi) ** 0.25
        yield geom, data.geom_xpos[geom] + frame @ center, moment, extent


def _mesh(model: mujoco.MjModel, mesh: int) -> tuple[Array, float, Array]:
    """Return the center of a mesh, its volume, and the rotation from the declared frame."""
    first, start, turn = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh], np.empty(9)
    faces = model.mesh_face[start : start + model.mesh_facenum[mesh]]
    corners = model.mesh_vert[first + faces].astype(float)
    mujoco.mju_quat2Mat(turn, model.mesh_quat[mesh])
    parts = np.linalg.det(corners) / 6
    volume = float(parts.sum())
    return parts @ corners.sum(axis=1) / (4 * volume), volume, turn.reshape(3, 3).T


def _drives(
    model: mujoco.MjModel, kinds: int
) -> tuple[Array, NDArray[np.int64], NDArray[np.int64]]:
    """Return the largest drives, their actuators without limits, and all actuators.

    They are those of all sites, and then of all geoms. The drive is 1 where neither a limit nor
    saturation bounds it; elsewhere, the actuator without limits is -1. All are -1 for what is no
    coil.
    """
    of_coil = np.concatenate([coil_of_sites(model), coil_of_geoms(model)])
    drives, (unbounded, coils) = np.ones(len(of_coil)), np.full((2, len(of_coil)), -1)
    for coil, row in enumerate(rows(model, of_table.COILS) if kinds & COILS else ()):
        actuator = int(row.actuator)
        saturation = float(model.tuple_objprm[row.element])
        own, largest = of_coil == coil, largest_drive(model, actuator, saturation)
        drives[own], coils[own] = drive_limit(model, actuator, saturation), actuator
        unbounded[own] = actuator if largest == math.inf else -1
    return drives, unbounded, coils


def drive_limit(model: mujoco.MjModel, actuator: int, saturation: float) -> float:
    """Return the largest drive that a coil or a field can have, or 1 if nothing bounds it."""
    largest = largest_drive(model, actuator, saturation)
    return 1.0 if largest == math.inf else largest


def largest_drive(model: mujoco.MjModel, actuator: int, saturation: float = 0.0) -> float:
    """Return the largest drive that an actuator allows, infinite if nothing bounds it."""
    largest, dynamics = math.inf, int(model.actuator_dyntype[actuator])
    control = control_of(model, actuator)
    clamped = model.actuator_ctrllimited[control] and not disabled(model, "clampctrl")
    if clamped and dynamics in FOLLOWING:
        largest = abs(model.actuator_ctrlrange[control]).max()
    if model.actuator_actlimited[actuator]:
        largest = min(largest, abs(model.actuator_actrange[actuator]).max())
    if saturation > 0:
        return saturation / math.hypot(1, saturation / largest)
    return float(largest)


def _pieces(model: mujoco.MjModel) -> Iterator[tuple[int, float, float, float]]:
    """Yield the geoms of iron, with their largest response, saturation moment, and depth.

    Diamagnets are left out, since magnets only repel them.
    """
    scale = moment_scale(model)
    for row in rows(model, of_table.PIECES):
        geom, material = int(row.geom), model.numeric(int(row.material)).data
        chi, magnetization = material[0], material[1] if len(material) > 1 else 0.0
        if chi > 0:
            *axes, volume = ellipsoid(int(model.geom_type[geom]), *model.geom_size[geom])
            factor = min(demagnetizing_factors(*axes))
            response = volume * chi / (1 + factor * chi) / VACUUM_PERMEABILITY
            saturated = scale * volume * magnetization or math.inf
            yield geom, response, saturated, min(axes)


def _planes(model: mujoco.MjModel, kinds: int) -> Iterator[tuple[int, float]]:
    """Yield the plane of iron, if there is one, and the strength of the images in it."""
    for row in rows(model, of_table.PLANES) if kinds & IRON else ():
        chi = float(model.numeric(int(row.material)).data[0])
        yield int(row.geom), chi / (chi + 2)


def _plane(model: mujoco.MjModel, data: mujoco.MjData, geom: int, images: float) -> Magnet:
    """Return a plane of iron, with a point of it in place of a dipole."""
    body, none = model.geom_bodyid[geom], np.zeros(1)
    return Magnet(
        int(model.body_weldid[body]), data.geom_xpos[[geom]], np.zeros((1, 3)), none,
        np.array([body]), none, none, none, none, np.array([model.nsite + geom]), -1, frozenset(),
        images,
    )  # fmt: skip
