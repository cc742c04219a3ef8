"""Brownian increments as a pure function of (seed, replica, step, channel).

The generator is counter-based: Threefry-2x64 with 13 rounds (Salmon, Moraes, Dror and Shaw,
*Parallel random numbers: as easy as 1, 2, 3*, 2011), which passes the batteries of TestU01. There
is no state to keep or to restore: any thread, method, or resumed run finds the same numbers. Normal
numbers come from it by the Box-Muller transform, a pair from a block, for two steps.

A path is known at its own timestep; coarser increments are sums of its own, finer ones are drawn
conditionally on its own by Levy's construction of the Brownian bridge.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false, reportGeneralTypeIssues=false

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from magmotor.common.checks import check_integer, check_number, reject
from magmotor.common.environment import physical_memory
from magmotor.common.files import check_fields, fields_in
from magmotor.numerics.compiled import compiled_once
from magmotor.numerics.elementary import (
    bits_as_float,
    cosine_of_quarter,
    float_as_bits,
    logarithm,
    sine_of_quarter,
)

__all__ = ["LARGEST_SEED", "BrownianPath"]

LARGEST_SEED = 2**53
"""Seeds are less: the largest integer that a double, MuJoCo's only type for user data, holds."""

FINEST = 31
"""Largest level: how many times a path's own steps can be halved."""

COARSEST = 2**24
"""Largest factor: how many of a path's own steps a step can be; its sum takes 0.1 s."""

LARGEST_STEP = 2**53
"""Steps of a path's own are counted up to less."""

BRIDGES = 2**32
"""Channels are less: those from there on are the bridges between refined steps."""

PIECE = 2**22
"""Random numbers that are drawn between two looks for Ctrl-C: some 0.05 s."""

_PARITY = np.uint64(0x1BD11BDAA9FC1A22)
_ONE = np.uint64(0x3FF0000000000000)


@njit(inline="always")
def _mix(x, y, rotation):
    x += y
    y = (y << np.uint64(rotation)) | (y >> np.uint64(64 - rotation))
    return x, y ^ x


@njit(inline="always")
def threefry(x, y, key0, key1):
    """Encrypt the counter (x, y) with 13 rounds of Threefry-2x64; all are uint64."""
    key2 = _PARITY ^ key0 ^ key1
    x, y = _mix(x + key0, y + key1, 16)
    x, y = _mix(x, y, 42)
    x, y = _mix(x, y, 12)
    x, y = _mix(x, y, 31)
    x, y = _mix(x + key1, y + key2 + np.uint64(1), 16)
    x, y = _mix(x, y, 32)
    x, y = _mix(x, y, 24)
    x, y = _mix(x, y, 21)
    x, y = _mix(x + key2, y + key0 + np.uint64(2), 16)
    x, y = _mix(x, y, 42)
    x, y = _mix(x, y, 12)
    x, y = _mix(x, y, 31)
    return _mix(x + key0, y + key1 + np.uint64(3), 16)


@njit(inline="always")
def box_muller(x, y):
    """Two independent standard normal numbers from two words of 64 random bits.

    The radius comes from 52 bits (at most 8.49), the angle from 52 bits, within half a turn, and a
    sign.
    """
    radius = math.sqrt(-2.0 * logarithm(2.0 - bits_as_float((x >> np.uint64(12)) | _ONE)))
    angle = 0.5 * (bits_as_float((y >> np.uint64(12)) | _ONE) - 1.5)
    signed = bits_as_float(float_as_bits(radius) | (y << np.uint64(63)))
    return signed * cosine_of_quarter(angle), radius * sine_of_quarter(angle)


@njit(inline="always")
def _normal(seed, replica, step, channel):
    """Standard normal number of a step; two steps share a block."""
    x, y = threefry(np.uint64(step >> 1), np.uint64(channel), np.uint64(seed), np.uint64(replica))
    even, odd = box_muller(x, y)
    return odd if step & 1 else even


@compiled_once(nogil=True)
def _compiled_normal(checksum: int):
    """The function `normal`."""

    def normal(seed, replica, step, channel, factor, level):
        """Standard normal number of one step of a path that is coarsened or refined.

        Parameters
        ----------
        seed, replica, step, channel : int
        factor : int
            The step is as long as so many steps of the seed's own path ...
        level : int
            ... or, if `factor` is 1, as one of its own halved so many times.
        """
        _ = checksum
        if level == 0:
            total = 0.0
            for k in range(factor):
                total += _normal(seed, replica, step * factor + k, channel)
            return total / math.sqrt(factor)
        # In units of its own step's root, each half is (parent +- bridge)/sqrt 2.
        value = _normal(seed, replica, step >> level, channel)
        for k in range(1, level + 1):
            parent = step >> (level - k + 1)
            bridge = _normal(seed, replica, parent, channel + (k << 32))
            right = (step >> (level - k)) & 1
            value = (value - bridge if right else value + bridge) * math.sqrt(0.5)
        return value

    return normal


normal = _compiled_normal()


@compiled_once(nogil=True)
def _compiled_fill(checksum: int):
    """The loop over steps."""

    def fill(out, seed, replica, first, channel, factor, level):
        _ = checksum
        for i in range(out.size):
            out[i] = normal(seed, replica, first + i, channel, factor, level)

    return fill


