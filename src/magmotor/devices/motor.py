"""What the front door knows of the fluctuation-driven motor."""

import numpy as np

from magmotor.checks import check_integer, reject
from magmotor.devices.column import Column
from magmotor.devices.linear_limits import check_bearing_limit, check_step_limit
from magmotor.devices.motor_guard import Guard as guard
from magmotor.devices.motor_initial import initial_state
from magmotor.engines.mujoco.methods import METHODS as MUJOCO
from magmotor.engines.mujoco.methods import PLANAR as MUJOCO_PLANAR
from magmotor.engines.variational import schemes
from magmotor.observables.motion import slip_velocity
from magmotor.observables.motor_energy import motor_energy
from magmotor.scenes import Motor
from magmotor.states.ball import axes
from magmotor.states.motor import MotorStates

__all__ = ["check_run", "columns", "guard", "initial_state", "methods"]

TIME_UNIT = "s"


def methods(scene: Motor) -> tuple[str, ...]:
    """Names of the methods that the scene takes."""
    if scene.surface == "plane":
        return MUJOCO
    noise = any(scene.noises)
    exact = () if noise else ("scipy/dop853",)
    return (*schemes.methods(schemes.RIGID, noise=noise), *MUJOCO_PLANAR, *exact)


def check_run(
    scene: Motor,
    method: str,
    timestep: float,
    replicas: int | None,
    allow_unstable: bool = False,
) -> None:
    """Check what depends on the scene; of the timestep nothing if it may be unstable.

    Raises
    ------
    ValueError
        Replicas of a motor without noise, or a timestep at which the method is unstable.
    """
    if replicas is not None:
        check_integer("replicas", replicas, at_least=1)
        if not any(scene.noises):
            raise reject("replicas", replicas, "None: without noise all would be the same")
    if allow_unstable or method == "scipy/dop853":
        return
    if scene.surface == "plane":
        check_bearing_limit(method, timestep)
    check_step_limit(scene, method, timestep)


def columns(scene: Motor, states: MotorStates, replicas: int | None) -> dict[str, Column]:
    """The variables of a run's dataset."""
    energy = motor_energy(scene, states)
    spin, ring_spin = states.angular_velocity, states.ring_angular_velocity
    slip = slip_velocity(scene, states.velocity, spin)
    axis = axes(states.orientation)
    momentum = scene.ball_inertia * np.sum(axis * spin, axis=-1)
    quaternion = "unit quaternion (w, x, y, z)"
    values = {
        "position": (states.position, "m", "position of the ball's centre"),
        "velocity": (states.velocity, "m/s", "velocity of the ball's centre"),
        "axis": (axis, "1", "axis xi_3 of the ball, the direction of its dipole"),
        "angular_velocity": (spin, "rad/s", "angular velocity of the ball in the world frame"),
        "slip_velocity": (slip, "m/s", "slip velocity V_Q of the contact point"),
        "momentum_map": (momentum, "kg m^2/s", "momentum map J = pi . xi_3 of the ball"),
        "orientation": (states.orientation, "1", f"orientation of the ball, {quaternion}"),
        "ring_axis": (axes(states.ring_orientation), "1", "axis zeta_3 of the inner ring"),
        "ring_angular_velocity": (ring_spin, "rad/s", "its angular velocity in the world frame"),
        "ring_orientation": (states.ring_orientation, "1", f"its orientation, {quaternion}"),
        "energy": (energy.total, "J", "total energy"),
        "ring_energy": (
            energy.ring,
            "J",
            "inner ring's kinetic energy and energy in the outer",
        ),
        "heat": (states.ball_heat + states.ring_heat, "J", "energy that friction has taken"),
        "work": (states.ball_work + states.ring_work, "J", "Stratonovich work of the noise"),
        "ring_heat": (states.ring_heat, "J", "energy that the inner ring's friction has taken"),
        "ring_work": (states.ring_work, "J", "Stratonovich work of the noise on the inner ring"),
    }
    return {name: _column(replicas, *value) for name, value in values.items()}


def _column(replicas: int | None, values, unit: str, label: str) -> Column:
    vector = {2: (), 3: ("space",), 4: ("component",)}
    inner = vector[2 if values.ndim == 2 else values.shape[-1]]
    if replicas is None:
        return Column(("time", *inner), values[:, 0], unit, label)
    return Column(("replica", "time", *inner), np.swapaxes(values, 0, 1), unit, label)
