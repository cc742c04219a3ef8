"""Many free magnets: time of their forces and of a step, from 10 to 10 000, beside LAMMPS."""

from functools import partial
from pathlib import Path

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
    """Draw the times over the number of magnets."""
    with style.figure(11, 4.6) as figure:
        forces, steps = figure.subplots(1, 2, sharey=True)
        for axes, curves in ((forces, FORCES), (steps, STEPS)):
            for name, (label, color, line) in curves.items():
                found = [(n, _seconds(records, n, name)) for n in COUNTS]
                drawn = [(n, 1e3 * s) for n, s in found if s is not None]
                if drawn:
                    axes.loglog(
                        *zip(*drawn, strict=True), line, marker="o", markersize=3.5, color=color,
                        label=label,
                    )  # fmt: skip
            axes.set_xlabel("free magnets")
            axes.legend(loc="upper left")
        forces.set_title("forces and torques of all magnets on one another, ms")
        steps.set_title("a step of MuJoCo, ms")
        sign(figure)
        figure.savefig(folder / "many_magnets.png")


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
