"""The physical prototype's questions: dry friction, lift-off and finite magnets."""

import math

import magpylib
import mujoco
import numpy as np
import pytest
from PIL import Image

import magmotor as mm
from magmotor import dipoles
from paper.prototype import dry_friction, finite_magnets, finite_ring, lift_off, magnet_shapes
from paper.prototype.bracket import bracket
from paper.prototype.dry_friction_limits import held_axis, hertz_torsional_coefficient
from paper.prototype.lift import any_axis, critical_height, largest_lift, lift_map

MU0 = 4e-7 * math.pi
RNG = np.random.default_rng(5)


def drawn(figure, data, folder):
    path = folder / f"{figure.name}.png"
    figure.draw(data, path)
    assert path.stat().st_size < 150_000  # 18 to 25 kB
    with Image.open(path) as picture:
        assert picture.width == 990
    return figure.claims(data)


def verdicts(claims):
    return [claim.verdict for claim in claims]


@pytest.mark.parametrize(("first", "last"), [(1e-3, 10.0), (10.0, 1e-3)])
def test_a_bracket_holds_the_threshold(first, last):
    below = (lambda x: x < 0.3) if first < last else (lambda x: x > 0.3)
    holds, fails = bracket(below, first, last, 1.01)
    assert below(holds)
    assert not below(fails)
    assert max(holds, fails) / min(holds, fails) < 1.01


def test_a_bracket_that_holds_nothing_is_refused():
    with pytest.raises(ValueError, match="first = 1: the condition must hold there"):
        bracket(lambda _: False, 1.0, 2.0, 1.1)
    with pytest.raises(ValueError, match="last = 2: the condition must fail there"):
        bracket(lambda _: True, 1.0, 2.0, 1.1)


@pytest.fixture(scope="module")
def dry():
    return dry_friction.compute(quick=True)


def test_dry_friction_figure(dry, tmp_path):
    claims = drawn(dry_friction.FIGURE, dry, tmp_path)
    assert verdicts(claims) == ["right"] * 4 + ["in part", "right"]


def test_weak_coulomb_friction_spins_the_ball_as_first_order_says(dry):
    for level, bound in ((0.01, 0.15), (0.5, 0.3)):
        above, below = dry.thresholds["instead", level]
        expected = level * dry.viscous / dry.slope
        assert math.sqrt(above * below) == pytest.approx(expected, rel=bound)  # 2 %, 14 %


def test_strong_coulomb_friction_lets_the_ball_roll_as_energy_says(dry):
    strongest = dry.spins["instead"][1][-1]
    assert strongest == pytest.approx(dry.stuck.spin, rel=0.02)  # 0.8 %
    slips, sticks = dry.sticking
    assert dry.stuck.coulomb < sticks  # 0.0108 < 0.0205
    assert slips < dry.stuck.coulomb_librating  # 0.0178 < 0.0197


def test_friction_torques_stop_the_ball_where_statics_says(dry):
    for kind, estimate in zip(("torsional", "rolling"), dry.stopping, strict=True):
        above, below = dry.thresholds[kind, 0.05]
        assert 0.8 < estimate / above < 1.4  # 1.15, 1.16
        assert dry.thresholds[kind, 0.5][1] < below  # 1.8e-5, 1.5e-5 < 3.2e-5


def test_coulomb_friction_is_stiction():
    """MuJoCo's solver without regularisation has the same spin."""
    scene = mm.Top(surface="plane", friction=0.0, coulomb_friction=0.3)
    largest = []
    for iterations in (0, 20):
        model = mm.build(scene)
        model.opt.timestep, model.opt.noslip_iterations = 0.004, iterations
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        spin = []
        with mm.magnetism():
            for _ in range(300):
                mujoco.mj_step(model, data, nstep=50)
                spin.append(abs(data.qvel[-1]))
        largest.append(max(spin))
    assert largest[1] == pytest.approx(largest[0], rel=5e-5)  # 2e-6


def test_no_torque_turns_the_axis_of_a_ball_that_friction_holds():
    scene = mm.Top()
    points = RNG.uniform(-0.2, 0.2, (20, 2))
    axis, force, energy = held_axis(scene, points)
    centre = np.insert(points, 2, scene.ball_radius, axis=1)
    pull, torque = dipoles.wrench(centre, scene.moment * axis, *scene.ring_sources())
    about = torque + np.cross([0.0, 0.0, scene.ball_radius], pull)
    across = about - np.sum(about * axis, axis=1, keepdims=True) * axis
    assert np.abs(across).max() < 1e-10 * np.abs(energy).max()  # 1e-11
    assert np.abs(force - pull).max() < 1e-9 * np.abs(pull).max()  # 7e-11


