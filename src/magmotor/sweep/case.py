"""A case of a sweep: one run, spec completely, under the hash of what tells it."""

import hashlib
import json
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from magmotor.common.checks import check_integer, reject
from magmotor.noise import check_seed
from magmotor.sweep.axes import listed


class Case(NamedTuple):
    """A run to be made.

    `spec` is JSON: scene, scene_fields, method, timestep, duration, record_interval, replicas,
    seed, versions; `key` is its hash.
    """

    key: str
    spec: dict[str, Any]


def case_of(spec: dict[str, Any]) -> Case:
    """The case that is spec so."""
    return Case(hashlib.sha256(canonical(spec)).hexdigest()[:32], spec)


def canonical(spec: Any) -> bytes:
    """JSON in the one form in which equal things have equal bytes."""
    return json.dumps(spec, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()


def checked_seeds(seeds: Any) -> tuple[int, ...]:
    """Seeds as they are given, or how many of 0, 1, ...; ValueError if they are none."""
    if not isinstance(seeds, Iterable):
        seeds = range(check_integer("seeds", seeds, at_least=1))
    found = [check_seed(seed) for seed in listed("seeds", seeds)]
    if not found or len(set(found)) < len(found):
        raise reject("seeds", found, "must be a range that is not empty, of different seeds")
    return tuple(found)


def child(seed: int, point: int) -> int:
    """Seed of a point: the child of that number that `SeedSequence(seed)` spawns, in 53 bits."""
    spawned = np.random.SeedSequence(seed, spawn_key=(point,))
    return int(spawned.generate_state(1, np.uint64)[0] >> 11)
