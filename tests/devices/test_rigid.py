"""The reference integrators of rigid bodies: forces, invariants, steps, and noise."""

import subprocess
import sys
from functools import partial
from typing import Any

import numpy as np
import pytest
from numba import njit
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import magmotor as mm
from magmotor.device import job as jobs
from magmotor.device.job import Job
from magmotor.devices.ball import rigid_forces, rigid_steps, rigid_surroundings
from magmotor.devices.ball import rigid_kernel as rigid
from magmotor.devices.ball.rigid_forces import step_coefficients
from magmotor.devices.ball.rigid_kernel import kernel
from magmotor.devices.motor import variational as motor
from magmotor.devices.motor.device import MOTOR
from magmotor.devices.motor.energy import motor_energy
from magmotor.noise import BrownianPath
from magmotor.numerics.splittings import RIGID

wrenches: Any = njit(rigid_forces.wrenches.py_func)
with_background: Any = njit(rigid_surroundings.with_background.py_func)
angular_velocity: Any = njit(rigid_steps.angular_velocity.py_func)
momentum_of: Any = njit(rigid_steps.discrete_momentum.py_func)

METHODS = (
    "variational/euler",
    "variational/cayley",
    "variational/verlet",
    "variational/baoab",
    "variational/middle",
)
ALL_METHODS = (*METHODS, "variational/blanes-moan4", "variational/blanes-moan6")
"""Including methods without noise."""

SPLITTINGS = ALL_METHODS[2:]

QUIET = {"temperature": "nonuniform", "alpha_ring": 0.0}
WARM = {"alpha_ball": 2e-3, "alpha_ring": 3e-2, "friction_ring": 0.4, "temperature": "nonuniform"}
"""Noise and friction are so strong that a few steps show their effect."""

LIVELY = {"position": (0.45, 0.2), "velocity": (0.02, -0.01), "axis": (0.3, -0.2, 1.0)}
TILT = np.radians(8)
TILTED = {
    "ring_axis": [np.sin(TILT), 0, np.cos(TILT)],
    "ring_angular_velocity": [0.02, 0.03, 0.4],
    "angular_velocity": [1.0, 0.5, 0.3],
}


def turns(quaternions):
    return Rotation.from_quat(quaternions, scalar_first=True)


def largest(values):
    return float(np.abs(values).max())


def order(steps, errors):
    """Return the order, by regression of log error on log timestep."""
    return np.polyfit(-np.log(np.array(steps)), np.log(np.array(errors)), 1)[0]


def momentum(scene, run):
    """Return the angular momentum of the inner ring in the world frame."""
    across, _, axial = scene.inner_moments
    axis, spin = run.ring_axis.values, run.ring_angular_velocity.values
    return across * spin + (axial - across) * np.sum(axis * spin, -1, keepdims=True) * axis


def at_rest(scene, place, ball, ring):
    """Return motor states at rest with given positions and orientations."""
    state = MOTOR.initial_state(scene, None, 1)
    still = np.zeros((1, 1, 3))
    return state._replace(
        position=place[None, None],
        orientation=ball.as_quat(scalar_first=True)[None, None],
        ring_orientation=ring.as_quat(scalar_first=True)[None, None],
        velocity=still,
        angular_velocity=still,
        ring_angular_velocity=still,
    )


