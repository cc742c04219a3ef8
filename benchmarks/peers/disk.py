"""The disk's ensemble with other software: cost of a step of one of many replicas, on one thread.

The paper's disk with its own scheme, or with Euler's where only that is available, at h = 0.01.
"""

from collections.abc import Callable
from contextlib import ExitStack
from functools import partial

from benchmarks.harness.records import NOT_INSTALLED, Case, Record
from benchmarks.harness.tables import number, seconds, table
from benchmarks.harness.timing import in_turns
from benchmarks.peers import ensembles
from magmotor.common import style

OURS = "variational/euler, 32 lanes"


def _ours(left_out: list[str], stack: ExitStack) -> ensembles.Cases:
    return {"variational/baoab, 32 lanes": partial(ensembles.by_kernel, "baoab")}


def _compiled(left_out: list[str], stack: ExitStack) -> ensembles.Cases:
    return {"compiled scalar loop": ensembles.by_scalar_loop}


GROUPS: dict[str, Callable[[list[str], ExitStack], ensembles.Cases]] = {
    "ours": _ours,
    "C": lambda left_out, stack: ensembles.by_c(left_out),
    "loop": _compiled,
    "NumPy": lambda left_out, stack: ensembles.by_numpy(),
    "diffrax": partial(ensembles.by_other_environments, programs=["disk_diffrax"]),
    "torchsde": partial(ensembles.by_other_environments, programs=["disk_torchsde"]),
}


SLOW = ("diffrax", "torchsde")
"""Skipped with --quick."""


def cases(quick: bool) -> list[Case]:
    turns = 3 if quick else 10
    return [
        Case(f"peers/disk/{name}", partial(_measure, name, turns), 12 if name in SLOW else 4)
        for name in GROUPS
        if not (quick and name in SLOW)
    ]


def _measure(name: str, turns: int) -> Record:
    left_out: list[str] = []
    with ExitStack() as stack:
        group = GROUPS[name](left_out, stack)
        if not group:
            return {"failed": NOT_INSTALLED + ", ".join(left_out)}
        both = {OURS: partial(ensembles.by_kernel, "euler")} | group
        least = {other: min(times) for other, times in in_turns(both, turns).items()}
    return {other: {"seconds": wall, "ratio": wall / least[OURS]} for other, wall in least.items()}


def _rows(records: dict[str, Record]) -> dict[str, Record]:
    """Return the measurements, by name."""
    found: dict[str, Record] = {OURS: {}}
    for name in GROUPS:
        record = records.get(f"peers/disk/{name}", {})
        found |= {name: record} if "failed" in record else record
    found[OURS] = records["peers/disk/ours"][OURS]
    return found


def tabulate(records: dict[str, Record]) -> str:
    rows = []
    for name, record in _rows(records).items():
        known = "failed" not in record
        costs = ["", "", ""]
        if known:
            wall, ratio = record["seconds"], record["ratio"]
            costs = [seconds(wall), seconds(wall / ratio), number(ratio)]
        rows.append([name if known else f"{name} ({record['failed']})", *costs])
    return table(
        ["the disk", "a step of a replica", "of ours, in turns with it", "over ours"], rows
    )


def bars(records: dict[str, Record]) -> list[tuple[str, float | None, str, str]]:
    """Return the name, length, text and color of each bar."""
    found = []
    for name, record in _rows(records).items():
        color = style.BLUE if name.startswith("variational") else style.GRAY
        if "failed" in record:
            found.append((name, None, record["failed"], color))
        else:
            text = f"{seconds(record['seconds'])}, ×{number(record['ratio'])}"
            found.append((name, 1e9 * record["seconds"], text, color))
    return found
