"""Runs a module of this folder with another library, in a process with its own environment.

The process reads and writes one JSON value per line. A module that defines `answer` answers one
question. One that defines `PEERS` measures the disk: first it writes the best number of replicas
for each variant; then, for each name that it reads, the seconds per step of a replica.
"""

import argparse
import json
import sys
import time
from collections.abc import Callable, Mapping
from importlib import import_module

Peer = tuple[Callable[[int], object], tuple[int, ...], int]
"""Function that advances a number of replicas by all steps, candidate numbers, and steps."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("module", help="without .py")
    module = import_module(parser.parse_args().module)
    if hasattr(module, "answer"):
        print(json.dumps(module.answer(**json.loads(sys.stdin.readline()))))
    else:
        serve(module.PEERS)


def serve(peers: Mapping[str, Peer]) -> None:
    sizes = {name: min(peers[name][1], key=lambda n: _least(peers[name], n)) for name in peers}
    print(json.dumps(sizes), flush=True)
    for line in sys.stdin:
        name = json.loads(line)
        print(json.dumps(_seconds(peers[name], sizes[name])), flush=True)


def _least(peer: Peer, replicas: int) -> float:
    return min(_seconds(peer, replicas) for _ in range(4))  # the first run compiles


def _seconds(peer: Peer, replicas: int) -> float:
    run, _, steps = peer
    begin = time.perf_counter()
    run(replicas)
    return (time.perf_counter() - begin) / replicas / steps


if __name__ == "__main__":
    main()