@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_wrenches_are_the_gradient_of_the_energy(factor):
    """On R^3 x SO(3) x SO(3), by central differences along world-frame axes."""
    rng = np.random.default_rng(1)
    scene = mm.Motor(
        ball_ring_factor=factor,
        gravity=0.001,
        floor_tilt=(0.1, 0.2),
        background_field=(1e-5, 2e-5, 3e-5),
    )
    magnets = motor.magnets(scene)
    work = magnets.frame.copy()
    for _ in range(3):
        place = np.array([0.5, 0.1, 0.2]) + 0.1 * rng.normal(size=3)
        ball, ring = Rotation.random(rng=rng), Rotation.from_rotvec(0.3 * rng.normal(size=3))

        def energy(q, place=place, ball=ball, ring=ring):
            there = place + q[:3], Rotation.from_rotvec(q[3:6]) * ball
            state = at_rest(scene, *there, Rotation.from_rotvec(q[6:]) * ring)
            return motor_energy(scene, state).total[0, 0]

        e = 3e-5
        expected = [-(energy(e * q) - energy(-e * q)) / (2 * e) for q in np.eye(9)]
        orientation = tuple(ball.as_quat(scalar_first=True))
        found = wrenches(
            tuple(place),
            orientation,
            tuple(ring.as_quat(scalar_first=True)),
            work,
            magnets,
        )
        expected[2] += scene.weight  # the floor bears it
        surrounded = tuple(place), orientation, motor.bodies(scene), magnets
        on_ball = with_background(*found[:2], *surrounded)
        found = *on_ball, found[2]
        for ours, theirs in zip(found, np.split(np.array(expected), 3), strict=True):
            assert largest(ours - theirs) < 1e-6 * largest(ours)  # 5e-8


@pytest.mark.parametrize("method", ALL_METHODS)
def test_a_free_ring_keeps_its_angular_momentum(method):
    scene, h = mm.Motor(**QUIET, coupling=1e-30), 0.1
    start = {"ring_axis": TILTED["ring_axis"], "ring_angular_velocity": [0.05, -0.03, 1.0]}
    run = mm.simulate(scene, method=method, timestep=h, duration=100, initial=start)
    pi = momentum(scene, run)
    if method in SPLITTINGS:
        assert largest(pi - pi[0]) < 1e-12 * largest(pi)  # 3e-13
        across, _, axial = scene.inner_moments
        t = run.time.values[:, None]
        about = (1 / axial - 1 / across) * (pi[0] @ run.ring_axis.values[0]) * t * [0, 0, 1]
        precession = Rotation.from_rotvec(pi[0] / across * t)
        exact = precession * turns(run.ring_orientation.values[0]) * Rotation.from_rotvec(about)
        error = largest((turns(run.ring_orientation.values) * exact.inv()).as_rotvec())
        assert error < 2e-12 * len(RIGID[method.split("/")[1]].parts)  # 4e-13 for each
        return
    # The discrete momentum of the finished step is constant.
    discrete = partial(discrete_momentum, method, -h)
    both = zip(run.ring_angular_velocity.values, pi, strict=True)
    mu = np.array([discrete(omega, p) for omega, p in both])
    assert largest(mu - mu[0]) < 1e-13 * largest(mu)  # 6e-15
    assert largest(pi - pi[0]) > 1e-3 * largest(pi)  # 5e-3


@pytest.mark.parametrize(
    ("method", "bound"), [("variational/euler", 1e-3), ("variational/baoab", 2e-5)]
)
def test_the_top_acquires_the_reference_momentum(method, bound, case4_truth):
    run = mm.simulate(
        mm.Top.paper(4), method=method, timestep=0.0025, duration=60, record_interval=40
    )
    error = largest(run.momentum_map - case4_truth.momentum_map.values)
    assert error < bound * largest(case4_truth.momentum_map)  # 2.4e-4, 1.1e-5


@pytest.mark.parametrize("method", ALL_METHODS)
@pytest.mark.parametrize("case", [1, 2])
def test_without_friction_the_tops_momentum_map_is_constant(method, case):
    scene = mm.Top.paper(case, spin=1e-4 / 2.592e-5)
    run = mm.simulate(scene, method=method, timestep=0.025, duration=500)
    change = largest(run.momentum_map / run.momentum_map[0] - 1)
    if method == "variational/cayley":  # its discrete momentum is constant
        omega = run.angular_velocity.values
        scale = 1 + 0.025**2 * np.sum(omega**2, axis=-1) / 4
        change = largest(scale * run.momentum_map / (scale[0] * run.momentum_map[0]) - 1)
    assert change < 5e-12  # 2.5e-13


