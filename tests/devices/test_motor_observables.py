"""Observables of the motor for paths and series with known results."""

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from refusals import refused
from scipy.spatial.transform import Rotation

import magmotor as mm
from magmotor.devices.motor.flights import turning_points
from magmotor.numerics.batch_means import mean_and_error
from magmotor.observables import (
    azimuth,
    censored_mean,
    dwell_times,
    efficiency,
    energy_balance,
    flights,
    mode_temperatures,
    motor_wells,
    ring_attitude,
    transitions,
)

SCENE = mm.Motor()
SECTOR = 2 * math.pi / 5


def rolled(*sectors, step=0.01):
    """Return a run in which theta moves from sector to sector, one sector per second."""
    pieces = [
        np.arange(round(abs(b - a) / step)) * math.copysign(step, b - a) + a
        for a, b in itertools.pairwise(sectors)
    ]
    return path_of(SECTOR * np.append(np.concatenate(pieces), sectors[-1]), step)


def path_of(theta, step=1.0):
    position = np.stack([np.cos(theta), np.sin(theta), np.full_like(theta, 0.04)], axis=-1)
    dims = ("replica", "time", "space")[3 - position.ndim :]
    time = step * np.arange(theta.shape[-1])
    return xr.Dataset({"position": (dims, position)}, {"time": time, "space": ["x", "y", "z"]})


def test_azimuth_is_unwrapped_and_rejects_ambiguous_steps():
    theta = np.array([np.linspace(0.3, 40, 100), np.linspace(-3, -70, 100)])
    found = azimuth(path_of(theta))
    assert found.dims == ("replica", "time")
    assert found.attrs["units"] == "rad"
    np.testing.assert_allclose(found, theta, rtol=5e-15)  # 2e-16
    np.testing.assert_allclose(azimuth(path_of(theta[0])), theta[0], rtol=1e-15)  # 0
    with refused("largest rotation between two records"):
        azimuth(path_of(np.array([0.0, 1.6])))


def test_ring_attitude_separates_twist_from_swing():
    """For any tilt and direction, and for both signs of the quaternion."""
    random = np.random.default_rng(1)
    tilt, yaw = random.uniform(0, 1.2, 300), np.cumsum(random.uniform(-0.5, 1.5, 300))
    side = random.uniform(0, 2 * math.pi, 300)
    swing = tilt * np.array([-np.sin(side), np.cos(side), 0 * side])
    rotation = Rotation.from_rotvec(swing.T) * Rotation.from_euler("z", yaw[:, np.newaxis])
    orientation = rotation.as_quat(scalar_first=True) * random.choice([-1, 1], (300, 1))
    columns = {
        "ring_orientation": (("time", "component"), orientation),
        "ring_axis": (("time", "space"), rotation.apply([0.0, 0.0, 1.0])),
    }
    run = xr.Dataset(columns, {"time": np.arange(300.0), "space": ["x", "y", "z"]})
    found = ring_attitude(run)
    np.testing.assert_allclose(found.tilt, tilt, rtol=0, atol=5e-15)  # 2e-16
    np.testing.assert_allclose(
        found.yaw - found.yaw[0], yaw - yaw[0], rtol=0, atol=1e-12
    )  # 8.5e-14
    both = xr.concat([run] * 2, "replica")
    np.testing.assert_array_equal(ring_attitude(both).yaw[1], found.yaw)


@pytest.mark.parametrize(("factor", "radius", "barrier"), [(2, 0.5906, 0.587), (1, 0.5997, 0.665)])
def test_wells_and_their_barrier(factor, radius, barrier):
    scene = mm.Motor(ball_ring_factor=factor)
    wells = motor_wells(scene)
    assert wells.radius == pytest.approx(radius, abs=1e-4)  # 1.9e-5
    assert wells.barrier / scene.kT == pytest.approx(barrier, abs=1e-3)  # 3.8e-4
    np.testing.assert_allclose(wells.azimuth, SECTOR * np.arange(5), rtol=1e-15)  # 0
    points = mm.observables.critical_points(scene)
    for kind, energy in (("minimum", wells.energy), ("saddle", wells.energy + wells.barrier)):
        nearest = min((p for p in points if p.kind == kind), key=lambda p: abs(p.energy - energy))
        assert nearest.energy == pytest.approx(energy, rel=1e-15, abs=0)  # 0, or rounding


