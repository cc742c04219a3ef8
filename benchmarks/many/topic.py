"""Many free magnets: time of their forces and of a step, from 10 to 10 000, beside LAMMPS."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.harness.machine import sign
from benchmarks.harness.records import Case, Record
from benchmarks.harness.tables import number, table
from benchmarks.many.magnets import dipoles_of, state_of, times
from benchmarks.peers.other_environment import answer_of
from magmotor.common import style

COUNTS = (10, 30, 100, 300, 1000, 2000, 5000, 10_000)
FORCES = {
    "before": ("each pair twice (before)", style.GRAY, "-"),
    "forces": ("each pair once", style.BLUE, "-"),
    "forces, 2 threads": ("each pair once, 2 threads", style.BLUE, "--"),
    "forces, box": ("within 1e-3, in a box", style.ORANGE, "-"),
    "forces, sheet": ("within 1e-3, in a sheet", style.ORANGE, "--"),
    "lammps": ("LAMMPS, all pairs", style.GREEN, "-"),
}
STEPS = {
    "bare step": ("without magnetism", style.GRAY, "-"),
    "step": ("each pair once", style.BLUE, "-"),
    "step, box": ("within 1e-3, in a box", style.ORANGE, "-"),
}


def cases(quick: bool) -> list[Case]:
    counts = COUNTS[:5:2] if quick else COUNTS
    turns = 5 if quick else 20
    return [
        case
        for count in counts
        for case in (
            Case(f"many/{count}", partial(times, count, turns), 2 + turns * count**2 * 6e-9),
            Case(f"many/lammps/{count}", partial(_by_lammps, count), 2 + count**2 * 1e-7),
        )
    ]


def _by_lammps(count: int) -> Record:
    """Seconds of the same forces and torques by LAMMPS, on one core; see langevin_lammps.py."""
    positions, moments = dipoles_of(state_of(count, 3))
    # In LAMMPS's units, mu0/(4 pi) is 1.
    return answer_of(
        "langevin_lammps", what="many", positions=positions.tolist(), moments=moments.tolist()
    )


def draw(records: dict[str, Record], folder: Path) -> None:
    """Draw the forces' time for each pair of magnets, and that of a step, over their number."""
    with style.figure(11, 4.6) as figure:
        forces, steps = figure.subplots(1, 2)
        _curves(forces, records, FORCES, lambda count: 2e9 / (count * (count - 1)))
        _curves(steps, records, STEPS, lambda _: 1e3)
        forces.set_title("forces and torques of all magnets on one another, ns a pair")
        forces.set_ylim(0.1, 5000)
        forces.legend(loc="upper right")
        steps.set_title("a step of MuJoCo, ms")
        steps.legend(loc="upper left")
        sign(figure)
        figure.savefig(folder / "many_magnets.png")


def _curves(
    axes: Any, records: dict[str, Record], curves: dict, scale: Callable[[int], float]
) -> None:
    for name, (label, color, line) in curves.items():
        found = [(n, _seconds(records, n, name)) for n in COUNTS]
        drawn = [(n, scale(n) * s) for n, s in found if s is not None]
        if drawn:
            look = {"marker": "o", "markersize": 3.5, "color": color, "label": label}
            axes.loglog(*zip(*drawn, strict=True), line, **look)
    axes.set_xlabel("free magnets")


def tables(records: dict[str, Record]) -> dict[str, str]:
    names = {**FORCES, **STEPS}
    columns = ["magnets", *(f"step: {STEPS[n][0]}" if n in STEPS else names[n][0] for n in names)]
    rows = [
        [str(n), *(number(1e3 * s) if (s := _seconds(records, n, name)) else "" for name in names)]
        for n in COUNTS
        if f"many/{n}" in records
    ]
    return {"many": table(columns, rows)}


def _seconds(records: dict[str, Record], count: int, name: str) -> float | None:
    if name == "lammps":
        return records.get(f"many/lammps/{count}", {}).get("seconds")
    return records.get(f"many/{count}", {}).get(name)
