"""Linear stability: closed limits, one-step maps, and runs on both sides of each limit."""

import math

import numpy as np
import pytest
from refusals import refused
from scipy.spatial.transform import Rotation

import magmotor as mm
from magmotor.device import ENERGY_GREW
from magmotor.device import step_limits as linear_limits
from magmotor.device.step_limits import (
    SLACK,
    STEPS,
    check_step_limit,
    small_motion,
    step_limit,
)
from magmotor.devices.ball.resting import resting_ball
from magmotor.devices.ball.states import smallest_turn
from magmotor.devices.motor.device import MOTOR
from magmotor.devices.motor.energy import motor_energy
from magmotor.numerics.linear_stability import (
    FACTOR,
    LONGEST,
    ROUNDING,
    SHORTEST,
    SmallMotion,
    StableSteps,
    largest_stable_step,
    spectral_radius,
)

NUDGE, SMALL = 1e-5, 1e-6
"""Initial velocities, and steps of differences, in SI units; small enough for linear theory."""

EXPLICIT = ["euler", "cayley", "implicitfast"]
"""Schemes that treat the friction of a contact as Euler's does."""

INSIDE, OUTSIDE = 0.93, 1.2
"""Timesteps over their limits: just stable, and unstable enough for the guard."""

SCENES = {
    "top": mm.Top.paper(4),
    "conservative top": mm.Top.paper(2),
    "top on the plane": mm.Top.paper(4, surface="plane"),
    "motor": mm.Motor(temperature="nonuniform", alpha_ring=0.0, friction_ring=0.15),
    "disk": mm.Disk(noise=0.0),
}

STEPPING = [
    (name, method)
    for name, scene in SCENES.items()
    for method in mm.methods(scene)
    if method != "scipy/dop853"
]


def oscillator(frequency=0.0, friction=0.0, implicit=0.0):
    return SmallMotion.of(*(np.array([[x]]) for x in (1.0, frequency**2, friction, implicit)))


def at_rest(scene):
    """Return the initial state at rest for which the limits are computed."""
    if isinstance(scene, mm.Disk):
        return {"x": -math.pi / 2, "v": NUDGE}
    place, axis = resting_ball(scene)
    return {"position": place, "axis": axis, "angular_velocity": (NUDGE, 2 * NUDGE, 0.0)}


@pytest.mark.parametrize("scheme", STEPS)
def test_an_oscillator_has_the_closed_limits(scheme):
    resonates = scheme.startswith("blanes-moan")
    swing = math.pi if resonates else {"rk4": 2 * math.sqrt(2)}.get(scheme, 2.0)
    found = largest_stable_step(oscillator(frequency=3.0), STEPS[scheme])
    assert found == pytest.approx(swing / 3, rel=3e-3 if resonates else 1e-6)  # 2.8e-3, 2e-8
    decay = {"rk4": 2.785293563405282} | dict.fromkeys(EXPLICIT, 2.0)
    found = largest_stable_step(oscillator(friction=3.0), STEPS[scheme])
    assert found == pytest.approx(decay.get(scheme, math.inf) / 3, rel=1e-6)  # 5e-7


@pytest.mark.parametrize("scheme", ["rk4", *EXPLICIT])
def test_a_damper_is_implicit_in_implicitfast_alone(scheme):
    found = largest_stable_step(oscillator(friction=3.0, implicit=3.0), STEPS[scheme])
    assert math.isinf(found) == (scheme == "implicitfast")


def test_friction_shortens_the_limit_of_kick_and_drift():
    """The step matrix has the eigenvalue -1 where (h omega)^2 + 2 h c = 4."""
    omega, c = 1.3, 0.7
    closed = (math.sqrt(c**2 + 4 * omega**2) - c) / omega**2
    found = largest_stable_step(oscillator(frequency=omega, friction=c), STEPS["euler"])
    assert found == pytest.approx(closed, rel=1e-6, abs=0)  # 1.3e-7
    assert found < 0.8 * 2 / omega


def test_friction_closes_the_window_of_resonance():
    """The window of Blanes and Moan's scheme near pi is 1 % wide; see `largest_stable_step`."""
    step = STEPS["blanes-moan4"]
    assert spectral_radius(oscillator(frequency=1.0), step, 3.145) > 1.01  # 1.0135
    assert largest_stable_step(oscillator(frequency=1.0, friction=0.05), step) > 2 * math.pi  # 6.94


