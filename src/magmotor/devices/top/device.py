"""The device of Hamel's top."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import xarray as xr

from magmotor.common.checks import check_integer, check_number
from magmotor.common.exceptions import ArgumentError
from magmotor.device.device import register
from magmotor.device.engine import Engine, Equation, MujocoAdapter
from magmotor.device.job import METHODS as MUJOCO
from magmotor.device.job import PLANAR as MUJOCO_PLANAR
from magmotor.device.job import Job
from magmotor.device.sliders import Slider, positive
from magmotor.device.states import Column
from magmotor.device.step_limits import check_step_limit, small_motion
from magmotor.devices.ball.device import BallDevice
from magmotor.devices.ball.resting import resting_ball, split_by
from magmotor.devices.ball.slip import slip_velocity
from magmotor.devices.ball.states import given_parts
from magmotor.devices.top import theory
from magmotor.devices.top.guard import TopGuard
from magmotor.devices.top.measures import MEASURES
from magmotor.devices.top.movie import GAUGE, TopMovieContent
from magmotor.devices.top.observables import (
    MOMENTUM_MAP,
    conserved_momentum,
    energy,
    top_energy_balance,
)
from magmotor.devices.top.plots import top_overview
from magmotor.devices.top.scene import Top
from magmotor.devices.top.states import BallStates, start
from magmotor.numerics import splittings
from magmotor.numerics.linear_stability import SmallMotion

SIZES = {"position": 3, "velocity": 3, "axis": 3, "angular_velocity": 3, "orientation": 4}


class TopDevice(BallDevice[Top, BallStates]):
    """See `magmotor.device.device.Device`."""

    is_random = False
    measures = MEASURES
    movie_content = TopMovieContent
    gauge = GAUGE

    def methods(self, scene: Top) -> tuple[str, ...]:
        """Return the names of the methods that can simulate the scene."""
        if scene.surface == "plane":
            return MUJOCO
        if scene.ring_script or scene.inertia[0] != scene.inertia[2] or scene.is_unbalanced:
            return (*MUJOCO, "scipy/dop853")
        if scene.torsional_damping:
            return (*splittings.methods(splittings.RIGID, noise=False), *MUJOCO, "scipy/dop853")
        return (*splittings.methods(splittings.RIGID, noise=False), *MUJOCO_PLANAR, "scipy/dop853")

    def check_method(self, scene: Top, method: str) -> None:
        """Check that a method can integrate the scene, and say why not if the ball is to blame.

        Raises
        ------
        ValueError
            It cannot; the message names the methods that can.
        """
        if scene.is_unbalanced:
            field = "center_of_mass" if any(scene.center_of_mass) else "products_of_inertia"
            self.check_field(scene, method, field, scene.balanced())
        super().check_method(scene, method)

    def check_run(
        self,
        scene: Top,
        method: str,
        timestep: float,
        replicas: int | None,
        allow_unstable: bool = False,
    ) -> None:
        """Check replicas and, unless `allow_unstable`, the timestep.

        Raises
        ------
        ValueError
            Replicas are given, the timestep makes dry friction, contact or method unstable, or the
            floor is so steep that the ball finds no rest.
        """
        if replicas is not None:
            check_integer("replicas", replicas, at_least=1)
            raise ArgumentError(
                "replicas", replicas, "must be None: without noise all replicas are the same"
            )
        if allow_unstable:
            return
        if method in MUJOCO and any(scene.dry_friction):
            from magmotor.devices.ball.contacts import DRY_FRICTION_RATE

            check_number(
                "timestep", timestep, below=1 / DRY_FRICTION_RATE, unit="s with dry friction"
            )
        self.check_contact(scene, method, timestep)
        if method != "scipy/dop853":
            check_step_limit(scene, method, timestep)
        elif any(scene.floor_tilt):
            resting_ball(self.poses(scene)[0])

    def initial_state(
        self, scene: Top, initial: Mapping[str, Any] | xr.Dataset | None, replicas: int | None
    ) -> BallStates:
        """Return the initial state as one row; see `simulate` for `initial`.

        Raises
        ------
        ValueError
            The message names the part, its value and the bound.
        """
        return start(scene)._replace(**given_parts(scene, SIZES, initial, 1))

    def followed(self, scene: Top, first: BallStates, method: str) -> BallStates:
        """Return the initial state, for SciPy without an orientation that it does not follow."""
        if method.startswith("scipy") and not scene.is_unbalanced:
            return first._replace(orientation=None)
        return first

    def guard(self, scene: Top, first: BallStates) -> TopGuard:
        """Return a `TopGuard`."""
        return TopGuard(scene, first)

    def columns(self, scene: Top, states: BallStates, replicas: int | None) -> dict[str, Column]:
        """Return the variables of a run's dataset."""
        spin = states.angular_velocity
        values = {
            "position": (states.position, "m", "position of the ball's center"),
            "velocity": (states.velocity, "m/s", "velocity of the ball's center"),
            "axis": (states.axis, "1", "axis xi_3 of the ball, the direction of its dipole"),
            "angular_velocity": (spin, "rad/s", "angular velocity in the world frame"),
            "slip_velocity": (
                slip_velocity(scene, states.velocity, spin),
                "m/s",
                "slip velocity V_Q of the contact point",
            ),
            "momentum_map": (
                conserved_momentum(scene, states),
                MOMENTUM_MAP.unit,
                f"{MOMENTUM_MAP.label} = pi . xi_3",
            ),
            "energy": (energy(scene, states), "J", "total energy"),
        }
        found = {k: Column(("time", "space")[: v[0].ndim], *v) for k, v in values.items()}
        if states.orientation is not None:
            label = "orientation of the ball, unit quaternion (w, x, y, z)"
            found["orientation"] = Column(("time", "component"), states.orientation, "1", label)
        return found

    def energy_balance(self, run: xr.Dataset, scene: Top) -> xr.Dataset:
        """Compare the energy of a run with the heat."""
        return top_energy_balance(run, scene)

    def overview(self, run: xr.Dataset, scene: Top, path: str | Path, dpi: int) -> None:
        """Draw the path over V_e, and J and energy compared with theory."""
        top_overview(run, scene, path, dpi)

    @property
    def variational(self) -> Engine:
        """The variational integrators."""
        from magmotor.devices.top import variational

        return variational

    @property
    def ode(self) -> Equation:
        """The paper's ODE."""
        from magmotor.devices.top import ode

        return ode

    def compose(self, scene: Top, *, visual: bool) -> Any:
        """Compose the top as a PyMJCF tree."""
        from magmotor.devices.top.mjcf import compose_top

        return compose_top(scene, visual=visual)

    def mujoco(self, job: Job) -> MujocoAdapter:
        """Return the adapter for ball and scripted ring."""
        from magmotor.devices.top.mjcf import BallAdapter

        return BallAdapter(job)

    def poses(self, scene: Top) -> list[Top]:
        """Return the scene with its ring at rest, once for each waypoint if it has a script."""
        return theory.poses(scene)

    def small_motion(self, scene: Top) -> SmallMotion:
        """Linearize about rest in the deepest minimum of V_e, with the axis along the field."""
        return theory.small_motion(scene)

    @property
    def charted(self) -> Top:
        """The paper's fourth case."""
        return Top.paper(4)

    def check_charted(self, scene: Top) -> None:
        """Check that there is no dry friction, with which errors do not follow the timestep.

        Raises
        ------
        ValueError
            There is dry friction.
        """
        if any(scene.dry_friction):
            sentence = (
                "the charts have no dry friction, with which the error depends on the coefficient"
                " more than on the timestep: pass a method and a timestep to simulate"
            )
            raise ArgumentError("coulomb_friction", scene.coulomb_friction, sentence)

    def rates(self, scene: Top) -> tuple[float, ...]:
        """Return the rates of the spinning ball's fastest swing and of friction."""
        across, _, axial = scene.inertia
        motions = [small_motion(pose) for pose in self.poses(scene)]
        swing = max(motion.frequency for motion in motions)
        spinning = split_by(scene.spin * axial / across, swing)
        return spinning, float(motions[0].decay.max())

    def quantities(self, scene: Top) -> tuple[str, ...]:
        """The momentum map."""
        return ("momentum_map",)

    def has_script(self, scene: Top) -> bool:
        """Whether the ring moves."""
        return bool(scene.ring_script)

    def place(self, scene: Top, data: Any, time: float) -> None:
        """Set the pose of the ring at a time (s)."""
        from magmotor.devices.top.mjcf import placed_ring

        data.mocap_pos[0], data.mocap_quat[0] = placed_ring(scene, time)

    def sliders(self, scene: Top) -> dict[str, Slider]:
        """Return sliders for friction and, without a script, for tilt and height of the ring."""
        friction = {"friction": positive(scene.friction, Top().friction, "kg/s")}
        if scene.ring_script:
            return friction
        ring = {
            "tilt": Slider(scene.tilt, 0.0, max(0.4, scene.tilt), "rad"),
            "height": Slider(
                scene.ring_height, 0.5 * scene.ring_height, 2 * scene.ring_height, "m"
            ),
        }
        return ring | friction

    def scene_at(self, scene: Top, values: Mapping[str, float]) -> Top:
        """Return the scene with its sliders at these values."""
        fields = {"ring_height" if name == "height" else name: x for name, x in values.items()}
        return scene.replace(**fields)


TOP = TopDevice()
register(TOP, Top)
