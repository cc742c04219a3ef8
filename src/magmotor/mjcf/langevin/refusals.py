"""What is said of a model that Langevin cannot integrate: the obstacles and the flags that help."""

from collections.abc import Callable, Sequence

import mujoco

from magmotor.common.exceptions import ArgumentError, DeclarationError, InputError
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
    may help `otherwise`. An error about the declarations is returned as it is: nothing else helps.
    """
    if isinstance(refused, DeclarationError):
        return refused
    needed = [flag for flag in FLAGS if flag not in disable]
    if _refusal(model, check, [*disable, *needed]):
        return _extended(refused, otherwise)
    for flag in tuple(needed):
        fewer = [other for other in needed if other != flag]
        needed = needed if _refusal(model, check, [*disable, *fewer]) else fewer
    others = [[*disable, *(other for other in needed if other != flag)] for flag in needed]
    obstacles = [_refusal(model, check, flags) for flags in others]
    remedy = f"disable={[*disable, *needed]} lets Langevin ignore"
    if len(obstacles) == 1 and obstacles[0]:
        return _extended(obstacles[0], f"{remedy} this; {otherwise}")
    return InputError(f"{'; '.join(map(str, obstacles))} ({remedy} these; {otherwise})")


def _extended(refused: ValueError, more: str) -> ValueError:
    """Return an error with more words, and with its attributes."""
    if isinstance(refused, ArgumentError):
        return ArgumentError(refused.argument, refused.value, f"{refused.allowed} ({more})")
    return InputError(f"{refused} ({more})")


def _refusal(model: mujoco.MjModel, check: Check, flags: Sequence[str]) -> ValueError | None:
    """Return the error of the check for a copy of the model with disabled flags, or None."""
    try:
        check(copy_with(model, flags))
    except ValueError as error:
        return error
    return None
