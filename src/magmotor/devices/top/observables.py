"""Observables of the top: momentum map, energy, and their balances."""

from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.spatial.transform import Rotation

from magmotor import dipoles
from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import Vectors
from magmotor.device.analysis import OWN, analysis, checked_run
from magmotor.device.observable import Observable, labeled
from magmotor.devices.ball.scene import gravitational_energy
from magmotor.devices.top import unbalanced
from magmotor.devices.top.scene import Top
from magmotor.devices.top.states import BallStates, states_of

MOMENTUM_MAP = Observable(lambda run, scene: run.momentum_map, "kg m^2/s", "momentum map J")
SPIN = Observable(
    lambda run, scene: (
        (run.angular_velocity * run.axis).sum("space")
        if scene.is_unbalanced
        else run.momentum_map / scene.inertia[2]
    ),
    "rad/s",
    "spin",
)
DISTANCE = Observable(
    lambda run, scene: np.hypot(run.position.sel(space="x"), run.position.sel(space="y")),
    "m",
    "distance of the ball from the center",
)
SPEED = Observable(
    lambda run, scene: np.sqrt((run.velocity**2).sum("space")), "m/s", "speed of the ball"
)


class BallEnergy(NamedTuple):
    """Energies in J and the lift in N, each of shape (T,)."""

    total: Array
    """Includes gravity, which is zero when the ball is on a level plane."""
    kinetic: Array
    magnetic: Array
    lift: Array
    """Vertical magnetic force on the ball."""


@checked
def momentum_map(scene: Top, axis: Vectors, angular_velocity: Vectors) -> Array:
    """Compute J = pi . xi_3 = I_3 omega . xi_3 in kg m^2/s; shapes (..., 3) -> (...).

    Raises
    ------
    ValueError
        The ball is not balanced, so that J also depends on its velocity and orientation.
    """
    if scene.is_unbalanced:
        sentence = "must be a balanced ball; simulate records the momentum map of another one"
        raise ArgumentError("scene", scene, sentence)
    return scene.inertia[2] * np.sum(axis * angular_velocity, axis=-1)


def conserved_momentum(scene: Top, states: BallStates) -> Array:
    """Compute J, shape (T,), which is conserved without friction if the ball is balanced."""
    if scene.is_unbalanced:
        return unbalanced.momentum_along_axis(scene, states)
    return momentum_map(scene, states.axis, states.angular_velocity)


@checked
def friction_torque(scene: Top, axis: Vectors, slip: Vectors) -> Array:
    """Compute the friction torque c r xi_3 . (e_z x V_Q) in N m; shapes (..., 3) -> (...).

    It equals dJ/dt by the paper's equation (magtopnc), since magnetism exerts no torque about xi_3.
    """
    turned = slip[..., 0] * axis[..., 1] - slip[..., 1] * axis[..., 0]
    return scene.friction * scene.ball_radius * turned


@checked
def magnetic_energy(scene: Top, states: BallStates) -> Array:
    """Compute the energy -m . B of the ball in the field of the ring, in J, shape (T,)."""
    return ball_energy(scene, states).magnetic


@checked
def magnetic_energy_and_lift(scene: Top, states: BallStates) -> tuple[Array, Array]:
    """Compute the energy -m . B of the ball in J and the vertical magnetic force on it in N."""
    found = ball_energy(scene, states)
    return found.magnetic, found.lift


@checked
def kinetic_energy(scene: Top, states: BallStates) -> Array:
    """Compute the energy of translation and rotation in J, shape (T,)."""
    return ball_energy(scene, states).kinetic


@checked
def energy(scene: Top, states: BallStates) -> Array:
    """Compute the total energy in J, shape (T,); that of gravity is zero on a level plane."""
    return ball_energy(scene, states).total


def ball_energy(scene: Top, states: BallStates) -> BallEnergy:
    """Compute energies and lift with one evaluation of the field, without checks."""
    magnetic, force, _ = magnetic_forces(scene, states)
    lift = force[:, 2]
    raised = gravitational_energy(scene, states.position)
    if scene.is_unbalanced:
        kinetic = unbalanced.kinetic_energy(scene, states)
        raised += unbalanced.raised_energy(scene, states)
        return BallEnergy(kinetic + magnetic + raised, kinetic, magnetic, lift)
    across, _, axial = scene.inertia
    spin = states.angular_velocity
    about = np.sum(spin * states.axis, axis=-1)
    turning = across * np.sum(spin**2, axis=-1) + (axial - across) * about**2
    kinetic = 0.5 * (scene.ball_mass * np.sum(states.velocity**2, axis=-1) + turning)
    return BallEnergy(kinetic + magnetic + raised, kinetic, magnetic, lift)


