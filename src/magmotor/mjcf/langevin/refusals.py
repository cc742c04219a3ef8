"""What is said of a model that Langevin cannot integrate: the obstacles and the flags that help."""

from collections.abc import Callable, Sequence

import mujoco

from magmotor.common.exceptions import InputError
from magmotor.mjcf.langevin.own_model import copy_with

FLAGS = "damper", "limit", "equality", "actuation", "frictionloss", "contact"
"""Flags that may help, in the order in which they change a model most."""

BY_MUJOCO = (
    "splitting='o-step-o' with friction=1.0 takes every model, but can be far too cold where dry"
    " friction acts"
)
WITH_KT = "with kT, Langevin takes other bodies, too, but not the noise of the model"
"""What else may help, with a temperature and without."""


Check = Callable[[mujoco.MjModel], object]
"""A function that raises a ValueError for a model that is not supported."""


def refusal_with_remedies(
    model: mujoco.MjModel, disable: Sequence[str], check: Check, refused: ValueError, otherwise: str
) -> ValueError:
    """Return the error for a model that a check refuses with disabled flags.

    Its message contains what the check says of each obstacle, the flags that would help, and what
    may help `otherwise`.
    """
    needed = [flag for flag in FLAGS if flag not in disable]
    if _refusal(model, check, [*disable, *needed]):
        return InputError(f"{refused} ({otherwise})")
    for flag in tuple(needed):
        fewer = [other for other in needed if other != flag]
        needed = needed if _refusal(model, check, [*disable, *fewer]) else fewer
    others = [[*disable, *(other for other in needed if other != flag)] for flag in needed]
    obstacles = "; ".join(_refusal(model, check, flags) for flags in others)
    ignored = "these" if len(needed) > 1 else "this"
    return InputError(
        f"{obstacles} (disable={[*disable, *needed]} lets Langevin ignore {ignored}; {otherwise})"
    )


def _refusal(model: mujoco.MjModel, check: Check, flags: Sequence[str]) -> str:
    """Return what the check says of a copy of the model with disabled flags; "" if it passes."""
    try:
        check(copy_with(model, flags))
    except ValueError as error:
        return str(error)
    return ""
