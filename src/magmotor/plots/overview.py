"""A run of the top at a glance: its path over V_e, its J and its energy against theory."""

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from magmotor import observables
from magmotor.analysis import analysis
from magmotor.arguments import Picture
from magmotor.plots import style
from magmotor.plots.momentum import draw_momentum
from magmotor.plots.path import draw_path
from magmotor.scenes import Top

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@analysis(
    *("position", "axis", "slip_velocity", "momentum_map", "energy"),
    of=Top, records=2, replicas=False,
)  # fmt: skip
def overview(run: xr.Dataset, scene: Top | None, path: Picture) -> None:
    """Write one picture of a run.

    Left the path over the effective potential, right J(t) against the integral of friction's
    torque c r xi_3 . (e_z x V_Q), and the energy against the heat.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate`.
    scene : Top or None
        Its scene; None, the one that the attributes of the run tell.
    path : str or Path
        The file to write; its suffix says in which format.
    """
    assert scene is not None  # the run's own by now
    with style.figure(12.0, 6.0) as figure:
        axes = figure.subplot_mosaic([["path", "momentum"], ["path", "energy"]])
        draw_path(axes["path"], run, scene)
        _draw_momentum(axes["momentum"], run, scene)
        _draw_energy(axes["energy"], run, scene)
        figure.savefig(path, dpi=150)


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
