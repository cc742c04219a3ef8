"""Plots of the top: an overview of a run."""

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from magmotor.common import style
from magmotor.common.hints import Dpi, Picture
from magmotor.device.analysis import analysis
from magmotor.devices.ball.landscape import critical_points, effective_potential, valley
from magmotor.devices.top.observables import momentum_balance, top_energy_balance
from magmotor.devices.top.scene import Top

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D


@analysis(
    *("position", "axis", "slip_velocity", "momentum_map", "energy"),
    of=Top, records=2, replicas=False,
)  # fmt: skip
def top_overview(run: xr.Dataset, scene: Top | None, path: Picture, dpi: Dpi = style.DPI) -> None:
    """Write an overview of a run as one picture.

    On the left is the path over the effective potential; on the right are J(t) with the integral of
    the friction torque c r xi_3 . (e_z x V_Q), and the energy with the heat.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate`.
    scene : Top or None
        The scene of the run; None takes the one in its attributes.
    path : str or Path
        The file to write; its suffix sets the format, such as .png, .pdf or .svg.
    dpi : int
        Dots per inch of the picture.
    """
    assert scene is not None  # `analysis` has replaced None
    with style.figure(11.0, 5.5) as figure:
        axes = figure.subplot_mosaic([["path", "momentum"], ["path", "energy"]])
        draw_path(axes["path"], run, scene)
        _draw_momentum(axes["momentum"], run, scene)
        _draw_energy(axes["energy"], run, scene)
        style.save(figure, path, dpi, shaded=True)


def _draw_momentum(axes: "Axes", run: xr.Dataset, scene: Top) -> None:
    _, residual = draw_momentum(axes, run, scene)
    axes.set(title=f"J against theory: largest difference {residual:.1e} kg m²/s")
    _legend_above(axes, lines=2)


def _draw_energy(axes: "Axes", run: xr.Dataset, scene: Top) -> None:
    balance = top_energy_balance(run, scene)
    gain = 1e3 * (run.energy - run.energy[0])
    axes.plot(run.time, gain, color=style.BLUE, lw=3, label="$E(t) - E(0)$, simulated")
    label = r"$-\int c\,|V_Q|^2\,dt$, the heat"
    axes.plot(run.time, -1e3 * balance.heat, "--", color=style.ORANGE, label=label)
    if scene.ring_script:
        work = 1e3 * balance.residual
        axes.plot(run.time, work, ":", color=style.GREEN, label="their difference: the ring's work")
        axes.set(title="Energy against heat, and the work of moving the ring")
    else:
        largest = float(1e3 * np.abs(balance.residual).max())
        axes.set(title=f"Energy against heat: largest difference {largest:.1e} mJ")
    axes.set(xlabel="t (s)", ylabel="energy (mJ)")
    _legend_above(axes, lines=len(axes.lines))


def _legend_above(axes: "Axes", lines: int) -> None:
    """Add a legend above the curves of a panel, with room for its lines."""
    bottom, top = axes.get_ylim()
    axes.set_ylim(bottom, top + 0.2 * lines * (top - bottom))
    axes.legend(loc="upper right")


def draw_momentum(axes: "Axes", run: xr.Dataset, scene: Top) -> tuple[list["Line2D"], float]:
    """Draw J from the simulation and as the integral of the torque that changes it.

    Returns
    -------
    lines : list of Line2D
    residual : float
        Largest difference of the two, in kg m^2/s.
    """
    balance = momentum_balance(run, scene)
    lines = axes.plot(run.time, run.momentum_map, color=style.BLUE, lw=3, label="simulated")
    label = r"theory: $J(0) + \int c\,r\,\xi_3\cdot(e_z\times V_Q)\,dt$"
    if scene.is_unbalanced:  # the weight and inertia also exert torques
        label = r"theory: $J(0) + \int$ torque about $\xi_3$ $dt$"
    lines += axes.plot(run.time, balance.integral, "--", color=style.ORANGE, label=label)
    axes.set(xlabel="t (s)", ylabel="J (kg m²/s)")
    inertia = scene.inertia[2]
    least = style.NO_SPIN * inertia
    if np.abs(run.momentum_map).max() < least:
        axes.set_ylim(-least, least)
    if scene.is_unbalanced:  # then the spin does not follow from J
        return lines, float(np.abs(balance.residual).max())
    to_spin = (lambda J: np.asarray(J) / inertia, lambda spin: np.asarray(spin) * inertia)
    spin = axes.secondary_yaxis("right", functions=to_spin)
    spin.set_ylabel("spin (rad/s)")
    return lines, float(np.abs(balance.residual).max())


FLAT = 1e-3
"""A valley whose floor varies by a smaller fraction of its depth has no marked minimum."""

CROWDED = 30
"""Length of a path, over half the width of the panel, above which its line is thin."""


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
            marker_style = {"color": style.ORANGE, "ms": 8, "mec": "white", "zorder": 4}
            axes.plot(*point.position, marker, label=label, **marker_style)
