"""Observables: what is read off a run, and, from theory, the landscape in which it happens."""

from magmotor.devices.ball.landscape import (
    CriticalPoint,
    critical_points,
    effective_potential,
    minimum,
    saddle,
    valley_radius,
)
from magmotor.devices.ball.slip import slip_velocity
from magmotor.devices.disk.energy_balance import disk_energy_balance
from magmotor.devices.disk.observables import d_diffusion, flight_survival, local_slope
from magmotor.devices.motor.energy import efficiency, motor_energy_balance
from magmotor.devices.motor.exponential_law import exponential_test, squared_variation
from magmotor.devices.motor.flights import censored_mean, flights, stays, transitions
from magmotor.devices.motor.modes import mode_temperatures
from magmotor.devices.motor.observables import azimuth, ring_attitude
from magmotor.devices.motor.theory import MotorWells, motor_wells
from magmotor.devices.top.observables import (
    energy,
    energy_balance,
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
    "disk_energy_balance",
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
    "motor_energy_balance",
    "motor_wells",
    "ring_attitude",
    "saddle",
    "slip_velocity",
    "squared_variation",
    "stays",
    "transitions",
    "valley_radius",
]
