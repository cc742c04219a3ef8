"""Observables of the devices: quantities computed from runs, and the potential landscape."""

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
    "transitions",
    "valley_radius",
]


@analysis("energy", of=Scene, records=2)
def energy_balance(run: xr.Dataset, scene: Scene = OWN) -> xr.Dataset:
    """Compare the energy of a run with the heat of friction and the work of the noise.

    For the top, dE = -c |V_Q|^2 dt. For the disk and the motor the balance follows the paper's
    remarks; the work is the Stratonovich integral along the Brownian path of the run. `simulate`
    checks the residual only for the motor, whose records hold heat and work; those of the others do
    not, and say nothing of steps that are not recorded.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate`; for the top and the disk with every step recorded.
    scene : Scene, optional
        The scene of the run; by default the one in its attributes.

    Returns
    -------
    xarray.Dataset
        `heat`; with noise, its work as `injected`, the mean, and `martingale`, the rest; and
        `residual`, the change of energy that these do not explain. In J; dimensionless for the
        disk.

    Raises
    ------
    ValueError
        The run has too few records or lacks a variable; the message names it.
    """
    return scene.device.energy_balance(run, scene)
