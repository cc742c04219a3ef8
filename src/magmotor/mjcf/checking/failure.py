"""A sentence about what will fail in a model, and the settings without it."""

import math
from typing import NamedTuple

from magmotor.common.arrays import Array
from magmotor.mjcf.checking.contact_rule import SLACK

ABSURD = 1e-6
"""Timestep, over that of the model, below which none is proposed."""


class Failure(NamedTuple):
    """One finding, and the settings without it."""

    subject: str
    predicate: str
    number: int = 1
    """Number of subjects like this one."""
    timestep: float = math.inf
    constant: float = math.inf
    """Time constant of contacts."""
    owners: tuple[tuple[str, Array], ...] = ()
    """What has the parameters of these contacts: name and numbers."""
    integrator: str = ""
    """The integrator without it, if that is the cheaper remedy."""
    note: bool = False
    """Whether it is a doubt or information, and no failure."""


def rounded_down(value: float) -> float:
    """Return a number with two digits that is not larger."""
    value = max(value, 1e-30)
    digit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{math.floor(value / digit * SLACK) * digit:.6g}")
