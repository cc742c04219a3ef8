"""Observables: what is read off a run, and, from theory, the landscape in which it happens."""

import xarray as xr

from magmotor.device.analysis import OWN, analysis
from magmotor.device.device import Scene
from magmotor.devices.ball.landscape import (
    CriticalPoint,
    critical_points,
    effective_potential,
    minimum,
    saddle,
    valley_radius,
)
from magmotor.devices.ball.slip import slip_velocity
from magmotor.devices.disk.observables import d_diffusion, flight_survival, local_slope
from magmotor.devices.motor.energy import efficiency
from magmotor.devices.motor.exponential_test import exponential_test, squared_variation
from magmotor.devices.motor.flights import censored_mean, dwell_times, flights, transitions
from magmotor.devices.motor.modes import mode_temperatures
from magmotor.devices.motor.observables import azimuth, ring_attitude
from magmotor.devices.motor.theory import MotorWells, motor_wells
from magmotor.devices.top.observables import (
    energy,
    friction_torque,
    kinetic_energy,
    magnetic_energy,
    magnetic_energy_and_lift,
    momentum_balance,
    momentum_map,
)

__all__ = [
    "CriticalPoint",
    "MotorWells",
    "azimuth",
    "censored_mean",
    "critical_points",
    "d_diffusion",
    "dwell_times",
    "effective_potential",
    "efficiency",
    "energy",
    "energy_balance",
    "exponential_test",
    "flight_survival",
    "flights",
    "friction_torque",
    "kinetic_energy",
    "local_slope",
    "magnetic_energy",
    "magnetic_energy_and_lift",
    "minimum",
    "mode_temperatures",
    "momentum_balance",
    "momentum_map",
    "motor_wells",
    "ring_attitude",
    "saddle",
    "slip_velocity",
    "squared_variation",
    "transitions",
    "valley_radius",
]


@analysis("energy", of=Scene, records=2)
def energy_balance(run: xr.Dataset, scene: Scene = OWN) -> xr.Dataset:
    """Energy of a run against the heat that friction takes and the work that noise does.

    Of the top dE = -c |V_Q|^2 dt, of the disk and the motor the paper's remarks, where the work is
    the Stratonovich integral along the run's own Brownian path.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate`, with every step recorded.
    scene : Scene, optional
        Its scene; by default the one that the attributes of the run tell.

    Returns
    -------
    xarray.Dataset
        `heat`, where there is noise what it did (`injected` in the mean, and `martingale`), and
        `residual`, what is left of the energy's change; in J, of the disk dimensionless.

    Raises
    ------
    ValueError
        The run has too few records, or not what the device needs; the message names it.
    """
    return scene.device.energy_balance(run, scene)
