"""J(t), and the spin that it is, beside the theory of it."""

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from magmotor import observables
from magmotor.plots import style
from magmotor.scenes import Top

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D


def draw_momentum(axes: "Axes", run: xr.Dataset, scene: Top) -> tuple[list["Line2D"], float]:
    """Draw J as simulated and as the integral of friction's torque.

    Returns
    -------
    lines : list of Line2D
    residual : float
        Their largest difference, in kg m^2/s.
    """
    balance = observables.momentum_balance(run, scene)
    lines = axes.plot(run.time, run.momentum_map, color=style.BLUE, lw=3, label="simulated")
    label = r"theory: $J(0) + \int c\,r\,\xi_3\cdot(e_z\times V_Q)\,dt$"
    lines += axes.plot(run.time, balance.integral, "--", color=style.ORANGE, label=label)
    axes.set(xlabel="t (s)", ylabel="J (kg m²/s)")
    inertia = scene.inertia[2]
    least = style.NO_SPIN * inertia
    if np.abs(run.momentum_map).max() < least:
        axes.set_ylim(-least, least)
    to_spin = (lambda J: np.asarray(J) / inertia, lambda spin: np.asarray(spin) * inertia)
    spin = axes.secondary_yaxis("right", functions=to_spin)
    spin.set_ylabel("spin (rad/s)")
    return lines, float(np.abs(balance.residual).max())
