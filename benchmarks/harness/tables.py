"""Tables: in Markdown for documents, and of ratios with their targets for the terminal."""

import statistics
from collections.abc import Iterable
from dataclasses import dataclass, field

NOISY = 0.1
"""Relative difference of ratio of minima and median ratio that marks a disturbed measurement."""


@dataclass(frozen=True)
class Row:
    """A measured time in seconds, and the times for comparison from the same turns."""

    name: str
    times: list[float]
    against: list[float] = field(default_factory=list)
    at_most: float | None = None
    at_least: float | None = None

    @property
    def ratio(self) -> float:
        """Ratio of the minimum times, since disturbances only add time."""
        return min(self.times) / min(self.against)

    @property
    def noisy(self) -> bool:
        """Whether the median over the turns disagrees with the minima."""
        turns = [a / b for a, b in zip(self.times, self.against, strict=True)]
        return abs(statistics.median(turns) / self.ratio - 1) > NOISY

    def cells(self) -> list[str]:
        """Return the row as text; a row without comparison is judged by its median in s."""
        value, shown = statistics.median(self.times), [seconds(statistics.median(self.times))]
        shown += ["", ""]
        if self.against:
            value = self.ratio
            shown = [seconds(min(self.times)), seconds(min(self.against)), f"{value:.3g}"]
        target, met = "", True
        if self.at_most is not None:
            bound = f"{self.at_most:g}" if self.against else seconds(self.at_most)
            target, met = f"<= {bound}", value <= self.at_most
        if self.at_least is not None:
            target, met = f">= {self.at_least:g}", value >= self.at_least
        verdict = ("met" if met else "MISSED") if target else ""
        if self.against and self.noisy:
            verdict += " (noisy)" if verdict else "noisy"
        return [self.name, *shown, target, verdict]


def show(title: str, note: str, columns: tuple[str, str, str], rows: list[Row]) -> None:
    """Print a table; `columns` name the time, the time for comparison, and their ratio."""
    lines = [["", *columns, "target", "verdict"], *(row.cells() for row in rows)]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    print(f"\n{title}\n")
    for name, *cells in lines:
        line = [name.ljust(widths[0])]
        line += [cell.rjust(width) for cell, width in zip(cells, widths[1:], strict=True)]
        print("  " + "  ".join(line).rstrip())
    print(f"\n  {note}", flush=True)


def seconds(time: float) -> str:
    """Format a time in a suitable unit."""
    for unit, name in ((1e-6, "ns"), (1e-3, "µs"), (1.0, "ms")):
        if time < unit:
            return f"{time / unit * 1e3:.3g} {name}"
    return f"{time:.3g} s"


def table(columns: list[str], rows: Iterable[list[str]]) -> str:
    """Return a Markdown table whose columns after the first are right-aligned numbers."""
    ruler = ["---", *["---:"] * (len(columns) - 1)]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in [columns, ruler, *rows])


def number(value: float | None) -> str:
    """Format a number with two digits, as in 0.012 and 3.4e-11; None as an empty string."""
    if value is None:
        return ""
    if value == 0 or 0.01 <= abs(value) < 100:
        return f"{value:.2g}"
    if 100 <= abs(value) < 1e5:
        return f"{value:.0f}"
    mantissa, exponent = f"{value:.1e}".split("e")
    return f"{mantissa}e{int(exponent)}"


def cost_cells(record: dict) -> list[str]:
    """Return the microseconds and the ratio of a record as text."""
    return [number(1e6 * record["seconds"]), f"{record['ratio']:.2f}"]
