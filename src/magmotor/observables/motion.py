"""Observables of the ball's motion: slip velocity, momentum map, energy, and their balances."""

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from magmotor import dipoles
from magmotor.engines.state import States
from magmotor.scenes import Top

Array = NDArray[np.float64]


def slip_velocity(scene: Top, velocity: Array, angular_velocity: Array) -> Array:
    """Slip velocity V_Q = v + omega x q of the contact point, q = -r e_z; equation (slip).

    Parameters
    ----------
    velocity, angular_velocity : ndarray, shape (..., 3)
        In m/s and rad/s, in the world frame.

    Returns
    -------
    ndarray, shape (..., 3)
        In m/s.
    """
    return velocity + np.cross(angular_velocity, [0.0, 0.0, -scene.ball_radius])


def momentum_map(scene: Top, axis: Array, angular_velocity: Array) -> Array:
    """Momentum map J = pi . xi_3 = I_3 omega . xi_3, in kg m^2/s; shapes (..., 3) -> (...)."""
    return scene.inertia[2] * np.sum(axis * angular_velocity, axis=-1)


def friction_torque(scene: Top, axis: Array, slip: Array) -> Array:
    """Torque c r xi_3 . (e_z x V_Q) of friction about the axis, in N m; shapes (..., 3) -> (...).

    The paper's equation (magtopnc) gives dJ/dt = this, since magnetism has no torque about xi_3.
    """
    turned = slip[..., 0] * axis[..., 1] - slip[..., 1] * axis[..., 0]
    return scene.friction * scene.ball_radius * turned


def magnetic_energy(scene: Top, states: States) -> Array:
    """Energy -m . B of the ball in the ring's field, in J, shape (T,)."""
    moment = scene.moment * states.axis
    return _along_ring(scene, states, dipoles.energy, moment, np.empty(len(states.time)))


def magnetic_lift(scene: Top, states: States) -> Array:
    """Vertical component of the magnetic force on the ball, in N, shape (T,)."""

    def vertical(position, moment, positions, moments):
        return dipoles.wrench(position, moment, positions, moments)[0][..., 2]

    moment = scene.moment * states.axis
    return _along_ring(scene, states, vertical, moment, np.empty(len(states.time)))


def kinetic_energy(scene: Top, states: States) -> Array:
    """Energy of translation and rotation, in J, shape (T,)."""
    across, _, axial = scene.inertia
    spin = states.angular_velocity
    about = np.sum(spin * states.axis, axis=-1)
    turning = across * np.sum(spin**2, axis=-1) + (axial - across) * about**2
    return 0.5 * (scene.ball_mass * np.sum(states.velocity**2, axis=-1) + turning)


def energy(scene: Top, states: States) -> Array:
    """Total energy in J, shape (T,); gravity counts from the ball's height on the plane."""
    height = states.position[:, 2] - scene.ball_radius
    weight = scene.ball_mass * scene.gravity
    return kinetic_energy(scene, states) + magnetic_energy(scene, states) + weight * height


def momentum_balance(run: xr.Dataset, scene: Top) -> xr.Dataset:
    """Theory's account of J: the integral of friction's torque, and what it leaves unexplained.

    Parameters
    ----------
    run : xarray.Dataset
        With every step recorded, or steps close enough for quintic splines.
    scene : Top
        Its scene.

    Returns
    -------
    xarray.Dataset
        `torque` (N m), `integral` = J(0) + int torque dt and `residual` = J - integral (kg m^2/s).
    """
    torque = friction_torque(scene, run.axis.values, run.slip_velocity.values)
    integral = run.momentum_map.values[0] + _integrate(run.time.values, torque)
    residual = run.momentum_map.values - integral
    columns = {"torque": torque, "integral": integral, "residual": residual}
    return xr.Dataset({k: ("time", v) for k, v in columns.items()}, coords={"time": run.time})


def energy_balance(run: xr.Dataset, scene: Top) -> xr.Dataset:
    """Theory's account of the energy with a ring at rest: dE/dt = -c |V_Q|^2.

    Returns
    -------
    xarray.Dataset
        `heat` = int c |V_Q|^2 dt and `residual` = E - E(0) + heat, in J.
    """
    power = scene.friction * np.sum(run.slip_velocity.values**2, axis=-1)
    heat = _integrate(run.time.values, power)
    residual = run.energy.values - run.energy.values[0] + heat
    columns = {"heat": heat, "residual": residual}
    return xr.Dataset({k: ("time", v) for k, v in columns.items()}, coords={"time": run.time})


def _integrate(time: Array, values: Array) -> Array:
    """Running integral by splines of sixth order, so that quadrature is no part of the error."""
    degree = min(5, len(time) - 1)
    spline = make_interp_spline(time, values, k=degree).antiderivative()
    return spline(time) - spline(time[0])


def _along_ring(scene: Top, states: States, function, moment: Array, out: Array) -> Array:
    if not scene.ring_script:
        return function(states.position, moment, *scene.ring_sources())
    for i, time in enumerate(states.time):
        out[i] = function(states.position[i], moment[i], *scene.ring_sources(time))
    return out
