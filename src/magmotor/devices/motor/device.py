"""What the front door knows of the fluctuation-driven motor."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import xarray as xr

from magmotor.common.checks import check_integer, reject
from magmotor.device.guard import ENERGY_GREW, LARGEST_ERROR, Fault, FirstFailure
from magmotor.device.initial import given_parts
from magmotor.device.job import METHODS as MUJOCO
from magmotor.device.job import PLANAR as MUJOCO_PLANAR
from magmotor.device.states import Column
from magmotor.devices.ball.states import axes
from magmotor.devices.disk.device import LARGEST_FLUCTUATION
from magmotor.devices.motor.energy import motor_energy
from magmotor.devices.motor.scene import LARGEST_TILT, Motor
from magmotor.devices.motor.states import MotorStates, start_motor
from magmotor.devices.top.device import lifted
from magmotor.devices.top.observables import slip_velocity
from magmotor.numerics import splittings as schemes
from magmotor.run.step_limits import check_bearing_limit, check_step_limit

ROUNDING = 1e-9
"""Of energies, over a long run."""

RING_LOST = "the inner ring is lost"
"""How the reason begins that a run ends for whose ring has tipped over."""


class Guard(FirstFailure):
    """Finds the first wrong row among recorded states of a scene.

    Parameters
    ----------
    scene : Motor
    first : MotorStates
        The initial state; it sets the energy that the motion may have.
    """

    def __init__(self, scene: Motor, first: MotorStates):
        self.scene = scene
        start = motor_energy(scene, first)
        self.start, self.ring = start.total[0], start.ring[0]
        warm = scene.temperature == "uniform"
        self.largest_fluctuation = LARGEST_FLUCTUATION * scene.kT if warm else 0.0
        # What heats the motion without cooling it; a warm one forgets what it was given.
        self.heated = any(scene.noises) and not warm

    def _faults(self, states: MotorStates) -> Iterator[Fault]:
        found = motor_energy(self.scene, states)
        work = states.ball_work + states.ring_work if self.heated else 0.0
        # A ring that only turns about its axis has energy that no method touches.
        ring = np.abs(found.ring - self.ring) + found.wobble
        in_play = np.abs(found.total - found.ring) + ring
        allowed = np.maximum(self.largest_fluctuation, LARGEST_ERROR * in_play)
        allowed += ROUNDING * np.abs(found.total)
        grew = np.any(found.total > self.start + work + allowed, axis=1)
        upright = axes(states.ring_orientation)[..., 2]
        lost = np.any(upright < math.cos(LARGEST_TILT), axis=1)
        yield grew & ~lost, lambda _: ENERGY_GREW
        # A ring that tips between two records may have driven a method beyond its limit meanwhile.
        yield lost, lambda row: _tipped(upright[row]) + (f"; {ENERGY_GREW}" if grew[row] else "")
        if self.scene.surface == "planar":
            weight = self.scene.ball_mass * self.scene.gravity
            lift = found.lift.max(axis=1)
            yield lift > weight, lambda row: lifted(lift[row], weight)


def _tipped(upright) -> str:
    tilt = math.degrees(math.acos(max(-1.0, upright.min())))
    limit = math.degrees(LARGEST_TILT)
    return f"{RING_LOST}: it is tilted by {tilt:.1f} degrees, beyond {limit:g}"


SIZES = {
    "position": 3,
    "velocity": 3,
    "axis": 3,
    "angular_velocity": 3,
    "orientation": 4,
    "ring_axis": 3,
    "ring_angular_velocity": 3,
    "ring_orientation": 4,
}


def initial_state(
    scene: Motor, initial: Mapping[str, Any] | xr.Dataset | None, replicas: int | None
) -> MotorStates:
    """The state that a run starts from, as one row of all replicas; see `simulate` for `initial`.

    Raises
    ------
    ValueError
        Names the part, its value and the bound.
    """
    state = start_motor(scene, replicas or 1)
    parts = given_parts(scene, SIZES, initial, replicas or 1)
    if "ring_axis" in parts and (parts["ring_axis"][:, 2] < np.cos(LARGEST_TILT)).any():
        bound = f"within {np.degrees(LARGEST_TILT):g} degrees of the vertical"
        raise reject("initial['ring_axis']", parts["ring_axis"].tolist(), bound)
    kept = {name: part[np.newaxis] for name, part in parts.items() if name in state._fields}
    return state._replace(**kept)


guard = Guard

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
