"""Boltzmann's law from `Langevin`: its parts, its limits, and trees against exact laws.

A deviation is in standard errors, from 16 batches or more: a bound of 5 is exceeded by chance once
in 6000 or less (Student's t, 15 degrees of freedom). All seeds are fixed.
"""

import math
from unittest.mock import patch

import mujoco
import numpy as np
import pytest
import scipy.linalg
import scipy.stats
from brief_runs import BRIEF

import magmotor as mm
from benchmarks.accuracy.tree_models import TREES
from benchmarks.accuracy.trees import Law, by_quadrature, sampled
from magmotor.mjcf.langevin.langevin import STATE
from magmotor.numerics.batch_means import mean_and_error

SIGMAS = 5
SPLITTINGS = ["baoab", "obabo", "middle", "verlet", "o-rk4-o"]


SLIDES = """
<mujoco>
  <option gravity="0 0 0"><flag contact="disable"/></option>
  <worldbody>
    <body>
      <joint name="a" type="slide" axis="1 0 0" damping="3" stiffness="{spring}"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <body>
        <joint name="b" type="slide" axis="1 1 0" damping="9" stiffness="{spring}"/>
        <inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/>
        <body>
          <joint name="c" type="slide" axis="1 1 1" damping="0.5" stiffness="{spring}"/>
          <inertial pos="0 0 0" mass="0.5" diaginertia="1 1 1"/>
        </body>
      </body>
    </body>
  </worldbody>
  <tendon>
    <fixed name="t" damping="2"><joint joint="a" coef="1"/><joint joint="c" coef="-1"/></fixed>
  </tendon>
</mujoco>
"""
"""Three slides at angles to each other, whose inertia is a constant full matrix."""

AXES = np.array([[1, 0, 0], [1, 1, 0] / np.sqrt(2), [1, 1, 1] / np.sqrt(3)])
CARRIED = np.array([3.5, 2.5, 0.5])
"""Masses that each slide moves."""
INERTIA = AXES @ AXES.T * CARRIED[np.maximum.outer(range(3), range(3))]
ROWS = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, -1]])
DAMPING = np.array([3, 9, 0.5, 2])
BATHS = {"a": 1.0, "b": 3.0, "c": 0.2, "t": 2.0}


REPLICAS = 500


def deviation(series, expected):
    """Return the difference of mean and expectation in standard errors."""
    mean, error = mean_and_error(np.asarray(series))
    return abs(mean - expected) / error


def slides(timestep, spring=0.0):
    model = mujoco.MjModel.from_xml_string(SLIDES.format(spring=spring))
    model.opt.timestep = timestep
    return model


def covariance_error(samples, expected):
    """Return the largest deviation of a covariance from independent samples, in standard errors."""
    outer = samples[:, :, np.newaxis] * samples[:, np.newaxis, :]
    return abs((outer.mean(0) - expected) / (outer.std(0) / math.sqrt(len(samples)))).max()


@pytest.mark.parametrize("splitting", ["baoab", "obabo"])
@pytest.mark.parametrize("size", [0.2, 1.0, 100.0])
def test_friction_and_noise_are_exact_for_any_timestep(splitting, size):
    """The law of velocities without forces, and the Kolmogorov-Smirnov test of each.

    From 500 independent replicas, 9 entries and 3 tests in each of 6 cases: a false alarm once in
    4000. Measured: at most 2.1 standard errors, and p of at least 0.05.
    A variance that is wrong by half is seen in 99 of 100 runs.
    """
    rates = scipy.linalg.eigvalsh((ROWS.T * DAMPING) @ ROWS, INERTIA)
    model = slides(size / rates[-1])
    x = size / 2 * rates / rates[-1]
    nstep = math.ceil(6 / np.log(abs((1 + x) / (1 - x + 1e-9))).min())
    run = mm.Langevin(model, 0.7, splitting=splitting, seed=3).sample(
        nstep * model.opt.timestep, replicas=REPLICAS, record_interval=nstep
    )
    velocities = run.qvel.values[:, -1]
    assert covariance_error(velocities, 0.7 * np.linalg.inv(INERTIA)) < SIGMAS
    unit = velocities @ scipy.linalg.cholesky(INERTIA / 0.7).T
    assert min(scipy.stats.kstest(each, "norm").pvalue for each in unit.T) > 1e-5


