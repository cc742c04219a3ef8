"""A top that is not balanced, against a program of Newton's equations and against statics."""

import numpy as np
import pytest
from refusals import refused
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation
from third_top import largest_spin, newton_euler, third_program

import magmotor as mm
from magmotor.device.step_limits import step_limit
from magmotor.devices.ball.landscape import aligned_force
from magmotor.devices.top import unbalanced
from magmotor.devices.top.observables import magnetic_forces
from magmotor.devices.top.scene import PAPER_TILT
from magmotor.devices.top.states import states_of

HEAVY = {"center_of_mass": (3e-3, -2e-3, 1e-3), "products_of_inertia": (2e-6, -3e-6, 1.5e-6)}
SCENE = mm.Top.paper(
    4, ball_axial_inertia=3e-5, floor_tilt=(1e-3, 5e-4), background_field=(2e-5, 1e-5, -3e-5),
    torsional_damping=1e-5, drag=0.01, rotational_drag=2e-6, **HEAVY,
)  # fmt: skip
FREE = mm.Top.paper(2, spin=3.0, position=(0.1, 0.05), **HEAVY)


@pytest.fixture(scope="module")
def truth():
    return third_program(SCENE, np.linspace(0, 5, 501))


@pytest.mark.parametrize(("method", "finer", "bound"), [
    ("scipy/dop853", 1, 1e-9),  # 3e-10, 9e-11, 8e-11
    ("mujoco/rk4", 4, 1e-6),  # 9e-8, 1.1e-7, 1.4e-7
])  # fmt: skip
def test_a_third_program_finds_the_same_motion(method, finer, bound, truth):
    """Positions relative to the ball's radius, axes, and spins relative to the largest one."""
    run = mm.simulate(
        SCENE, method=method, timestep=0.01 / finer, duration=5, record_interval=finer
    )
    axis, spin = truth[:, 6:15].reshape(-1, 3, 3)[:, :, 2], truth[:, 15:]
    assert np.abs(run.position.values - truth[:, :3]).max() < bound * SCENE.ball_radius
    assert np.abs(run.axis.values - axis).max() < bound
    assert np.abs(run.angular_velocity.values - spin).max() < bound * np.abs(spin).max()
    balanced = mm.simulate(SCENE.balanced(), method="scipy/dop853", timestep=0.01, duration=5)
    assert np.abs(balanced.axis.values - axis).max() > 0.5  # 1.6


def test_mujoco_and_scipy_agree():
    """On J, relative to its largest value, within a fourth-order error of the timestep."""
    truth = mm.simulate(SCENE, method="scipy/dop853", timestep=0.01, duration=10)
    scale = float(abs(truth.momentum_map).max())
    errors = []
    for finer in (2, 4):
        run = mm.simulate(
            SCENE, method="mujoco/rk4", timestep=0.01 / finer, duration=10, record_interval=finer
        )
        errors.append(float(abs(run.momentum_map - truth.momentum_map).max()) / scale)
    assert errors[1] < 1e-6  # 2.3e-7
    assert 14 < errors[0] / errors[1] < 18  # 15.8


@pytest.mark.parametrize(("method", "timestep", "bound"), [
    ("scipy/dop853", 0.005, 1e-8),  # 1.9e-9, 7e-10
    ("mujoco/rk4", 0.005, 1e-5),  # 5e-7, 1.1e-6
])  # fmt: skip
def test_the_balances_close(method, timestep, bound):
    """J against its torques and the energy against the heat; without the torque of the weight and
    of inertia, J would be off by more than its largest value.
    """
    run = mm.simulate(SCENE, method=method, timestep=timestep, duration=10)
    balance, scale = mm.observables.momentum_balance(run), float(abs(run.momentum_map).max())
    assert abs(balance.residual).max() < bound * scale
    energies = mm.observables.energy_balance(run)
    assert abs(energies.residual).max() < bound * energies.heat[-1]
    added = unbalanced.unbalanced_torque(SCENE, states_of(run))
    assert np.abs(np.cumsum(added) * timestep).max() > scale  # 2.1 times


