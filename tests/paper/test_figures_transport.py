"""The motor's transport: statistics of spreading, rolling without slip, the reduced theory."""

import dataclasses

import numpy as np
import pytest

import magmotor as mm
from magmotor.devices.disk.theory.flat import flat_variance_from_rest
from paper.motor import ablation, theory_of_transport
from paper.motor.ablation import SCENES, Ablation, Flown, background_rate, isotropic
from paper.motor.held_ring import held
from paper.motor.long_runs import LongRun
from paper.motor.reduced_theory import equivalent_disk, rolling, wells
from paper.motor.rolling_start import rolling_start
from paper.motor.rotor import rotor
from paper.motor.spreading import (
    Measured,
    correlations,
    green_kubo,
    half_octaves,
    local_slopes,
    logarithmic_slope,
    over_replicas,
    rotor_square,
    square_increments,
)
from paper.motor.theory_of_transport import Case, Theory
from paper.motor.tilted_ring import tilted_ring
from paper.motor.transport import transport_of
from paper.motor.transport_claims import claims

RATE, MEMORY, STEP = 3e-3, 3300.0, 50.0


@pytest.fixture(scope="module")
def rotors():
    """Azimuths of 400 rotors over 4e4 s."""
    return rotor(RATE, MEMORY, STEP * np.arange(800), 400, seed=3)


def test_mean_squares_and_slopes_of_rotors(rotors):
    """Scores of about 5 independent lags; one beyond 4.5 has the chance of 3e-5."""
    lags = half_octaves(800)
    assert lags[-1] == 256
    squares = square_increments(rotors, lags)
    seconds = STEP * lags.astype(float)
    exact = rotor_square(RATE, MEMORY, seconds)
    mean, error = over_replicas(squares)
    assert np.abs((mean - exact) / error).max() < 4.5  # 1.3
    found = local_slopes(squares, seconds)
    np.testing.assert_allclose(found.lag**2, STEP**2 * lags[2:] * lags[:-2], rtol=1e-15)  # 2e-16
    scores = (found.slope - logarithmic_slope(exact, seconds)) / found.error
    assert np.abs(scores).max() < 4.5  # 1.4


def test_errors_of_slopes_are_those_between_ensembles(rotors):
    """The jackknife in 20 ensembles of 20 rotors, against the standard deviation of their slopes.

    The latter has a relative error of 1/sqrt(38) = 16 %.
    """
    lags = np.array([16, 64, 256])
    squares = square_increments(rotors, lags).reshape(20, 20, 3)
    slopes, errors = zip(*(local_slopes(part, lags)[1:] for part in squares), strict=True)
    assert np.mean(errors) / np.std(slopes, ddof=1) == pytest.approx(1, abs=0.5)  # 0.06


def test_the_integral_of_the_correlation_is_half_the_growth():
    time = 0.1 * np.arange(4000)
    wave = np.cos(time)[np.newaxis]
    found = correlations(wave, 100)
    np.testing.assert_allclose(found[0], np.cos(time[:100]) / 2, atol=3e-3, rtol=0)  # 8e-4
    integral = green_kubo(np.exp(-time)[np.newaxis], 0.1)[0]
    np.testing.assert_allclose(integral, 1 - np.exp(-time), atol=3e-3, rtol=0)  # 8e-4


@pytest.fixture(scope="module")
def still():
    """A motor without noise under rings that are held and have no wells."""
    return held(mm.Motor(alpha_ball=0.0, alpha_ring=0.0))


