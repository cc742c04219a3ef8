"""The device of the fluctuation-driven motor."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from magmotor.common.checks import check_integer
from magmotor.common.exceptions import ArgumentError
from magmotor.device.analysis import checked_run
from magmotor.device.device import register
from magmotor.device.engine import Engine, Equation, MujocoAdapter
from magmotor.device.job import METHODS as MUJOCO
from magmotor.device.job import PLANAR as MUJOCO_PLANAR
from magmotor.device.job import Job
from magmotor.device.sliders import Slider, noise_at, positive
from magmotor.device.states import Column
from magmotor.device.step_limits import check_step_limit, small_motion
from magmotor.devices.ball.device import BallDevice
from magmotor.devices.ball.resting import resting_ball, split_by
from magmotor.devices.ball.slip import slip_velocity
from magmotor.devices.ball.states import axes, given_parts
from magmotor.devices.motor import theory
from magmotor.devices.motor.energy import check_first_law, motor_energy, motor_energy_balance
from magmotor.devices.motor.guard import MotorGuard
from magmotor.devices.motor.measures import MEASURES
from magmotor.devices.motor.movie import GAUGE, MotorMovieContent
from magmotor.devices.motor.parameters import LARGEST_TILT
from magmotor.devices.motor.plot_panels import MotorRun
from magmotor.devices.motor.plots import motor_overview
from magmotor.devices.motor.scene import Motor
from magmotor.devices.motor.states import MotorStates, start_motor
from magmotor.numerics import splittings
from magmotor.numerics.linear_stability import SmallMotion

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


class MotorDevice(BallDevice[Motor, MotorStates]):
    """See `magmotor.device.device.Device`."""

    measures = MEASURES
    movie_content = MotorMovieContent
    gauge = GAUGE

    def methods(self, scene: Motor) -> tuple[str, ...]:
        """Return the names of the methods that can simulate the scene."""
        if scene.surface == "plane":
            return MUJOCO
        noise = scene.is_noisy
        exact = () if noise else ("scipy/dop853",)
        mujoco = () if scene.load_torque else MUJOCO_PLANAR
        return (*splittings.methods(splittings.RIGID, noise=noise), *mujoco, *exact)

    def check_method(self, scene: Motor, method: str) -> None:
        """Check that a method can integrate the scene, and say why not if the load is to blame.

        Raises
        ------
        ValueError
            It cannot; the message names the methods that can.
        """
        self.check_field(scene, method, "load_torque", scene.replace(load_torque=0.0))
        super().check_method(scene, method)

    def check_run(
        self,
        scene: Motor,
        method: str,
        timestep: float,
        replicas: int | None,
        allow_unstable: bool = False,
    ) -> None:
        """Check replicas and, unless `allow_unstable`, the timestep.

        Raises
        ------
        ValueError
            Replicas are given for a motor without noise, the method is unstable, or the floor is
            too steep for the ball to rest.
        """
        if replicas is not None:
            check_integer("replicas", replicas, at_least=1)
            if not scene.is_noisy:
                raise ArgumentError(
                    "replicas", replicas, "must be None: without noise all replicas are the same"
                )
        if allow_unstable:
            return
        if method == "scipy/dop853":
            if any(scene.floor_tilt):
                resting_ball(scene)
            return
        self.check_contact(scene, method, timestep)
        check_step_limit(scene, method, timestep)

    def initial_state(
        self, scene: Motor, initial: Mapping[str, Any] | xr.Dataset | None, replicas: int | None
    ) -> MotorStates:
        """Return the initial state of all replicas as one row; see `simulate` for `initial`.

        Raises
        ------
        ValueError
            The message names the part, its value and the bound.
        """
        state = start_motor(scene, replicas or 1)
        parts = given_parts(scene, SIZES, initial, replicas or 1)
        if "ring_axis" in parts and (parts["ring_axis"][:, 2] < np.cos(LARGEST_TILT)).any():
            sentence = f"must be within {np.degrees(LARGEST_TILT):g} degrees of the vertical"
            raise ArgumentError("initial['ring_axis']", parts["ring_axis"].tolist(), sentence)
        columns = {name: p[np.newaxis] for name, p in parts.items() if name in state._fields}
        return state._replace(**columns)

    def guard(self, scene: Motor, first: MotorStates) -> MotorGuard:
        """Return a `MotorGuard`."""
        return MotorGuard(scene, first)

    def columns(self, scene: Motor, states: MotorStates, replicas: int | None) -> dict[str, Column]:
        """Return the variables of a run's dataset."""
        energy = motor_energy(scene, states)
        spin, ring_spin = states.angular_velocity, states.ring_angular_velocity
        slip = slip_velocity(scene, states.velocity, spin)
        axis = axes(states.orientation)
        momentum = scene.ball_inertia * np.sum(axis * spin, axis=-1)
        quaternion = "unit quaternion (w, x, y, z)"
        values = {
            "position": (states.position, "m", "position of the ball's center"),
            "velocity": (states.velocity, "m/s", "velocity of the ball's center"),
            "axis": (axis, "1", "axis xi_3 of the ball, the direction of its dipole"),
            "angular_velocity": (spin, "rad/s", "angular velocity of the ball in the world frame"),
            "slip_velocity": (slip, "m/s", "slip velocity V_Q of the contact point"),
            "momentum_map": (momentum, "kg m^2/s", "momentum map J = pi . xi_3 of the ball"),
            "orientation": (states.orientation, "1", f"orientation of the ball, {quaternion}"),
            "ring_axis": (axes(states.ring_orientation), "1", "axis zeta_3 of the inner ring"),
            "ring_angular_velocity": (
                ring_spin,
                "rad/s",
                "its angular velocity in the world frame",
            ),
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
            "ring_work": (
                states.ring_work,
                "J",
                "Stratonovich work of the noise on the inner ring",
            ),
        }
        return {name: _column(replicas, *value) for name, value in values.items()}

    def check_result(self, scene: Motor, run: xr.Dataset) -> None:
        """Warn if the method has created or destroyed energy; see `check_first_law`."""
        check_first_law(run, scene)

    def uncharted(self, scene: Motor) -> str:
        """Return the heat between two temperatures, which the charted motor does not have."""
        return "the heat that flows between its temperatures" if scene.has_two_temperatures else ""

    def energy_balance(self, run: xr.Dataset, scene: Motor) -> xr.Dataset:
        """Compare the energy of a run with heat and work."""
        return motor_energy_balance(run, scene)

    def overview(self, run: xr.Dataset, scene: Motor, path: str | Path, dpi: int) -> None:
        """Draw flights, the beginning of the longest one, path, energy and temperatures."""
        run = checked_run("run", run, (), (Motor,), replicas=False)
        motor_overview(MotorRun("motor", run), path, dpi=dpi)

    @property
    def variational(self) -> Engine:
        """The variational integrators."""
        from magmotor.devices.motor import variational

        return variational

    @property
    def ode(self) -> Equation:
        """The differential equation without noise."""
        from magmotor.devices.motor import ode

        return ode

    def compose(self, scene: Motor, *, visual: bool) -> Any:
        """Compose the motor as a PyMJCF tree."""
        from magmotor.devices.motor.mjcf import compose_motor

        return compose_motor(scene, visual=visual)

    def mujoco(self, job: Job) -> MujocoAdapter:
        """Return the adapter for runs in MuJoCo."""
        from magmotor.devices.motor.mjcf import MotorAdapter

        return MotorAdapter(job)

    def small_motion(self, scene: Motor) -> SmallMotion:
        """Linearize about rest with the ball under the first outer dipole and the ring level."""
        return theory.small_motion(scene)

    @property
    def charted(self) -> Motor:
        """The paper's motor at uniform temperature."""
        return Motor()

    def rates(self, scene: Motor) -> tuple[float, ...]:
        """Return the rates of the spinning ball's swing and of friction."""
        motion = small_motion(scene)
        return split_by(scene.spin, motion.frequency), float(motion.decay.max())

    def quantities(self, scene: Motor) -> tuple[str, ...]:
        """Return temperature for a motor with noise, otherwise position and path."""
        return ("temperature",) if scene.is_noisy else ("position", "path")

    def sliders(self, scene: Motor) -> dict[str, Slider]:
        """Return sliders for friction, and for the temperature or, if nonuniform, the noise."""
        default = Motor(temperature=scene.temperature)
        units = {"friction_ball": "kg/s", "friction_ring": "kg m^2/s"}
        if scene.temperature != "uniform":
            units = {"friction_ball": "kg/s", "alpha_ring": "N m sqrt(s)"}
        found = {
            name: positive(getattr(scene, name), getattr(default, name), unit)
            for name, unit in units.items()
        }
        if scene.temperature == "uniform":
            found["temperature"] = positive(1 / scene.beta, 1 / default.beta, "J")
        return found

    def scene_at(self, scene: Motor, values: Mapping[str, float]) -> Motor:
        """Return the scene with its sliders at these values."""
        fields = dict(values)
        if scene.temperature == "uniform":
            kT = fields.pop("temperature")
            for body in ("ball", "ring"):
                fields[f"alpha_{body}"] = noise_at(fields[f"friction_{body}"], kT)
        return scene.replace(**fields)


MOTOR = MotorDevice()
register(MOTOR, Motor)


def _column(replicas: int | None, values, unit: str, label: str) -> Column:
    vector = {2: (), 3: ("space",), 4: ("component",)}
    inner = vector[2 if values.ndim == 2 else values.shape[-1]]
    if replicas is None:
        return Column(("time", *inner), values[:, 0], unit, label)
    return Column(("replica", "time", *inner), np.swapaxes(values, 0, 1), unit, label)
