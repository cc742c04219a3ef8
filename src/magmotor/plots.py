"""Plots: figures drawn from datasets."""

import xarray as xr

from magmotor.common.hints import Picture
from magmotor.device.analysis import analysis
from magmotor.device.device import Scene
from magmotor.devices.disk.plots import disk_figure, disk_overview
from magmotor.devices.motor.plot_panels import MotorRun
from magmotor.devices.motor.plots import motor_figure, motor_overview
from magmotor.devices.top.plots import spin_map
from magmotor.sweep.plots import sweep

__all__ = [
    "MotorRun",
    "disk_figure",
    "disk_overview",
    "motor_figure",
    "motor_overview",
    "overview",
    "spin_map",
    "sweep",
]


@analysis(of=Scene, records=2)
def overview(run: xr.Dataset, scene: Scene | None, path: Picture) -> None:
    """Write one picture of a run.

    Of the top: left the path over the effective potential, right J(t) against the integral of
    friction's torque c r xi_3 . (e_z x V_Q), and the energy against the heat. Of the motor: its
    flights, where the longest begins, energy, temperatures. Of others: their numbers over time.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate`.
    scene : Scene or None
        Its scene; None, the one that the attributes of the run tell.
    path : str or Path
        The file to write; its suffix says in which format.
    """
    assert scene is not None  # the run's own by now
    scene.device.overview(run, scene, path)
