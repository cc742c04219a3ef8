"""Observables: what is read off a run, and, from theory, the landscape in which it happens."""

from magmotor.observables.disk import flight_survival, local_slope
from magmotor.observables.disk_balance import disk_energy_balance
from magmotor.observables.exponential_law import exponential_test, squared_variation
from magmotor.observables.motion import (
    energy,
    energy_balance,
    friction_torque,
    kinetic_energy,
    magnetic_energy,
    magnetic_energy_and_lift,
    momentum_balance,
    momentum_map,
    slip_velocity,
)
from magmotor.observables.motor import azimuth, ring_attitude
from magmotor.observables.motor_balance import efficiency, motor_energy_balance
from magmotor.observables.motor_flights import censored_mean, flights, stays, transitions
from magmotor.observables.motor_modes import mode_temperatures
from magmotor.theory.landscape import (
    CriticalPoint,
    critical_points,
    effective_potential,
    minimum,
    saddle,
    valley_radius,
)
from magmotor.theory.motor import MotorWells, motor_wells

__all__ = [
    "CriticalPoint",
    "MotorWells",
    "azimuth",
    "censored_mean",
    "critical_points",
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
