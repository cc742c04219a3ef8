"""A run of the top at a glance: its path over V_e, its J and its energy against theory."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from magmotor import observables
from magmotor.plots import style
from magmotor.plots.momentum import draw_momentum
from magmotor.scenes import Top

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FLAT = 1e-3
"""A valley whose floor varies by less than this part of its depth has no minimum worth marking."""


def overview(run: xr.Dataset, scene: Top, path: str | Path) -> None:
    """Write one picture of a run.

    Left the path over the effective potential, right J(t) against the integral of friction's
    torque c r xi_3 . (e_z x V_Q), and the energy against the heat.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate`.
    scene : Top
        Its scene.
    path : str or Path
        The file to write; its suffix says in which format.
    """
    with style.figure(12.0, 6.0) as figure:
        axes = figure.subplot_mosaic([["path", "momentum"], ["path", "energy"]])
        _draw_path(axes["path"], run, scene)
        _draw_momentum(axes["momentum"], run, scene)
        _draw_energy(axes["energy"], run, scene)
        figure.savefig(path, dpi=150)


def _draw_path(axes: "Axes", run: xr.Dataset, scene: Top) -> None:
    from matplotlib.colors import LinearSegmentedColormap

    x, y = run.position.values[:, 0], run.position.values[:, 1]
    reach = 1.05 * max(scene.ring_radius, np.abs(x).max(), np.abs(y).max())
    end = float(run.time[-1])
    grid = np.linspace(-reach, reach, 201)
    points = np.stack(np.meshgrid(grid, grid), axis=-1)
    depth = 1e3 * observables.effective_potential(scene, points, end)
    shades = LinearSegmentedColormap.from_list("landscape", style.LANDSCAPE)
    filled = axes.contourf(grid, grid, depth, levels=20, cmap=shades)
    bar = axes.figure.colorbar(filled, ax=axes, shrink=0.6, aspect=30)
    bar.set_label("$V_e$ (mJ)" + (f" under the ring at t = {end:g} s" if scene.ring_script else ""))
    if not scene.ring_script:
        _mark_valley(axes, scene)
    axes.plot(x, y, color=style.BLUE, label="path of the ball")
    axes.plot(x[0], y[0], "o", color=style.BLUE, markerfacecolor="white", label="start")
    axes.plot(x[-1], y[-1], "o", color=style.BLUE, label="end")
    axes.set(xlabel="x (m)", ylabel="y (m)", xlim=(-reach, reach), ylim=(-reach, reach))
    axes.set(aspect="equal", title="Path over the effective potential $V_e$")
    axes.grid(visible=False)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=3)


def _mark_valley(axes: "Axes", scene: Top) -> None:
    around = np.linspace(0, 2 * np.pi, 121)
    radius = np.array([observables.valley_radius(scene, azimuth) for azimuth in around])
    x, y = radius * np.cos(around), radius * np.sin(around)
    axes.plot(x, y, "--", color=style.ORANGE, lw=1.2, label="valley")
    points = observables.critical_points(scene)
    minima = [p for p in points if p.kind == "minimum"]
    saddles = [p for p in points if p.kind == "saddle"]
    if minima and saddles and saddles[-1].energy - minima[0].energy < -FLAT * minima[0].energy:
        return
    for label, marker, found in (("minimum", "v", minima[:1]), ("saddle", "X", saddles[-1:])):
        for point in found:
            axes.plot(*point.position, marker, color=style.ORANGE, ms=8, mec="white", label=label)


def _draw_momentum(axes: "Axes", run: xr.Dataset, scene: Top) -> None:
    _, residual = draw_momentum(axes, run, scene)
    axes.set(title=f"J against the torque of friction: largest difference {residual:.1e} kg m²/s")
    axes.legend()


def _draw_energy(axes: "Axes", run: xr.Dataset, scene: Top) -> None:
    balance = observables.energy_balance(run, scene)
    gain = 1e3 * (run.energy - run.energy[0])
    axes.plot(run.time, gain, color=style.BLUE, lw=3, label="$E(t) - E(0)$, simulated")
    label = r"$-\int c\,|V_Q|^2\,dt$, the heat"
    axes.plot(run.time, -1e3 * balance.heat, "--", color=style.ORANGE, label=label)
    if scene.ring_script:
        work = 1e3 * balance.residual
        axes.plot(run.time, work, ":", color=style.GREEN, label="their difference: the ring's work")
        bottom, top = axes.get_ylim()
        axes.set_ylim(bottom, top + 0.4 * (top - bottom))  # room for three lines of legend
        axes.set(title="Energy against heat, and the work of moving the ring")
    else:
        largest = float(1e3 * np.abs(balance.residual).max())
        axes.set(title=f"Energy against heat: largest difference {largest:.1e} mJ")
    axes.set(xlabel="t (s)", ylabel="energy (mJ)")
    axes.legend()