def test_without_friction_the_energy_is_kept_and_j_is_not():
    run = mm.simulate(FREE, method="scipy/dop853", timestep=0.005, duration=10)
    moving = abs(run.energy - mm.observables.minimum(FREE).energy).max()
    assert abs(run.energy - run.energy[0]).max() < 9e-13 * moving  # 3e-14
    J = run.momentum_map.values
    assert np.ptp(J) > abs(J[0])  # 9.6 times
    assert abs(mm.observables.momentum_balance(run).residual).max() < 1e-8 * np.ptp(J)  # 5e-10
    kept = mm.simulate(FREE.balanced(), method="scipy/dop853", timestep=0.005, duration=10)
    assert np.ptp(kept.momentum_map.values) < 9e-14 * abs(kept.momentum_map[0])  # 3e-15


def test_a_tiny_offset_is_a_balanced_ball():
    """The equations of the two kinds of ball, by the same solver; J relative to its largest value.

    The effect of an offset is in proportion to it.
    """
    plain = mm.Top.paper(4)
    runs = [
        mm.simulate(scene, method="scipy/dop853", timestep=0.02, duration=20)
        for scene in (plain, *(plain.replace(center_of_mass=(a, 0, 0)) for a in (1e-12, 1e-9)))
    ]
    J = [run.momentum_map.values for run in runs]
    none, small = (np.abs(each - J[0]).max() / np.abs(J[0]).max() for each in J[1:])
    assert none < 1e-7  # 7e-9
    assert 1e-6 < small < 1e-4  # 6.9e-6


def test_an_offset_along_the_axis_is_a_vertical_field():
    """m B + a W: it acts like the field a W/m, apart from the center of mass's own motion."""
    scene = mm.Top.paper(4, center_of_mass=(0, 0, 1e-6))
    weight = scene.ball_mass * np.array(scene.gravity_vector)
    field = tuple(1e-6 * weight / scene.moment)
    shifted = mm.Top.paper(4, background_field=field)
    runs = [
        mm.simulate(each, method="scipy/dop853", timestep=0.02, duration=20)
        for each in (scene, shifted, mm.Top.paper(4))
    ]
    J = [run.momentum_map.values for run in runs]
    assert np.abs(J[0] - J[1]).max() < 0.2 * np.abs(J[2] - J[1]).max()  # 0.055


def test_the_force_of_the_plane_in_the_guard(truth):
    """Weight plus dp_z/dt less lift, against the unknown of the third program."""
    run = mm.simulate(SCENE, method="scipy/dop853", timestep=0.01, duration=5)
    states = states_of(run)
    _, force, torque = magnetic_forces(SCENE, states)
    rate = unbalanced.vertical_momentum_rate(SCENE, states, force, torque)
    load = SCENE.weight + rate - force[:, 2]
    expected = np.array([newton_euler(SCENE, row)[3] for row in truth])
    assert np.abs(load - expected).max() < 2e-10 * SCENE.weight  # 1e-11
    assert np.abs(rate).max() > 0.01 * SCENE.weight  # 0.11


def test_a_ball_that_its_swing_lifts_ends_the_run():
    """About a level axis, the center of mass at the top needs m omega^2 a of its weight m g.

    With a = 1.5 cm they are equal at 25.6 rad/s.
    """
    scene = mm.Top(
        ball_inertia=5e-5, ball_axial_inertia=5e-5, center_of_mass=(0.015, 0, 0), axis=(0, 1, 0),
        coupling=1e-30, friction=0.0, ring_height=1.0, position=(0, 0),
    )  # fmt: skip
    for spin, lifts in ((20.0, False), (40.0, True)):
        fast = scene.replace(spin=spin)
        run = {"method": "mujoco/rk4", "timestep": 1e-3, "duration": 0.2, "allow_unstable": True}
        if not lifts:
            mm.simulate(fast, **run)
            continue
        with pytest.raises(mm.PhysicalEvent) as stop:
            mm.simulate(fast, **run)
        assert stop.value.event == "ball lifted"


