"""Stability: the steps at which methods fail, predicted and measured, and long-term behavior."""

from pathlib import Path

from benchmarks.harness.records import Case, Record
from benchmarks.stability import drift, limits, map

PARTS = (limits, map, drift)


def cases(quick: bool) -> list[Case]:
    return [case for part in PARTS for case in part.cases(quick)]


def draw(records: dict[str, Record], folder: Path) -> None:
    for part in PARTS:
        part.draw(records, folder)


def tables(records: dict[str, Record]) -> dict[str, str]:
    return {
        "stability_limits": limits.tabulate(records),
        "stability_drift": drift.tabulate(records),
    }
