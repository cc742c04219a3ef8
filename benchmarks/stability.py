"""Where methods fail, beside where theory says that they do, and what they do over long times."""

from pathlib import Path

import stability_drift
import stability_limits
import stability_map
from case import Case, Record

PARTS = (stability_limits, stability_map, stability_drift)


def cases(quick: bool) -> list[Case]:
    return [case for part in PARTS for case in part.cases(quick)]


def draw(records: dict[str, Record], folder: Path) -> None:
    for part in PARTS:
        part.draw(records, folder)


def tables(records: dict[str, Record]) -> dict[str, str]:
    return {
        "stability_limits": stability_limits.tabulate(records),
        "stability_drift": stability_drift.tabulate(records),
    }
