"""Schemes as lists of their parts, each of which is solved exactly or explicitly.

The parts of one step, in the order in which they act: A drifts with the velocity, B kicks with the
force of the potential, O applies friction and noise, K does both at once: friction and noise under
a force that stays. E is all of a step at once.
"""

from collections.abc import Mapping
from typing import NamedTuple

DRIFTS, KICKS, RUBS = "AE", "BKE", "OKE"
"""Parts that move, in which forces act, and in which friction and noise do."""


class Scheme(NamedTuple):
    """A splitting: its parts, and for which fraction of the step each acts.

    With `exact` friction and noise act as in truth, else by Euler's explicit step.
    """

    parts: str
    fractions: tuple[float, ...]
    exact: bool = True

    @property
    def takes_noise(self) -> bool:
        """Whether noise may act: it comes once in a step."""
        return sum(part in RUBS for part in self.parts) == 1


def evenly(parts: str, *, exact: bool = True) -> Scheme:
    """A scheme in which a part that comes n times acts for an nth of the step each."""
    return Scheme(parts, tuple(1 / parts.count(part) for part in parts), exact)


def palindrome(*half: float) -> Scheme:
    """AKA...KA, from the fractions of what comes before its middle part, which has the rest."""
    middle = 1 - 2 * sum(half[len(half) % 2 :: 2])
    fractions = (*half, middle, *reversed(half))
    return Scheme("".join("AK"[i % 2] for i in range(len(fractions))), fractions)


SPLITTINGS = {
    "verlet": evenly("AKA"),  # stochastic position Verlet: Melchionna, 2007
    "baoab": evenly("BAOAB"),  # Leimkuhler and Matthews, 2013
    "middle": evenly("BAOA"),  # BAOAB without its last kick: Zhang and others, 2019
    "blanes-moan4": palindrome(  # of fourth order, S6: Blanes and Moan, 2002
        0.0792036964311957,
        0.209515106613362,
        0.353172906049774,
        -0.143851773179818,
        -0.0420650803577195,
        0.434336666566456,
    ),
    "blanes-moan6": palindrome(  # of sixth order, S10, there
        0.0502627644003922,
        0.148816447901042,
        0.413514300428344,
        -0.132385865767784,
        0.0450798897943977,
        0.067307604692185,
        -0.188054853819569,
        0.432666402578175,
        0.541960678450780,
        -0.016404589403617997,
    ),
}

DISK = {"euler": evenly("OBA", exact=False), **SPLITTINGS}
"""Schemes of the disk: Euler's is the paper's stochastic variational one, (svi)."""

RIGID = {
    "euler": evenly("E", exact=False),
    "cayley": evenly("E", exact=False),
    **SPLITTINGS,
}
"""Schemes of rigid bodies: Euler's, in one part, comes by the exponential and by the Cayley map."""


def methods(schemes: Mapping[str, Scheme], *, noise: bool) -> tuple[str, ...]:
    """Names of the methods that serve a scene with noise, or without."""
    found = (name for name, scheme in schemes.items() if scheme.takes_noise or not noise)
    return tuple(f"variational/{name}" for name in found)


def kicks_that_evaluate(parts: str) -> tuple[bool, ...]:
    """For each part, whether it is a kick that needs the force anew.

    A kick after which the position has not moved has the force of the kick before, across the end
    of a step, too.
    """
    kicks = [part in KICKS for part in parts]
    anew = [False] * len(parts)
    after = parts[len(parts) - 1 - kicks[::-1].index(True) :]
    moved = any(part in DRIFTS for part in after)
    for i, part in enumerate(parts):
        anew[i] = kicks[i] and moved
        moved = part in DRIFTS or (moved and not kicks[i])
    return tuple(anew)
