"""Pairs of magnets that can come near each other, in groups of pairs that are alike."""

from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.mjcf.checking.close_iron import NEAR
from magmotor.mjcf.checking.geoms import bounding_radii
from magmotor.mjcf.checking.reach import reach
from magmotor.mjcf.checking.strengths import Magnet
from magmotor.mjcf.declared import couplings


def groups_of_pairs(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    magnets: list[Magnet],
    touching: NDArray[np.int64],
) -> Iterator[NDArray[np.int64]]:
    """Yield the pairs of magnets that can come near each other, shape (n, 2), like ones together.

    Only pairs of free bodies are put together, since other pairs differ in what they can reach.
    """
    kinds = {}
    coupled = {body for pair in couplings(model) for body in pair}
    kind = np.array(
        [kinds.setdefault(_kind(model, data, magnet, coupled), len(kinds)) for magnet in magnets]
    )
    moves = np.array([model.body_dofnum[magnet.body] > 0 for magnet in magnets])
    bounds = [_bound(model, data, magnet) for magnet in magnets]
    centers, room, radii = (np.array(parts) for parts in zip(*bounds, strict=True))
    apart = abs(centers[:, np.newaxis] - centers) - room[:, np.newaxis] - room
    apart = np.linalg.norm(np.maximum(apart, 0), axis=2)
    bodies = np.array([magnet.body for magnet in magnets])
    meets = (moves[:, np.newaxis] | moves) & (bodies[:, np.newaxis] != bodies)
    meets &= apart <= radii[:, np.newaxis] + radii
    first, second = np.nonzero(np.triu(meets, 1))
    if not len(first):
        return
    low, high = np.minimum(kind[first], kind[second]), np.maximum(kind[first], kind[second])
    keys = np.column_stack([low, high, touching[first, second]])
    _, group = np.unique(keys, axis=0, return_inverse=True)
    order = np.argsort(group, kind="stable")
    ends = np.flatnonzero(np.diff(group[order])) + 1
    yield from np.split(np.column_stack([first, second])[order], ends)


def _bound(
    model: mujoco.MjModel, data: mujoco.MjData, magnet: Magnet
) -> tuple[Array, Array, float]:
    """Return where a magnet can be if no limits hold it: a center, its room, and a radius."""
    geoms = np.flatnonzero(model.body_weldid[model.geom_bodyid] == magnet.body)
    origin = data.xpos[[magnet.body]]
    found = reach(model, data, magnet.body, 0, origin)
    size = np.linalg.norm(magnet.positions - origin, axis=1).max()
    if len(geoms):
        away = np.linalg.norm(data.geom_xpos[geoms] - origin, axis=1)
        size = max(size, (away + bounding_radii(model, geoms)).max())
    iron = magnet.elements[magnet.responses > 0] - model.nsite
    size += NEAR / 2 * model.geom_rbound[iron].max(initial=0)  # which is near before it touches
    return found.centers[0], found.links[0].room, float(found.radii[0] + size)


def _kind(model: mujoco.MjModel, data: mujoco.MjData, magnet: Magnet, coupled: set[int]) -> tuple:
    """Return what two free bodies have in common that behave alike; else, what is unique."""
    body, joint = magnet.body, model.body_jntadr[magnet.body]
    free = joint >= 0 and model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE
    if not free or (model.body_rootid == body).sum() > 1 or coupled & {*magnet.bodies.tolist()}:
        return body, magnet.images
    geoms = np.flatnonzero(model.geom_bodyid == body)
    frame = data.xmat[body].reshape(3, 3)
    places = (magnet.positions - data.xpos[body]) @ frame
    fields = [model.body_invweight0[body], places, magnet.axes @ frame, magnet.strengths,
              magnet.responses, magnet.saturations]  # fmt: skip
    fields += [getattr(model, f"geom_{name}")[geoms] for name in (
        "type", "size", "pos", "quat", "dataid", "contype", "conaffinity", "priority", "solmix",
        "solref", "solimp", "friction", "condim", "margin")]  # fmt: skip
    return (-1, *((np.round(field, 12) + 0.0).tobytes() for field in fields))