def test_a_ball_that_rolls_does_not_slip_and_its_axis_follows_the_field(still):
    rates, azimuths = np.array([1e-3, -3e-3]), np.array([0.3, 2.0])
    start = rolling_start(still, rates, azimuths)
    contact = np.array([0.0, 0.0, -still.ball_radius])
    omega, axis = start["angular_velocity"], start["axis"]
    slip = start["velocity"] + np.cross(omega, contact)
    around = start["velocity"] / np.linalg.norm(start["velocity"], axis=1, keepdims=True)
    assert np.abs(np.sum(slip * around, axis=1)).max() < 1e-17  # 0
    turned = np.cross(np.outer(rates, [0, 0, 1]), axis)
    np.testing.assert_allclose(np.cross(omega, axis), turned, atol=1e-17, rtol=0)  # 2e-18
    energy = still.ball_mass * np.sum(start["velocity"] ** 2, axis=1)
    energy += still.ball_inertia * np.sum(omega**2, axis=1)
    np.testing.assert_allclose(energy / rates**2, rolling(still).inertia, rtol=3e-5)  # 2e-6


def rate_after(scene, duration):
    """Return the rate of a ball at the end, over that at the start, by DOP853."""
    start = rolling_start(scene, np.array([2e-3]), np.array([0.1]))
    run = mm.simulate(
        scene, method="scipy/dop853", timestep=1.0, duration=duration,
        initial={name: value[0] for name, value in start.items()},
    )  # fmt: skip
    turn = np.diff(mm.observables.azimuth(run).values)
    return turn[-20:].mean() / turn[:20].mean()


def test_friction_of_the_slip_leaves_rolling_alone_and_isotropic_friction_ends_it(still):
    assert rate_after(still, 200.0) == pytest.approx(1, abs=3e-3)  # 3e-4
    slowed = isotropic(still, 0.01)
    expected = np.exp(-background_rate(slowed) * 180.0)
    assert rate_after(slowed, 200.0) == pytest.approx(expected, rel=0.05)  # 0.02


def test_a_cold_ball_has_the_free_energy_of_the_wells_and_of_the_leaning_ring():
    """At a tenth of the paper's temperature, barrier and lean are those of the lowest energy."""
    cold = mm.Motor(alpha_ball=3e-4, alpha_ring=3e-4)
    found = wells(cold, 2)
    barrier = mm.observables.motor_wells(cold).barrier
    assert found.free_energy[1] * cold.kT == pytest.approx(barrier, rel=0.05)  # 0.01
    leans = np.linspace(0, 0.02, 401)
    lowest = leans[np.argmin([sum(tilted_ring(cold, lean, 0.0)) for lean in leans])]
    assert found.lean[0] == pytest.approx(lowest, abs=1e-4)  # 5e-6


def test_the_disk_has_the_balls_rate_and_slip():
    scene = mm.Motor()
    ball, disk = rolling(scene), equivalent_disk(scene)
    around = scene.outer_dipoles**2
    rate_square = mm.theory.gibbs_mean_squares(disk)["d"] / (1 + disk.sigma) ** 2 / around
    assert rate_square == pytest.approx(scene.kT / ball.inertia, rel=9e-15, abs=0)  # 3e-16
    flat = disk.replace(potential="flat", drag=0.0)
    late, later = flat_variance_from_rest(flat, np.array([1e4, 2e4])) / around
    assert (later - late) / 2e4 == pytest.approx(ball.slip_diffusion, rel=1e-14, abs=0)  # 4e-16
    (_, wave), *_ = disk.coefficients
    depth = wells(scene).free_energy.max()
    assert -2 * wave * disk.beta == pytest.approx(depth, rel=0.02)  # 8e-4


def rotating(memory, seed):
    """Return rotors in place of motors."""
    azimuth = rotor(RATE, memory, 10.0 * np.arange(6000), 48, seed=seed)
    return LongRun("", 10.0, azimuth, np.gradient(azimuth, 10.0, axis=1), {})


def verdicts(run, physical, mujoco, beside):
    return [claim.verdict for claim in claims(transport_of(run, physical, mujoco, beside))]