def baoab_map(h, spring):
    """Return the matrices x -> T x + N xi of BAOAB on (q, v), and of its part before O."""
    n = len(INERTIA)
    friction = (ROWS.T * DAMPING) @ ROWS
    kick, drift = np.eye(2 * n), np.eye(2 * n)
    kick[n:, :n] = -h / 2 * spring * np.linalg.inv(INERTIA)
    drift[:n, n:] = h / 2 * np.eye(n)
    solve = np.linalg.inv(INERTIA + h / 2 * friction)
    damp, noise = np.eye(2 * n), np.zeros((2 * n, len(ROWS)))
    damp[n:, n:] = solve @ (INERTIA - h / 2 * friction)
    noise[n:] = solve @ (ROWS.T * np.sqrt(2 * h * DAMPING * [*BATHS.values()]))
    return kick @ drift, damp, noise, drift @ kick


@pytest.mark.parametrize("size", [0.5, 1.0])
def test_several_baths_against_lyapunovs_equations(size):
    """Stationary covariance of the linear map, and the heat that flows between four baths.

    500 independent replicas. Measured: at most 2.4 standard errors.
    """
    spring = 40.0
    h = size / math.sqrt(scipy.linalg.eigvalsh(spring * np.eye(3), INERTIA)[-1])
    stationary, heats = linear_theory(h, spring)
    settle, nstep = math.ceil(30 / size), math.ceil(100 / size)
    run = mm.Langevin(slides(h, spring), BATHS, seed=4).sample(
        nstep * h, replicas=REPLICAS, record_interval=nstep, burn_in=settle * h
    )
    states = np.concatenate([run.qpos.values[:, -1], run.qvel.values[:, -1]], axis=1)
    assert covariance_error(states, stationary) < SIGMAS
    for k in range(4):
        assert deviation(run.heat.values[:, -1, k] / (nstep * h), heats[k]) < SIGMAS


def linear_theory(h, spring):
    """Return the stationary covariance of BAOAB, and the mean power of each bath.

    A damper exchanges u (noise - h c u), where u = a (v + v')/2 is its mean velocity during O.
    """
    after, damp, noise, before = baoab_map(h, spring)
    stationary = scipy.linalg.solve_discrete_lyapunov(
        after @ damp @ before, after @ noise @ noise.T @ after.T
    )
    average = (np.eye(6) + damp)[3:] / 2 @ before
    mean = average @ stationary @ average.T + noise[3:] @ noise[3:].T / 4
    squares = np.einsum("ki,ij,kj->k", ROWS, mean, ROWS)
    strengths = np.sqrt(2 * h * DAMPING * [*BATHS.values()])
    with_noise = np.einsum("ki,ik->k", ROWS, noise[3:]) / 2 * strengths
    return stationary, with_noise / h - DAMPING * squares


# Motion without noise


@pytest.mark.parametrize("name", TREES)
def test_the_largest_timestep_against_frequencies(name):
    """2/omega, where omega is from second differences of the energy; measured: at most 2e-5."""
    law = Law(TREES[name])
    tree = law.tree
    thermostat = mm.Langevin(law.model, tree.kT, friction=tree.friction, disable=tree.disable)
    data = mujoco.MjData(law.model)
    data.qpos[:] = law.rest
    assert thermostat.largest_timestep(data) * law.frequencies()[-1] / 2 == pytest.approx(
        1, rel=1e-4
    )


@pytest.mark.parametrize("rate", [0.1, 5.0])
@pytest.mark.parametrize("splitting", SPLITTINGS)
def test_the_limit_of_stability(splitting, rate):
    """The step at which a small motion of a double pendulum grows, by bisection.

    Measured: within 1.4 % of the prediction.
    """
    tree = TREES["double pendulum"]

    def follow(timestep):
        model = tree.model(timestep)
        thermostat = mm.Langevin(model, 0.0, friction=rate, splitting=splitting)
        data = mujoco.MjData(model)
        limit = thermostat.largest_timestep(data)
        data.qpos[:] = 1e-6, -2e-6
        try:
            thermostat.step(data, 2000)
        except FloatingPointError:
            return True, limit
        return max(*abs(data.qpos), *abs(data.qvel / 20)) > 1e-4, limit

    _, limit = follow(0.01)
    assert math.isfinite(limit)
    low, high = 0.5 * limit, 1.5 * limit
    while high - low > 0.01 * limit:
        middle = (low + high) / 2
        low, high = (low, middle) if follow(middle)[0] else (middle, high)
    assert abs((low + high) / (2 * limit) - 1) < 0.05