def test_torque_of_a_hertzian_contact_that_slides():
    scene, modulus, friction = mm.Top(), 1e11, 0.4
    load = scene.ball_mass * scene.gravity
    radius = (0.75 * load * scene.ball_radius / modulus) ** (1 / 3)
    r = (np.arange(100_000) + 0.5) / 100_000
    pressure = 1.5 * load / (math.pi * radius**2) * np.sqrt(1 - r**2)
    torque = friction * np.mean(pressure * radius * r * 2 * math.pi * r) * radius**2
    coefficient = hertz_torsional_coefficient(scene, friction, modulus)
    assert coefficient == pytest.approx(torque / load, rel=2e-7)  # 1e-8


@pytest.fixture(scope="module")
def lift():
    return lift_off.compute(quick=True)


def test_lift_off_figure(lift, tmp_path):
    claims = drawn(lift_off.FIGURE, lift, tmp_path)
    assert verdicts(claims) == ["right", "wrong", "in part", "wrong"]


def test_lift_is_the_gradient_of_the_energy():
    scene, points, step = mm.Top(), RNG.uniform(-0.4, 0.4, (50, 2)), 1e-6
    lift, axis = lift_map(scene, points)
    up, down = (
        dipoles.energy(
            np.insert(points, 2, scene.ball_radius + side, axis=1),
            scene.moment * axis,
            *scene.ring_sources(),
        )
        for side in (step, -step)
    )
    weight = scene.ball_mass * scene.gravity
    expected = (down - up) / (2 * step) / weight
    assert np.abs(lift - expected).max() < 1e-9 * np.abs(lift).max()  # 7e-11


def test_no_axis_is_lifted_more_than_the_bound():
    scene, points = mm.Top(), RNG.uniform(-0.4, 0.4, (50, 2))
    bound = any_axis(scene, points)
    axes = RNG.normal(size=(2000, 1, 3))
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    centre = np.insert(points, 2, scene.ball_radius, axis=1)
    force = dipoles.wrench(centre, scene.moment * axes, *scene.ring_sources())[0][..., 2]
    lifts = force.max(axis=0) / (scene.ball_mass * scene.gravity)
    assert np.all(lifts <= bound * (1 + 1e-12))
    assert np.all(lifts > 0.97 * bound)  # 0.99: one of 2000 is near the best


def test_runs_leave_the_plane_where_statics_says(lift):
    at_paper = lift.ran == 0.2
    stays, leaves = lift.brackets[at_paper][0]
    static = lift.scene.coupling / largest_lift(lift.scene).aligned
    bound = lift.scene.coupling / largest_lift(lift.scene).any_axis
    assert bound <= static
    assert bound < leaves
    assert 0.97 < stays / static < leaves / static < 1.08  # 0.99, 1.03
    assert lift.first.lift == pytest.approx(1.0, abs=0.05)  # 1.01
    assert lift.brackets[0, 0] > 3 * np.interp(0.1, lift.heights, lift.aligned)  # 4.1
    assert lift.si.lift > 1  # 1.19
    caught, passes = lift.caught
    assert 0.1 < caught < passes < 0.13


def test_critical_height_is_that_of_the_largest_lift():
    scene = mm.Top()
    at = largest_lift(scene.replace(ring_height=critical_height(scene)))
    assert at.aligned == pytest.approx(1.0, rel=2e-3)  # 1e-4


def magnet(shape, edge, moment=10.0):
    """The same magnet by magpylib, its moment along x."""
    polarization = MU0 * moment / edge**3
    if shape == "rod":
        length = edge * (4 / math.pi) ** (1 / 3)
        body = magpylib.magnet.Cylinder(
            dimension=(length, length), polarization=(0, 0, polarization)
        )
        return body.rotate_from_angax(90, "y")
    slender = edge / 4 ** (1 / 3)
    wide = edge * 4 ** (1 / 3)
    edges = {
        "cube": (edge,) * 3,
        "bar": (4 * slender, slender, slender),
        "plate": (wide / 4, wide, wide),
    }
    return magpylib.magnet.Cuboid(dimension=edges[shape], polarization=(polarization, 0, 0))


def directions(count=100):
    points = RNG.normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


