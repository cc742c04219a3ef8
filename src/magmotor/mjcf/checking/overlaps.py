"""Geoms of magnets and iron that overlap more than contacts should allow."""

import itertools
from collections.abc import Iterator

import mujoco
import numpy as np

from magmotor.mjcf import declared
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.checking.coil_bores import goes_into
from magmotor.mjcf.checking.contact_rule import SUNK
from magmotor.mjcf.checking.depth import depth_and_normal
from magmotor.mjcf.checking.failure import Failure
from magmotor.mjcf.checking.geoms import bounding_radii
from magmotor.mjcf.checking.strengths import Magnet, magnets_of
from magmotor.mjcf.declarations.marks import IRON, SHAPES
from magmotor.mjcf.lookup import label

ALLOWED = 0.1
"""Largest depth of a magnet of true shape in another one or in iron, over the smaller width."""


def overlaps(model: mujoco.MjModel, state: mujoco.MjData, where: str) -> Iterator[Failure]:
    """Yield geoms of magnets or iron that overlap in a state, which a sentence names by `where`."""
    magnets = magnets_of(model, state)
    yield from _in_iron(model, state, magnets, where)
    said = set()
    for failure, pair in _of_true_shapes(model, state, where):
        said.add(pair)
        yield failure
    bodies = [magnet.body for magnet in magnets if not magnet.images]
    planes = [magnet.elements[0] - model.nsite for magnet in magnets if magnet.images]
    welds = model.body_weldid[model.geom_bodyid]
    magnetic = np.isin(welds, bodies) | np.isin(np.arange(model.ngeom), planes)
    for contact in state.contact:
        geoms = contact.geom
        if (geoms < 0).any() or not magnetic[geoms].all() or frozenset(geoms.tolist()) in said:
            continue
        if -contact.dist > SUNK * bounding_radii(model, geoms).min():
            yield Failure(
                _names(model, geoms.tolist()),
                f"of magnets overlap by {-contact.dist:.2g} m {where}; move them apart",
            )


def _of_true_shapes(
    model: mujoco.MjModel, state: mujoco.MjData, where: str
) -> Iterator[tuple[Failure, frozenset[int]]]:
    """Yield magnets by their geom that are deep in others or in iron, and the numbers of both.

    On one rigid body, magnets may overlap, since polarizations add up, but iron displaces magnets.
    What fits in a coil may be in it.
    """
    kinds = acting_forces(model)
    magnets = [*declared.polarizations(model)] if kinds & SHAPES else []
    iron = [geom for geom, value in declared.iron(model).items() if value] if kinds & IRON else []
    welds, everything = model.body_weldid[model.geom_bodyid], np.arange(model.ngeom)
    pairs = [*itertools.combinations(magnets, 2), *itertools.product(magnets, iron)]
    one, other = np.array(pairs, int).reshape(-1, 2).T
    apart = np.linalg.norm(state.geom_xpos[one] - state.geom_xpos[other], axis=1)
    radii = bounding_radii(model, everything)
    near = (welds[one] != welds[other]) | np.isin(other, iron)
    near &= apart < radii[one] + radii[other]
    widths = 2 * model.geom_aabb[:, 3:].min(axis=1)
    widths[model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE] = np.inf
    for first, second in np.column_stack([one, other])[near].tolist():
        pair = [first, second]
        if goes_into(model, first, second) or goes_into(model, second, first):
            continue
        allowed = ALLOWED * float(widths[pair].min())
        depth = -mujoco.mj_geomDistance(model, state, first, second, allowed, None)
        if depth > allowed:
            what = "a magnet and iron" if second in iron else "magnets"
            fixed = welds[first] == welds[second] or not model.body_dofnum[welds[pair]].any()
            remedy = "no motion separates them: change their places" if fixed else "move them apart"
            yield (
                Failure(
                    _names(model, pair),
                    f"({what}) overlap by {depth:.2g} m {where}, where forces mean nothing; at"
                    f" most {allowed:.2g} m is allowed, {ALLOWED:g} of the smaller width; {remedy}",
                ),
                frozenset(pair),
            )


def _in_iron(
    model: mujoco.MjModel, state: mujoco.MjData, magnets: list[Magnet], where: str
) -> Iterator[Failure]:
    """Yield dipole sites that are deep in iron, such as a coil that is meant to have a core."""
    if not acting_forces(model) & IRON:
        return
    elements = np.concatenate([magnet.elements for magnet in magnets])
    places = np.concatenate([magnet.positions for magnet in magnets])
    strengths = np.concatenate([magnet.strengths for magnet in magnets])
    dipoles = (strengths > 0) & (elements < model.nsite)
    for geom, value in declared.iron(model).items():
        if value and model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_PLANE:
            depth, _ = depth_and_normal(model, state, geom, places[dipoles])
            allowed = ALLOWED * 2 * float(model.geom_aabb[geom, 3:].min())
            for site in elements[dipoles][depth > allowed].tolist():
                yield Failure(
                    label(model, "site", site),
                    f"is in the iron of {label(model, 'geom', geom)} {where}: iron shields a dipole"
                    " in it; for a coil with a core, let the coil list a geom, and give that the"
                    " user numbers 0 0 mu0 N I/L, in T",
                )


def _names(model: mujoco.MjModel, geoms: list[int]) -> str:
    return " and ".join(label(model, "geom", geom) for geom in geoms)
