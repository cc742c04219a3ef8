"""How magnets and iron by their geom are described, how right that is, and what it costs.

The errors are those of docs/fields_coils_iron.md. The times are measured on one core of a server by
benchmarks/speed/shapes.py and iron.py, and rough.
"""

from collections import defaultdict
from collections.abc import Iterator
from ctypes import c_double, c_int64

import mujoco

from magmotor.mjcf import declared
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.checking.closest_approach import Meeting
from magmotor.mjcf.checking.failure import Failure
from magmotor.mjcf.checking.strengths import Magnet, magnets_of
from magmotor.mjcf.checking.touching_iron import unions_of
from magmotor.mjcf.checking.true_pull import TYPES
from magmotor.mjcf.declarations.iron import BOX, CAPSULE, CYLINDER, ELLIPSOID, PLANE, SPHERE
from magmotor.mjcf.declarations.marks import IRON, SHAPES
from magmotor.mjcf.declarations.meshes import MESH, MOST_FACES
from magmotor.mjcf.declarations.table import PIECES
from magmotor.mjcf.forces import responses
from magmotor.mjcf.forces.charges import ORDERS
from magmotor.mjcf.lookup import label
from magmotor.numerics.iron.nodes import RADIUS

POINTS = {
    BOX: f"{ORDERS[0] ** 2} to {ORDERS[-1] ** 2} charges on a face",
    CYLINDER: f"{ORDERS[0] ** 2} to {ORDERS[-1] ** 2} charges on a face",
    CAPSULE: f"{8 * ORDERS[0]} to {6 * ORDERS[-1] ** 2} charges",
    ELLIPSOID: f"{2 * ORDERS[0] ** 2} to {2 * ORDERS[-1] ** 2} charges",
}
"""How many charges a magnet has where its shape counts."""

TOUCHING = {
    BOX: (2.5, 10), CYLINDER: (2.5, 3), CAPSULE: (1.1, 20), ELLIPSOID: (2, 7), MESH: (1.1, 5),
}  # fmt: skip
"""Error in percent of the force on a magnet that touches one like it, and the time in us for such a
pair; for a mesh, the time for each of its faces."""

QUADRATIC, FACING, TOGETHER = 2e-4, 20, 200
"""Time in us of a piece of iron over its number of nodes squared; for each magnet that touches it;
and for each other piece that it magnetizes."""


def shape_notes(
    model: mujoco.MjModel, state: mujoco.MjData, pairs: list[Meeting]
) -> Iterator[Failure]:
    """Yield a note for each magnet by its geom, and for each piece of iron; like ones are alike.

    `pairs` tells what can touch what.
    """
    kinds, welds = acting_forces(model), model.body_weldid[model.geom_bodyid]
    met = _met(model, state, pairs)
    for geom in declared.polarizations(model) if kinds & SHAPES else ():
        what = _magnet(model, geom, met[int(welds[geom])])
        yield Failure(label(model, "geom", geom), what, note=True)
    rows = declared.rows(model, PIECES) if kinds & IRON else ()
    for row, address in zip(rows, unions_of(model, len(rows))[1].tolist(), strict=True):
        geom = int(row.geom)
        if address > 0:
            what = _iron(model, geom, address, met[int(welds[geom])])
            yield Failure(label(model, "geom", geom), what, note=True)


def _met(
    model: mujoco.MjModel, state: mujoco.MjData, pairs: list[Meeting]
) -> dict[int, list[Magnet]]:
    """Return, for each rigid body, the magnets that it can touch, or come close to with iron."""
    of_body, met = defaultdict(list), defaultdict(list)
    for magnet in magnets_of(model, state):
        of_body[magnet.body].append(magnet)
    for pair in pairs:
        if pair.approach:  # also where a cover is between them
            for one, other in (pair.magnets, pair.magnets[::-1]):
                met[one.body].append(other)
        for row in pair.like[:, :2].tolist():
            for one, other in (row, row[::-1]):
                weld, there = model.body_weldid[model.geom_bodyid[[one, other]]].tolist()
                flat = model.geom_type[other] == PLANE
                met[weld] += [each for each in of_body[there] if flat == (each.images != 0)]
    return met


def _magnet(model: mujoco.MjModel, geom: int, others: list[Magnet]) -> str:
    """Say how a magnet is described, if it can touch others."""
    kind = int(model.geom_type[geom])
    if kind == SPHERE:
        return "is a magnet, a sphere: a dipole, which is exact for other spheres"
    error, time = TOUCHING[kind]
    points = POINTS.get(kind, "")
    if kind == MESH:
        faces = int(model.mesh_facenum[model.geom_dataid[geom]])
        points, time = f"{faces} faces with up to {MOST_FACES} charges", time * faces
    what = "magnet" if declared.coil_of_geoms(model)[geom] < 0 else "coil"
    said = f"is a {what}, a {TYPES[kind]}: {points} where it is near, else a dipole"
    if any(other.shaped or other.images for other in others):
        said += (
            f"; in contact, forces are right to {error:g} %, for about {time} us per pair and step"
        )
    return said


def _iron(model: mujoco.MjModel, geom: int, address: int, others: list[Magnet]) -> str:
    """Say how a piece of iron is described, whose response is at an address."""
    count = c_int64.from_address(address + 8 * responses.COUNT).value
    distance = c_double.from_address(address + 8 * responses.RADIUS).value / RADIUS
    key = address + 8 * c_int64.from_address(address + 8 * responses.KEY).value
    saturates = c_double.from_address(key + 8 * responses.SATURATES).value != 0.0
    said = f"is iron: {count} nodes about {distance:.2g} m apart, for about"
    said += f" {max(1, round(QUADRATIC * count**2))} us per step"
    if any(other.strengths.any() for other in others):
        flat = model.geom_type[geom] in (BOX, CYLINDER)
        thin = ", to 20 % on a sheet that they saturate" if saturates else ""
        error = f"1 % on a face{thin}, but to 10 % near its edges" if flat else "14 %"
        said += (
            f"; in contact with magnets, forces are right to {error}, for about {FACING} us each"
        )
    else:
        said += "; forces on magnets are right to 0.5 % from that distance on"
    if any(other.responses.any() for other in others):
        said += f"; close to other iron, forces are rough, for about {TOGETHER} us each"
    return said