def test_transitions_have_hysteresis():
    """There is no transition between two cores, however often the ball passes the barrier."""
    run = rolled(0, 0.7, 0.3, 0.74, 0.26, 0.76, 0.26, 0.24, -0.3, -1)
    found = transitions(run, SCENE)
    assert found.well.values.tolist() == [1, 0, -1]
    assert found.step.values.tolist() == [1, -1, -1]
    assert found.time.values[0] == pytest.approx(
        0.7 + 0.4 + 0.44 + 0.48 + 0.5 - 0.01, rel=1e-15, abs=0
    )  # 0
    between = rolled(0.4, 0.6, 0.4)
    assert not transitions(between, SCENE).sizes["transition"]


def test_turning_points_ignore_small_reversals():
    theta = np.array([0, 0.1, -0.1, 1, 0.8, 3, 2.6, 2.7, -1, -0.9, 5.0])
    assert turning_points(theta, 0.3) == [0, 2, 5, 8, 10]
    assert turning_points(theta, 0.1999999) == [0, 1, 2, 3, 4, 5, 8, 10]
    assert turning_points(-theta, 0.3) == [0, 2, 5, 8, 10]
    assert turning_points(theta[2:], 0.3) == [0, 3, 6, 8]
    assert turning_points(theta, 10.0) == [0, 10]


def test_an_initial_dwell_is_not_part_of_the_flight():
    """Even if the ball swings only a little during the dwell."""
    run = rolled(0, *[-0.05, 0.05] * 20, -0.1, 7)
    found = flights(run, SCENE)
    np.testing.assert_allclose(found.begin, [4.1], rtol=1e-15)  # 0
    np.testing.assert_allclose(dwell_times(run, SCENE).end, [4.1], rtol=1e-15)  # 0


def test_flights_and_dwells_of_a_prescribed_path():
    """Swing, 1.7 revolutions, almost one, three backward, and one that is censored."""
    run = rolled(0, 0.6, -0.4, 7.1, 6.9, 8.1, 5, 9, -6, -5, -5.5, 0)
    found, dwells = flights(run, SCENE), dwell_times(run, SCENE)
    np.testing.assert_allclose(found.revolutions, [8.5 / 5, -3, 5.5 / 5], rtol=1e-15)  # 0
    np.testing.assert_allclose(found.begin, [1.6, 17.6, 34.1], rtol=1e-15)  # 0
    np.testing.assert_allclose(found.once, [6.6, 22.6, 39.1], atol=0.011)  # 0.01
    np.testing.assert_allclose(found.end, [10.5, 32.6, 39.6], rtol=1e-15)  # 0
    assert found.censored.values.tolist() == [False, False, True]
    np.testing.assert_allclose(dwells.begin, [0, 10.5, 32.6], rtol=1e-15)  # 0
    np.testing.assert_allclose(dwells.end, [1.6, 17.6, 34.1], rtol=1e-15)  # 0
    assert dwells.censored.values.tolist() == [False, False, False]


def test_a_run_without_flight_is_one_dwell_and_replicas_are_separate():
    quiet, fast = (path_of(theta) for theta in (np.zeros(99), np.linspace(0, 9, 99)))
    assert flights(quiet, SCENE).sizes["flight"] == 0
    assert transitions(quiet, SCENE).sizes["transition"] == 0
    assert dwell_times(quiet, SCENE).to_dict(data="list")["data_vars"]["end"]["data"] == [98]
    both = xr.concat([fast, quiet, fast], "replica")
    found, dwells = flights(both, SCENE), dwell_times(both, SCENE)
    assert found.replica.values.tolist() == [0, 2]
    assert found.censored.values.all()
    assert dwells.replica.values.tolist() == [1]
    assert dwells.censored.values.all()
    assert transitions(both, SCENE).replica.values.tolist() == [0] * 7 + [2] * 7


