"""The path of the top's ball over the effective potential."""

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from magmotor.common import style
from magmotor.devices.ball.landscape import critical_points, effective_potential, valley
from magmotor.devices.top.scene import Top

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FLAT = 1e-3
"""A valley whose floor varies by less than this part of its depth has no minimum worth marking."""

CROWDED = 30
"""A path so many times as long as the picture is drawn thin."""


def draw_path(axes: "Axes", run: xr.Dataset, scene: Top) -> None:
    """Draw a run's path, start and end, over V_e with its valley, minimum and saddle."""
    from matplotlib.colors import LinearSegmentedColormap

    x, y = run.position.values[:, 0], run.position.values[:, 1]
    reach = 1.05 * max(scene.ring_radius, np.abs(x).max(), np.abs(y).max())
    end = float(run.time[-1])
    grid = np.linspace(-reach, reach, 201)
    points = np.stack(np.meshgrid(grid, grid), axis=-1)
    depth = 1e3 * effective_potential(scene, points, end)
    shades = LinearSegmentedColormap.from_list("landscape", style.LANDSCAPE)
    filled = axes.contourf(grid, grid, depth, levels=20, cmap=shades)
    bar = axes.figure.colorbar(filled, ax=axes, shrink=0.6, aspect=30)
    bar.set_label("$V_e$ (mJ)" + (f" under the ring at t = {end:g} s" if scene.ring_script else ""))
    if not scene.ring_script:
        _mark_valley(axes, scene)
    crowded = np.hypot(np.diff(x), np.diff(y)).sum() > CROWDED * reach
    axes.plot(x, y, color=style.BLUE, lw=0.7 if crowded else 1.6, label="path of the ball")
    axes.plot(x[0], y[0], "o", color=style.BLUE, markerfacecolor="white", label="start")
    axes.plot(x[-1], y[-1], "o", color=style.BLUE, label="end")
    axes.set(xlabel="x (m)", ylabel="y (m)", xlim=(-reach, reach), ylim=(-reach, reach))
    axes.set(aspect="equal", title="Path over the effective potential $V_e$")
    axes.grid(visible=False)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=3)


def _mark_valley(axes: "Axes", scene: Top) -> None:
    around = np.linspace(0, 2 * np.pi, 121)
    axes.plot(*valley(scene, around).T, "--", color=style.ORANGE, lw=1.2, label="valley")
    points = critical_points(scene)
    minima = [p for p in points if p.kind == "minimum"]
    saddles = [p for p in points if p.kind == "saddle"]
    if minima and saddles and saddles[-1].energy - minima[0].energy < -FLAT * minima[0].energy:
        return
    for label, marker, found in (("minimum", "v", minima[:1]), ("saddle", "X", saddles[-1:])):
        for point in found:
            look = {"color": style.ORANGE, "ms": 8, "mec": "white", "zorder": 4}
            axes.plot(*point.position, marker, label=label, **look)