def test_euler_is_mujocos():
    scene, arguments = mm.Top.paper(4), {"timestep": 0.0125, "duration": 20}
    ours = mm.simulate(scene, method="variational/euler", **arguments)
    theirs = mm.simulate(scene, method="mujoco/euler", **arguments)
    for name in ("position", "velocity", "orientation", "angular_velocity"):
        assert largest(ours[name] - theirs[name]) < 1e-12 * largest(ours[name])  # 3.8e-14
    assert largest(ours.momentum_map - theirs.momentum_map) < 5e-18  # 3e-19 of 1.8e-4


@pytest.mark.parametrize("method", ALL_METHODS)
def test_energy_has_no_drift_without_friction_and_noise(method):
    """In short steps, schemes of higher order would show only rounding."""
    scene, steps = mm.Motor(**QUIET, **LIVELY, friction_ball=0.0), 20 if method in METHODS else 2
    run = mm.simulate(
        scene, method=method, timestep=1 / steps, duration=1e4, record_interval=steps,
        initial=TILTED,
    )  # fmt: skip
    change = (run.energy - run.energy[0]).values
    # 1.9e-4; of second and higher order 3.9e-6 to 2.6e-5
    bound = 1e-3 if method.split("/")[1] in ("euler", "cayley", "middle") else 1e-4
    assert largest(change) < bound * largest(run.energy)
    drift = np.polyfit(run.time.values, change, 1)[0] * 1e4
    assert abs(drift) < 0.02 * change.std()  # 8e-4


@pytest.mark.parametrize(
    ("method", "bound"), [("variational/euler", 3e-3), ("variational/baoab", 1e-4)]
)
def test_energy_balances_heat_and_work(method, bound):
    """E - E(0) = work - heat for ten paths over 1000 s."""
    scene, h = mm.Motor(), 0.1
    run = mm.simulate(
        scene, method=method, timestep=h, duration=1000, record_interval=100, replicas=10
    )
    residual = run.energy + run.heat - run.work - run.energy[:, 0]
    assert largest(residual) < bound * largest(run.work)  # 2.3e-4, 6.3e-6
    assert (run.ring_work > 0)[:, -1].all()
    assert (run.heat > run.ring_heat)[:, 1:].all()


def test_retractions_differ_in_second_order():
    """cay(W) = exp(W + O(W^3)), which changes the result by O(h^2)."""
    scene, steps, apart = mm.Motor(**QUIET, **LIVELY), (5, 10, 20), []
    for n in steps:
        runs = [
            mm.simulate(
                scene, method=m, timestep=0.5 / n, duration=20, record_interval=n, initial=TILTED
            )
            for m in METHODS[:2]
        ]
        apart.append(largest(runs[0].ring_orientation - runs[1].ring_orientation))
    assert abs(order(steps, apart) - 2) < 0.004  # 2e-4


def hat(W):
    return np.cross(np.eye(3), W)


def discrete_momentum(method, time, omega, pi):
    """Return (dtau^-1_W)* pi for W = time omega, by Bernoulli's series or Cayley's definition."""
    ad = time * hat(omega)
    if method == "variational/cayley":
        columns = [(np.eye(3) - ad / 2) @ hat(V) @ (np.eye(3) + ad / 2) for V in np.eye(3)]
        inverse = np.array([[c[2, 1], c[0, 2], c[1, 0]] for c in columns]).T
    else:
        terms = (1, -1 / 2, 1 / 12, 0, -1 / 720, 0, 1 / 30240, 0, -1 / 1209600)
        powers = [b * np.linalg.matrix_power(ad, k) for k, b in enumerate(terms)]
        inverse = np.sum(powers, axis=0)
    return inverse.T @ pi