@pytest.mark.parametrize("point", [(0.1, 0.02), (0.28, -0.1), (0.0, 0.05)])
def test_the_effective_potential_is_the_least_energy_over_attitudes(point):
    sources, weight = SCENE.ring_sources(), SCENE.ball_mass * np.array(SCENE.gravity_vector)

    def energy(turn, x, y):
        place = np.array([x, y, SCENE.ball_radius])
        R = Rotation.from_rotvec(turn)
        field = mm.dipoles.field(place, *sources) + SCENE.background_field
        pull = weight @ (R.apply(SCENE.center_of_mass) + np.array([x, y, 0]))
        return -SCENE.moment * R.apply([0, 0, 1]) @ field - pull

    starts = Rotation.random(8, rng=np.random.default_rng(1)).as_rotvec()
    found = min(
        (minimize(energy, turn, args=point, method="BFGS", tol=1e-12) for turn in starts),
        key=lambda each: each.fun,
    )
    assert mm.observables.effective_potential(SCENE, [point])[0] == pytest.approx(
        found.fun,
        rel=5e-15,
        abs=0,  # 2e-16
    )
    force, axis = aligned_force(SCENE, point)
    assert axis == pytest.approx(Rotation.from_rotvec(found.x).apply([0, 0, 1]), abs=2e-6)  # 8e-8
    near = [
        (point[0] + dx, point[1] + dy) for dx, dy in ((1e-5, 0), (-1e-5, 0), (0, 1e-5), (0, -1e-5))
    ]
    values = mm.observables.effective_potential(SCENE, near)
    slope = [(values[1] - values[0]) / 2e-5, (values[3] - values[2]) / 2e-5]
    assert force[:2] == pytest.approx(slope, abs=2e-6 * np.abs(slope).max())  # 9e-8


@pytest.mark.parametrize("scene", [SCENE, mm.Top.paper(4, center_of_mass=(0, 0, 1e-3))])
@pytest.mark.parametrize(("method", "timestep"), [("scipy/dop853", 0.01), ("mujoco/rk4", 0.01)])
def test_a_ball_at_rest_stays(scene, method, timestep):
    position, _ = mm.theory.resting_ball(scene)
    orientation = unbalanced.resting_rotation(scene).as_quat(scalar_first=True)[0]
    run = mm.simulate(
        scene, method=method, timestep=timestep, duration=5,
        initial={"position": position, "orientation": orientation},
    )  # fmt: skip
    assert abs(run.velocity).max() < 1e-14  # 1.4e-16 .. 1.3e-15
    assert abs(run.angular_velocity).max() < 4e-13  # 1.5e-14 .. 8e-14


def test_small_motion_has_the_frequencies_of_the_motion():
    """Against the eigenvalues of the accelerations that small displacements from rest cause."""
    scene = SCENE.replace(friction=0.0, drag=0.0, rotational_drag=0.0, torsional_damping=0.0)
    motion = mm.theory.small_motion(scene)
    rest, _ = mm.theory.resting_ball(scene)
    rotation = unbalanced.resting_rotation(scene)
    y = np.concatenate([rest, np.zeros(3), rotation.as_matrix().ravel(), np.zeros(3)])
    columns, size = [], 1e-6
    for i in range(5):
        sides = []
        for sign in (1, -1):
            moved = y.copy()
            if i < 2:
                moved[i] += sign * size
            else:
                turn = Rotation.from_rotvec(sign * size * np.eye(3)[i - 2])
                moved[6:15] = (turn * rotation).as_matrix().ravel()
            _, center, turning, _ = newton_euler(scene, moved)
            sides.append(np.concatenate([center[:2], turning]))
        columns.append((sides[1] - sides[0]) / (2 * size))
    squares = np.linalg.eigvals(np.array(columns).T)
    assert motion.frequency**2 == pytest.approx(np.abs(squares).max(), rel=3e-8)  # 1.5e-9


def test_reruns_and_movies_know_the_orientation():
    for method in ("scipy/dop853", "mujoco/implicitfast"):
        run = mm.simulate(SCENE, method=method, timestep=0.005, duration=1)
        assert mm.rerun(run).identical(run)
        joints = SCENE.device.joints(run, SCENE, run.time.values[[0, -1]])
        assert joints.shape == (2, 6)
    assert "orientation" not in mm.simulate(
        SCENE.balanced(), method="scipy/dop853", timestep=0.005, duration=0.1
    )


def test_methods_are_refused_by_name():
    assert mm.methods(SCENE) == (
        "mujoco/euler", "mujoco/implicitfast", "mujoco/rk4", "scipy/dop853",
    )  # fmt: skip
    heavy = mm.Top(center_of_mass=(1e-4, 0, 0))
    with refused("method"):
        mm.simulate(heavy, method="variational/verlet", timestep=0.01, duration=1)
    skew = mm.Top(products_of_inertia=(0, 1e-6, 0))
    with refused("method"):
        mm.recommend(skew, method="mujoco/baoab")
    axis = np.array([[0.0, 0, 1]])
    with refused("scene"):
        mm.observables.momentum_map(heavy, axis, axis)


