"""A case of a sweep: one run with its full specification, whose hash is its key."""

import hashlib
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from magmotor.common.checks import check_integer
from magmotor.common.exceptions import ArgumentError
from magmotor.common.integrity import canonical
from magmotor.noise import check_seed
from magmotor.sweep.axes import listed


class Case(NamedTuple):
    """One run of a sweep.

    `spec` is JSON with scene, scene_fields, method, timestep, duration, record_interval, replicas,
    seed and versions; `key` is its hash.
    """

    key: str
    spec: dict[str, Any]


def case_of(spec: dict[str, Any]) -> Case:
    """Return the case with a specification."""
    return Case(hashlib.sha256(canonical(spec)).hexdigest()[:32], spec)


def checked_seeds(seeds: Any) -> tuple[int, ...]:
    """Return the seeds from a sequence or the number of 0, 1, ...; ValueError if invalid."""
    if not isinstance(seeds, Iterable):
        seeds = range(check_integer("seeds", seeds, at_least=1))
    found = [check_seed(seed) for seed in listed("seeds", seeds)]
    if not found or len(set(found)) < len(found):
        raise ArgumentError("seeds", found, "must be distinct, and at least one")
    return tuple(found)


def child(seed: int, point: int) -> int:
    """Return the seed of a point: 53 bits of the child `point` of `SeedSequence(seed)`."""
    spawned = np.random.SeedSequence(seed, spawn_key=(point,))
    return int(spawned.generate_state(1, np.uint64)[0] >> 11)