def twin_wrenches(scene, place, ball, ring):
    """Return force and torque on the ball and torque on the ring, each summed over pairs."""
    mu = scene.moment
    inner, outward = scene.inner_dipole_frame()
    center = np.array([0, 0, scene.inner_height])
    inner, outward = ring.apply(inner), ring.apply(mu * outward)
    outer, fixed = scene.outer_sources()
    m = mu * ball.as_matrix()[:, 2]
    factor = scene.ball_ring_factor
    force, torque, on_ring = np.zeros(3), np.zeros(3), np.zeros(3)
    for x, n, weight in (
        *((center + x, n, factor) for x, n in zip(inner, outward, strict=True)),
        *((x, n, 1.0) for x, n in zip(outer, fixed, strict=True)),
    ):
        f, b = twin_pair(place - x, m, n)
        force, torque = force + weight * f, torque + weight * np.cross(m, b)
    for x, n in zip(inner, outward, strict=True):
        for y, other, weight in (
            (place, m, factor), *((y, o, 1.0) for y, o in zip(outer, fixed, strict=True))
        ):  # fmt: skip
            f, b = twin_pair(center + x - y, n, other)
            on_ring = on_ring + weight * (np.cross(x, f) + np.cross(n, b))
    return force, torque, on_ring


def twin_pair(r, a, b):
    """Return the force on dipole a in the field of b, and this field; r points from b to a."""
    d = np.linalg.norm(r)
    n = r / d
    force = (a @ n) * b + (b @ n) * a + (a @ b) * n - 5 * (a @ n) * (b @ n) * n
    return 3e-7 * force / d**4, 1e-7 * (3 * (b @ n) * n - b) / d**3


def twin_step(scene, method, h, state, xi):
    """Advance a state (position, v, R, omega, R_ring, omega_ring); written independently."""
    if method in SPLITTINGS:
        return twin_splitting(scene, method, h, state, xi)
    place, v, R, omega, R_ring, spin = state
    force, torque, on_ring = twin_wrenches(scene, place, R, R_ring)
    c, a = np.array(scene.frictions), np.array(scene.noises)
    r, m, J = scene.ball_radius, scene.ball_mass, scene.ball_inertia
    arm = np.array([0, 0, -r])
    slip = v + np.cross(omega, arm)
    push = np.append(-h * c[:2] * slip[:2] + a[:2] * np.sqrt(h) * xi[:2], 0.0)
    force = h * np.append(force[:2], 0.0) + push
    torque = h * torque + np.cross(arm, push)
    on_ring = h * on_ring - h * c[2:] * spin + a[2:] * np.sqrt(h) * xi[2:]

    def turned(R, inertia, omega, impulse):
        I = R.as_matrix() @ np.diag(inertia) @ R.as_matrix().T
        mu = discrete_momentum(method, -h, omega, I @ omega) + impulse
        w = np.linalg.solve(I, mu)
        for _ in range(50):
            w = w + np.linalg.solve(I, mu - discrete_momentum(method, h, w, I @ w))
        W = h * hat(w) / 2
        cay = np.linalg.solve(np.eye(3) - W, np.eye(3) + W)
        by_cayley = method == "variational/cayley"
        tau = Rotation.from_matrix(cay) if by_cayley else Rotation.from_rotvec(h * w)
        return tau * R, w

    v = v + force / m
    R, omega = turned(R, [J, J, J], omega, torque)
    R_ring, spin = turned(R_ring, scene.inner_moments, spin, on_ring)
    return place + h * v, v, R, omega, R_ring, spin


