"""The smallest step at which each method fails on each scene, measured and predicted."""

import math
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import Any

import xarray as xr

import magmotor as mm
from benchmarks.harness.machine import sign
from benchmarks.harness.records import Case, Record
from benchmarks.harness.tables import table
from magmotor.common import style
from magmotor.device.step_limits import step_limit
from magmotor.numerics.splittings import DISK, kicks_that_evaluate
from magmotor.theory import resting_ball

SCENES = {
    "top, no friction": mm.Top.paper(2),
    "top": mm.Top.paper(4),
    "top on the plane": mm.Top.paper(4, surface="plane"),
    "motor": mm.Motor(temperature="nonuniform", alpha_ring=0.0, friction_ring=0.15),
    "motor, ring without friction": mm.Motor(temperature="nonuniform", alpha_ring=0.0),
    "disk at rest": mm.Disk(noise=0.0),
    "disk in flight": mm.Disk(noise=0.0),
}
"""Scenes without noise, which does not affect the limits; the motor's friction is the paper's."""

FLIGHT = 30.0
"""Initial |d| of the disk in flight: it should slow down, and accelerates if it is aliased."""

NUDGE, GROWN, STEPS = 1e-5, 1e-2, 4000
"""Initial velocities, velocities that count as failure (both in SI units), and number of steps."""

RATIOS = (0.5, 0.7, 0.8, 0.9, 0.95, 0.98, 1.005, 1.02, 1.05, 1.1, 1.2, 1.5, 2.0)
"""Steps over the predicted limit; the first that fails and the one before are bisected."""

BISECTIONS = 3
QUICK = ("top", "motor", "disk at rest")

LARGEST = 1.12
"""Largest ratio that is drawn."""


def cases(quick: bool) -> list[Case]:
    bisections = 1 if quick else BISECTIONS
    return [
        Case(_key(name, method), partial(measure, name, method, bisections), 1.5)
        for name in (QUICK if quick else SCENES)
        for method in methods(name)
    ]


def methods(name: str) -> list[str]:
    """Return the methods that have a limit on a scene; aliasing requires one kick per step."""
    excluded = {"dop853"}
    if name == "disk in flight":
        multiple_kicks = (
            key for key, scheme in DISK.items() if sum(kicks_that_evaluate(scheme.parts)) > 1
        )
        excluded |= {"rk4", *multiple_kicks}
    return [method for method in mm.methods(SCENES[name]) if method.split("/")[1] not in excluded]


def predict(name: str, method: str) -> float:
    scene = SCENES[name]
    if isinstance(scene, mm.Disk) and name == "disk in flight":
        return math.pi * (1 + scene.sigma) / FLIGHT
    return step_limit(scene, method)


def measure(name: str, method: str, bisections: int) -> Record:
    fails = aliases if name == "disk in flight" else grows
    predicted = predict(name, method)
    stable, failing = 0.0, math.nan
    for ratio in RATIOS:
        if fails(name, method, ratio * predicted):
            failing = ratio
            break
        stable = ratio
    if math.isnan(failing):
        return {"predicted": predicted, "failed": f"no failure up to {RATIOS[-1]:g} times that"}
    for _ in range(bisections):
        middle = (stable + failing) / 2
        if fails(name, method, middle * predicted):
            failing = middle
        else:
            stable = middle
    return {"predicted": predicted, "measured": predicted * (stable + failing) / 2}


def grows(name: str, method: str, h: float) -> bool:
    """Whether a nudge of the resting scene grows."""
    try:
        run = nudged(SCENES[name], method, h, STEPS)
    except mm.SimulationStopped:
        return True
    names = {"velocity", "angular_velocity", "v", "omega"} & run.data_vars.keys()
    return max(float(abs(run[name]).max()) for name in names) > GROWN


def nudged(scene: mm.Top | mm.Motor | mm.Disk, method: str, h: float, steps: int) -> xr.Dataset:
    """Simulate a run from rest with small initial velocities."""
    if isinstance(scene, mm.Disk):
        start: dict[str, Any] = {"x": -math.pi / 2, "v": NUDGE}
    else:
        place, axis = resting_ball(scene)
        start = {"position": place, "axis": axis, "angular_velocity": (NUDGE, 2 * NUDGE, 0.0)}
    return mm.simulate(
        scene, method=method, timestep=h, duration=steps * h, initial=start, allow_unstable=True
    )


def aliases(name: str, method: str, h: float) -> bool:
    """Whether the flight of a disk without noise accelerates, which friction forbids."""
    scene = SCENES[name]
    assert isinstance(scene, mm.Disk)
    slow = FLIGHT / (1 + scene.sigma)
    start = {"v": -slow, "omega": slow}
    try:
        run = mm.simulate(
            scene,
            method=method,
            timestep=h,
            duration=5 * STEPS * h,
            initial=start,
            allow_unstable=True,
        )
    except mm.SimulationStopped:
        return True
    d = abs(scene.sigma * run.omega - run.v).values
    third = len(d) // 3
    return d[-third:].mean() > d[:third].mean()


def draw(records: dict[str, Record], folder: Path) -> None:
    """Draw measured over predicted limits, a row for each scene."""
    all_methods = _methods_of(SCENES)
    with style.figure(9, 5) as figure:
        axes = figure.subplots()
        axes.axvspan(0.95, 1.05, color=style.GRAY, alpha=0.15, lw=0, label="within 5 %")
        for i, method in enumerate(all_methods):
            look = style.method_look(method)
            axes.plot([], [], ls="", label=method, **look)
            for y, name in enumerate(SCENES):
                record = records.get(_key(name, method))
                place = y + 0.6 * (i / (len(all_methods) - 1) - 0.5)
                if record and "measured" in record:
                    axes.plot(record["measured"] / record["predicted"], place, **look)
                elif record:
                    axes.text(LARGEST, place, "none ", color=look["color"], ha="right", va="center")
        axes.set_yticks(range(len(SCENES)), [*SCENES])
        axes.set_ylim(len(SCENES) - 0.5, -0.5)
        axes.set_xlim(2 - LARGEST, LARGEST)
        axes.set_xlabel("smallest failing step, measured over predicted")
        axes.set_title("Methods fail where linear theory says")
        figure.legend(loc="outside right upper")
        sign(figure)
        figure.savefig(folder / "stability_limits.png")


def tabulate(records: dict[str, Record]) -> str:
    """Return a Markdown table of limits: a row for each method, a column for each scene."""
    rows = [
        [f"`{method}`", *(_cell(records.get(_key(name, method))) for name in SCENES)]
        for method in _methods_of(SCENES)
    ]
    return table(["smallest failing step: measured (predicted)", *SCENES], rows)


def _methods_of(names: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(method for name in names for method in methods(name)))


def _cell(record: Record | None) -> str:
    if record is None:
        return ""
    measured = f"{record['measured']:.3g}" if "measured" in record else "none"
    return f"{measured} ({record['predicted']:.3g})"


def _key(name: str, method: str) -> str:
    return f"stability/limit/{name}/{method}"