def after(model, data, splitting, timestep, duration=0.3):
    """Return the position after a time, without noise."""
    model.opt.timestep = timestep
    found = mujoco.MjData(model)
    mujoco.mj_copyState(model, data, found, STATE)
    nstep = round(duration / timestep)
    if splitting == "mujoco":
        mujoco.mj_step(model, found, nstep)
    else:
        mm.Langevin(model, 0.0, splitting=splitting).step(found, nstep)
    return found.qpos.copy()


@pytest.mark.parametrize("name", ["six links in 3-D", "chain in a fluid", "tendons"])
def test_orders(name):
    """Positions after 0.3 s against RK4 of `mj_step` at 50 us, with friction but no noise.

    Measured: 2.00, also for `o-rk4-o` by its friction; for `middle` 1.00.
    """
    model = TREES[name].model()
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    data, random = mujoco.MjData(model), np.random.default_rng(5)
    data.qpos[:], data.qvel[:] = random.normal(size=(2, model.nv)) * [[0.5], [2.0]]
    reference = after(model, data, "mujoco", 5e-5)
    for splitting in SPLITTINGS:
        errors = [abs(after(model, data, splitting, h) - reference).max() for h in (0.001, 0.0005)]
        order = math.log2(errors[0] / errors[1])
        assert abs(order - (1 if splitting == "middle" else 2)) < 0.05


@pytest.mark.parametrize("splitting", SPLITTINGS)
def test_heat_and_work_are_the_change_of_the_kinetic_energy(splitting):
    """To rounding; and without friction the work is that of the potential.

    The energy differs by an error of second order, that of `middle` of first order, since its
    positions are half a kick off. Measured at 0.5 ms: 1.8e-6, 7.6e-6, 0.020 (middle) and 2.4e-6 J,
    with ratios of 4.0, 4.0, 2.0 and 4.0. At longer steps not all motions are by the same rule.
    """
    order = {"middle": 1, "o-rk4-o": 4}.get(splitting, 2)
    law = Law(TREES["six links in 3-D"])
    baths = {f"joint {k}": 0.1 * (k + 1) for k in range(6)}
    model = law.tree.model(0.005)
    data = mujoco.MjData(model)
    exchanged = mm.Langevin(model, baths, splitting=splitting).step(data, 300)
    kinetic = kinetic_energy(model, data)
    assert kinetic > 0.1
    assert abs(sum(exchanged.values()) / kinetic - 1) < 1e-10
    errors = []
    for timestep in (0.002, 0.001) if order == 4 else (0.0005, 0.00025):
        model = law.tree.model(timestep)
        data = mujoco.MjData(model)
        data.qpos[:], data.qvel[:] = np.linspace(-1, 1, 6), np.linspace(3, -2, 6)
        before = law.energy(data.qpos)
        thermostat = mm.Langevin(model, 0.0, splitting=splitting, friction=1e-12)
        work = thermostat.step(data, round(0.5 / timestep))["work"]
        errors.append(abs(work + law.energy(data.qpos) - before))
    assert errors[0] < (0.2 if order == 1 else 5e-5)
    assert abs(math.log2(errors[0] / errors[1]) - order) < (0.3 if order == 4 else 0.02)


def kinetic_energy(model, data):
    """Return v^T M v/2."""
    product = np.empty(model.nv)
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_mulM(model, data, product, data.qvel)
    return data.qvel @ product / 2


# Noise


@BRIEF
def test_the_same_bits():
    """However steps are divided, however many replicas and threads there are."""
    tree = TREES["six links in 3-D"]
    model = tree.model(0.01)
    baths = {f"joint {k}": 0.1 * (k + 1) for k in range(6)}
    thermostat = mm.Langevin(model, baths, seed=7)
    whole = thermostat.sample(60 * thermostat.timestep, replicas=5)
    assert (
        whole.qpos[:, 6::7].values.tobytes()
        == thermostat.sample(
            60 * thermostat.timestep, replicas=5, record_interval=7
        ).qpos.values.tobytes()
    )
    settled = thermostat.sample(
        40 * thermostat.timestep, replicas=3, burn_in=20 * thermostat.timestep
    )
    assert (settled.qvel.values == whole.qvel.values[:3, 20:]).all()
    with patch("os.cpu_count", return_value=1):
        alone = thermostat.sample(60 * thermostat.timestep, replicas=5)
    assert alone[["qpos", "qvel"]].identical(whole[["qpos", "qvel"]])
    data = mujoco.MjData(model)
    for count in (1, 25, 0, 34):
        thermostat.step(data, count)
    assert (data.qpos == whole.qpos.values[0, -1]).all()
    assert (data.qvel == whole.qvel.values[0, -1]).all()


