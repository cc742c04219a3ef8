"""What of a model has dry friction, which takes energy that no noise gives back."""

import mujoco
import numpy as np

from magmotor.mjcf.lookup import disabled, label
from magmotor.mjcf.possible_contacts import possible_contacts
from magmotor.mjcf.viscous_contact import ALWAYS_IN_CONE


def dry_joints(model: mujoco.MjModel) -> list[str]:
    """Return the names of the joints and tendons with dry friction."""
    if disabled(model, "frictionloss"):
        return []
    joints = np.unique(model.dof_jntid[model.dof_frictionloss > 0])
    tendons = np.flatnonzero(model.tendon_frictionloss > 0)
    return [label(model, "joint", i) for i in joints] + [label(model, "tendon", i) for i in tendons]


def dry_contacts(model: mujoco.MjModel) -> list[str]:
    """Return the names of the contacts with dry friction."""
    return [
        contact.name
        for contact in possible_contacts(model)
        if contact.dimension > 1 and contact.sliding_friction != ALWAYS_IN_CONE
    ]
