"""The motor's hops and flights: the rotor as null, barriers, and the laws of flights."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

import magmotor as mm
from magmotor.plots import MotorRun
from paper.motor import flight_law, hops, position
from paper.motor.azimuths import RECORD_INTERVAL, Azimuths
from paper.motor.barriers import Valley
from paper.motor.crossings import LAGS, Places, barriers, crossings
from paper.motor.flight_definitions import DEFINITIONS, Remaining, remaining
from paper.motor.hop_barriers import Ahead, Found, Mean, Sample
from paper.motor.rotor import RateAndMemory, rate_and_memory, rotor
from paper.motor.runs import SETS, Motors, collected
from paper.motor.two_states import Rotors, States, states

RATE, MEMORY = 3e-3, 3300.0
SECTOR = 2 * math.pi / 5
MOTOR = mm.Motor()


@pytest.mark.parametrize("steps", [np.full(100, 60.0), np.tile([5.0, 4e3], 5)])
def test_a_rotor_moves_as_an_ornstein_uhlenbeck_process_does(steps):
    """Mean squares over 40 000 rotors; their standard error is sqrt(2/40 000) = 0.7 %.

    The chance that one of 3 Gaussian scores is beyond 4.5 errors is 2e-5.
    """
    times = np.append(0.0, np.cumsum(steps))
    azimuths = rotor(RATE, MEMORY, times, 40_000, seed=1)
    assert azimuths.shape == (40_000, len(times))
    assert not azimuths[:, 0].any()
    for k in (1, len(times) // 2, len(times) - 1):
        t = times[k] / MEMORY
        expected = 2 * (RATE * MEMORY) ** 2 * (t - 1 + np.exp(-t))
        score = ((azimuths[:, k] ** 2).mean() / expected - 1) / np.sqrt(2 / 40_000)
        assert abs(score) < 4.5  # 1.4
    again = rotor(RATE, MEMORY, times[:20], 3, seed=1)
    np.testing.assert_array_equal(rotor(RATE, MEMORY, times[:20], 3, seed=1), again)


def test_rate_and_memory_of_rotors():
    """300 rotors for 10 memories each, with one of another length."""
    times = np.arange(0, 33_000, 20.0)
    rows = [*rotor(RATE, MEMORY, times, 300, seed=2)]
    rows[0] = rows[0][:100]
    found = rate_and_memory(rows, 20.0)
    assert found.rate == pytest.approx(RATE, rel=0.03)  # 0.0046
    assert found.memory == pytest.approx(MEMORY, rel=0.06)  # 0.025


def energy_in_the_valley(lean, azimuth):
    """Return the minimum of -m |B| over the radius, by a sum over dipoles."""
    axis = np.array([*lean, math.sqrt(1 - lean[0] ** 2 - lean[1] ** 2)])
    turn = Rotation.align_vectors([axis], [[0.0, 0.0, 1.0]])[0]

    def ring(count, radius, height, factor, turned):
        around = 2 * math.pi * np.arange(count) / count
        outward = np.stack([np.cos(around), np.sin(around), 0 * around], axis=1)
        if turned:
            outward = turn.apply(outward)
        return radius * outward + [0, 0, height], factor * outward

    inner = ring(20, 0.75, 0.48, 2.0, turned=True)
    outer = ring(5, 0.98, 0.48, 1.0, turned=False)
    places, moments = np.vstack([inner[0], outer[0]]), np.vstack([inner[1], outer[1]])

    def energy(radius):
        r = np.array([radius * math.cos(azimuth), radius * math.sin(azimuth), 0.04]) - places
        distance = np.linalg.norm(r, axis=1)[:, np.newaxis]
        along = np.sum(r * moments, axis=1)[:, np.newaxis]
        return -2e-6 * np.linalg.norm(
            np.sum(3 * along * r / distance**5 - moments / distance**3, axis=0)
        )

    lowest: Any = minimize_scalar(energy, bounds=(0.5, 0.7), method="bounded")
    return lowest.fun


@pytest.mark.parametrize(("well", "step"), [(0, 1), (2, -1), (-7, 1)])
def test_the_barrier_ahead_is_that_of_the_leaning_rings_field(well, step):
    """In any well, in both directions."""
    lean = np.array([0.004, 0.011])
    places = Places(*np.array([[0], [0], [well], [step]]))
    ensemble = Azimuths(MOTOR, "", [np.zeros(1)], [lean[np.newaxis]])
    (found,) = barriers(Valley(MOTOR), places, ensemble, np.zeros(1))[0]
    around = SECTOR * (well + step * np.linspace(-0.5, 1.5, 161))
    energy = np.array([energy_in_the_valley(lean, azimuth) for azimuth in around])
    here = int(energy[:81].argmin())
    there = 80 + int(energy[80:].argmin())
    expected = energy[here : there + 1].max() - energy[here]
    assert found / MOTOR.kT == pytest.approx(expected / MOTOR.kT, abs=0.02)  # 0.0018


def test_places_near_the_ends_of_a_run_or_of_the_one_that_lends_its_lean_are_left_out():
    """120 records each side fit; the second run is shorter."""
    leans = [np.zeros((400, 2)), np.zeros((300, 2))]
    ensemble = Azimuths(MOTOR, "", [np.zeros(400), np.zeros(300)], leans)
    record = np.array([119, 120, 279, 280, 179, 180])
    run = np.array([0, 0, 0, 0, 1, 1])
    places = Places(run, record, np.zeros(6, dtype=int), np.ones(6, dtype=int))
    assert places.inside(ensemble, LAGS).record.tolist() == [120, 279, 179]
    assert places.inside(ensemble, LAGS, 1).record.tolist() == [120, 179, 180]


def path(*corners):
    """Return azimuths that move 0.01 sectors per record between these, in sectors."""
    pairs = itertools.pairwise(corners)
    parts = [np.arange(a, b, math.copysign(0.01, b - a)) for a, b in pairs]
    return SECTOR * np.concatenate([*parts, corners[-1:]])


def test_crossings_are_hops_outside_of_flights_and_passages_in_them():
    """One hop back and forth, of which the ball goes halfway twice, and a flight around."""
    row = path(0, 0.6, 0.4, 1.2, 0, 6.6, 6)
    lean = np.zeros((len(row), 2))
    found = crossings(Azimuths(MOTOR, "", [row], [lean]))
    assert found.hops.well.tolist() == [0, 1]
    assert found.hops.step.tolist() == [1, -1]
    np.testing.assert_allclose(row[found.hops.record], 0.5 * SECTOR, atol=0.011 * SECTOR)
    np.testing.assert_allclose(found.hops.record, [90, 230], atol=1)  # the second time it is there
    assert found.passes.well.tolist() == [0, 1, 2, 3, 4, 5]
    assert set(found.passes.step) == {1}
    resting = row[found.waiting.record] / SECTOR - found.waiting.well
    assert np.abs(resting).max() <= 0.25 + 1e-9
    assert set(found.waiting.step) == {-1, 1}


def test_five_definitions_of_a_flight():
    """Two sectors, one revolution with a step back by half a sector, and four revolutions."""
    row = path(0, 2.5, 1.8, 4.6, 4.1, 7.3, 6, 27, 26)
    found = {key: remaining([row], each) for key, each in DEFINITIONS.items()}
    assert {key: len(left.lasts) for key, left in found.items()} == {
        "once": 1, "sector": 2, "two": 4, "thrice": 1, "fast": 1,
    }  # fmt: skip
    ends = RECORD_INTERVAL * np.array([1600.0, 600.0])  # 21 sectors less 5, less 15
    np.testing.assert_allclose(found["once"].lasts, ends[:1], rtol=2e-3)
    np.testing.assert_allclose(found["thrice"].lasts, ends[1:], rtol=4e-3)
    assert not found["once"].censored.any()
    assert found["once"].direction.tolist() == [1]
    (cut,) = remaining([row[:2000]], DEFINITIONS["once"]).censored
    assert cut


def test_what_is_left_of_flights_by_hand():
    left = Remaining(
        np.array([0, 0, 1, 2]), np.array([3.0, 2.0, 1.0, 4.0]),
        np.array([False, True, False, False]), np.ones(4, dtype=int),
    )  # fmt: skip
    times, survival = left.survival
    np.testing.assert_allclose(times, [1, 2, 3, 4])
    np.testing.assert_allclose(survival, [0.75, 0.75, 0.375, 0])
    y = np.array([1, 2, 3, 4]) * 3 / 10
    variation = 1 + (np.sum(y**2) - 2 * (y.sum() - y[1])) / 3
    assert left.squared_variation[0] == pytest.approx(variation, rel=1e-14)


def test_flights_of_rotors_have_no_heavy_tail():
    """Those of the motor have 1.6 and more; the error is 0.04."""
    times = np.arange(0, 1e5, RECORD_INTERVAL)
    left = remaining([*rotor(RATE, 8000.0, times, 60, seed=3)], DEFINITIONS["once"])
    value, error = left.squared_variation
    assert value < 1.15  # 0.9
    assert error < 0.15  # 0.08


def test_a_rotor_is_near_wells_as_often_in_flight_as_otherwise():
    """Between flights the motor is near them for three quarters of the time."""
    times = np.arange(0, 1e5, RECORD_INTERVAL)
    found = states([*rotor(RATE, 8000.0, times, 60, seed=4)], RECORD_INTERVAL)
    assert abs(found.held) < 0.06  # 0.01
    assert found.contrast > 2  # 2.9


@pytest.mark.parametrize(
    ("found", "verdicts"),
    [
        (States(2.9, 0.5, 0.5), ["wrong", "in part"]),
        (States(2.9, 0.74, 0.43), ["in part", "right"]),
        (States(9.0, 0.74, 0.43), ["right", "right"]),
    ],
)
def test_a_rotor_fails_the_claims_of_two_states(found, verdicts, monkeypatch):
    """It flies and moves farther in flights, but no well holds it between them."""
    mean, spread = States(2.8, 0.5, 0.5), States(0.3, 0.03, 0.01)
    beside = Rotors(RateAndMemory(RATE, MEMORY), 120, mean, spread, (0.9, 0.03))
    monkeypatch.setattr(position, "rotors_beside", lambda *_: beside)
    monkeypatch.setattr(position, "states_of", lambda *_: found)
    runs = []
    for name in SETS:
        scene = mm.Motor.paper(name)
        data = mm.simulate(
            scene, method="variational/baoab", timestep=0.1, duration=400, record_interval=10
        )
        theta = 2 * math.pi * np.interp(data.time, [0, 300, 400], [0, 2, 1.8])
        data["position"][:, :2] = 0.59 * np.stack([np.cos(theta), np.sin(theta)], axis=1)
        runs.append(MotorRun(name, data))
    many = dict.fromkeys(SETS, collected("uniform-a", 3 * runs[1:2]))
    motors = Motors(runs, many)
    for claim in position.claims_of_the_position(motors):
        assert claim.verdict == verdicts[0]
    for claim in position.claims_of_theta(motors)[:2]:
        assert claim.verdict == verdicts[1]


def ahead(hop, well, around):
    """Return barriers in J with these means at hops and in wells, and around hops, in 40 runs."""
    random = np.random.default_rng(6)
    run = np.arange(400) % 40
    now = {
        kind: Sample(1e-6 * (mean + 0.1 * random.normal(size=400)), run)
        for kind, mean in (("hops", hop), ("passes", hop), ("waiting", well))
    }
    columns = np.where(LAGS == 0, hop, around) + 0.1 * random.normal(size=(400, len(LAGS)))
    return Ahead(now, dict.fromkeys(("hops", "passes", "other"), Sample(1e-6 * columns, run)))


@pytest.mark.parametrize(
    ("hop", "well", "around", "verdict"),
    [(1.0, 3.0, 3.0, "right"), (2.0, 3.0, 2.0, "in part"), (3.0, 3.0, 3.0, "wrong")],
)
def test_barriers_at_hops_decide_what_the_paper_says(hop, well, around, verdict):
    found = Found(
        "", Valley(MOTOR), ahead(hop, well, around), ahead(3.0, 3.0, 3.0), Mean(0.01, 1e-4),
        [1e-6 * well, 1e-6 * hop], {"flights": (Mean(0.5, 0.01), 9)},
    )  # fmt: skip
    claims = hops.claims(found)
    assert claims[0].verdict == verdict
    assert [claims[k].verdict for k in (1, 3, 5)] == ["right"] * 3
    assert claims[2].verdict == ("right" if hop < well else "wrong")
    uneven = found._replace(clockwise={"hops": (Mean(0.6, 0.01), 9)}, gibbs=[0.0, 0.0])
    assert [hops.claims(uneven)[k].verdict for k in (3, 5)] == ["wrong", "wrong"]
    low = found._replace(nonuniform=ahead(1.0, 3.0, 3.0))
    assert hops.claims(low)[1].verdict == "wrong"


def test_errors_are_those_of_runs_not_of_hops():
    """Each run has one value four times; a difference within the runs has no error."""
    values = np.array([1.0, 2.0, 4.0])
    sample = Sample(np.repeat(values, 4), np.repeat([0, 1, 5], 4))
    expected = values.std() / np.sqrt(3)
    assert sample.mean == pytest.approx((7 / 3, expected))
    table = Sample(np.stack([sample.values, 2 * sample.values], axis=1), sample.run)
    np.testing.assert_allclose(table.error, [expected, 2 * expected])
    above = Sample(sample.values + 3, sample.run).above(sample)
    assert above == pytest.approx((3, 0), abs=1e-14)
    apart = Sample(sample.values + 3, sample.run + 6).above(sample)
    assert apart == pytest.approx((3, np.sqrt(2) * expected))


def test_the_rank_of_a_sample_in_another():
    """By hand, and the error against the spread of 400 repetitions in 30 runs of 5 values each."""
    one = Sample(np.array([0.0, 1.0, 5.0]), np.arange(3))
    other = Sample(np.array([1.0, 2.0]), np.arange(2))
    assert one.rank_in(other).value == pytest.approx((0 + 0.25 + 1) / 3)
    random = np.random.default_rng(8)
    run = np.repeat(np.arange(30), 5)
    means = []
    for _ in range(400):
        shared = random.normal(size=30)[run]
        low, high = (shared + random.normal(size=150) + shift for shift in (0.0, 0.7))
        means.append(Sample(low, run).rank_in(Sample(high, run)))
    values, errors = np.array(means).T
    assert errors.mean() == pytest.approx(values.std(), rel=0.2)  # 0.11


@pytest.mark.parametrize(
    ("tails", "count", "verdict"),
    [(0, 350, "wrong"), (2, 350, "in part"), (5, 350, "right"), (5, 290, "not decided")],
)
def test_definitions_decide_whether_flights_vary_more_than_those_of_rotors(tails, count, verdict):
    """By the first few definitions the motor's have 4, and otherwise the rotors' 1."""
    random = np.random.default_rng(7)

    def left(lasts):
        no = np.zeros(count, dtype=bool)
        return Remaining(np.arange(count), lasts, no, np.ones(count, int))

    null = left(random.exponential(5e3, count))
    varied = left(random.gamma(0.25, 2e4, count))
    motor = {key: varied if k < tails else null for k, key in enumerate(DEFINITIONS)}
    law = flight_law.Law(count, motor, dict.fromkeys(DEFINITIONS, null), RateAndMemory(RATE, 1e4))
    (claim,) = flight_law.claims(flight_law.Laws("", {"uniform": law}))
    assert claim.verdict == verdict
    assert f"By {tails} of 5 definitions" in claim.measured