@BRIEF
def test_the_same_bits_of_heat_and_work():
    """However long `sample` lets the compiled loop run."""
    model = TREES["six links in 3-D"].model(0.01)
    thermostat = mm.Langevin(model, {f"joint {k}": 0.1 * (k + 1) for k in range(6)}, seed=7)
    with patch("magmotor.mjcf.langevin.loop_calls.SECONDS_BETWEEN_CHECKS", 1e-9):
        pieces = thermostat.sample(100 * thermostat.timestep)
    assert pieces.identical(thermostat.sample(100 * thermostat.timestep))


def test_replicas_are_independent():
    """Correlations of 64 replicas from 1000 velocities each, which forget in one step.

    The largest of 2016 exceeds 5.5 standard errors once in 13000. Measured: 3.6.
    """
    model = slides(2 / 0.6947)
    run = mm.Langevin(model, 1.0, friction=2 / model.opt.timestep, seed=1).sample(
        1000 * model.opt.timestep, replicas=64
    )
    correlations = np.corrcoef(run.qvel.values[:, :, 1])
    np.fill_diagonal(correlations, 0)
    assert abs(correlations).max() * math.sqrt(1000) < 5.5
    lagged = np.corrcoef(run.qvel.values[0, 1:, 1], run.qvel.values[0, :-1, 1])[0, 1]
    assert abs(lagged) * math.sqrt(1000) < SIGMAS


# Positions


@pytest.mark.parametrize("name", ["pendulum", "double pendulum", "cart-pole", "limits"])
def test_positions_against_quadrature(name):
    """BAOAB at omega h = 1, from 32 replicas of 3500 or 6500 steps.

    The bias of <V> above rest and of each <1 - cos> (or <x^2>) is less than 1 %, beyond 4 standard
    errors (a false alarm once in 1000 at a bias of 1 %); one of 10 % is seen in 99 of 100 runs.
    Measured: at most 1.7 %; the charts have smaller errors.
    """
    law = Law(TREES[name])
    exact = by_quadrature(law, 80)  # as by 160, to 5e-4 beside the kinks of the limits
    run = sampled(law, 1.0, 6500 if name == "limits" else 3500)
    for observable, series in law.observables(run.qpos.values).items():
        mean, error = mean_and_error(series / exact[observable])
        assert error < 0.014, observable
        assert abs(mean - 1) < 0.01 + 4 * error, observable


METROPOLIS: dict[str, dict[str, tuple[float, float]]] = {
    "six links in 3-D": {
        "joint 0": (0.00791253, 4.5e-05),
        "joint 1": (0.00991823, 6.2e-05),
        "joint 2": (0.0221048, 0.00013),
        "joint 3": (0.0309018, 0.00021),
        "joint 4": (0.0564276, 0.00037),
        "joint 5": (0.186261, 0.00093),
        "V/kT": (3.16434, 0.01),
    },
    "four ball joints": {
        "joint 0": (1.01074, 0.01),
        "joint 1": (1.05835, 0.0079),
        "joint 2": (1.07666, 0.0046),
        "joint 3": (1.19593, 0.0027),
        "V/kT": (4.22221, 0.011),
    },
    "chain in a fluid": {
        "joint 0": (0.0196309, 0.00012),
        "joint 1": (0.040842, 0.00025),
        "joint 2": (0.192609, 0.0011),
        "V/kT": (1.58347, 0.0053),
    },
    "free body": {
        "stone: place": (0.0585588, 0.0002),
        "stone": (0.577475, 0.0025),
        "V/kT": (3.2082, 0.0097),
    },
    "tendons": {
        "shoulder": (0.0793275, 0.00051),
        "elbow": (0.173201, 0.00092),
        "wrist": (0.304395, 0.0017),
        "V/kT": (1.63198, 0.0051),
    },
    "arm of dm_control": {
        "joint_1": (0.0951988, 0.00053),
        "joint_2": (0.0829652, 0.00049),
        "joint_3": (0.100072, 0.00066),
        "joint_4": (0.0953785, 0.0006),
        "joint_5": (0.094968, 0.00051),
        "joint_6": (0.0944123, 0.00058),
        "V/kT": (2.99898, 0.0075),
    },
}
"""Means and standard errors by `truth(Law(TREES[name]), 1600)`, in three minutes for all."""