_fill_normals = _compiled_fill()


@dataclass(frozen=True)
class BrownianPath:
    """A Brownian path in any number of channels and replicas, seen at some timestep.

    Two methods, or two timesteps, follow the same path if they are given coarser or finer views of
    one: ``fine = BrownianPath(seed=1, timestep=0.01)`` and ``fine.coarsened(4)``.

    Parameters
    ----------
    seed : int
        At least 0, less than 2^53.
    timestep : float
        Of the increments, in s.
    factor, level : int
        How this view was made: by summing `factor` steps, or by halving `level` times.

    Examples
    --------
    >>> import magmotor as mm
    >>> fine = mm.noise.BrownianPath(seed=1, timestep=0.01)
    >>> print(fine.increments(4).sum().round(12), *fine.coarsened(4).increments(1).round(12))
    0.106231422153 0.106231422153
    """

    seed: int
    timestep: float
    factor: int = 1
    level: int = 0

    def __post_init__(self) -> None:
        """Check every field.

        Raises
        ------
        ValueError
            Names the field, its value and the bound.
        """
        checked = {
            "seed": check_seed(self.seed),
            "timestep": check_number("timestep", self.timestep, above=0, unit="s"),
            "factor": check_integer("factor", self.factor, at_least=1, at_most=COARSEST),
            "level": check_integer("level", self.level, at_least=0, at_most=FINEST),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)
        if self.level and self.factor > 1:
            raise reject("factor", self.factor, "must be 1 in a path that is refined")

    def coarsened(self, factor: int) -> "BrownianPath":
        """The same path at a timestep `factor` times longer.

        Raises
        ------
        ValueError
            `factor` is no power of 2 that undoes a refinement, not at least 1, or more than 2^24.
        """
        factor = check_integer("factor", factor, at_least=1, at_most=max(COARSEST, 2**FINEST))
        halvings = factor.bit_length() - 1
        if self.level and (factor != 1 << halvings or halvings > self.level):
            raise reject("factor", factor, f"must be a power of 2, at most 2^{self.level}, here")
        if self.level:
            return replace(self, timestep=factor * self.timestep, level=self.level - halvings)
        return replace(self, timestep=factor * self.timestep, factor=self.factor * factor)

    def refined(self, halvings: int = 1) -> "BrownianPath":
        """The same path at a timestep halved so many times.

        Raises
        ------
        ValueError
            The path is a sum of steps that cannot be halved so often, or its own steps would be
            halved more than 31 times.
        """
        halvings = check_integer("halvings", halvings, at_least=0, at_most=FINEST)
        timestep = self.timestep / 2**halvings
        if self.factor == 1:
            return replace(self, timestep=timestep, level=self.level + halvings)
        if self.factor % 2**halvings:
            raise reject(
                "halvings", halvings, f"must be such that 2^halvings divides {self.factor}"
            )
        return replace(self, timestep=timestep, factor=self.factor >> halvings)

    def increments(
        self, steps: int, *, first: int = 0, replica: int = 0, channel: int = 0
    ) -> NDArray[np.float64]:
        """Increments W(t + h) - W(t) of `steps` steps from step `first` on, shape (steps,).

        Their variance is the timestep.

        Raises
        ------
        ValueError
            One of the numbers is no integer, negative, or larger than a path can count.
        """
        steps = check_integer("steps", steps, at_least=0)
        first = check_integer("first", first, at_least=0)
        replica = check_integer("replica", replica, at_least=0, at_most=LARGEST_SEED - 1)
        channel = check_integer("channel", channel, at_least=0, at_most=BRIDGES - 1)
        if 8 * steps > physical_memory():
            raise reject("steps", steps, "must be so few that the machine has memory for them")
        if (first + steps) * self.factor > LARGEST_STEP:
            last = LARGEST_STEP // self.factor - steps
            raise reject("first", first, f"must be at most {last} for {steps} steps of this path")
        out = np.empty(steps)
        size = max(1, PIECE // (self.factor + self.level))
        for start in range(0, steps, size):
            piece = out[start : start + size]
            of_path = channel, self.factor, self.level
            _fill_normals(piece, self.seed, replica, first + start, *of_path)
        return math.sqrt(self.timestep) * out


def path_of(attributes: Mapping[str, Any]) -> BrownianPath:
    """The Brownian path that a run followed, as the attributes of its dataset tell.

    Raises
    ------
    ValueError
        Names the attribute that is missing, or tells of no path.
    """
    if "path" not in attributes:
        seed, timestep = (attributes.get(name) for name in ("seed", "timestep"))
        return BrownianPath(seed, timestep)  # pyright: ignore[reportArgumentType]
    fields = fields_in(attributes, "path")
    check_fields("path", fields, BrownianPath.__dataclass_fields__)
    return BrownianPath(**fields)


def check_seed(seed: int) -> int:
    """Return a seed if it is an integer that every engine can hold.

    Raises
    ------
    ValueError
        It is not, or it is negative, or not less than 2^53.
    """
    number = check_integer("seed", seed, at_least=0)
    if number >= LARGEST_SEED:
        raise reject("seed", seed, f"must be less than 2^53 = {LARGEST_SEED}")
    return number
