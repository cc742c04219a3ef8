"""V_e, its minima, valley and saddles, compared with reference numbers and closed forms."""

import math

import numpy as np
import pytest

import magmotor as mm
from magmotor import observables, theory
from magmotor.devices.ball.landscape import effective_potential, valley


def test_level_ring():
    scene = mm.Top(tilt=0.0)
    points = observables.critical_points(scene)
    kinds = [point.kind for point in points]
    assert [kinds.count(k) for k in ("minimum", "saddle", "maximum")] == [20, 20, 1]
    assert points[-1].energy == pytest.approx(-4.353e-3, rel=1e-4)  # 9.2e-5
    assert observables.minimum(scene).energy == pytest.approx(-7.165e-3, rel=1e-4)  # 5.4e-5
    ripple = observables.saddle(scene).energy - observables.minimum(scene).energy
    assert ripple == pytest.approx(4.9e-7, rel=0.02)  # 0.0092
    assert observables.valley_radius(scene) == pytest.approx(0.2770, abs=1e-4)  # 1.5e-5


def test_tilted_ring():
    scene = mm.Top(tilt=math.pi / 64)
    kinds = [point.kind for point in observables.critical_points(scene)]
    assert sorted(kinds) == ["maximum", "minimum", "saddle"]
    low, high = observables.minimum(scene), observables.saddle(scene)
    assert low.energy == pytest.approx(-8.206e-3, rel=1e-4)  # 2.8e-5
    assert low.position == pytest.approx((0.2851, 0), abs=1e-4)  # 3.2e-5
    assert high.energy == pytest.approx(-6.379e-3, rel=1e-5)  # 6e-7
    assert high.position == pytest.approx((-0.2679, 0), abs=1e-4)  # 2.6e-5
    turned = mm.Top(tilt_azimuth=2.0)
    turned_low = observables.minimum(turned)
    assert math.atan2(*turned_low.position[::-1]) == pytest.approx(2.0, abs=0.02)  # 0.017


@pytest.mark.parametrize(
    "tilt", [0.0, 2e-4, 1e-3, *np.linspace(4.3e-3, 4.8e-3, 6), *np.linspace(0.01, 0.5, 8)]
)
def test_no_critical_point_is_missed(tilt):
    """V_e increases outward, so that minima and maxima minus saddles are one."""
    kinds = [point.kind for point in observables.critical_points(mm.Top(tilt=float(tilt)))]
    assert len(kinds) - 2 * kinds.count("saddle") == 1


def test_the_saddle_is_the_highest_point_of_the_valley():
    """It is one of five, each between two dipoles; 120 azimuths come close to it."""
    scene = mm.Top(ring_dipoles=5, tilt=0.05, tilt_azimuth=0.3)
    around = np.linspace(0, 2 * np.pi, 120, endpoint=False)
    along = effective_potential(scene, valley(scene, around))
    found = observables.saddle(scene).energy
    assert found - 2e-6 < along.max() < found  # 6.7e-7 J; the next saddle is 3.4e-5 J lower


def test_a_minimum_near_its_saddles_is_found():
    """It is on the mirror line of a tilted ring, 2 mm from two saddles."""
    points = observables.critical_points(mm.Top(tilt=4.7e-3))
    behind = sorted((p for p in points if p.position[0] < -0.2), key=lambda p: p.position[1])
    assert [p.kind for p in behind] == ["saddle", "minimum", "saddle"]
    assert behind[1].position == pytest.approx((-0.2762, 0.0), abs=1e-4)  # 1.1e-5, 4e-13
    assert behind[2].position[1] == pytest.approx(-behind[0].position[1], abs=1e-11)  # 6e-13


def test_a_high_ring_has_its_only_minimum_at_the_center():
    scene = mm.Top(tilt=0.0, ring_height=0.6)
    (point,) = observables.critical_points(scene)
    assert point.kind == "minimum"
    assert np.hypot(*point.position) < 1e-15  # 0
    with pytest.raises(mm.InputError):
        observables.saddle(scene)


@pytest.mark.parametrize(
    "scene",
    [mm.Top(ring_dipoles=1), mm.Top(ring_dipoles=3), mm.Top(tilt=0.0, ring_height=0.05)],
    ids=["one dipole", "three dipoles", "low ring"],
)
def test_critical_points_are_near_and_stationary(scene):
    points = observables.critical_points(scene)
    assert points
    assert points[0].kind == "minimum"
    for point in points:
        assert np.hypot(*point.position) <= 1.5 * scene.ring_radius
        around = point.position + 1e-4 * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
        values = observables.effective_potential(scene, around)
        slope = max(abs(values[0] - values[1]), abs(values[2] - values[3])) / 2e-4
        assert slope < 1e-3 * abs(point.energy) / scene.ring_radius  # 6e-5