def test_rotors_pass_what_they_should():
    first, second = rotating(3000.0, 21), rotating(3000.0, 22)
    expected = ["in part", "right", "right", "right", "right", "wrong", "right"]
    assert verdicts(first, second, first, second) == expected
    for memory, verdict in ((1e7, "right"), (30.0, "wrong")):
        assert verdicts(rotating(memory, 21), first, first, second)[0] == verdict


def test_each_claim_can_be_refuted():
    run, other = rotating(3000.0, 21), rotating(3000.0, 22)
    assert verdicts(run, rotating(1e7, 23), run, other)[1] == "wrong"
    assert verdicts(run._replace(rate=2 * run.rate), run, run, other)[2] == "wrong"
    slowed = np.concatenate([run.azimuth[:, :3000], 0.1 * run.azimuth[:, 3000:]], axis=1)
    assert verdicts(run._replace(azimuth=slowed), run, run, other)[3] == "wrong"
    farther = run._replace(azimuth=2 * run.azimuth)
    assert verdicts(run, run, farther, other)[4] == "wrong"
    # The ball is slow near wells.
    attracted = run._replace(azimuth=run.azimuth - 0.15 * np.sin(5 * run.azimuth))
    assert verdicts(attracted, run, run, other)[6] == "wrong"


def case(growth, friction=1e-5, replicas=50):
    """Return a motor whose mean squares are `growth` times those of its disks, with 2 % errors."""
    lag = np.geomspace(10.0, 10.0 * 2**11, 12)
    noise = 1 + 0.02 * np.sqrt(replicas) * np.linspace(-1.7, 1.7, replicas)
    theory = Measured(lag**2, 0.01 * lag**2)
    squares = growth * noise[:, np.newaxis] * lag**2
    return Case(mm.Motor(), lag, squares, Measured(friction, 1e-6), 2e-5, theory, theory)


@pytest.mark.parametrize(
    ("made", "expected"),
    [
        (case(1.0), ["right", "wrong", "right", "right"]),
        (case(1.0, friction=1e-6), ["right", "right", "right", "right"]),
        (case(1.5), ["wrong", "wrong", "wrong", "wrong"]),
    ],
)
def test_a_theory_that_is_off_is_wrong(made, expected):
    found = wells(mm.Motor(), 24)
    density = Measured(found.density, np.full(24, 0.01))
    data = Theory([made], made, found, density, Measured(0.59, 0.01))
    judged = [claim.verdict for claim in theory_of_transport.claims(data)]
    assert judged == ["right", *expected]
    even = dataclasses.replace(data, density=Measured(np.ones(24), np.full(24, 0.01)))
    assert theory_of_transport.claims(even)[0].verdict == "wrong"


def test_flights_with_any_friction_would_refute_the_ablation():
    number, lasts = Measured(4.0, 0.2), Measured(8000.0, 600.0)
    turns, speed = Measured(30.0, 2.0), Measured(1.0, 0.01)
    flying = Flown("", 1e-3, number, turns, lasts, 40.0, speed, number, 8000.0)
    alike = dict.fromkeys(SCENES, flying)
    none = Measured(0.0, 0.0)
    still = flying._replace(number=none, turns=none, longest=0.0)
    shorter = {
        f"{share} %": flying._replace(lasts=Measured(mean, 0.05 * mean))
        for share, mean in ((0.1, 1800.0), (1, 600.0))
    }
    ended = alike | shorter | dict.fromkeys(("10 %", "isotropic"), still)
    for flown, expected in (
        (alike, ["right", "right", "wrong"]),
        (ended, ["wrong", "right", "right"]),
        (ended | {"1 %": shorter["0.1 %"]}, ["wrong", "right", "wrong"]),
        (ended | {"10 %": shorter["1 %"]}, ["wrong", "right", "wrong"]),
        (alike | {"isotropic": still._replace(speed=Measured(1.2, 0.01))}, ["wrong"] * 3),
    ):
        found = ablation.claims(Ablation(flown, 60.0, 9000.0))
        assert [claim.verdict for claim in found] == expected