@pytest.mark.parametrize("unstable", [-1.0, -100.0])
def test_a_physically_unstable_direction_does_not_limit_the_step(unstable):
    none = np.zeros((2, 2))
    motion = SmallMotion.of(np.eye(2), np.diag([9.0, unstable]), none, none)
    assert largest_stable_step(motion, STEPS["euler"]) == pytest.approx(
        2 / 3, rel=5e-9, abs=0
    )  # 2.5e-10


SEARCHED = {
    "nothing": oscillator(),
    "slip": oscillator(friction=3.0),
    "swing": oscillator(frequency=1.0),  # it resonates with Blanes and Moan's schemes
    "damped swing": oscillator(frequency=1.0, friction=0.05),
    **{name: small_motion(scene) for name, scene in SCENES.items()},
    "particle": small_motion(mm.LangevinParticle()),
}


def searched(motion, step):
    """Return the smallest unstable step, by a search one by one."""
    frequency, decay = motion.frequency, float(motion.decay.max())
    if frequency == decay == 0:
        return math.inf

    def unstable(h):
        return spectral_radius(motion, step, h) > 1 + ROUNDING

    stable, h = 0.0, SHORTEST / max(frequency, decay)
    while not unstable(h):
        stable, h = h, FACTOR * h
        if h > LONGEST / (frequency or decay):
            return math.inf
    while h - stable > 1e-8 * h:
        middle = (stable + h) / 2
        stable, h = (stable, middle) if unstable(middle) else (middle, h)
    return h


@pytest.mark.parametrize("scheme", STEPS)
@pytest.mark.parametrize("name", SEARCHED)
def test_a_bounded_search_agrees_with_the_full_one(name, scheme):
    motion, step = SEARCHED[name], STEPS[scheme]
    end = searched(motion, step)
    assert largest_stable_step(motion, step) == end
    goes_on = StableSteps(motion, step)
    for enough in (1.0 if math.isinf(end) else end) * np.geomspace(0.1, 3.0, 4):
        for found in (goes_on.end(enough), StableSteps(motion, step).end(enough)):
            assert found == end or enough < found < end
    assert goes_on.end() == end


@pytest.mark.parametrize(("name", "method"), STEPPING)
def test_timesteps_at_and_above_the_limit_are_refused(name, method):
    """Also in the stable windows above it, and when the scene is not yet in the cache."""
    scene = SCENES[name]
    limit = (1 - SLACK) * step_limit(scene, method)
    before, at = math.nextafter(limit, 0), limit
    for h in [*limit * np.geomspace(0.1, 0.999, 3), before, at, *limit * np.geomspace(1.001, 9, 5)]:
        linear_limits._stable_steps.cache_clear()  # pyright: ignore[reportFunctionMemberAccess]
        if h < limit:
            check_step_limit(scene, method, float(h))
        else:
            with refused("timestep") as told:
                check_step_limit(scene, method, float(h))
            assert f" {step_limit(scene, method):.4g}, " in told.value.allowed


@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_the_motors_stiffness_is_the_curvature_of_its_energy(factor):
    """To the extent that the level ring is at rest."""
    scene = mm.Motor(ball_ring_factor=factor)
    place, axis = resting_ball(scene)
    upright = Rotation.from_quat(smallest_turn(axis), scalar_first=True)

    def energy(q):
        initial = {
            "position": place + np.append(q[:2], 0.0),
            "orientation": (Rotation.from_rotvec(q[2:5]) * upright).as_quat(scalar_first=True),
            "ring_orientation": Rotation.from_rotvec(q[5:8]).as_quat(scalar_first=True),
        }
        return float(motor_energy(scene, MOTOR.initial_state(scene, initial, None)).total[0, 0])

    changes = 1e-3 * np.diag([scene.ball_radius] * 2 + [1.0] * 6)
    curvature = [
        [
            sum(a * b * energy(a * p + b * q) for a in (1, -1) for b in (1, -1))
            / (4 * p.sum() * q.sum())
            for p in changes
        ]
        for q in changes
    ]
    inertia = np.array([scene.ball_mass] * 2 + [scene.ball_inertia] * 3 + [*scene.inner_moments])
    expected = np.linalg.eigvalsh(curvature / np.sqrt(np.outer(inertia, inertia)))
    found = np.linalg.eigvalsh(small_motion(scene).stiffness)
    error = np.abs(found - np.maximum(expected, 0)).max()
    assert error < 1e-4 * found.max()  # 1.1e-5