def magnetic_forces(scene: Top, states: BallStates) -> tuple[Array, Array, Array]:
    """Compute the magnetic energy in J (T,), the force in N and the torque in N m, (T, 3) each."""
    position, axis, sources = states.position, states.axis, scene.ring_sources()
    rotation = None
    if scene.ring_script:  # the dipoles are at rest in the frame of the ring
        center, rotation = _ring_frame(scene, states.time)
        position = rotation.apply(position - center, inverse=True)
        axis = rotation.apply(axis, inverse=True)
        dipole_positions, outward = scene.ring_dipole_frame()
        sources = dipole_positions, scene.moment * outward
    force, field = dipoles.force_and_field(position, scene.moment * axis, *sources)
    energy = np.sum(axis * field, axis=-1) + np.sum(states.axis * scene.background_field, axis=-1)
    if rotation is not None:
        force, field = rotation.apply(force), rotation.apply(field)
    torque = scene.moment * np.cross(states.axis, field + scene.background_field)
    return -scene.moment * energy, force, torque


@analysis(
    *("axis", "slip_velocity", "angular_velocity", "momentum_map"),
    of=Top, records=2, replicas=False,
)  # fmt: skip
def momentum_balance(run: xr.Dataset, scene: Top = OWN) -> xr.Dataset:
    """Compare J with the integral of the friction torque.

    The torque is that of drag and of the viscous friction of slip and torsion, which always act; if
    the ball is not balanced, also that of the weight and of inertia. Dry friction and a ball that
    leaves the plane therefore contribute to the residual.

    Parameters
    ----------
    run : xarray.Dataset
        A run recorded finely enough for quintic splines, at best at every step.
    scene : Top, optional
        The scene of the run; by default the one in its attributes.

    Returns
    -------
    xarray.Dataset
        `torque` (N m), `integral` = J(0) + int torque dt and `residual` = J - integral (kg m^2/s).
    """
    torque = friction_torque(scene, run.axis.values, run.slip_velocity.values)
    axis, spin = run.axis.values, run.angular_velocity.values
    torque -= scene.torsional_damping * spin[:, 2] * axis[:, 2]
    torque -= scene.rotational_drag * np.sum(spin * axis, axis=-1)
    if scene.is_unbalanced:
        needs = "position", "velocity", "orientation"
        run = checked_run("run", run, needs, (Top,), replicas=False)
        torque += unbalanced.unbalanced_torque(scene, states_of(run))
    integral = run.momentum_map.values[0] + _integrate(run.time.values, torque)
    residual = run.momentum_map.values - integral
    columns = {"torque": torque, "integral": integral, "residual": residual}
    data = {k: ("time", v) for k, v in columns.items()}
    labels = {
        "torque": ("N m", "torque about the axis, which changes J"),
        "integral": (MOMENTUM_MAP.unit, "J(0) plus the integral of the torque"),
        "residual": (MOMENTUM_MAP.unit, "residual of the momentum balance"),
    }
    return labeled(xr.Dataset(data, coords={"time": run.time}), labels)


@analysis(
    *("velocity", "slip_velocity", "angular_velocity", "energy"), of=Top, records=2, replicas=False
)
def top_energy_balance(run: xr.Dataset, scene: Top = OWN) -> xr.Dataset:
    """Compare the energy with the heat; dE/dt is minus the power lost if the ring is at rest.

    Parameters
    ----------
    run : xarray.Dataset
        A run recorded finely enough for quintic splines, at best at every step.
    scene : Top, optional
        The scene of the run; by default the one in its attributes.

    Returns
    -------
    xarray.Dataset
        `heat` = int (c |V_Q|^2 + k omega_z^2 + drag) dt and `residual` = E - E(0) + heat, in J.
    """
    power = scene.friction * np.sum(run.slip_velocity.values**2, axis=-1)
    power += scene.torsional_damping * run.angular_velocity.values[:, 2] ** 2
    power += scene.drag * np.sum(run.velocity.values**2, axis=-1)
    power += scene.rotational_drag * np.sum(run.angular_velocity.values**2, axis=-1)
    heat = _integrate(run.time.values, power)
    residual = run.energy.values - run.energy.values[0] + heat
    data = {"heat": ("time", heat), "residual": ("time", residual)}
    labels = {
        "heat": ("J", "heat dissipated by friction"),
        "residual": ("J", "residual of the energy balance"),
    }
    return labeled(xr.Dataset(data, coords={"time": run.time}), labels)


def _integrate(time: Array, values: Array) -> Array:
    """Integrate by quintic splines, so that the quadrature error is negligible."""
    from scipy.interpolate import make_interp_spline

    degree = min(5, len(time) - 1)
    spline = make_interp_spline(time, values, k=degree).antiderivative()
    return spline(time) - spline(time[0])


def _ring_frame(scene: Top, times: Array) -> tuple[Array, Rotation]:
    """Return the center of the ring at each time and the rotation from its frame to the world."""
    center = np.array([[0.0, 0.0, scene.ring_pose(time)[0]] for time in times])
    quaternions = [scene.ring_orientation(time) for time in times]
    return center, Rotation.from_quat(quaternions, scalar_first=True)