def test_a_heavy_side_stops_the_spin_where_its_weight_balances_friction():
    """m g a sin(theta) exceeds the largest torque of friction where the offset a exceeds 12 um.

    theta is the angle of the axis at rest. The heavy side starts along x. Along the axis an offset
    matters a hundred times less.
    """
    plain = mm.Top.paper(4)
    run = mm.simulate(plain, method="scipy/dop853", timestep=0.02, duration=60)
    torque = float(abs(mm.observables.momentum_balance(run).torque).max())
    level = float(np.hypot(*mm.theory.resting_ball(plain)[1][:2]))
    balance = torque / (plain.weight * level)
    assert balance == pytest.approx(1.16e-5, rel=0.01)  # 0.003
    spins = {}
    for offset in ((0.5 * balance, 0, 0), (3 * balance, 0, 0), (0, 0, 3 * balance)):
        scene = plain.replace(center_of_mass=offset)
        run = mm.simulate(scene, method="scipy/dop853", timestep=0.02, duration=60)
        spins[offset] = float(abs((run.axis * run.angular_velocity).sum("space")).max())
    light, heavy, along = spins.values()
    assert abs(light / 7.17 - 1) < 0.05  # 0.005
    assert heavy < 1.0  # 0.34
    assert abs(along / 7.17 - 1) < 0.05  # 0.005


@pytest.mark.parametrize(("offset", "tilt", "spin"), [
    ((4.2e-5, 0, 0), PAPER_TILT, 0.32), ((0, 2e-4, 0), PAPER_TILT, 2.01), ((0, 0, 1e-3), 0.0, 0.13),
])  # fmt: skip
def test_the_spin_after_a_minute(offset, tilt, spin):
    """The largest omega . xi_3 in rad/s, by DOP853, by another solver and by a third program."""
    scene = mm.Top.paper(4, tilt=tilt, center_of_mass=offset)
    assert largest_spin(scene) == pytest.approx(spin, abs=0.0051)  # two decimals
    for method, timestep in (("scipy/dop853", 0.02), ("mujoco/rk4", 0.0125)):
        run = mm.simulate(scene, method=method, timestep=timestep, duration=60)
        largest = float(abs((run.axis * run.angular_velocity).sum("space")).max())
        assert largest == pytest.approx(spin, abs=0.0051), method  # two decimals


@pytest.mark.parametrize("method", ["mujoco/euler", "mujoco/implicitfast", "mujoco/rk4"])
def test_small_motions_decay_below_the_limit_of_the_timestep_and_grow_above(method):
    rest, _ = mm.theory.resting_ball(SCENE)
    pushed = {
        "position": rest, "angular_velocity": (1e-7, 2e-7, -1e-7),
        "orientation": unbalanced.resting_rotation(SCENE).as_quat(scalar_first=True)[0],
    }  # fmt: skip
    growth = []
    for part in (0.98, 1.02):
        h = part * step_limit(SCENE, method)
        try:
            run = mm.simulate(
                SCENE, method=method, timestep=h, duration=600 * h, initial=pushed,
                allow_unstable=True,
            )  # fmt: skip
        except mm.SimulationStopped as stop:
            run = stop.dataset
        spin = np.linalg.norm(run.angular_velocity.values, axis=1)
        growth.append(spin[-20:].max() / spin[:20].max())
    assert growth[0] < 1e-4  # 4e-6
    assert growth[1] > 3e3  # 6e4 .. 2e6


def test_a_moving_ring_and_a_plane_that_bears_the_ball():
    """By MuJoCo's RK4, against DOP853 on the paper's plane; J relative to its largest value."""
    light = {**HEAVY, "center_of_mass": (1e-3, -2e-3, 1e-3)}
    moving = mm.Top.experiment(**light)
    bearing = mm.Top.paper(4, **light)
    for scene, surface, timestep, duration, bound in (
        (moving, "planar", 0.005, 15, 1e-4),  # 4.2e-6
        (bearing, "plane", 0.002, 3, 6e-5),  # 2.8e-6
    ):
        truth = mm.simulate(scene, method="scipy/dop853", timestep=0.02, duration=duration)
        run = mm.simulate(
            scene.replace(surface=surface), method="mujoco/rk4", timestep=timestep,
            duration=duration, record_interval=round(0.02 / timestep),
        )  # fmt: skip
        apart = float(abs(run.momentum_map - truth.momentum_map).max())
        assert apart < bound * float(abs(truth.momentum_map).max())
