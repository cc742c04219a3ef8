"""What was tried for the top and dropped, beside what was kept: the work that an accuracy takes."""

import math
import time
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import tried_averaged
import tried_lie_group
import tried_multirate
from case import Case, Record
from machine import sign
from markdown_table import number, table
from numpy.typing import NDArray
from speed_accuracy_panels import LOOKS
from step_cost import run_seconds, seconds_a_step
from tried_splittings import SPLITTINGS, offered

import magmotor as mm
from magmotor.common import style
from magmotor.devices.ball.states import axes
from magmotor.devices.top import reference as top
from magmotor.devices.top.device import TOP as ball_initial

Array = NDArray[np.float64]


class Subject(NamedTuple):
    """A top, for how long it runs in s, and what is compared at every second."""

    scene: mm.Top
    duration: int
    quantity: str
    label: str


SUBJECTS = {
    "friction": Subject(mm.Top.paper(4), 60, "momentum_map", "J over 60 s, case 4"),
    "free": Subject(mm.Top.paper(2, spin=5.0), 20, "position", "position over 20 s, case 2"),
}
KEPT = ("verlet", "baoab", "blanes-moan4", "blanes-moan6")
LIE_GROUP = {"munthe-kaas": False, "commutator-free": True}
SUBSTEPS = {"multirate-2": 2, "multirate-3": 3, "multirate-5": 5}
AVERAGED = "averaged"
DROPPED = {
    tuple(SPLITTINGS): ("dropped: splittings", "-"),
    tuple(LIE_GROUP): ("dropped: on the Lie group", ":"),
    tuple(SUBSTEPS): ("dropped: multiple time steps", "--"),
}
"""How the families of those dropped are drawn."""

NUMBERS = sorted({round(2 ** (k / 3)) for k in range(3, 28)})
"""Of steps in a second."""

QUICK_NUMBERS = [2**k for k in range(1, 9)]
LONG = 400_000
ACCURACIES = (1e-2, 1e-4, 1e-6, 1e-8)


def cases(quick: bool) -> list[Case]:
    """One for each subject, candidate and step, and one for what a step costs."""
    numbers = QUICK_NUMBERS if quick else NUMBERS
    stepping = (*KEPT, *SPLITTINGS, *LIE_GROUP, *SUBSTEPS)
    errors = [
        Case(f"tried/{subject}/{name}/{count}", partial(_error, subject, name, count), 0.02)
        for subject in SUBJECTS
        for name in stepping
        for count in numbers
    ]
    slow = Case(f"tried/friction/{AVERAGED}", _averaged, 4.0)
    turns = 2 if quick else 15
    costs = Case("tried/cost", partial(_costs, stepping, turns), 2.5 * turns)
    return [*errors, slow, costs]


def draw(records: dict[str, Record], folder: Path) -> None:
    """Work against error: of those kept in colour, of the others in grey."""
    costs = records["tried/cost"]
    with style.figure(11, 5.2) as figure:
        panels = figure.subplots(1, len(SUBJECTS), sharey=True)
        for panel, (subject, described) in zip(panels, SUBJECTS.items(), strict=True):
            for name in costs:
                found = [r for r in _runs(records, subject, name) if r.get("error", 1) < 1]
                x = [record["error"] for record in found]
                y = [1e6 * costs[name] * record["number"] for record in found]
                if name in KEPT:
                    colour, marker = LOOKS[name]
                    panel.plot(x, y, marker=marker, ms=4, mfc="white", color=colour, label=name)
                else:
                    label, line = DROPPED[next(family for family in DROPPED if name in family)]
                    new = label not in panel.get_legend_handles_labels()[1]
                    panel.plot(x, y, line, color="0.6", lw=0.9, zorder=0, label=label * new)
            panel.set(xscale="log", yscale="log")
            panel.set_xlabel(f"relative error of {described.label}")
        panels[0].set_ylabel("µs a simulated second")
        panels[1].legend(loc="upper right")
        sign(figure)
        figure.savefig(folder / "tried.png", dpi=120)


