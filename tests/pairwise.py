"""Some of all combinations, such that any two values of different parameters come together."""

from collections.abc import Sequence
from itertools import combinations, product
from typing import Any


def pairwise(*values: Sequence[Any]) -> list[tuple[Any, ...]]:
    """Return combinations of one value of each sequence that contain every pair of two values.

    A fault that takes two parameters to appear is seen as in the full product; one that takes three
    may be missed. Each time, the combination with the most new pairs is next.
    """
    rest = [*product(*map(range, map(len, values)))]
    missing = {pair for one in rest for pair in _pairs(one)}
    chosen = []
    while missing:
        best = max(rest, key=lambda one: len(missing.intersection(_pairs(one))))
        missing.difference_update(_pairs(best))
        chosen.append(best)
    return [tuple(each[k] for each, k in zip(values, one, strict=True)) for one in chosen]


def _pairs(one: tuple[int, ...]) -> list[tuple[tuple[int, int], ...]]:
    return [*combinations(enumerate(one), 2)]