WITHOUT_DETERMINANT = {"four ball joints": (3.99141, 0.011)}
"""V/kT by the law without sqrt(det M): of the same samples, with weights 1/sqrt(det M)."""
STEPS = {"six links in 3-D": 2000, "four ball joints": 1600, "tendons": 2000}
"""Where the motion is slow, and where the wrong law must be seen; 1000 otherwise."""


@pytest.mark.parametrize("name", METROPOLIS)
def test_positions_against_the_metropolis_algorithm(name):
    """The same from 32 replicas; without sqrt(det M), that of ball joints has 5 % less energy.

    By chance, at a bias of 1 %, each of 28 deviations is too large once in 15000; a bias of 15 % of
    an energy, or of 29 % of an angle, is seen in 99 of 100 runs.
    """
    law = Law(TREES[name])
    run = sampled(law, 1.0, STEPS.get(name, 1000))
    found = law.observables(run.qpos.values)
    for observable, series in found.items():
        off, error = relative(series, METROPOLIS[name][observable])
        assert error < (0.022 if observable == "V/kT" else 0.045), observable
        assert off < 0.01 + 4 * error, observable
    if name in WITHOUT_DETERMINANT:
        off, error = relative(found["V/kT"], WITHOUT_DETERMINANT[name])
        assert off > 0.01 + 4 * error  # 0.076 > 0.035


def relative(series, truth):
    """Return the relative deviation from a mean and its error, and its own standard error."""
    (mean, error), (truth_mean, truth_error) = mean_and_error(series), truth
    return abs(mean / truth_mean - 1), math.hypot(error, truth_error) / truth_mean


def test_histogram_of_a_pendulum():
    """BAOAB at omega h = 1: chi^2 of 20 bins with 19200 samples, 5 relaxation times apart.

    The law is exp(a cos q). A false alarm once in 10000. Measured: p = 0.65.
    """
    law = Law(TREES["pendulum"])
    run = sampled(law, 1.0, 12_000, record_interval=20)
    angles = (run.qpos.values.ravel() + np.pi) % (2 * np.pi) - np.pi
    edges = np.linspace(-np.pi, np.pi, 21)
    found, _ = np.histogram(angles, edges)
    fine = np.linspace(-np.pi, np.pi, 20_001)
    middles = (fine[1:] + fine[:-1]) / 2
    height = law.energy(np.array([np.pi])) - law.lowest
    weights = np.exp(height / 2 / law.tree.kT * np.cos(middles)).reshape(20, -1).sum(axis=1)
    expected = weights / weights.sum() * found.sum()
    assert scipy.stats.chisquare(found, expected).pvalue > 1e-4


def test_the_kinetic_temperature_is_of_second_order():
    """A pendulum of inertia I loses the part h^2 <f^2>/(4 I kT) = h^2 <V''>/(4 I) of kT.

    Measured at omega h = 1 and 1/2: 0.152(3) and 0.039(4); theory: 0.157 and 0.039.
    """
    law = Law(TREES["pendulum"])
    mean = 1 - by_quadrature(law)["joint 0"]
    inertia = kinetic_energy(law.model, at_unit_velocity(law.model))
    for size, worst in ((1.0, 0.04), (0.5, 0.15)):
        run = sampled(law, size, 10_000, record_interval=2)
        loss, error = mean_and_error(1 - 2 * inertia * run.qvel.values[..., 0] ** 2 / law.tree.kT)
        assert abs(loss - size**2 * mean / 4) < SIGMAS * error
        assert error < worst * loss


def at_unit_velocity(model):
    """Return data of a model at rest, with unit velocities."""
    data = mujoco.MjData(model)
    data.qvel[:] = 1
    return data
