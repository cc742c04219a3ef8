"""The cost and effect of each part of a model."""

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.detail import contact, motor, ring, top
from benchmarks.harness.machine import sign
from benchmarks.harness.records import Case, Record
from magmotor.common import style

PARTS = {"top": top, "contact": contact, "ring": ring, "motor": motor}
STYLES = ((style.BLUE, "o"), (style.PURPLE, "D"), (style.ORANGE, "s"), (style.GREEN, "^"))
COLORS = {"top": style.BLUE, "contact": style.ORANGE, "motor": style.GREEN}
SMALLEST, LARGEST = 1e-12, 20.0
"""Smallest and largest change that is drawn; failures are drawn near the largest."""

GROUPS = (
    ("top", top.PARTS, "momentum"),
    ("contact", contact.PARTS, "momentum"),
    ("motor", (*motor.PARTS, *motor.RUNS), "moved"),
)
"""Groups of parts, and the quantity that they change."""


def cases(quick: bool) -> list[Case]:
    return [case for part in PARTS.values() for case in part.cases(quick)]


def draw(records: dict[str, Record], folder: Path) -> None:
    _draw_parts(records, folder / "detail.png")
    _draw_rings(records, folder / "ring_dipoles.png")


def tables(records: dict[str, Record]) -> dict[str, str]:
    return {f"detail_{name}": part.tabulate(records) for name, part in PARTS.items()}


def _draw_parts(records: dict[str, Record], path: Path) -> None:
    """Draw the relative cost of a step, and the change, for all parts."""
    rows = [
        (group, name, records[f"detail/{group}/{name}"], quantity)
        for group, names, quantity in GROUPS
        for name in names
    ]
    with style.figure(11, 0.235 * len(rows) + 1.3) as figure:
        cost, change = figure.subplots(1, 2, sharey=True, width_ratios=(1, 1.6))
        for y, (group, _, record, quantity) in enumerate(rows):
            color = COLORS[group]
            _bar(cost, y, 1.0, record["ratio"], color)
            if "failed" in record:
                change.plot(LARGEST / 2, y, "x", color=style.INK)
                change.text(LARGEST / 5, y, record["failed"], ha="right", va="center", fontsize=9)
            else:
                _bar(change, y, SMALLEST, max(record[quantity], SMALLEST), color)
        edges = np.cumsum([len(names) for _, names, *_ in GROUPS])[:-1] - 0.5
        for axes in (cost, change):
            for edge in edges:
                axes.axhline(edge, color=style.GRAY, linewidth=0.8)
        cost.set_yticks(range(len(rows)), [f"{row[0]}: {row[1]}".replace("`", "") for row in rows])
        cost.set_ylim(len(rows) - 0.4, -0.6)
        cost.set_title("a step's cost, as a multiple")
        cost.axvline(1.0, color=style.GRAY)
        change.set_xscale("log")
        change.set_xlim(SMALLEST / 2, LARGEST)
        change.set_title("change, relative: of J in 60 s; of the motor's ball in 500 s")
        sign(figure)
        figure.savefig(path)


def _bar(axes: Any, y: float, start: float, end: float, color: str) -> None:
    axes.plot([start, end], [y, y], color=color, linewidth=2.5, alpha=0.35)
    axes.plot(end, y, "o", color=color, markersize=5)


def _draw_rings(records: dict[str, Record], path: Path) -> None:
    """Draw the errors of rings of N dipoles, and their cost."""
    numbers = np.array(ring.measured(records))
    rings = [records[f"detail/ring/{n}"] for n in numbers]
    with style.figure(10, 4.4) as figure:
        errors, cost = figure.subplots(1, 2, width_ratios=(1.7, 1))
        for (name, label), (color, marker) in zip(ring.QUANTITIES.items(), STYLES, strict=True):
            errors.semilogy(numbers, [r[name] for r in rings], marker, color=color, label=label)
        fine = np.linspace(5, 62, 100)
        law = np.sqrt(fine) * np.exp(-ring.decay_rate() * (fine - 20))
        law *= records["detail/ring/20"]["potential"] / np.sqrt(20)
        errors.semilogy(fine, law, color=style.INK, linewidth=1, label="√N exp(−ηN)")
        errors.set(xlabel="dipoles N, as strong together as 20", ylim=(1e-16, 10))
        errors.set_title("error, relative")
        errors.axvline(20, color=style.GRAY, linewidth=0.8, zorder=0)
        errors.legend(loc="lower left")
        for engine, method in (("mujoco", "mujoco/euler"), ("kernel", "variational/baoab")):
            ratios = [r[engine]["ratio"] for r in rings]
            cost.plot(numbers, ratios, label=method, markersize=4, **style.method_look(method))
        cost.set(xlabel="dipoles N", ylim=(0, None))
        cost.set_title("a step's cost, over that with 20 dipoles")
        cost.axvline(20, color=style.GRAY, linewidth=0.8, zorder=0)
        cost.legend(loc="lower right")
        sign(figure)
        figure.savefig(path)
