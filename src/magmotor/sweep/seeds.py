"""Seeds of a sweep, and of its cases."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from magmotor.checks import check_integer, reject
from magmotor.noise import check_seed
from magmotor.sweep.axes import listed


def checked_seeds(seeds: Any) -> tuple[int, ...]:
    """Seeds as they are given, or how many of 0, 1, ...; ValueError if they are none."""
    if not isinstance(seeds, Iterable):
        seeds = range(check_integer("seeds", seeds, at_least=1))
    found = [check_seed(seed) for seed in listed("seeds", seeds)]
    if not found or len(set(found)) < len(found):
        raise reject("seeds", found, "a range that is not empty, of different seeds")
    return tuple(found)


def child(seed: int, point: int) -> int:
    """Seed of a point: the child of that number that `SeedSequence(seed)` spawns, in 53 bits."""
    spawned = np.random.SeedSequence(seed, spawn_key=(point,))
    return int(spawned.generate_state(1, np.uint64)[0] >> 11)
