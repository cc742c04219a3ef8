"""The steps that fail, from the unit reading to the SI reading of the top's moments."""

from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm

import magmotor as mm
from benchmarks.harness.machine import sign
from benchmarks.harness.records import Case, Record
from benchmarks.stability.limits import GROWN, nudged
from magmotor.common import style
from magmotor.device.step_limits import step_limit

SCENE = mm.Top.paper(4, gravity=1e4)
"""So heavy that the magnetic lift does not cause the failure."""

METHODS = ("mujoco/euler", "mujoco/rk4")
UNIT, SI, PAPER_STEP = 1e-5, 1e-3, 0.025
COUPLINGS = np.geomspace(UNIT, SI, 9)
SHORTEST, LONGEST, NUMBER_OF_STEPS = 4e-3, 0.25, 25
STEPS = 1000
COLORS = "YlOrRd_r"

QUICK_STRIDE = 4
"""Stride over couplings and steps with --quick."""


def cases(quick: bool) -> list[Case]:
    stride = QUICK_STRIDE if quick else 1
    return [
        Case(_key(method, coupling), partial(measure, method, coupling, stride), 4.0 / stride)
        for method in METHODS
        for coupling in COUPLINGS[::stride].tolist()
    ]


def measure(method: str, coupling: float, stride: int) -> Record:
    scene = SCENE.replace(coupling=coupling)
    steps = np.geomspace(SHORTEST, LONGEST, NUMBER_OF_STEPS)[::stride].tolist()
    return {
        "predicted": step_limit(scene, method),
        "timesteps": steps,
        "lasted": [lasted(scene, method, h) for h in steps],
    }


def lasted(scene: mm.Top, method: str, h: float) -> int:
    """Return the steps until a nudge of the resting ball has grown; `STEPS` if it does not grow."""
    try:
        run = nudged(scene, method, h, STEPS)
    except mm.SimulationStopped as failure:
        run = failure.dataset
        grown = np.append(_grown(run), True)
    else:
        grown = np.append(_grown(run)[:-1], True)
    return max(1, int(grown.argmax()))


def _grown(run) -> np.ndarray:
    return (abs(run.angular_velocity) > GROWN).any("space").values


def draw(records: dict[str, Record], folder: Path) -> None:
    """Draw how long a nudge takes to grow, with the predicted limits as lines."""
    with style.figure(10, 4.6) as figure:
        norm = LogNorm(1, STEPS)
        panels = figure.subplots(1, len(METHODS), sharey=True)
        for axes, method in zip(panels, METHODS, strict=True):
            found = {c: records[_key(method, c)] for c in COUPLINGS if _key(method, c) in records}
            _draw_panel(axes, found, norm)
            axes.set_title(method)
        panels[0].set_ylabel("timestep (s)")
        panels[0].legend(loc="lower left")
        bar = ScalarMappable(norm, COLORS)
        figure.colorbar(bar, ax=panels, label="steps until a nudge has grown (white: never)")
        figure.suptitle("The top at rest: the paper's step in the unit and in the SI reading")
        sign(figure)
        figure.savefig(folder / "stability_map.png")


def _draw_panel(axes: Axes, found: dict[float, Record], norm: LogNorm) -> None:
    couplings, steps = [*found], next(iter(found.values()))["timesteps"]
    lasted = np.array([record["lasted"] for record in found.values()]).T
    grown = np.ma.masked_greater_equal(lasted, STEPS)
    axes.grid(False)
    axes.pcolormesh(couplings, steps, grown, cmap=COLORS, norm=norm, shading="nearest")
    predicted = [record["predicted"] for record in found.values()]
    axes.plot(couplings, predicted, color=style.BLUE, label="linear theory")
    for coupling, name, color in ((UNIT, "unit", style.INK), (SI, "SI", "white")):
        axes.plot(coupling, PAPER_STEP, "o", color=style.GREEN, mec="white", ms=9)
        axes.annotate(
            name, (coupling, PAPER_STEP), (0, 9), textcoords="offset points", ha="center",
            color=color,
        )  # fmt: skip
    axes.set(xscale="log", yscale="log", xlabel="coupling of a pair of dipoles (J m³)")


def _key(method: str, coupling: float) -> str:
    return f"stability/map/{method}/{coupling:.3g}"
