"""Brownian increments as a pure function of (seed, replica, step, channel).

The generator is counter-based: Threefry-2x64 with 13 rounds (Salmon, Moraes, Dror and Shaw,
*Parallel random numbers: as easy as 1, 2, 3*, 2011), which passes the TestU01 batteries. It has no
state to save or restore: every thread, method and resumed run obtains the same numbers. The
Box-Muller transform turns each block into two normal numbers, which serve two consecutive steps.

A path has increments at its own timestep. Coarser increments are sums of these; finer ones are
drawn conditionally on them by Levy's construction of the Brownian bridge. A held path is the noise
of a digital source, whose bandwidth is limited.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magmotor.common.checks import check_integer, check_number
from magmotor.common.environment import physical_memory
from magmotor.common.exceptions import ArgumentError
from magmotor.common.files import check_fields, fields_in
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.deferred import subroutine
from magmotor.numerics.elementary import (
    bits_as_float,
    cosine_of_quarter,
    float_as_bits,
    logarithm,
    sine_of_quarter,
)

__all__ = ["LARGEST_SEED", "BrownianPath"]

LARGEST_SEED = 2**53
"""Upper bound (exclusive) of seeds, since MuJoCo stores user data as doubles."""

FINEST = 31
"""Largest level: the number of times that a path's own steps can be halved."""

COARSEST = 2**24
"""Largest factor: the number of a path's own steps in one coarse step, whose sum takes 0.1 s.

Also the largest number of steps for which a sample is held, and of samples in a window.
"""

HELD = FINEST + 1
"""Level of a path whose samples are held for `factor` steps; a window is added to it."""

LARGEST_STEP = 2**53
"""Upper bound (exclusive) of the numbers of a path's own steps."""

BRIDGES = 2**32
"""Upper bound (exclusive) of channels; larger ones are the bridges between refined steps."""

PIECE = 2**22
"""Random numbers drawn between two checks for Ctrl-C, which takes about 0.05 s."""

_PARITY = np.uint64(0x1BD11BDAA9FC1A22)
_ONE = np.uint64(0x3FF0000000000000)


@subroutine(forceinline=True)
def _mix(x, y, rotation):
    x += y
    y = (y << np.uint64(rotation)) | (y >> np.uint64(64 - rotation))
    return x, y ^ x


@subroutine(forceinline=True)
def threefry(x, y, key0, key1):
    """Encrypt the counter (x, y) with 13 rounds of Threefry-2x64; all arguments are uint64."""
    key2 = _PARITY ^ key0 ^ key1
    # Rotations of Salmon et al. (2011); a key is added after every four rounds.
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


@subroutine(forceinline=True)
def box_muller(x, y):
    """Return two independent standard normal numbers from two words of 64 random bits.

    The radius (at most 8.49) uses 52 bits; the angle uses 52 bits for half a turn, and a sign bit.
    """
    # 52 bits make a float in [1, 2); two minus it is in (0, 1], where the logarithm is finite.
    radius = math.sqrt(-2.0 * logarithm(2.0 - bits_as_float((x >> np.uint64(12)) | _ONE)))
    angle = 0.5 * (bits_as_float((y >> np.uint64(12)) | _ONE) - 1.5)
    # The sign bit turns the angle's half circle into a whole one.
    signed = bits_as_float(float_as_bits(radius) | (y << np.uint64(63)))
    return signed * cosine_of_quarter(angle), radius * sine_of_quarter(angle)


@subroutine(forceinline=True)
def _normal(seed, replica, step, channel):
    """Return the standard normal number of a step; two steps share a block."""
    x, y = threefry(np.uint64(step >> 1), np.uint64(channel), np.uint64(seed), np.uint64(replica))
    # Both are computed again for the other step: nothing is stored, and any step can be asked for.
    even, odd = box_muller(x, y)
    return odd if step & 1 else even


@compiled_once(nogil=True)
def _compiled_normal(checksum: int):
    """Define the function `normal`."""

    def normal(seed, replica, step, channel, factor, level):
        """Return the standard normal number of one step of a coarsened or refined path.

        Parameters
        ----------
        seed, replica, step, channel : int
        factor, level : int
            The view of the path; see `BrownianPath.view`.
        """
        _ = checksum
        if level == 0:
            total = 0.0
            for k in range(factor):
                total += _normal(seed, replica, step * factor + k, channel)
            return total / math.sqrt(factor)
        if level >= HELD:
            sample, window = step // factor, level - HELD
            # Number k + window of the same sequence: what is added now is taken back later.
            value = _normal(seed, replica, sample + window, channel)
            if window > 0:
                value = math.sqrt(0.5) * (value - _normal(seed, replica, sample, channel))
            return value / math.sqrt(factor)
        # In units of the root of its length, each half is (parent +- bridge)/sqrt 2.
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
    """Define the loop over steps."""

    def fill(out, seed, replica, first, channel, factor, level):
        _ = checksum
        for i in range(out.size):
            out[i] = normal(seed, replica, first + i, channel, factor, level)

    return fill


