"""A case of a sweep: one run, told completely, under the hash of what tells it."""

import hashlib
import json
from typing import Any, NamedTuple


class Case(NamedTuple):
    """A run to be made.

    `told` is JSON: scene, scene_fields, method, timestep, duration, record_interval, replicas,
    seed, versions; `key` is its hash.
    """

    key: str
    told: dict[str, Any]


def case_of(told: dict[str, Any]) -> Case:
    """The case that is told so."""
    return Case(hashlib.sha256(canonical(told)).hexdigest()[:32], told)


def canonical(told: Any) -> bytes:
    """JSON in the one form in which equal things have equal bytes."""
    return json.dumps(told, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()
