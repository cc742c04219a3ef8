"""The contacts that a model can have, whatever its configuration."""

from collections.abc import Iterator
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.mjcf.lookup import disabled, label


class Contact(NamedTuple):
    """A contact that two geoms may have."""

    name: str
    """Its contact pair, or both geoms."""
    geoms: tuple[int, int]
    dimension: int
    """Dimension of the contact force, condim; there is friction if it exceeds 1."""
    sliding_friction: float
    """That of the contact pair; infinite if there is none."""
    adhesion: list[float]


def may_touch(model: mujoco.MjModel) -> bool:
    """Return whether the model may have contacts."""
    possible = model.npair > 0 or len(colliding_geoms(model)) > 0
    return possible and not disabled(model, "contact")


def possible_contacts(model: mujoco.MjModel) -> Iterator[Contact]:
    """Yield the contacts of contact pairs and of other geoms that MuJoCo tests for collisions."""
    if disabled(model, "contact"):
        return
    paired = set()
    for pair in range(model.npair):
        geoms = int(model.pair_geom1[pair]), int(model.pair_geom2[pair])
        paired.add(frozenset(geoms))
        yield Contact(
            label(model, "pair", pair),
            geoms,
            int(model.pair_dim[pair]),
            float(model.pair_friction[pair, 0]),
            _adhesion(model, "pair", [pair]),
        )
    for one, other in colliding_geoms(model).tolist():
        if frozenset((one, other)) not in paired:
            yield Contact(
                " and ".join(label(model, "geom", geom) for geom in (one, other)),
                (one, other),
                _dimension(model, one, other),
                np.inf,
                _adhesion(model, "geom", [one, other]),
            )


def colliding_geoms(model: mujoco.MjModel) -> NDArray[np.int64]:
    """Return the pairs (n, 2) of geoms that MuJoCo tests for collisions without being told to."""
    types, affinities = model.geom_contype, model.geom_conaffinity
    meets = types[:, np.newaxis] & affinities
    bodies = model.body_weldid[model.geom_bodyid]
    moves = model.body_dofnum[bodies] > 0
    collide = (meets | meets.T).astype(bool) & (moves[:, np.newaxis] | moves)
    collide &= bodies[:, np.newaxis] != bodies
    if not disabled(model, "filterparent"):
        parents = model.body_weldid[model.body_parentid[bodies]]
        related = (bodies == parents[:, np.newaxis]) & (bodies > 0)
        collide &= ~(related | related.T)
    owners = model.geom_bodyid
    collide &= ~are_excluded(model, owners, owners)
    return np.argwhere(np.triu(collide, 1))


def are_excluded(model: mujoco.MjModel, one: NDArray, other: NDArray) -> NDArray[np.bool_]:
    """Return for which of bodies (n,) and (m,) the model excludes contacts, shape (n, m)."""
    low, high = np.minimum.outer(one, other), np.maximum.outer(one, other)
    return np.isin((low << 16) + high, model.exclude_signature)


def _dimension(model: mujoco.MjModel, one: int, other: int) -> int:
    """Return the condim of a contact of two geoms: of the one with priority, or the larger one."""
    first, second = model.geom_priority[[one, other]]
    dimensions = model.geom_condim[[one, other]]
    return int(dimensions.max() if first == second else dimensions[int(second > first)])


def _adhesion(model: mujoco.MjModel, kind: str, numbers: list[int]) -> list[float]:
    """Return the adhesion of geoms or pairs, which MuJoCo has since version 4."""
    return getattr(model, f"{kind}_adhesion", np.zeros(max(numbers) + 1))[numbers].tolist()
