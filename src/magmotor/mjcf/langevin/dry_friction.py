"""What of a model has dry friction, which takes energy that no noise gives back."""

import mujoco
import numpy as np

from magmotor.mjcf.langevin.checks import colliding_geoms
from magmotor.mjcf.langevin.supported import contact_dimension
from magmotor.mjcf.lookup import disabled, label
from magmotor.mjcf.viscous_contact import ALWAYS_IN_CONE


def dry_joints(model: mujoco.MjModel) -> list[str]:
    """Return the names of the joints and tendons with dry friction."""
    if disabled(model, "frictionloss"):
        return []
    joints = np.unique(model.dof_jntid[model.dof_frictionloss > 0])
    tendons = np.flatnonzero(model.tendon_frictionloss > 0)
    return [label(model, "joint", i) for i in joints] + [label(model, "tendon", i) for i in tendons]


def dry_contacts(model: mujoco.MjModel) -> list[str]:
    """Return the names of the pairs of geoms whose contacts have dry friction."""
    if disabled(model, "contact"):
        return []
    geoms = [*zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True)]
    dry = (model.pair_dim > 1) & (model.pair_friction[:, 0] != ALWAYS_IN_CONE)
    rubbing = [geoms[pair] for pair in np.flatnonzero(dry)]
    paired = {frozenset(both) for both in geoms}
    rubbing += [
        (one, other)
        for one, other in colliding_geoms(model).tolist()
        if frozenset((one, other)) not in paired and contact_dimension(model, one, other) > 1
    ]
    return [" on ".join(label(model, "geom", geom) for geom in both) for both in rubbing]
