"""What the front door knows of the ball under its ring."""

import xarray as xr

from magmotor.checks import check_integer, check_number, reject
from magmotor.devices.ball_guard import Guard as guard
from magmotor.devices.ball_initial import initial_state
from magmotor.devices.column import Column
from magmotor.devices.linear_limits import check_bearing_limit, check_step_limit
from magmotor.engines.mujoco.methods import METHODS as MUJOCO
from magmotor.engines.mujoco.methods import PLANAR as MUJOCO_PLANAR
from magmotor.engines.variational import schemes
from magmotor.observables.motion import energy, momentum_map, slip_velocity
from magmotor.scenes import Top
from magmotor.scenes.top import DRY_FRICTION_RATE
from magmotor.states.ball import BallStates

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
