"""Work-precision diagrams: error against cost, one panel per quantity, one style per method."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from matplotlib.markers import CARETLEFTBASE

from benchmarks.accuracy.points import USELESS, Point, by_method, chosen, front
from benchmarks.harness.machine import small_print
from magmotor.common.style import GRAY, INK, figure, method_look

if TYPE_CHECKING:
    from matplotlib.axes import Axes

EDGE = 3.0
"""Abscissa of failed steps."""

LEAST = 1e-10
"""Smallest error that is drawn."""


class Mark(NamedTuple):
    """A point that is labeled in the picture."""

    method: str
    timestep: float
    text: str


class Panel(NamedTuple):
    """A quantity of a scene, and its title; `theory` is the error of Euler's scheme."""

    scene: str
    quantity: str
    title: str
    theory: Callable[[float], float] | None = None
    mark: Mark | None = None


def draw_panels(
    points: Sequence[Point], panels: Sequence[Panel], columns: int, path: Path, note: str = ""
) -> None:
    """Draw panels in rows of `columns`, with a legend below, to a PNG."""
    rows = -(-len(panels) // columns)
    with figure(4.4 * columns, 3.6 * rows + 1.2) as drawing:
        axes = drawing.subplots(rows, columns, squeeze=False).ravel()
        for ax in axes[len(panels) :]:
            ax.set_axis_off()
        for ax, panel in zip(axes, panels, strict=False):
            draw_panel(ax, chosen(points, panel.scene, panel.quantity), panel)
        handles = {
            label: handle
            for ax in axes
            for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)
        }
        drawing.legend(
            [handles[label] for label in sorted(handles)], sorted(handles),
            loc="outside lower center", ncols=min(6, 2 * columns), frameon=False,
        )  # fmt: skip
        drawing.suptitle(f"{note}\n{small_print()}".strip(), fontsize=8, color=GRAY, ha="center")
        drawing.savefig(path)


def draw_panel(ax: "Axes", points: Sequence[Point], panel: Panel) -> None:
    """Draw one quantity."""
    ax.set(xscale="log", yscale="log", title=panel.title)
    ax.set(xlabel="relative error", ylabel="wall time of a simulated second (s)")
    points = [replace(point, error=max(point.error, LEAST)) for point in points]
    best = front(points)
    ax.plot([p.bound for p in best], [p.seconds for p in best], color=INK, alpha=0.13, lw=9)
    for method, curve in by_method(points).items():
        _draw_method(ax, method, curve)
    floors = [point.floor for point in points if point.floor > 0]
    if floors:
        ax.axvspan(LEAST / 2, min(floors), color=GRAY, alpha=0.12, lw=0)
    shown = [point.bound for point in points if point.bound < USELESS]
    left = min(shown, default=USELESS) / 2
    if panel.theory:
        _draw_theory(ax, points, panel.theory)
    for p in points:
        if panel.mark and (p.method, p.timestep) == panel.mark[:2]:
            ax.annotate(panel.mark.text, (p.bound, p.seconds), (-8, 12), ha="right", fontsize=8,
                        textcoords="offset points", arrowprops={"arrowstyle": "-"})  # fmt: skip
    ax.axvline(USELESS, color=GRAY, lw=0.8)
    ax.set_xlim(left, 2 * EDGE)


def _draw_method(ax: "Axes", method: str, curve: Sequence[Point]) -> None:
    look = method_look(method)
    color = look["color"]
    good = sorted((p for p in curve if p.error < USELESS), key=lambda p: (p.timestep, p.error))
    x, y = np.array([(p.bound, p.seconds) for p in good]).reshape(-1, 2).T
    ax.plot(x, y, lw=1, label=method, ms=5, mew=1.1, **look)
    below = [p for p in good if p.error < p.floor]
    ax.plot([p.floor for p in below], [p.seconds for p in below], ls="", marker=CARETLEFTBASE,
            ms=8, color=color)  # fmt: skip
    bad = [p.seconds for p in curve if p.error >= USELESS]
    ax.plot([EDGE] * len(bad), bad, ls="", marker="x", ms=5, color=color)


def _draw_theory(ax: "Axes", points: Sequence[Point], error: Callable[[float], float]) -> None:
    curve = [p for p in points if p.method == "variational/euler" and p.error < USELESS]
    x = [error(p.timestep) for p in curve]
    ax.plot(x, [p.seconds for p in curve], color=INK, lw=1, ls=":", label="theory, Euler")