def test_the_slip_of_a_leaning_ball_decays_by_all_of_its_moments():
    """The slip caused by unit forces along x and y at the contact point, in its principal axes."""
    scene = mm.Top(ball_inertia=2e-5, ball_axial_inertia=3.9e-5)
    _, axis = resting_ball(scene)
    own = Rotation.align_vectors([axis], [[0.0, 0.0, 1.0]])[0]
    arm, slips = np.array([0.0, 0.0, -scene.ball_radius]), []
    for force in np.eye(2, 3):
        spin = own.apply(own.apply(np.cross(arm, force), inverse=True) / [2e-5, 2e-5, 3.9e-5])
        slips.append((force / scene.ball_mass + np.cross(spin, arm))[:2])
    expected = scene.friction * np.linalg.eigvals(slips)
    found = np.sort(small_motion(scene).decay)[-2:]
    assert expected.max() > 1.1 * expected.min()
    np.testing.assert_allclose(found, np.sort(expected), rtol=1e-14)  # 3.5e-16


def test_a_scripted_ring_has_the_limit_of_its_stiffest_waypoint():
    script = tuple(mm.Waypoint(*way, 0.0) for way in [(0, 0.6), (5, 0.1), (9, 0.4)])
    low = step_limit(mm.Top(ring_height=0.1, tilt=0.0), "mujoco/euler")
    assert step_limit(mm.Top(ring_script=script), "mujoco/euler") == low  # 0.053
    assert low < step_limit(mm.Top(ring_height=0.6, tilt=0.0), "mujoco/euler") / 3


@pytest.mark.parametrize(
    ("name", "method"), [(n, m) for n, m in STEPPING if n in ("top", "motor", "disk")]
)
def test_a_run_of_one_step_is_the_linear_map(name, method):
    """Its Jacobian, by differences, has the eigenvalues of theory, since traces of powers agree."""
    scene = SCENES[name]
    h = 0.5 * step_limit(scene, method)
    found = jacobian(scene, method, h)
    expected = STEPS[method.split("/")[1]](small_motion(scene), h)
    power = np.linalg.matrix_power
    error = max(abs(np.trace(power(found, k) - power(expected, k))) for k in (1, 2, 3))
    # The motor's ring is level here; at rest, it would be tilted by 0.3 degrees.
    assert error < (0.005 if name == "motor" else 1e-5)  # 3.5e-3, 2.2e-6


def jacobian(scene, method, h):
    """Return the Jacobian of one step in positions, rotations and velocities near rest."""
    take = disk_step if isinstance(scene, mm.Disk) else rigid_step
    changes = SMALL * np.eye(2 * len(small_motion(scene).stiffness))
    rest = take(scene, method, h, np.zeros(len(changes)))
    return np.transpose([take(scene, method, h, dz) - rest for dz in changes]) / SMALL


def disk_step(scene, method, h, change):
    names = "x", "theta", "v", "omega"
    rest = np.array([-math.pi / 2, 0.0, 0.0, 0.0])
    run = one_step(scene, method, h, dict(zip(names, rest + change, strict=True)))
    return np.array([run[name] for name in names])


def rigid_step(scene, method, h, change):
    place, axis = resting_ball(scene)
    rest = {"": Rotation.from_quat(smallest_turn(axis), scalar_first=True)}
    if isinstance(scene, mm.Motor):
        rest["ring_"] = Rotation.identity()
    places, velocities = np.split(change, 2)
    initial = {"position": place + np.append(places[:2], 0.0), "velocity": velocities[:2]}
    for body, turn, spin in zip(rest, triples(places), triples(velocities), strict=True):
        turned = Rotation.from_rotvec(turn) * rest[body]
        initial[f"{body}orientation"] = turned.as_quat(scalar_first=True)
        initial[f"{body}angular_velocity"] = spin
    run = one_step(scene, method, h, initial)
    ends = {b: Rotation.from_quat(run[f"{b}orientation"], scalar_first=True) for b in rest}
    turns = [(ends[body] * rest[body].inv()).as_rotvec() for body in rest]
    spins = [run[f"{body}angular_velocity"] for body in rest]
    return np.concatenate([run.position[:2], *turns, run.velocity[:2], *spins])


def triples(values):
    """Split into triples after the first two numbers, which are the position."""
    return values[2:].reshape(-1, 3)