def test_mean_of_censored_durations():
    """Three durations, and mean and error of exponential ones over 400 repetitions."""
    assert censored_mean([3, 5, 4], [False, False, True]) == (6.0, math.sqrt(9 + 1 + 16) / 2, 2)
    assert math.isnan(censored_mean([3], [True]).mean)
    random = np.random.default_rng(3)
    duration, seen = random.exponential(7, (400, 100)), random.exponential(14, (400, 100))
    means = [
        censored_mean(np.minimum(*pair), pair[0] > pair[1])
        for pair in zip(duration, seen, strict=True)
    ]
    assert np.mean([m.mean for m in means]) == pytest.approx(7, abs=0.15)  # 0.12; one error: 0.05
    wrong = np.array([(m.mean - 7) / m.error for m in means])
    assert np.std(wrong) == pytest.approx(1, abs=0.15)  # 1.001; one error: 0.035
    assert np.mean([m.completed for m in means]) == pytest.approx(200 / 3, rel=0.03)  # 0.0084


@pytest.mark.parametrize("memory", [0.0, 0.9])
def test_error_of_the_mean_of_a_correlated_series(memory):
    """The error for an autoregressive series has a closed form."""
    random = np.random.default_rng(4)
    series = np.empty((40, 20000))
    series[:, 0] = random.standard_normal(40)
    kicks = math.sqrt(1 - memory**2) * random.standard_normal(series.shape)
    for i in range(1, 20000):
        series[:, i] = memory * series[:, i - 1] + kicks[:, i]
    variance = (1 + memory) / (1 - memory)
    mean, error = mean_and_error(3 + series)
    assert error == pytest.approx(math.sqrt(variance / series.size), rel=0.16)  # 4 %: one sigma
    assert abs(mean - 3) < 4 * error
    single = [mean_and_error(row)[1] for row in series]
    assert np.mean(np.square(single)) == pytest.approx(variance / 20000, rel=0.35)  # 8 %


def gibbs(scene, replicas, count):
    """Draw independent states from Gibbs' law, so that slow modes have no correlation either."""
    random = np.random.default_rng(5)
    shape = (replicas, count)

    def normal(inertia, *size):
        return np.sqrt(scene.kT / inertia) * random.standard_normal((*shape, *size))

    velocity = normal(scene.ball_mass, 3) * [1, 1, 0]
    spin, body = normal(scene.ball_inertia, 3), normal(np.array(scene.inner_moments), 3)
    rotation = Rotation.random(replicas * count, rng=random)
    angle = random.uniform(0, 7, shape)
    position = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    slip = velocity + np.cross(spin, [0, 0, -scene.ball_radius])
    vectors = {
        "position": 0.6 * position,
        "velocity": velocity,
        "angular_velocity": spin,
        "slip_velocity": slip,
        "ring_angular_velocity": rotation.apply(body.reshape(-1, 3)).reshape(body.shape),
    }
    dims = ("replica", "time", "space")
    data: dict[str, Any] = {name: (dims, values) for name, values in vectors.items()}
    quaternion = rotation.as_quat(scalar_first=True).reshape(*shape, 4)
    data["ring_orientation"] = (("replica", "time", "component"), quaternion)
    data["momentum_map"] = (("replica", "time"), scene.ball_inertia * spin[..., 2])
    return xr.Dataset(data, {"time": np.arange(count), "space": ["x", "y", "z"]})


