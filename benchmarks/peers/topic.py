"""Comparison with other software: cost of the same top and disk, and the same Langevin dynamics."""

from pathlib import Path

from benchmarks.harness.machine import sign
from benchmarks.harness.records import Case, Record
from benchmarks.peers import disk, langevin, langevin_orders, top
from magmotor.common import style

PARTS = {"top": top, "disk": disk, "langevin": langevin, "orders": langevin_orders}


def cases(quick: bool) -> list[Case]:
    return [case for part in PARTS.values() for case in part.cases(quick)]


def tables(records: dict[str, Record]) -> dict[str, str]:
    return {f"peers_{name}": part.tabulate(records) for name, part in PARTS.items()}


def draw(records: dict[str, Record], folder: Path) -> None:
    """Draw bars of cost for the top and the disk, and the orders of the Langevin solvers."""
    langevin_orders.draw(records, folder)
    panels = {
        "the top, case 4: wall time of a simulated second (s), and the error of J": top.bars,
        "the disk: a step of one of many replicas, in ns, and over ours": disk.bars,
    }
    rows = [bars(records) for bars in panels.values()]
    with style.figure(10, 0.28 * sum(map(len, rows)) + 1.8) as figure:
        both = figure.subplots(2, 1, height_ratios=[len(bars) for bars in rows])
        for axes, title, bars in zip(both, panels, rows, strict=True):
            for y, (_, value, text, color) in enumerate(bars):
                if value is None:
                    axes.text(0.01, y, text, va="center", transform=axes.get_yaxis_transform())
                    continue
                axes.barh(y, value, color=color, height=0.65)
                axes.text(1.1 * value, y, text, va="center", fontsize=9)
            values = [value for _, value, *_ in bars if value is not None]
            axes.set_xscale("log")
            axes.set_xlim(min(values) / 3, 15 * max(values))
            axes.set_yticks(range(len(bars)), [name for name, *_ in bars])
            axes.set_ylim(len(bars) - 0.4, -0.6)
            axes.grid(axis="y", visible=False)
            axes.set_axisbelow(True)
            axes.set_title(title)
        sign(figure)
        figure.savefig(folder / "peers.png")
