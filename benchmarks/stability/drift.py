"""Long-term behavior: energy, momentum map and quaternion of a top without friction."""

from functools import partial
from pathlib import Path

import numpy as np

import magmotor as mm
from benchmarks.harness.machine import sign
from benchmarks.harness.records import Case, Record
from benchmarks.harness.tables import number, table
from magmotor.common import style

SCENE = mm.Top.paper(1)
TIMESTEP = 0.025
STEPS, QUICK_STEPS = 10_000_000, 300_000
RECORDS, POINTS = 100_000, 120
"""Records of a run, and points of its curve, evenly spaced in the logarithm of time."""

METHODS = (
    "variational/euler",
    "mujoco/euler",
    "mujoco/implicitfast",
    "variational/baoab",
    "mujoco/baoab",
    "mujoco/rk4",
    "variational/blanes-moan4",
)
LINES = {"variational": {"lw": 4, "alpha": 0.45}, "mujoco": {"lw": 1.4, "ls": "--"}}
"""Line style of each engine; wide lines remain visible below MuJoCo's thin ones."""


def cases(quick: bool) -> list[Case]:
    steps = QUICK_STEPS if quick else STEPS
    return [Case(_key(method), partial(measure, method, steps), 3e-6 * steps) for method in METHODS]


def measure(method: str, steps: int) -> Record:
    failed = {}
    try:
        run = mm.simulate(
            SCENE,
            method=method,
            timestep=TIMESTEP,
            duration=steps * TIMESTEP,
            record_interval=steps // RECORDS,
            allow_unstable=True,
        )
    except mm.SimulationStopped as failure:
        run, failed = failure.dataset, {"failed": failure.reason}
    energy, momentum = run.energy.values, run.momentum_map.values
    largest = np.maximum.accumulate(abs(energy / energy[0] - 1))
    shown = np.unique(np.geomspace(1, len(energy) - 1, POINTS).astype(int))
    scale = SCENE.inertia[2] * float(abs(run.angular_velocity).max())
    return failed | {
        "time": run.time.values[shown].tolist(),
        "largest": largest[shown].tolist(),
        "drift": float(np.polyfit(run.time.values, energy / energy[0], 1)[0] * run.time.values[-1]),
        "momentum": float(abs(momentum - momentum[0]).max()) / scale,
        "quaternion": float(abs(np.linalg.norm(run.orientation, axis=1) - 1).max()),
    }


def draw(records: dict[str, Record], folder: Path) -> None:
    """Draw the largest error of the energy up to each time."""
    with style.figure(8, 4.8) as figure:
        axes = figure.subplots()
        for method in METHODS:
            record = records[_key(method)]
            color = style.method_look(method)["color"]
            line = LINES[method.split("/")[0]]
            axes.plot(record["time"], record["largest"], label=method, color=color, **line)
            if "failed" in record:
                last = record["time"][-1], record["largest"][-1]
                axes.plot(*last, "x", color=color)
        axes.set(xscale="log", yscale="log", xlabel="time (s)")
        axes.set_ylabel("largest error of energy until then, over |E|")
        axes.set_title(f"Top without friction, h = {TIMESTEP} s: MuJoCo's RK4 drifts")
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), handlelength=3)
        sign(figure)
        figure.savefig(folder / "stability_drift.png")


def tabulate(records: dict[str, Record]) -> str:
    columns = ["", "error of E", "drift of E", "error of J, over I max omega", "of the norm"]
    rows = []
    for method in METHODS:
        found = records[_key(method)]
        numbers = found["largest"][-1], found["drift"], found["momentum"], found["quaternion"]
        rows.append([f"`{method}`", *map(number, numbers)])
    return table(columns, rows)


def _key(method: str) -> str:
    return f"stability/drift/{method}"
