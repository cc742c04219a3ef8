"""What the front door knows of the ball under its ring."""

from collections.abc import Iterator, Mapping
from typing import Any

import xarray as xr
from numpy.typing import NDArray

from magmotor.common.checks import check_integer, check_number, reject
from magmotor.device.guard import ENERGY_GREW, LARGEST_ERROR, Fault, FirstFailure
from magmotor.device.initial import given_parts
from magmotor.device.job import METHODS as MUJOCO
from magmotor.device.job import PLANAR as MUJOCO_PLANAR
from magmotor.device.states import Column
from magmotor.devices.ball.states import BallStates, start
from magmotor.devices.top.observables import (
    BallEnergy,
    ball_energy,
    energy,
    momentum_map,
    slip_velocity,
)
from magmotor.devices.top.scene import DRY_FRICTION_RATE, Top
from magmotor.numerics import splittings as schemes
from magmotor.run.step_limits import check_bearing_limit, check_step_limit

SIZES = {"position": 3, "velocity": 3, "axis": 3, "angular_velocity": 3, "orientation": 4}


def initial_state(
    scene: Top, initial: Mapping[str, Any] | xr.Dataset | None, replicas: None = None
) -> BallStates:
    """The state that a run starts from, as one row; see `simulate` for `initial`.

    Raises
    ------
    ValueError
        Names the part, its value and the bound.
    """
    return start(scene)._replace(**given_parts(scene, SIZES, initial, 1))


LARGEST_WORK = 10.0
"""Energy that a ring which moves may add, over what is in play at the start."""


class Guard(FirstFailure):
    """Finds the first wrong row among recorded states of a scene.

    Parameters
    ----------
    scene : Top
    first : BallStates
        The initial state; it sets the energy that the motion may have.
    """

    def __init__(self, scene: Top, first: BallStates):
        self.scene = scene
        start = ball_energy(scene, first)
        # A ring at rest does no work, and friction only takes.
        work = LARGEST_WORK if scene.ring_script else 0.0
        self.largest_energy = float((start.total + work * _in_play(start))[0])

    def _faults(self, states: BallStates) -> Iterator[Fault]:
        found = ball_energy(self.scene, states)
        error = LARGEST_ERROR * _in_play(found)
        yield found.total > self.largest_energy + error, lambda _: ENERGY_GREW
        if self.scene.surface == "planar":
            weight = self.scene.ball_mass * self.scene.gravity
            yield found.lift > weight, lambda row: lifted(found.lift[row], weight)


def _in_play(energy: BallEnergy) -> NDArray:
    return energy.kinetic + abs(energy.magnetic)


def lifted(lift: float, weight: float) -> str:
    """What to say of a lift and a weight, both in N."""
    return (
        f"the magnetic lift, {lift:.3g} N, exceeds the ball's weight, {weight:.3g} N, and the"
        " plane cannot hold it down: use a larger gravity or surface = 'plane'"
    )


guard = Guard

__all__ = ["check_run", "columns", "guard", "initial_state", "methods", "states_of"]

TIME_UNIT = "s"


def methods(scene: Top) -> tuple[str, ...]:
    """Names of the methods that the scene takes."""
    if scene.surface == "plane":
        return MUJOCO
    if scene.ring_script or scene.inertia[0] != scene.inertia[2]:
        return (*MUJOCO, "scipy/dop853")
    return (*schemes.methods(schemes.RIGID, noise=False), *MUJOCO_PLANAR, "scipy/dop853")


def check_run(
    scene: Top,
    method: str,
    timestep: float,
    replicas: int | None,
    allow_unstable: bool = False,
) -> None:
    """Check what depends on the scene; of the timestep nothing if it may be unstable.

    Raises
    ------
    ValueError
        Replicas, or a timestep at which dry friction, the plane or the method is unstable.
    """
    if replicas is not None:
        check_integer("replicas", replicas, at_least=1)
        raise reject("replicas", replicas, "None: this scene has no noise, all would be the same")
    if allow_unstable:
        return
    if method in MUJOCO and any(scene.dry_friction):
        check_number("timestep", timestep, below=1 / DRY_FRICTION_RATE, unit="s with dry friction")
    if scene.surface == "plane":
        check_bearing_limit(method, timestep)
    if method != "scipy/dop853":
        check_step_limit(scene, method, timestep)


def columns(scene: Top, states: BallStates, replicas: int | None) -> dict[str, Column]:
    """The variables of a run's dataset."""
    spin = states.angular_velocity
    values = {
        "position": (states.position, "m", "position of the ball's centre"),
        "velocity": (states.velocity, "m/s", "velocity of the ball's centre"),
        "axis": (states.axis, "1", "axis xi_3 of the ball, the direction of its dipole"),
        "angular_velocity": (spin, "rad/s", "angular velocity in the world frame"),
        "slip_velocity": (
            slip_velocity(scene, states.velocity, spin),
            "m/s",
            "slip velocity V_Q of the contact point",
        ),
        "momentum_map": (
            momentum_map(scene, states.axis, spin),
            "kg m^2/s",
            "momentum map J = pi . xi_3",
        ),
        "energy": (energy(scene, states), "J", "total energy"),
    }
    found = {k: Column(("time", "space")[: v[0].ndim], *v) for k, v in values.items()}
    if states.orientation is not None:
        label = "orientation of the ball, unit quaternion (w, x, y, z)"
        found["orientation"] = Column(("time", "component"), states.orientation, "1", label)
    return found


def states_of(run: xr.Dataset) -> BallStates:
    """The recorded states in a dataset."""
    orientation = run["orientation"].values if "orientation" in run else None
    known = [run[name].values for name in BallStates._fields[:-1]]
    return BallStates(*known, orientation=orientation)
