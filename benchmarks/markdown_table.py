"""Tables in Markdown."""

from collections.abc import Iterable


def table(columns: list[str], rows: Iterable[list[str]]) -> str:
    """Columns after the first are numbers, set to the right."""
    ruler = ["---", *["---:"] * (len(columns) - 1)]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in [columns, ruler, *rows])


def number(value: float | None) -> str:
    """Two digits, as in 0.012 and 3.4e-11; nothing if there is none."""
    if value is None:
        return ""
    if value == 0 or 0.01 <= abs(value) < 100:
        return f"{value:.2g}"
    if 100 <= abs(value) < 1e5:
        return f"{value:.0f}"
    mantissa, exponent = f"{value:.1e}".split("e")
    return f"{mantissa}e{int(exponent)}"


def cost_cells(record: dict) -> list[str]:
    """Microseconds and their ratio to another's."""
    return [number(1e6 * record["seconds"]), f"{record['ratio']:.2f}"]
