"""Model no more than a scene needs: what each part of a model costs, and what it changes."""

from pathlib import Path

import detail_contact
import detail_draw
import detail_motor
import detail_ring
import detail_top
from case import Case, Record

PARTS = {
    "detail_top": detail_top,
    "detail_contact": detail_contact,
    "detail_ring": detail_ring,
    "detail_motor": detail_motor,
}


def cases(quick: bool) -> list[Case]:
    return [case for part in PARTS.values() for case in part.cases(quick)]


def draw(records: dict[str, Record], folder: Path) -> None:
    detail_draw.draw_parts(records, folder / "detail.png")
    detail_draw.draw_rings(records, folder / "ring_dipoles.png")


def tables(records: dict[str, Record]) -> dict[str, str]:
    return {name: part.tabulate(records) for name, part in PARTS.items()}