_fill_normals = _compiled_fill()


@dataclass(frozen=True)
class BrownianPath:
    """A Brownian path with any number of channels and replicas, sampled at a timestep.

    To make runs with different methods or timesteps follow the same path, pass them coarser or
    finer views of one path, for example ``fine = BrownianPath(seed=1, timestep=0.01)`` and
    ``fine.coarsened(4)``.

    Parameters
    ----------
    seed : int
        At least 0 and less than 2^53.
    timestep : float
        Timestep of the increments, in s.
    factor, level : int
        How this view was derived: by summing `factor` steps, or by halving steps `level` times.
    hold : int
        Number of steps for which a sample is held; see `held`.
    window : int, optional
        Number of samples after which each one is taken back; see `held`.

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
    hold: int = 1
    window: int | None = None

    def __post_init__(self) -> None:
        """Check every field.

        Raises
        ------
        ValueError
            A field is invalid. The message names the field, its value and the bound.
        """
        checked = {
            "seed": check_seed(self.seed),
            "timestep": check_number("timestep", self.timestep, above=0, unit="s"),
            "factor": check_integer("factor", self.factor, at_least=1, at_most=COARSEST),
            "level": check_integer("level", self.level, at_least=0, at_most=FINEST),
            "hold": check_integer("hold", self.hold, at_least=1, at_most=COARSEST),
        }
        if self.window is not None:
            window = check_integer("window", self.window, at_least=1, at_most=COARSEST)
            checked["window"] = window
        for name, value in checked.items():
            object.__setattr__(self, name, value)
        if self.level and self.factor > 1:
            raise ArgumentError("factor", self.factor, "must be 1 if the level is not 0")
        if self._is_held and (self.factor > 1 or self.level):
            sentence = "must be 1, without a window, if the path is coarsened or refined"
            raise ArgumentError("hold", self.hold, sentence)

    @property
    def _is_held(self) -> bool:
        return self.hold > 1 or self.window is not None

    @property
    def view(self) -> tuple[int, int]:
        """Factor and level as `normal` and MuJoCo's user data have them.

        They are those of the path, unless it is held: then they are `hold`, and 32 plus the window
        (0 without one).
        """
        if self._is_held:
            return self.hold, HELD + (self.window or 0)
        return self.factor, self.level

    def held(self, steps: int, window: int | None = None) -> "BrownianPath":
        """Return noise as a digital source generates it: each sample is held for `steps` timesteps.

        W is then a polygon. At the ends of the holds it is the white path of this seed with a
        timestep of `steps` timesteps, and in between, it is straight. With H = `steps` x timestep,
        the spectrum of dW/dt is that of white noise times [sin(pi f H)/(pi f H)]^2, which is one
        half at f = 0.443/H.

        With a `window`, the sample number k is (xi_{k+window} - xi_k)/sqrt 2, where xi are
        independent standard normal numbers. What was added is then taken back later, so that W has
        a bounded variance, at most `window` H; so does the displacement of a plate that moves with
        the velocity dW/dt. The spectrum is multiplied by 2 sin(pi f `window` H)^2: it is zero at
        f = 0, and 1 on average above 1/(`window` H).

        Every method takes the noise to be white within a step. In a splitting that solves friction
        of a rate r exactly, this changes the amplitude of the response by (r x timestep)^2/24 of
        itself.

        Parameters
        ----------
        steps : int
            From 1 to 2^24. One step without a window is white noise again, to the bit.
        window : int, optional
            In samples, from 1 to 2^24.

        Raises
        ------
        ValueError
            A number is invalid, or the path is coarsened, refined, or held already.

        Examples
        --------
        >>> import magmotor as mm
        >>> path = mm.noise.BrownianPath(seed=1, timestep=0.1)
        >>> path.held(4).increments(8).round(3).tolist()
        [-0.152, -0.152, -0.152, -0.152, 0.141, 0.141, 0.141, 0.141]
        """
        if self._is_held:
            raise ArgumentError(
                "steps", steps, "must not be given twice: this path is held already"
            )
        steps = check_integer("steps", steps, at_least=1, at_most=COARSEST)
        return replace(self, hold=steps, window=window)

    def coarsened(self, factor: int) -> "BrownianPath":
        """Return the same path at a timestep `factor` times longer.

        Raises
        ------
        ValueError
            `factor` is less than 1 or more than 2^24, the path is refined and `factor` is not a
            power of 2 that undoes a refinement, or the path is held for a number of steps that
            `factor` does not divide.
        """
        factor = check_integer("factor", factor, at_least=1, at_most=max(COARSEST, 2**FINEST))
        if self._is_held:
            if self.hold % factor:
                raise ArgumentError(
                    "factor", factor, f"must divide the hold, {self.hold} timesteps"
                )
            return replace(self, timestep=factor * self.timestep, hold=self.hold // factor)
        halvings = factor.bit_length() - 1
        if self.level and (factor != 1 << halvings or halvings > self.level):
            sentence = f"must be a power of 2 up to 2^{self.level} for this refined path"
            raise ArgumentError("factor", factor, sentence)
        if self.level:
            return replace(self, timestep=factor * self.timestep, level=self.level - halvings)
        return replace(self, timestep=factor * self.timestep, factor=self.factor * factor)

    def refined(self, halvings: int = 1) -> "BrownianPath":
        """Return the same path at a timestep that is halved `halvings` times.

        Raises
        ------
        ValueError
            The path is coarsened by a factor that 2^halvings does not divide, its own steps would
            be halved more than 31 times, or it would be held for more than 2^24 steps.
        """
        halvings = check_integer("halvings", halvings, at_least=0, at_most=FINEST)
        timestep = self.timestep / 2**halvings
        if self._is_held:
            return replace(self, timestep=timestep, hold=self.hold << halvings)
        if self.factor == 1:
            return replace(self, timestep=timestep, level=self.level + halvings)
        if self.factor % 2**halvings:
            raise ArgumentError("halvings", halvings, f"2^halvings must divide {self.factor}")
        return replace(self, timestep=timestep, factor=self.factor >> halvings)

    def increments(
        self, steps: int, *, first: int = 0, replica: int = 0, channel: int = 0
    ) -> NDArray[np.float64]:
        """Return the increments W(t + h) - W(t) of `steps` steps, starting with step `first`.

        Their variance is the timestep, divided by `hold`; the shape is (steps,).

        Raises
        ------
        ValueError
            A number is not an integer, is negative, or is too large.
        """
        steps = check_integer("steps", steps, at_least=0)
        first = check_integer("first", first, at_least=0)
        replica = check_integer("replica", replica, at_least=0, at_most=LARGEST_SEED - 1)
        channel = check_integer("channel", channel, at_least=0, at_most=BRIDGES - 1)
        if 8 * steps > physical_memory():
            raise ArgumentError("steps", steps, "the increments do not fit in memory")
        if (first + steps) * self.factor > LARGEST_STEP:
            last = LARGEST_STEP // self.factor - steps
            count = f"{steps} step{'s' * (steps != 1)}"
            raise ArgumentError("first", first, f"must be at most {last} for {count} of this path")
        out = np.empty(steps)
        size = max(1, PIECE // (self.factor + self.level))
        for start in range(0, steps, size):
            piece = out[start : start + size]
            _fill_normals(piece, self.seed, replica, first + start, channel, *self.view)
        return math.sqrt(self.timestep) * out


def path_of(attributes: Mapping[str, Any]) -> BrownianPath:
    """Return the Brownian path of a run from the attributes of its dataset.

    Raises
    ------
    ValueError
        An attribute is missing or invalid. The message names it.
    """
    if "path" not in attributes:
        seed, timestep = (attributes.get(name) for name in ("seed", "timestep"))
        return BrownianPath(seed, timestep)  # pyright: ignore[reportArgumentType]
    fields = fields_in(attributes, "path")
    check_fields("path", fields, BrownianPath.__dataclass_fields__)
    return BrownianPath(**fields)


def check_seed(seed: int) -> int:
    """Return a seed if it is a valid one for every engine.

    Raises
    ------
    ValueError
        The seed is not an integer from 0 to 2^53 - 1.
    """
    number = check_integer("seed", seed, at_least=0)
    if number >= LARGEST_SEED:
        raise ArgumentError("seed", seed, f"must be less than 2^53 = {LARGEST_SEED}")
    return number
