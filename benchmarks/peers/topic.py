"""Comparison with other software: the same top and the same disk, measured in one run."""

from pathlib import Path

from benchmarks.harness.machine import sign
from benchmarks.harness.records import Case, Record
from benchmarks.peers import disk, top
from magmotor.common import style


def cases(quick: bool) -> list[Case]:
    return [*top.cases(quick), *disk.cases(quick)]


def tables(records: dict[str, Record]) -> dict[str, str]:
    return {"peers_top": top.tabulate(records), "peers_disk": disk.tabulate(records)}


def draw(records: dict[str, Record], folder: Path) -> None:
    """Draw bars of cost, one panel for the top, one for the disk."""
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