def twin_splitting(scene, method, h, state, xi):
    """Verlet: drift, kick with friction and noise at once, drift; BAOAB: one by one."""
    place, v, R, omega, R_ring, spin = state
    c, a = np.array(scene.frictions), np.array(scene.noises)
    r, m, J = scene.ball_radius, scene.ball_mass, scene.ball_inertia
    arm, moments = np.array([0, 0, -r]), np.array(scene.inner_moments)

    def drift(place, v, R, omega, R_ring, body):
        """The ring by its Euler equations, in its own frame."""

        def free(t, y):
            q, w = y[:4], y[4:]
            turning = [-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))]
            return [*(0.5 * np.array(turning)), *(np.cross(moments * w, w) / moments)]

        start = [*R_ring.as_quat(scalar_first=True), *body]
        y = solve_ivp(free, (0, h / 2), start, method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
        return (
            place + h / 2 * v,
            v,
            Rotation.from_rotvec(h / 2 * omega) * R,
            omega,
            turns(y[:4]),
            y[4:],
        )

    def act(place, v, R, omega, R_ring, body, time, o_part):
        """Forces for so long; with `o_part` friction and noise for the whole step."""
        force, torque, on_ring = twin_wrenches(scene, place, R, R_ring)
        force, on_ring = np.append(force[:2], 0.0), R_ring.inv().apply(on_ring)
        v, omega = v + time * force / m, omega + time * torque / J
        slip_mass = 1 / (1 / m + r * r / J)
        along = (force / m + np.cross(torque / J, arm))[:2]
        if not o_part:
            return place, v, R, omega, R_ring, body + time * on_ring / moments
        slip = (v + np.cross(omega, arm))[:2] - time * along
        before = slip + time * along
        after = flow(slip_mass, c[:2], a[:2], slip, along, time, xi[:2])
        push = np.append(slip_mass * (after - before), 0.0)
        v, omega = v + push / m, omega + np.cross(arm, push) / J
        noise = R_ring.inv().apply(xi[2:])
        body = flow(moments, c[2:], a[2:], body, on_ring / moments, time, noise)
        return place, v, R, omega, R_ring, body

    def flow(mass, friction, noise, u, acceleration, time, xi):
        """Ornstein and Uhlenbeck's process over a step, under an acceleration for a time."""
        rate = friction / mass
        some = np.maximum(rate, 1e-300)
        variance = np.where(rate > 0, -np.expm1(-2 * rate * h) / (2 * some), h)
        response = np.where(rate > 0, -np.expm1(-rate * time) / some, time)
        return (
            np.exp(-rate * h) * u + response * acceleration + noise / mass * np.sqrt(variance) * xi
        )

    full = place, v, R, omega, R_ring, R_ring.inv().apply(spin)
    if method == "variational/verlet":
        *full, body = drift(*act(*drift(*full), h, True))
    else:
        whole = method == "variational/middle"
        full = drift(*act(*full, h if whole else h / 2, False))
        full = drift(*act(*full, 0.0, True))
        *full, body = full if whole else act(*full, h / 2, False)
    return *full, full[4].apply(body)


@pytest.mark.parametrize(
    "noise",
    [WARM, {**WARM, "friction_ball": 0.0, "friction_ring": 0.0}, {**WARM, "alpha_ball": 0.0}],
)
@pytest.mark.parametrize("method", METHODS)
def test_steps_equal_those_of_an_independent_implementation(method, noise):
    """Four steps of 0.2 s of replica 2, with a fast ring and a coarsened path."""
    scene, h, replica = mm.Motor(**noise, **LIVELY), 0.2, 2
    start = {**TILTED, "ring_angular_velocity": [0.2, -0.3, 1.5]}
    fine = BrownianPath(seed=5, timestep=h / 2)
    run = mm.simulate(
        scene, method=method, timestep=h, duration=4 * h, initial=start, replicas=3,
        path=fine.coarsened(2),
    )  # fmt: skip
    mine = run.sel(replica=replica)
    state = [
        mine.position[0].values, mine.velocity[0].values, turns(mine.orientation[0].values),
        mine.angular_velocity[0].values, turns(mine.ring_orientation[0].values),
        mine.ring_angular_velocity[0].values,
    ]  # fmt: skip
    slips = [0, 1] if scene.noises[0] else [9, 9]
    channels = [*slips, *(range(2, 5) if scene.noises[0] else range(3))]
    path = fine.coarsened(2)
    xi = [path.increments(4, replica=replica, channel=k) / np.sqrt(h) for k in channels]
    for n, numbers in enumerate(np.transpose(xi), start=1):
        state = twin_step(scene, method, h, state, numbers)
        place, v, R, omega, R_ring, spin = state
        now = mine.isel(time=n)
        errors = [
            largest(now.position - place), largest(now.velocity - v),
            largest(now.angular_velocity - omega), largest(now.ring_angular_velocity - spin),
            (R * turns(now.orientation.values).inv()).magnitude(),
            (R_ring * turns(now.ring_orientation.values).inv()).magnitude(),
        ]  # fmt: skip
        assert max(errors) < 1e-12  # 4e-14


def test_replicas_do_not_depend_on_the_others():
    scene, h = mm.Motor(), 0.1
    path = BrownianPath(4, h)
    run = Job(scene, "baoab", h, 50, 2, MOTOR.initial_state(scene, TILTED, 5), path, 0)
    ((_, last),) = motor.run(run)
    for number in range(5):
        alone = motor.pack(run.initial)
        numbers = motor.bodies(scene), motor.magnets(scene)
        recorded = np.empty((50, *alone.shape))
        rule = step_coefficients(numbers[0], RIGID["baoab"], h)
        kernel("baoab")(
            alone, recorded, (number, number + 1), (0, 2), (4, 1, 0), *numbers, rule, None
        )
        assert np.array_equal(alone[number], last[number])


@pytest.mark.parametrize("scheme", RIGID)
def test_threads_chunks_and_resuming_do_not_change_a_bit(scheme, monkeypatch):
    scene, h = mm.Motor() if RIGID[scheme].takes_noise else mm.Motor(**QUIET), 0.1
    start, path = MOTOR.initial_state(scene, TILTED, 5), BrownianPath(4, h)
    whole = Job(scene, scheme, h, 40, 3, start, path, 7)
    ((expected, last),) = motor.run(whole)
    monkeypatch.setattr(rigid, "thread_count", lambda: 3)
    monkeypatch.setattr(jobs, "CHUNK", 60)
    chunks = list(motor.run(whole))
    assert len(chunks) == 10
    for k in range(len(expected)):
        found = np.concatenate([states[k] for states, _ in chunks])
        assert np.array_equal(found, expected[k])
    assert np.array_equal(chunks[-1][1], last)
    resumed = list(motor.run(whole._replace(done=12, state=chunks[2][1])))
    assert np.array_equal(resumed[-1][1], last)
    assert np.array_equal(resumed[0][0].position, expected.position[12:16])


def test_a_spherical_ring_rotates_uniformly_at_any_timestep():
    """By exp, its discrete momentum is I omega, without iterations."""
    sphere = mm.Motor(**QUIET, coupling=1e-30, inner_inertia=3.0, inner_axial_inertia=3.0)
    start = {"ring_angular_velocity": [0.1, -0.05, 2.0]}
    run = mm.simulate(sphere, method="variational/euler", timestep=0.5, duration=50, initial=start)
    omega = run.ring_angular_velocity.values
    assert largest(omega - omega[0]) < 1e-15  # 0, or rounding
    exact = Rotation.from_rotvec(run.time.values[:, None] * omega[0])
    assert (turns(run.ring_orientation.values) * exact.inv()).magnitude().max() < 5e-13  # 3e-14


@pytest.mark.parametrize("method", ALL_METHODS)
def test_quaternions_stay_normalized(method):
    scene = mm.Motor() if method in METHODS else mm.Motor(**QUIET)
    run = mm.simulate(scene, method=method, timestep=0.1, duration=2e4, record_interval=1000)
    for name in ("orientation", "ring_orientation"):
        assert largest(np.linalg.norm(run[name], axis=-1) - 1) < 1e-15  # 2e-16


@pytest.mark.parametrize(("factor", "expected"), [(1.0, 0.638), (2.0, 0.874)])
def test_the_ball_librates_about_the_field(factor, expected):
    """It starts at a small angle to B, in the valley under a ring too heavy to tilt."""
    scene = mm.Motor(**QUIET, friction_ball=0.0, ball_ring_factor=factor, inner_mass=6e9)
    start = MOTOR.initial_state(scene, None, 1)
    turned = (Rotation.from_rotvec([0, 0.01, 0]) * turns(start.orientation[0, 0])).as_quat(
        scalar_first=True
    )
    run = mm.simulate(
        scene, method="variational/baoab", timestep=0.05, duration=200,
        initial={"orientation": turned},
    )  # fmt: skip
    spin = run.angular_velocity.values[:, 1]
    crossings = np.flatnonzero(np.diff(np.sign(spin)) > 0)
    # Between the first and the last upward zero crossing of omega_y.
    times = run.time.values[crossings]
    frequency = 2 * np.pi * (len(times) - 1) / (times[-1] - times[0])
    assert frequency == pytest.approx(expected, rel=3e-3)  # 0.639, 0.876


def test_the_angular_velocity_of_a_discrete_momentum_is_correct_or_nan():
    axis, inertia = (0.6, 0.0, 0.8), (1.0, 2.0)
    for by_cayley in (False, True):
        for size in (0.0, 1e-6, 0.1, 1.0):
            omega = (0.48 * size, 0.6 * size, -0.64 * size)
            mu = momentum_of(omega, axis, inertia, 1.0, by_cayley)
            found = angular_velocity(mu, axis, inertia, 1.0, by_cayley)
            assert largest(np.subtract(found, omega)) <= 1e-14 * size  # 1.3e-15
    mu = momentum_of((3.0, 3.0, 0.0), axis, inertia, 1.0, True)
    assert np.isnan(angular_velocity(mu, axis, inertia, 1.0, True)).all()


def test_too_long_a_timestep_stops_the_run():
    scene = mm.Top.paper(4, axis=(1.0, 0.0, 0.2))
    numerics = {"method": "variational/cayley", "timestep": 2.0, "duration": 2000}
    with pytest.raises(mm.SimulationDiverged):
        mm.simulate(scene, **numerics, allow_unstable=True)


def test_methods_of_the_top():
    assert set(ALL_METHODS) <= set(mm.methods(mm.Top()))
    for scene in (mm.Top.experiment(), mm.Top(ball_axial_inertia=2e-5), mm.Top(surface="plane")):
        assert not set(ALL_METHODS) & set(mm.methods(scene))


KERNEL_IN_A_PROCESS = """
import magmotor as mm
from magmotor.devices.ball.rigid_kernel import kernel
from magmotor.devices.disk import variational
mm.simulate(mm.Motor(), method="variational/baoab", timestep=0.1, duration=1)
mm.simulate(mm.Motor(ball_mass=1), method="variational/baoab", timestep=1, duration=1)
mm.simulate(mm.Top(), method="variational/baoab", timestep=0.01, duration=1)
mm.simulate(mm.Disk(), method="variational/baoab", timestep=0.01, duration=1)
for each in (kernel("baoab"), variational.kernel(mm.Disk(), "baoab")):
    print(sum(each.stats.cache_hits.values()), sum(each.stats.cache_misses.values()))
"""


def test_a_kernel_is_compiled_once_for_all_processes_and_scenes(monkeypatch):
    """Without the library, by Numba."""
    monkeypatch.setenv("MAGMOTOR_LIBRARY", "0")
    command = [sys.executable, "-c", KERNEL_IN_A_PROCESS]
    subprocess.run(command, check=True)
    second = subprocess.run(command, capture_output=True, text=True, check=True)
    assert second.stdout.splitlines() == ["1 0", "1 0"]