def test_each_mode_has_the_temperature_of_gibbs_law():
    run = gibbs(SCENE, 8, 20000)
    # With other moments of inertia only the modes of the ring are colder.
    for scene, ring in ((SCENE, 1.0), (replace(SCENE, inner_mass=3.0, inner_axial_inertia=2.0), 0)):
        found = mode_temperatures(run, scene)
        assert float(found.theory) == scene.kT
        for mode in found.mode.values:
            own = found.sel(mode=mode)
            expected = scene.kT
            if mode.startswith("ring") and not ring:
                i = int(mode[-1]) - 1
                expected *= scene.inner_moments[i] / SCENE.inner_moments[i]
            assert abs(own.temperature - expected) < 4 * own.temperature_error
            # The error of a mean of independent squares; the slip is the sum of two squares.
            relative = math.sqrt((1 if mode == "slip" else 2) / 160_000)
            assert own.temperature_error == pytest.approx(relative * expected, rel=0.35)  # 9 %
    one = mode_temperatures(run.isel(replica=0), SCENE, burn_in=10000)
    expected = SCENE.ball_inertia * np.mean(run.angular_velocity[0, 10000:, 2] ** 2)
    assert float(one.temperature.sel(mode="spin")) == pytest.approx(
        float(expected), rel=3e-15, abs=0
    )  # 0, or rounding
    assert "theory" not in mode_temperatures(run, mm.Motor(temperature="nonuniform"))


def random_energies(replicas=None):
    """Return a run with random energies, for which the identities must also hold."""
    random = np.random.default_rng(7)
    dims = ("time",) if replicas is None else ("replica", "time")
    shape = (50,) if replicas is None else (replicas, 50)
    names = ("energy", "ring_energy", "heat", "work", "ring_heat", "ring_work")
    data = {name: (dims, 1e-3 * random.standard_normal(shape).cumsum(-1)) for name in names}
    return xr.Dataset(data, {"time": 5 + 0.5 * np.arange(50)})


@pytest.mark.parametrize("replicas", [None, 3])
def test_energy_balance(replicas):
    run = random_energies(replicas)
    found = energy_balance(run, SCENE)
    assert found.residual.dims == run.work.dims
    np.testing.assert_allclose(
        found.gain - run.energy, -run.energy.isel(time=[0] * 50), rtol=0, atol=5e-17
    )  # 1.7e-18
    heat, work = (run[name] - run[name].isel(time=0) for name in ("heat", "work"))
    np.testing.assert_allclose(
        found.residual, found.gain + heat - work, rtol=0, atol=1e-17
    )  # 0, or rounding of 0.01
    np.testing.assert_allclose(
        found.injected + found.martingale, work, rtol=0, atol=4e-17
    )  # 1.7e-18
    # alpha_B^2 (1/m + r^2/J_B) = 1e-6 (2 + 5), and alpha_R^2/2 (2 * 2 + 1)/J_3, J_3 = 3.375.
    last = found.injected.isel(time=-1)
    np.testing.assert_allclose(last, 24.5 * (7e-6 + 2.5e-6 / 3.375), rtol=2e-15)  # 0
    cold = mm.Motor(temperature="nonuniform")
    injected = energy_balance(run, cold).injected.isel(time=-1)
    np.testing.assert_allclose(injected, 24.5 * 2e-4**2 * 2.5 / 3.375, rtol=4e-15)  # 1.5e-16


def test_efficiency_of_given_energies():
    """Of 10 J of kicks the ring keeps 2 and dissipates 1; the ball dissipates 4 of the other 7."""
    values = {"energy": 5, "ring_energy": 2, "heat": 5, "ring_heat": 1, "work": 10, "ring_work": 10}
    run = xr.Dataset({k: ("time", [0.0, v]) for k, v in values.items()}, {"time": [0.0, 1.0]})
    found = efficiency(run + 0, SCENE).isel(time=1)
    assert float(found.transferred) == 3
    assert float(found.efficiency) == pytest.approx(0.3, rel=1e-15, abs=0)  # 0
    assert float(found.reached) == 7
    assert float(found.share) == pytest.approx(0.7, rel=1e-15, abs=0)  # 0
    noisy = run.assign(work=run.work * 1.5)  # the noise on the ball has done 5 J of it
    assert float(efficiency(noisy, SCENE).share[1]) == pytest.approx(0.2, rel=1e-15, abs=0)  # 0
    assert np.isnan(efficiency(run, SCENE).share[0])
