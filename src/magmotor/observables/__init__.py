"""Observables: what is read off a run (`motion`, `disk`) and off the ring's field (`landscape`)."""

from magmotor.observables.disk import flight_survival, local_slope
from magmotor.observables.disk_balance import disk_energy_balance
from magmotor.observables.landscape import (
    CriticalPoint,
    critical_points,
    effective_potential,
    minimum,
    saddle,
    valley_radius,
)
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

__all__ = [
    "CriticalPoint",
    "critical_points",
    "disk_energy_balance",
    "effective_potential",
    "energy",
    "energy_balance",
    "flight_survival",
    "friction_torque",
    "kinetic_energy",
    "local_slope",
    "magnetic_energy",
    "magnetic_energy_and_lift",
    "minimum",
    "momentum_balance",
    "momentum_map",
    "saddle",
    "slip_velocity",
    "valley_radius",
]
