"""The timesteps at which methods become linearly unstable."""

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from magmotor import dipoles
from magmotor.common.arguments import checked
from magmotor.common.checks import check_number, reject
from magmotor.devices.ball.landscape import minimum, valley_radius
from magmotor.devices.disk.scene import Disk, LangevinParticle, steepest_curvature
from magmotor.devices.motor.scene import Motor
from magmotor.devices.top.scene import CONTACT_RATE, Top
from magmotor.numerics.small_motion import (
    SmallMotion,
    StableSteps,
    Step,
    euler_step,
    implicit_step,
    runge_kutta_step,
    splitting_step,
)
from magmotor.numerics.splittings import SPLITTINGS

Scene = Top | Motor | Disk | LangevinParticle

STEPS: dict[str, Step] = {
    "euler": euler_step,
    "cayley": euler_step,
    "implicitfast": implicit_step,
    "rk4": runge_kutta_step,
    **{name: splitting_step(s.parts, s.fractions, exact=s.exact) for name, s in SPLITTINGS.items()},
}
"""What a step of each scheme does to small motions; by the Cayley map it is Euler's."""

BEARING = {"rk4": 2.785 / CONTACT_RATE}
"""Step (s) at which the bearing contact of a plane becomes unstable; else (2 sqrt 2 - 2)/rate."""

SLACK = 1e-6
"""Part by which a step stays short of its limit, which is found to about this."""


def step_limit(scene: Scene, method: str, enough: float = math.inf) -> float:
    """Largest timestep, in s, at which a method keeps a scene at rest, from linear theory.

    Infinite for `scipy/dop853`, which chooses its steps. See `magmotor.theory.small_motion` for the
    resting state; on a plane that bears a ball the contact has a limit of its own. Where the ring
    follows a script, the stiffest of its waypoints counts. For a limit longer than `enough` another
    such time may stand, which costs less to find.
    """
    scheme = method.split("/")[1]
    if scheme == "dop853":
        return math.inf
    if isinstance(scene, Top) and scene.ring_script:
        return min(step_limit(pose, method, enough) for pose in poses(scene))
    limit = _stable_steps(scene, STEPS[scheme]).end(enough)
    borne = isinstance(scene, Top | Motor) and scene.surface == "plane"
    return min(limit, bearing_limit(method)) if borne else limit


@lru_cache
def _stable_steps(scene: Scene, step: Step) -> StableSteps:
    return StableSteps(small_motion(scene), step)


def bearing_limit(method: str) -> float:
    """Step, in s, at which the contact that bears a ball on a plane becomes unstable."""
    return BEARING.get(method.split("/")[1], (2 * math.sqrt(2) - 2) / CONTACT_RATE)


def check_bearing_limit(method: str, timestep: float) -> None:
    """Check a timestep against the contact that bears a ball on a plane.

    Raises
    ------
    ValueError
        Names the timestep and the limit.
    """
    limit = bearing_limit(method)
    check_number("timestep", timestep, below=limit, unit="s on a plane that bears the ball")


def check_step_limit(scene: Scene, method: str, timestep: float) -> None:
    """Check a timestep against linear theory.

    Raises
    ------
    ValueError
        Names the timestep and the limit.
    """
    limit = step_limit(scene, method, enough=(1 + 2 * SLACK) * timestep)
    if timestep >= (1 - SLACK) * limit:
        why = "the linear limit: beyond it, the smallest motion about rest grows"
        raise reject("timestep", timestep, f"less than {limit:.4g}, {why}")


Array = NDArray[np.float64]

DISPLACEMENT = 1e-4
"""Of the differences that find a stiffness: an angle in rad, or a part of the ball's radius."""


@checked
@lru_cache
def small_motion(scene: Top | Motor | Disk | LangevinParticle) -> SmallMotion:
    """A scene about rest: the ball in the deepest minimum of V_e with its axis along the field.

    The motor's ring is level, or almost: its tilt balances the ball. The disk is where U is
    steepest. A scripted ring stands where it begins. Coordinates are x and y of the ball, its turns
    about x, y and z and those of the ring, in m and rad; x and theta of the disk.
    """
    if isinstance(scene, Top):
        return _top(scene)
    if isinstance(scene, Motor):
        return _motor(scene)
    return _disk(scene)


def poses(scene: Top) -> list[Top]:
    """The scene with its ring at rest, at each of its script's waypoints if it has one."""
    return [
        scene.replace(ring_script=(), ring_height=height, tilt=tilt)
        for _, height, tilt in scene.ring_script
    ] or [scene]


