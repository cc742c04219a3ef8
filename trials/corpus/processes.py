"""A process for each file, so that a crash or an endless loop costs one model only."""

import multiprocessing
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, TypeVar

LIMIT = 300.0
"""Seconds after which the process of a file is ended."""

Findings = TypeVar("Findings")


def examine_all(
    paths: list[Path],
    examine: Callable[[Path], Findings],
    failed: Callable[[Path, str], Findings],
    workers: int,
) -> Iterator[Findings]:
    """Findings of `examine` on all files, in their order; of `failed` where it does not return."""
    context = multiprocessing.get_context("fork")
    waiting = list(enumerate(paths))[::-1]
    running = {}
    found: dict[int, Findings] = {}
    shown = 0
    while waiting or running:
        while waiting and len(running) < workers:
            number, path = waiting.pop()
            answer, sender = context.Pipe(duplex=False)
            process = context.Process(target=_examine_one, args=(examine, path, sender))
            process.start()
            sender.close()
            running[answer] = number, process, time.monotonic() + LIMIT
        ready = wait(list(running), timeout=1.0)
        for answer, (number, process, end) in list(running.items()):
            if answer not in ready and time.monotonic() < end:
                continue
            try:
                found[number] = (
                    answer.recv()
                    if answer in ready
                    else failed(paths[number], f"not done after {LIMIT:g} s")
                )
            except EOFError:
                process.join()
                found[number] = failed(paths[number], f"exit code {process.exitcode}")
            process.kill()
            process.join()
            del running[answer]
        while shown in found:
            yield found.pop(shown)
            shown += 1


def print_table(
    packages: Mapping[str, list[Path]],
    columns: Sequence[str],
    row: Callable[[list[Any]], str],
    examine: Callable[[Path], Any],
    failed: Callable[[Path, str], Any],
    workers: int,
) -> list[Any]:
    """Print a row for each package and one for all, and return the findings on all files.

    Those on a model that an earlier file has, too, are marked as `repeated`.
    """
    print("| package |", " | ".join(columns), "|")
    print("|---|" + "---|" * len(columns))
    everything: list[Any] = []
    digests: set[str] = set()
    for package, paths in packages.items():
        found = list(examine_all(paths, examine, failed, workers))
        for each in found:
            each.repeated = each.digest in digests
            digests |= {each.digest} - {""}
        print(f"| {package} |", row(found), flush=True)
        everything += found
    print("| all |", row(everything))
    return everything


def _examine_one(examine: Callable[[Path], object], path: Path, sender: Connection) -> None:
    """Send the findings on one file, without what MuJoCo prints about it."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    sender.send(examine(path))