@pytest.mark.parametrize("seed", range(12))
def test_the_minimum_is_the_deepest_critical_point(seed):
    """For level rings, one of many."""
    rng = np.random.default_rng(seed)
    height, radius = rng.uniform(0.1, 0.6), rng.uniform(0.1, 0.6)
    tilt = rng.choice([0.0, 1e-3, 0.1, 0.6]) * min(1.0, height / radius)
    scene = mm.Top(
        ring_height=height, ring_radius=radius, tilt=tilt, ring_dipoles=int(rng.integers(1, 25))
    )
    found, deepest = observables.minimum(scene), observables.critical_points(scene)[0]
    assert found.kind == "minimum"
    assert found.energy == pytest.approx(deepest.energy, rel=3e-15, abs=0)  # 2e-16


@pytest.mark.parametrize(("ratio", "kind"), [(0.979, "maximum"), (0.981, "minimum")])
def test_the_center_is_a_maximum_only_while_the_ring_is_low(ratio, kind):
    scene = mm.Top(tilt=0.0, ring_height=0.018 + 0.34 * ratio, ring_dipoles=40)
    center = min(observables.critical_points(scene), key=lambda p: np.hypot(*p.position))
    assert np.hypot(*center.position) < 5e-14  # 3e-15
    assert center.kind == kind


def test_effective_potential_takes_any_shape_and_is_minus_m_b():
    scene = mm.Top()
    grid = np.random.default_rng(0).uniform(-0.3, 0.3, size=(4, 5, 2))
    values = observables.effective_potential(scene, grid)
    assert values.shape == (4, 5)
    field = mm.dipoles.field([*grid[1, 2], scene.ball_radius], *scene.ring_sources())
    assert values[1, 2] == pytest.approx(
        -scene.moment * np.linalg.norm(field), rel=1e-15, abs=0
    )  # 0


def test_closed_forms():
    scene = mm.Top(tilt=0.0)
    under = theory.field_under_center(scene)
    numeric = mm.dipoles.field([0, 0, scene.ball_radius], *scene.ring_sources())
    assert numeric == pytest.approx([0, 0, under], abs=3e-18)  # 1.6e-19
    assert theory.libration_frequency(scene, under) == pytest.approx(12.96, abs=0.005)  # 0.0014
    in_valley = -observables.minimum(scene).energy / scene.moment
    assert theory.libration_frequency(scene, in_valley) == pytest.approx(16.63, abs=0.005)  # 0.0043
    assert theory.slip_relaxation_rate(scene) == pytest.approx(5.25, rel=2e-15, abs=0)  # 1.7e-16


def test_the_axis_librates_at_the_predicted_frequency():
    scene = mm.Top.paper(1, position=(0, 0), axis=(0.01, 0, 1))
    run = mm.simulate(scene, method="mujoco/rk4", timestep=0.0125, duration=5)
    crossings = np.flatnonzero(np.diff(np.sign(run.axis[:, 0])))
    values, times = run.axis[:, 0].values, run.time.values
    exact = [times[i] - values[i] * (times[i + 1] - times[i]) / (values[i + 1] - values[i])
             for i in crossings]  # fmt: skip
    frequency = math.pi / np.mean(np.diff(exact))
    expected = theory.libration_frequency(scene, theory.field_under_center(scene))
    assert frequency == pytest.approx(expected, rel=1e-4, abs=0)  # 1e-5


@pytest.mark.parametrize("dipoles", [6, 20])
def test_the_height_above_which_a_level_ring_has_no_valley(dipoles):
    scene = mm.Top(tilt=0.0, ring_dipoles=dipoles)
    limit = theory.highest_valley(scene)
    assert (limit - scene.ball_radius) / scene.ring_radius == pytest.approx(
        0.980, abs=5e-4
    )  # 1.7e-4
    for height, kind in ((0.999 * limit, "maximum"), (1.001 * limit, "minimum")):
        points = mm.observables.critical_points(scene.replace(ring_height=height))
        assert [p.kind for p in points if math.hypot(*p.position) < 1e-6] == [kind]