@pytest.mark.parametrize(
    ("shape", "bound"), [("cube", 1e-9), ("rod", 5e-9), ("plate", 1e-8), ("bar", 5e-7)]
)  # 1.5e-11, 1.7e-10, 5e-10, 3e-8
def test_shapes_against_magpylib(shape, bound):
    edge, points = 0.0213, 0.2 * directions()
    true = magnet(shape, edge).getB(points)
    positions, parts = magnet_shapes.SHAPES[shape](edge)
    found = dipoles.field(points, positions, np.outer(parts, [10.0, 0.0, 0.0]))
    assert np.abs(found - true).max() < bound * np.abs(true).max()
    dipole = dipoles.field(points, [[0.0, 0.0, 0.0]], [[10.0, 0.0, 0.0]])
    assert np.abs(dipole - true).max() > 1e-5 * np.abs(true).max()  # 1.9e-5 to 3e-2


def test_a_magnetised_ball_is_a_dipole():
    radius, points = 0.018, 0.05 * directions()
    moment = np.array([1.0, -2.0, 0.5])
    polarization = MU0 * moment / (4 / 3 * math.pi * radius**3)
    ball = magpylib.magnet.Sphere(diameter=2 * radius, polarization=polarization)
    true = dipoles.field(points, [[0.0, 0.0, 0.0]], [moment])
    assert np.abs(ball.getB(points) - true).max() < 2e-14 * np.abs(true).max()  # 9e-16


def test_a_cylinder_of_the_right_length_has_no_second_order():
    points = 0.3 * directions()
    dipole = dipoles.field(points, [[0.0, 0.0, 0.0]], [[1.0, 0.0, 0.0]])

    def difference(radius):
        positions, parts = magnet_shapes.cylinder(math.sqrt(3) * radius, radius)
        field = dipoles.field(points, positions, np.outer(parts, [1.0, 0.0, 0.0]))
        return np.abs(field - dipole).max()

    order = math.log2(difference(0.02) / difference(0.01))
    assert order == pytest.approx(4.0, abs=0.05)  # 4.00


def test_magnets_in_mujoco_are_those_of_the_ring():
    scene = mm.Top()
    cloud = magnet_shapes.bar(0.03)
    model = finite_ring.build(scene, cloud)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    on_ring = model.site_bodyid == model.body("ring").id
    positions, moments = finite_ring.sources(scene, cloud)
    assert np.abs(data.site_xpos[on_ring] - positions).max() < 5e-16  # 3e-17
    axes = data.site_xmat[on_ring].reshape(-1, 3, 3)[:, :, 2]
    sized = model.site_user[on_ring, :1] * axes
    assert np.abs(sized - moments).max() < 2e-15  # 1e-16


def test_one_point_a_magnet_is_the_scene():
    scene = mm.Top()
    point = np.zeros((1, 3)), np.ones(1)
    runs = [
        finite_ring.momentum(scene, model, 5.0)
        for model in (finite_ring.build(scene, point), mm.build(scene))
    ]
    assert np.abs(runs[0] - runs[1]).max() < 5e-15 * np.abs(runs[1]).max()  # 9e-16
    run = mm.simulate(scene, method="mujoco/rk4", timestep=0.025, duration=5, record_interval=4)
    assert np.abs(runs[1] - run.momentum_map.values).max() < 5e-15 * np.abs(runs[1]).max()  # 2e-16


@pytest.fixture(scope="module")
def finite():
    return finite_magnets.compute(quick=True)


def test_finite_magnets_figure(finite, tmp_path):
    claims = drawn(finite_magnets.FIGURE, finite, tmp_path)
    assert verdicts(claims) == ["right", "wrong", "right", "in part", "in part"]
    assert finite.ball_force < 2e-13  # 9e-15


def test_orders_in_the_size_of_the_magnets(finite):
    expected = {"cube": 4.0, "rod": 2.0, "plate": 2.0, "bar": 2.0}
    for shape, slope in expected.items():
        for differences in (finite.fields[shape], finite.changes[shape]):
            measured = finite_magnets.order(finite.edges, differences)
            assert measured == pytest.approx(slope, abs=0.1)  # 0.04


def test_a_tilted_ring_of_cubes_against_magpylib():
    scene, edge = mm.Top(), 0.06
    points = np.insert(RNG.uniform(-0.2, 0.2, (50, 2)), 2, scene.ball_radius, axis=1)
    normal = np.array([math.sin(scene.tilt), 0.0, math.cos(scene.tilt)])
    field = np.zeros((50, 3))
    for position, moment in zip(*scene.ring_sources(), strict=True):
        outward = moment / scene.moment
        turn = np.stack([outward, np.cross(normal, outward), normal], axis=1)
        field += magnet("cube", edge).getB((points - position) @ turn) @ turn.T
    found = dipoles.field(points, *finite_ring.sources(scene, magnet_shapes.cube(edge)))
    assert np.abs(found - field).max() < 1e-7 * np.abs(field).max()  # 4e-8
