"""Cost and effect of the top's surface, friction and decoration."""

from functools import partial

import magmotor as mm
from benchmarks.detail.flight import fly, momentum_error, position_error
from benchmarks.harness.records import Case, Record
from benchmarks.harness.stepping import cost
from benchmarks.harness.tables import cost_cells, number, table

ROLLING = mm.Top.paper(4)
SLIDING = mm.Top.paper(4, friction=0.0, spin=5.0)
"""With a spin, so that J is not zero."""

PREDICTABLE = 200
"""Number of records, 0.1 s each, after which runs without friction are chaotic."""

PARTS = {
    "planar": (ROLLING, False),
    "plane: gravity, unilateral contact": (ROLLING.replace(surface="plane"), False),
    "planar, without friction": (SLIDING, False),
    "plane, without friction": (SLIDING.replace(surface="plane"), False),
    "planar, with lights, cameras and decoration": (ROLLING, True),
}


def cases(quick: bool) -> list[Case]:
    turns = 10 if quick else 60
    return [Case(f"detail/top/{name}", partial(_measure, name, turns), 2) for name in PARTS]


def _measure(name: str, turns: int) -> Record:
    scene, visual = PARTS[name]
    model, planar = mm.build(scene, visual=visual), scene.replace(surface="planar")
    record = cost(model, mm.build(ROLLING), turns)
    with mm.magnetism():
        flight = fly(model, scene)
    record["momentum"] = momentum_error(flight.momentum, planar)
    record["position"] = position_error(flight.position[:PREDICTABLE], planar)
    return record


def tabulate(records: dict[str, Record]) -> str:
    columns = ["model", "µs a step", "ratio", "error of J, 60 s", "of position, 20 s (m)"]
    rows = []
    for name in PARTS:
        record = records[f"detail/top/{name}"]
        errors = [number(record[quantity]) for quantity in ("momentum", "position")]
        rows.append([name, *cost_cells(record), *errors])
    return table(columns, rows)
