"""What `Langevin` reads of a model, with a temperature or with noise of its own."""

import copy
import warnings
from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import mujoco
from numpy.typing import ArrayLike

from magmotor.mjcf.langevin.baths import dampers_with_temperatures, read_friction
from magmotor.mjcf.langevin.friction import Friction, model_friction
from magmotor.mjcf.langevin.lone_model import read_lone_bodies
from magmotor.mjcf.langevin.lone_motion import LoneBodies, lone_bodies
from magmotor.mjcf.langevin.loose_motion import loose_motions
from magmotor.mjcf.langevin.own_model import (
    check_damped,
    check_inertia,
    copy_with,
    couplings,
    leave_to_us,
    skip_plugins,
    without_friction,
)
from magmotor.mjcf.langevin.refusals import BY_MUJOCO, WITH_KT, refusal_with_remedies
from magmotor.mjcf.langevin.softening import soften
from magmotor.mjcf.langevin.supported import check_tree
from magmotor.mjcf.langevin.tree import Dampers, Tree, read_tree


class Prepared(NamedTuple):
    """A model as the compiled loop needs it."""

    own: mujoco.MjModel
    """The copy on which the loop runs."""
    effective_model: mujoco.MjModel
    """The same before the loop's own tasks were removed from it."""
    tree: Tree | LoneBodies
    dampers: Dampers | tuple[()]
    friction: Friction | None
    """None for lone bodies."""


def prepared_lone_bodies(model: mujoco.MjModel, disable: Sequence[str]) -> Prepared:
    """Read a model with noise of its own.

    Raises
    ------
    ValueError
        It does not consist of lone bodies. The message names the element and what to do.
    """
    own = copy_with(model, disable)
    try:
        lone = lone_bodies(own)
    except ValueError as error:
        raise refusal_with_remedies(model, disable, read_lone_bodies, error, WITH_KT) from None
    return Prepared(own, own, lone, (), None)


def prepared_tree(
    model: mujoco.MjModel,
    disable: Sequence[str],
    friction: float | ArrayLike | None,
    kT: float | dict[str, float],
    *,
    mujoco_steps: bool,
) -> Prepared:
    """Read a model with temperatures.

    Raises
    ------
    ValueError
        Nothing is damped, or something has no law of fluctuation and dissipation. The message names
        the element and what to do.
    """
    own = copy_with(model, disable)
    given = None if friction is None else read_friction(model, friction)
    check = partial(_check, mujoco_steps=mujoco_steps, all_friction=given is None)
    try:
        check(own)
    except ValueError as error:
        raise refusal_with_remedies(model, disable, check, error, BY_MUJOCO) from None
    if not mujoco_steps:
        soften(own)
    given = model_friction(own) if given is None else given
    effective = copy.copy(own)
    check_damped(own, given)
    for warning in loose_motions(own, given, mujoco_steps=mujoco_steps):
        warnings.warn(warning, stacklevel=3)
    full, rows = couplings(own, given)
    tree = read_tree(own, rows, full=full, mujoco_steps=mujoco_steps)
    dampers = dampers_with_temperatures(own, given, kT, constraints=tree.constraints)
    leave_to_us(own, mujoco_steps=mujoco_steps, all_friction=not mujoco_steps or friction is None)
    skip_plugins(own)
    return Prepared(own, effective, tree, dampers, given)


def _check(own: mujoco.MjModel, *, mujoco_steps: bool, all_friction: bool) -> None:
    """Check the forces of a model, unless MuJoCo takes the steps, and its friction."""
    if not mujoco_steps:
        check_tree(own)
        check_inertia(own)
    if all_friction or not mujoco_steps:
        model_friction(own if all_friction else without_friction(own))
