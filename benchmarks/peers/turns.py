"""Measures the disk by another library: a process of its own, as it is in another environment.

It hears and says one JSON value a line: first it says the best number of replicas of each way, then
for each name that it hears the seconds of a step of a replica.
"""

import argparse
import json
import sys
import time
from collections.abc import Callable, Mapping
from importlib import import_module

Peer = tuple[Callable[[int], object], tuple[int, ...], int]
"""A function that takes so many replicas through all steps, numbers to choose from, and steps."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("module", choices=("disk_diffrax", "disk_torchsde"))
    serve(import_module(parser.parse_args().module).PEERS)


def serve(peers: Mapping[str, Peer]) -> None:
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


if __name__ == "__main__":
    main()
