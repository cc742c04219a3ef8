"""What a benchmark's process in another environment says and hears: one JSON value a line."""

import json
import sys
import time
from collections.abc import Callable, Mapping

Peer = tuple[Callable[[int], object], tuple[int, ...], int]
"""A function that takes so many replicas through all steps, numbers to choose from, and steps."""


def serve(peers: Mapping[str, Peer]) -> None:
    """Say the best number of replicas of each; then, for each name heard, seconds of a step."""
    sizes = {name: min(peers[name][1], key=lambda n: _least(peers[name], n)) for name in peers}
    print(json.dumps(sizes), flush=True)
    for line in sys.stdin:
        name = json.loads(line)
        print(json.dumps(_seconds(peers[name], sizes[name])), flush=True)


def _least(peer: Peer, replicas: int) -> float:
    return min(_seconds(peer, replicas) for _ in range(4))  # the first one compiles


def _seconds(peer: Peer, replicas: int) -> float:
    run, _, steps = peer
    begin = time.perf_counter()
    run(replicas)
    return (time.perf_counter() - begin) / replicas / steps
