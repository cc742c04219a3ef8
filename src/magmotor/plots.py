"""Plots of runs, ensembles and sweeps.

Each function takes the path of the picture, whose suffix sets the format (such as .png, .pdf or
.svg), and `dpi`. Your own figures look alike after `matplotlib.rcParams.update(mm.plots.STYLE)`.
"""

import xarray as xr

from magmotor.common import style
from magmotor.common.hints import Dpi, Picture
from magmotor.common.style import STYLE
from magmotor.device.analysis import analysis
from magmotor.device.device import Scene
from magmotor.devices.motor.plot_panels import MotorRun
from magmotor.devices.motor.plots import motor_overview
from magmotor.sweep.plots import sweep

__all__ = [
    "STYLE",
    "MotorRun",
    "motor_overview",
    "overview",
    "sweep",
]


@analysis(of=Scene, records=2)
def overview(run: xr.Dataset, scene: Scene | None, path: Picture, dpi: Dpi = style.DPI) -> None:
    """Write an overview of a run as one picture.

    For the top: the path over the effective potential, J(t) with the integral of the friction
    torque c r xi_3 . (e_z x V_Q), and the energy with the heat. For the motor: flights, the
    beginning of the longest one, path, energy and temperatures. For others: scalars over time.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate`.
    scene : Scene or None
        The scene of the run; None takes the one in its attributes.
    path : str or Path
        The file to write; its suffix sets the format, such as .png, .pdf or .svg.
    dpi : int
        Dots per inch of the picture.
    """
    assert scene is not None  # `analysis` has replaced None
    scene.device.overview(run, scene, path, dpi)