def tables(records: dict[str, Record]) -> dict[str, str]:
    """Of each candidate the microseconds a simulated second that an accuracy takes."""
    costs = records["tried/cost"]
    columns = ["", "ns a step"]
    columns += [f"{s.label}: {e:g}" for s in SUBJECTS.values() for e in ACCURACIES]
    rows = []
    for name, cost in costs.items():
        cells = [f"`{name}`", number(1e9 * cost)]
        for subject in SUBJECTS:
            runs = _runs(records, subject, name)
            cells += [_work(runs, cost, accuracy) or "-" for accuracy in ACCURACIES]
        rows.append(cells)
    floor = records[f"tried/friction/{AVERAGED}"]["error"]
    slow = f"`{AVERAGED}` is a model, not a method: its own error of J is {100 * floor:.2g} %."
    return {"tried": f"{table(columns, rows)}\n\n{slow}"}


def _work(runs: list[Record], cost: float, accuracy: float) -> str:
    """At the longest step from which on all shorter ones are as accurate."""
    found = ""
    for record in sorted(runs, key=lambda r: -r["number"]):
        if record.get("error", math.inf) > accuracy:
            break
        found = number(1e6 * cost * record["number"])
    return found


def _runs(records: dict[str, Record], subject: str, name: str) -> list[Record]:
    prefix = f"tried/{subject}/{name}/"
    return [record for key, record in records.items() if key.startswith(prefix)]


def _error(subject: str, name: str, count: int) -> Record:
    described = SUBJECTS[subject]
    try:
        found = _path(described.scene, name, count, described.duration)[described.quantity]
    except mm.SimulationStopped as failure:
        return {"number": count, "failed": failure.reason}
    error = _distance(subject, found)
    if not math.isfinite(error):
        return {"number": count, "failed": "a value is not finite"}
    return {"number": count, "error": error}


def _averaged() -> Record:
    described = SUBJECTS["friction"]
    slow = tried_averaged.solve(described.scene, np.arange(described.duration + 1.0))
    return {"error": _distance("friction", slow.momentum_map)}


def _distance(subject: str, found: Array) -> float:
    truth = _truth(subject)
    return float(np.abs(found - truth).max() / np.abs(truth).max())


@cache
def _truth(subject: str) -> Array:
    scene, duration, quantity, _ = SUBJECTS[subject]
    run = mm.simulate(scene, method="scipy/dop853", timestep=1.0, duration=duration)
    return _columns(run.position.values, run.momentum_map.values)[quantity]


def _columns(position: Array, momentum_map: Array) -> dict[str, Array]:
    return {"position": position[:, :2], "momentum_map": momentum_map}


def _path(scene: mm.Top, name: str, count: int, duration: int) -> dict[str, Array]:
    """Places and momentum map at every second, in `count` steps each."""
    if name in KEPT or name in SPLITTINGS:
        with offered():
            run = mm.simulate(
                scene, method=f"variational/{name}", timestep=1 / count, duration=duration,
                record_interval=count, allow_unstable=True,
            )  # fmt: skip
        return _columns(run.position.values, run.momentum_map.values)
    advance, ball = _stepper(scene, name, 1 / count), _start(scene)
    balls = [ball, *(ball := advance(ball, count) for _ in range(duration))]
    places, _, turns, spins = (np.array(column) for column in zip(*balls, strict=True))
    along = np.sum(axes(turns) * spins, axis=1)
    return _columns(places, scene.inertia[0] * along)


def _start(scene: mm.Top):
    row = top.pack(ball_initial.initial_state(scene, None, None))[0]
    return tuple(tuple(row[a:b].tolist()) for a, b in ((0, 2), (2, 4), (4, 8), (8, 11)))


def _stepper(scene: mm.Top, name: str, timestep: float) -> Callable:
    """The function (ball, steps) -> ball of a candidate that is no splitting."""
    numbers = top.bodies(scene), top.magnets(scene)
    if name in LIE_GROUP:
        kernel = tried_lie_group.advance(LIE_GROUP[name])
        return lambda ball, steps: kernel(ball, timestep, steps, *numbers)
    sub = SUBSTEPS[name]
    return lambda ball, steps: tried_multirate.advance(ball, timestep, steps, sub, *numbers)


def _costs(names: tuple[str, ...], turns: int) -> Record:
    """Seconds a step."""
    return seconds_a_step(
        {name: partial(_seconds, name) for name in names}, dict.fromkeys(names, LONG), turns
    )


def _seconds(name: str, steps: int) -> float:
    scene, timestep = mm.Top.paper(4), 0.025
    if name in KEPT or name in SPLITTINGS:
        with offered():
            method = f"variational/{name}"
            return run_seconds(steps, scene, method, timestep, allow_unstable=True)
    begin = time.perf_counter()
    _stepper(scene, name, timestep)(_start(scene), steps)
    return time.perf_counter() - begin
