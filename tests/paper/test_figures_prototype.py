"""Questions about a physical prototype: dry friction, lift-off and finite magnets."""

import math

import mujoco
import numpy as np
import pytest

import magmotor as mm
from paper.bracket import bracket
from paper.prototype import dry_friction, finite_magnets, lift_off
from paper.top.finite_ring import build_finite_ring
from paper.top.lift import largest_lift


@pytest.mark.parametrize(("first", "last"), [(1e-3, 10.0), (10.0, 1e-3)])
def test_a_bracket_holds_the_threshold(first, last):
    below = (lambda x: x < 0.3) if first < last else (lambda x: x > 0.3)
    holds, fails = bracket(below, first, last, 1.01)
    assert below(holds)
    assert not below(fails)
    assert max(holds, fails) / min(holds, fails) < 1.01


@pytest.fixture(scope="module")
def dry():
    return dry_friction.compute(True)


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
    """MuJoCo's solver without regularization has the same spin."""
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


@pytest.fixture(scope="module")
def lift():
    return lift_off.compute(True)


def test_runs_leave_the_plane_where_statics_says(lift):
    at_paper = lift.ran == 0.2
    stays, leaves = lift.brackets[at_paper][0]
    static = lift.scene.coupling / largest_lift(lift.scene).aligned
    bound = lift.scene.coupling / largest_lift(lift.scene).any_axis
    assert bound <= static
    assert bound < leaves
    assert 0.97 < stays / static < leaves / static < 1.08  # 0.99, 1.03
    assert lift.first.lift == pytest.approx(1.0, abs=0.005)  # 1.0003
    assert lift.brackets[0, 0] > 3 * np.interp(0.1, lift.heights, lift.aligned)  # 4.1
    assert lift.si.lift > 1  # 1.19
    caught, passes = lift.caught
    assert 0.1 < caught < passes < 0.13


@pytest.mark.parametrize(
    ("shape", "slenderness"), [("cube", 1), ("rod", 1), ("plate", 1 / 4), ("bar", 4)]
)
def test_shapes_have_the_volume_of_the_cube(shape, slenderness):
    """By the mean squares of coordinates: edge²/12 and radius²/4."""
    points, parts = finite_magnets.SHAPES[shape](0.02)
    deviation = np.sqrt(parts @ points**2)
    length = math.sqrt(12) * deviation[0]
    width, depth = (4 if shape == "rod" else math.sqrt(12)) * deviation[1:]
    area = math.pi / 4 if shape == "rod" else 1
    assert length * width * depth * area == pytest.approx(0.02**3, rel=2e-14, abs=0)  # 1.7e-15
    assert length / width == pytest.approx(slenderness, rel=5e-15, abs=0)  # 3.3e-16


def test_one_point_a_magnet_is_the_scene():
    scene = mm.Top()
    point = np.zeros((1, 3)), np.ones(1)
    runs = [
        finite_magnets.momentum(scene, model, 5.0)
        for model in (build_finite_ring(scene, point), mm.build(scene))
    ]
    assert np.abs(runs[0] - runs[1]).max() < 5e-15 * np.abs(runs[1]).max()  # 2.5e-16
    run = mm.simulate(scene, method="mujoco/rk4", timestep=0.025, duration=5, record_interval=4)
    assert np.abs(runs[1] - run.momentum_map.values).max() < 5e-15 * np.abs(runs[1]).max()  # 2e-16


@pytest.fixture(scope="module")
def finite():
    return finite_magnets.compute(True)


def test_a_ball_magnetized_throughout_is_pulled_as_a_dipole(finite):
    assert finite.ball_force < 2e-13  # 9e-15


def test_orders_in_the_size_of_the_magnets(finite):
    expected = {"cube": 4.0, "rod": 2.0, "plate": 2.0, "bar": 2.0}
    for shape, slope in expected.items():
        for differences in (finite.fields[shape], finite.changes[shape]):
            measured = finite_magnets.order(finite.edges, differences)
            assert measured == pytest.approx(slope, abs=0.1)  # 0.04