@checked
@lru_cache
def resting_ball(scene: Top | Motor) -> tuple[Array, Array]:
    """Centre (m) and axis of a ball at rest in the deepest minimum of V_e, each of shape (3,).

    The motor's is under the first outer dipole, with the inner ring level.
    """
    motor = isinstance(scene, Motor)
    flat = (valley_radius(scene), 0.0) if motor else minimum(scene).position
    place = np.array([*flat, scene.ball_radius])
    field = dipoles.field(place, *scene.ring_sources())
    return place, field / np.linalg.norm(field)


def _disk(scene: Disk | LangevinParticle) -> SmallMotion:
    wrenches = scene.slip_directions
    friction = scene.friction * wrenches.T @ wrenches
    stiffness = np.zeros_like(friction)
    stiffness[0, 0] = steepest_curvature(scene.coefficients)
    # Of a tendon's damping MuJoCo's implicit integrator sees what a joint does to itself.
    on_floor = isinstance(scene, Disk) and scene.surface == "plane"
    implicit = np.zeros_like(friction) if on_floor else np.diag(np.diag(friction))
    return SmallMotion.of(np.diag(scene.masses), stiffness, friction, implicit)


def _top(scene: Top) -> SmallMotion:
    across, _, axial = scene.inertia
    place, axis = resting_ball(scene)
    sources = scene.ring_sources()

    def force(q: Array) -> Array:
        push, twist = dipoles.wrench(*_moved(scene, place, axis, q), *sources)
        return np.hstack([push[:, :2], twist])

    inertia = scene.ball_mass * np.eye(5)
    inertia[2:, 2:] = across * np.eye(3) + (axial - across) * np.outer(axis, axis)
    friction = _slip_friction(scene.friction, scene.ball_radius, 5)
    stiffness = _stiffness(force, _scales(scene, 5))
    return SmallMotion.of(inertia, stiffness, friction, np.zeros((5, 5)))


def _motor(scene: Motor) -> SmallMotion:
    place, axis = resting_ball(scene)
    centre = np.array([0.0, 0.0, scene.inner_height])
    arms, outward = scene.inner_dipole_frame()
    ring, outer = (arms, scene.ball_ring_factor * scene.moment * outward), scene.outer_sources()

    def force(q: Array) -> Array:
        ball, moment = _moved(scene, place, axis, q)
        turn = Rotation.from_rotvec(q[:, 5:8])
        back, turned = turn.inv(), turn.as_matrix().swapaxes(1, 2)
        by_ring = dipoles.wrench(back.apply(ball - centre), back.apply(moment), *ring)
        push, twist = (turn.apply(part) for part in by_ring)
        on_ring = -np.cross(ball - centre, push) - twist
        inner_arms, inner_moments = arms @ turned, scene.moment * outward @ turned
        pushes, twists = dipoles.wrench(inner_arms + centre, inner_moments, *outer)
        on_ring += np.sum(np.cross(inner_arms, pushes) + twists, axis=1)
        outer_push, outer_twist = dipoles.wrench(ball, moment, *outer)
        return np.hstack([(push + outer_push)[:, :2], twist + outer_twist, on_ring])

    sphere = scene.ball_inertia
    inertia = np.diag([scene.ball_mass, scene.ball_mass, *3 * [sphere], *scene.inner_moments])
    damper = np.diag([0.0] * 5 + [scene.frictions[-1]] * 3)
    friction = _slip_friction(scene.friction_ball, scene.ball_radius, 8) + damper
    return SmallMotion.of(inertia, _stiffness(force, _scales(scene, 8)), friction, damper)


def _slip_friction(friction: float, radius: float, size: int) -> Array:
    """Friction -c V on the slip V_x = v_x - r omega_y, V_y = v_y + r omega_x, as a matrix."""
    slip = np.zeros((2, size))
    slip[0, [0, 3]], slip[1, [1, 2]] = (1.0, -radius), (1.0, radius)
    return friction * slip.T @ slip


def _scales(scene: Top | Motor, size: int) -> Array:
    return DISPLACEMENT * np.array([scene.ball_radius] * 2 + [1.0] * (size - 2))


def _moved(scene: Top | Motor, place: Array, axis: Array, q: Array) -> tuple[Array, Array]:
    """Places and moments of a ball at rest after changes, shape (k, n), of its place and turns."""
    moved = place + q[:, :2] @ np.eye(2, 3)
    return moved, scene.moment * Rotation.from_rotvec(q[:, 2:5]).apply(axis)


def _stiffness(force: Callable[[Array], Array], scales: Array) -> Array:
    """-d force/d q by central differences; symmetric but for what is left of the force itself."""
    changes = np.diag(scales)
    before, after = np.split(force(np.vstack([-changes, changes])), 2)
    columns = (before - after) / (2 * scales[:, np.newaxis])
    return (columns + columns.T) / 2
