"""Schemes as lists of their parts, each of which is solved exactly or explicitly.

The parts of one step, in the order in which they act: A drifts with the velocity, B kicks with the
force of the potential, O applies friction and noise. A part that comes n times acts for h/n each.
"""

from typing import NamedTuple


class Scheme(NamedTuple):
    """A splitting; with `exact` its part O is the exact Ornstein-Uhlenbeck flow, else Euler's."""

    parts: str
    exact: bool


SCHEMES = {
    "euler": Scheme("OBA", exact=False),  # the paper's stochastic variational Euler, (svi)
    "baoab": Scheme("BAOAB", exact=True),  # Leimkuhler and Matthews, 2013
}

METHODS = tuple(f"variational/{name}" for name in SCHEMES)

RIGID = ("variational/euler", "variational/cayley", "variational/baoab")
"""Of rigid bodies: Euler by the exponential map, by the Cayley map, and the splitting."""


def kicks_that_evaluate(parts: str) -> tuple[bool, ...]:
    """For each part, whether it is a kick that needs the force anew.

    A kick after which the position has not moved has the force of the kick before, across the end
    of a step, too.
    """
    anew = [False] * len(parts)
    moved = "A" in parts[parts.rindex("B") :]
    for i, part in enumerate(parts):
        anew[i] = part == "B" and moved
        moved = part == "A" or (moved and part != "B")
    return tuple(anew)