def one_step(scene, method, h, initial):
    arguments = {"timestep": h, "duration": h, "initial": initial, "allow_unstable": True}
    return mm.simulate(scene, method=method, **arguments).isel(time=-1)


@pytest.mark.parametrize(("name", "method"), STEPPING)
def test_just_below_its_limit_a_method_is_stable(name, method):
    run = nudged(name, method, INSIDE * step_limit(SCENES[name], method))
    largest = max(float(abs(run[name]).max()) for name in ("angular_velocity", "v") if name in run)
    assert largest < 100 * NUDGE  # 8.2; 93 for the motor, whose level ring is not quite at rest


@pytest.mark.filterwarnings("ignore:.*mm.check.model. proposes:UserWarning")
@pytest.mark.parametrize(("name", "method"), STEPPING)
def test_just_above_its_limit_a_method_diverges(name, method):
    """The records before are finite, and end at the time in the exception."""
    with pytest.raises(mm.SimulationDiverged) as caught:
        nudged(name, method, unstable_step(name, method))
    kept = caught.value.dataset
    assert all(np.isfinite(kept[variable]).all() for variable in kept.data_vars)
    assert caught.value.time == pytest.approx(
        float(kept.time[-1]) + kept.timestep, rel=2e-15, abs=0
    )  # 1.7e-16


def unstable_step(name, method):
    """Return the step, up to `OUTSIDE` times the limit, at which motion grows fastest by theory.

    In Blanes and Moan's first windows motion grows, but to no forbidden energy: further on, then.
    """
    scene = SCENES[name]
    limit = step_limit(scene, method)
    if name == "top on the plane":
        return OUTSIDE * limit
    motion, step = small_motion(scene), STEPS[method.split("/")[1]]
    steps = limit * np.linspace(1.002, 2.5 if "blanes-moan" in method else OUTSIDE, 50)
    return max(steps, key=lambda h: spectral_radius(motion, step, h))


def nudged(name, method, h):
    """Run a scene from rest with small initial velocities."""
    scene = SCENES[name]
    arguments = {"timestep": h, "duration": 4000 * h, "allow_unstable": True}
    return mm.simulate(scene, method=method, initial=at_rest(scene), **arguments)


@pytest.mark.parametrize("method", ["variational/baoab", "mujoco/baoab"])
def test_energy_that_grows_despite_friction_ends_a_run(method):
    """Above its limit, 0.112 s, the libration heats the ball, which leaves its valley."""
    numerics = {"method": method, "timestep": 0.125, "duration": 500}
    with pytest.raises(mm.SimulationDiverged) as caught:
        mm.simulate(mm.Top.paper(4), **numerics, allow_unstable=True)
    assert caught.value.reason == ENERGY_GREW
    assert caught.value.time < 100  # 18.4


@pytest.mark.parametrize("case", [1, 2, 3, 4])
@pytest.mark.parametrize("method", ["variational/euler", "variational/verlet"])
def test_the_energy_error_of_stable_steps_is_allowed(case, method):
    """The largest errors of stable schemes are 0.05 of the energy in play; 0.33 is allowed."""
    scene = mm.Top.paper(case)
    h = 0.95 * step_limit(scene, method)
    run = mm.simulate(scene, method=method, timestep=h, duration=3000 * h)
    assert run.sizes["time"] == 3001


def test_an_unstable_motor_that_noise_does_not_heat_is_stopped():
    """The recorded work grows without bound then, and must not excuse the energy."""
    scene = SCENES["motor"]
    h = 1.1 * step_limit(scene, "variational/baoab")
    start = at_rest(scene)
    with pytest.raises(mm.SimulationDiverged) as caught:
        mm.simulate(
            scene, method="variational/baoab", timestep=h, duration=4000 * h, initial=start,
            allow_unstable=True,
        )  # fmt: skip
    assert caught.value.reason == ENERGY_GREW
    assert caught.value.time < 100 * h  # 17


@pytest.mark.parametrize("name", ["motor", "disk", "top on the plane"])
def test_unstable_steps_are_refused_unless_allowed(name):
    scene = SCENES[name]
    limit = step_limit(scene, "mujoco/euler")
    arguments = {"method": "mujoco/euler", "timestep": 1.01 * limit, "duration": 2 * limit}
    arguments["initial"] = at_rest(scene)
    with refused("timestep"):
        mm.simulate(scene, **arguments)
    assert mm.simulate(scene, **arguments, allow_unstable=True).sizes["time"] == 2
