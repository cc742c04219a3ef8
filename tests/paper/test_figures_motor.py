"""The motor's figures: the tilted ring's energy, and verdicts that can go either way."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import magmotor as mm
from magmotor import dipoles
from magmotor.devices.ball.states import smallest_turn
from magmotor.devices.motor.energy import motor_energy
from magmotor.devices.motor.scene import PAPER
from magmotor.devices.motor.states import start_motor
from magmotor.plots import MotorRun
from paper.motor import level_ring, position
from paper.motor.energy import claims_of_the_energy, claims_of_the_injection
from paper.motor.position import (
    claim_of_agreement,
    claim_of_the_law,
    claims_of_the_position,
    claims_of_theta,
)
from paper.motor.rotor import RateAndMemory
from paper.motor.runs import (
    SETS,
    Flights,
    HeatAndWork,
    ManyRuns,
    Motors,
    collected,
    in_flight,
)
from paper.motor.tilted_ring import tilted_ring
from paper.motor.two_states import Rotors, States
from paper.motor.weak_noise import SCENE, WeakNoise, axial_part, cogging


def test_a_level_ring_has_the_energy_of_its_wells():
    scene = mm.Motor()
    found = tilted_ring(scene, 0.0, 0.3)
    expected = mm.observables.motor_wells(scene).energy
    assert found.ball == pytest.approx(expected, rel=2e-9, abs=0)  # 1e-10
    assert found.ball < tilted_ring(scene.replace(ball_ring_factor=1), 0.0, 0.3).ball


def test_a_tilted_ring_has_the_least_energy_that_a_state_has():
    scene, tilt, azimuth = mm.Motor(), 0.2, 0.4
    found = tilted_ring(scene, tilt, azimuth)
    turn = Rotation.from_euler("zyz", [azimuth, tilt, -azimuth])
    frame, outward = scene.inner_dipole_frame()
    places = turn.apply(frame) + np.array([0, 0, scene.inner_height])
    moments = scene.ball_ring_factor * scene.moment * turn.apply(outward)
    fixed = scene.outer_sources()
    line = np.linspace(-0.8, 0.8, 81)
    x, y = (each.ravel() for each in np.meshgrid(line, line))
    center = np.stack([x, y, np.full_like(x, scene.ball_radius)], axis=1)
    field = dipoles.field(center, np.vstack([places, fixed[0]]), np.vstack([moments, fixed[1]]))
    start = start_motor(scene, len(center))
    states = start._replace(
        position=center[np.newaxis],
        orientation=np.array([[smallest_turn(axis) for axis in field]]),
        ring_orientation=np.tile(turn.as_quat(scalar_first=True), (1, len(center), 1)),
    )
    energy = motor_energy(scene, states)
    assert float(energy.ring[0, 0]) == pytest.approx(found.outer, rel=2e-14, abs=0)  # 1e-15
    least = float(energy.total.min())
    assert sum(found) < least
    assert sum(found) == pytest.approx(least, rel=1e-3)  # 1e-4


def test_barriers_are_alike_on_all_sides(monkeypatch):
    """The outer ring has five dipoles: the sides beyond 36 degrees are images of those before."""
    monkeypatch.setattr(level_ring, "TILTS", np.radians([0.0, 15.0]))
    monkeypatch.setattr(level_ring, "paper_runs", lambda _quick: [])
    monkeypatch.setattr(level_ring, "AZIMUTHS", np.radians([9.0, 81.0, 63.0, 189.0]))
    barriers = level_ring.compute(True).barriers
    np.testing.assert_allclose(barriers, barriers[0], rtol=2e-3)  # 6e-4


def durations(law, count, mean=5000.0, limit=1e5):
    lasts = mean * np.asarray(law(np.random.default_rng(4), count))
    cut = lasts > limit
    limits = np.full(count, limit)
    flights = Flights(np.minimum(lasts, limits), limits, cut)
    return ManyRuns("uniform-a", "variational/baoab", flights, np.zeros(1), [], [], 0.0, 0)


@pytest.mark.parametrize(
    ("law", "count", "verdict"),
    [
        (lambda random, count: random.exponential(size=count), 300, "right"),
        (lambda random, count: random.exponential(size=count), 16, "not decided"),
        (lambda random, count: random.gamma(2, 0.5, count), 300, "wrong"),
        (lambda random, count: 1.5 * random.pareto(2.5, count), 300, "wrong"),
        (lambda random, count: random.uniform(0, 2, count), 300, "wrong"),
    ],
)
def test_the_law_of_flights_is_decided_where_there_are_enough(law, count, verdict):
    assert claim_of_the_law(durations(law, count), 4, (0.9, 0.1)).verdict == verdict


@pytest.fixture(autouse=True)
def _known_rotors(monkeypatch):
    """Rotors as `rotors_beside` draws them, which needs an ensemble of motors."""
    mean, spread = States(2.9, 0.5, 0.5), States(0.3, 0.03, 0.01)
    beside = Rotors(RateAndMemory(2.9e-3, 8500.0), 120, mean, spread, (0.9, 0.03))
    monkeypatch.setattr(position, "rotors_beside", lambda *_: beside)


@pytest.fixture(scope="module")
def runs():
    """A run at each temperature, changed to go to and fro, around twice, and back a little."""
    made = []
    for name in ("nonuniform-a", "uniform-a"):
        scene = mm.Motor.paper(name)
        data = mm.simulate(
            scene, method="variational/baoab", timestep=0.1, duration=400, record_interval=10
        )
        moves = [0, 40, 45, 70, 75, 100, 300, 305, 400], [0, 0, 0.2, 0.2, 0.01, -0.005, 2, 1.8, 1.8]
        turns = np.interp(data.time, *moves)
        theta = 2 * math.pi * turns
        path = np.stack([np.cos(theta), np.sin(theta)], axis=1)
        data["position"][:, :2] = mm.observables.motor_wells(scene).radius * path
        made.append(MotorRun(name, data))
    return made


def test_records_in_flight(runs):
    for run in runs:
        assert run.flights.sizes["flight"] == 1
        time = run.data.time.values
        np.testing.assert_array_equal(in_flight(run), (time >= 100) & (time <= 300))
        assert not in_flight(MotorRun("", run.data.isel(time=slice(0, 50)))).any()


def resting(run):
    """Return the run up to its flight."""
    return MotorRun(run.name, run.data.isel(time=slice(0, 100)))


def test_what_is_kept_of_many_runs(runs):
    hot = runs[0]
    ended = MotorRun(hot.name, hot.data.assign_attrs(stopped="at t = 400 s"))
    found = collected("nonuniform-a", [hot, resting(hot), ended])
    assert (found.runs, found.flying, found.tipped) == (3, 2, 1)
    np.testing.assert_array_equal(found.first, [100, np.inf, 100])
    np.testing.assert_array_equal(found.flights.censored, [False, False])
    assert np.all(found.flights.lasts < 200)  # from once round; the flight lasts 200 s
    np.testing.assert_allclose(found.flights.limits - found.flights.lasts, 100, rtol=1e-15)  # 0
    assert [spent.spans for spent in found.heat_and_work] == [1, 0, 1]
    assert found.heat_and_work[1].injected == 0
    assert found.reach == pytest.approx(
        mm.observables.motor_wells(hot.scene).radius, rel=2e-15, abs=0
    )  # 1.9e-16


@pytest.mark.parametrize(
    ("flying", "verdicts"), [(4, ["right", "right", "in part"]), (2, ["wrong", "wrong", "right"])]
)
def test_whether_most_of_many_fly_decides_what_the_plots_show(runs, flying, verdicts):
    """One of the paper's few runs may have no flight by chance."""
    hot, warm = runs
    cool_scene = mm.simulate(
        mm.Motor.paper("uniform-d"), method="variational/baoab", timestep=0.1, duration=1
    ).attrs["scene_fields"]
    cool = MotorRun("uniform-d", warm.data.assign_attrs(scene_fields=cool_scene))
    many = {
        name: collected(name, [run] * flying + [resting(run)] * (6 - flying))
        for name, run in zip(SETS, (hot, warm, cool), strict=True)
    }
    claims = claims_of_theta(Motors([hot, warm, cool], many))
    assert [claim.verdict for claim in claims[:3]] == verdicts


def test_a_run_without_a_flight_is_no_verdict(runs):
    hot, warm = runs
    motors = Motors([hot, resting(hot), warm], {})
    assert [claim.verdict for claim in claims_of_the_position(motors)] == ["right", "right"]
    assert "(1 of 2 runs have flights)" in claims_of_the_position(motors)[0].measured
    still = MotorRun(hot.name, hot.data.copy(deep=True))
    still.data["position"][:, :2] = [0.59, 0.0]
    gained = hot.balance.gain[-1] / hot.balance.injected[-1]
    many = {"nonuniform-a": collected("nonuniform-a", [hot])}
    claim = claims_of_the_energy(Motors([hot, still, warm], many))[0]
    said = f"at nonuniform temperature 1 runs as nonuniform-a gain {gained:.2f} ± 0.00 of"
    assert claim.measured.startswith(said)


def test_what_friction_takes_decides_whether_a_velocity_is_critical(runs):
    def verdicts(hot, even, later):
        weak = WeakNoise(collected("nonuniform", [later]), np.array([0.2, 0.2]))
        motors = Motors([hot, even], {"nonuniform-a": collected("nonuniform-a", [hot])}, None, weak)
        return [claims_of_the_injection(motors)[k].verdict for k in (2, 4)]

    def taking(run, share):
        return MotorRun(run.name, run.data.assign(heat=run.balance.injected * share))

    hot, even = runs
    assert verdicts(taking(hot, 0.3), taking(even, 1.0), taking(hot, 0.3)) == ["wrong", "in part"]
    assert verdicts(taking(hot, 1.0), taking(even, 0.5), taking(hot, 1.0)) == ["right", "wrong"]
    assert verdicts(taking(hot, 0.3), taking(even, 0.5), taking(hot, 1.0)) == ["in part", "wrong"]
    injected = even.balance.injected
    only_flying = even.data.assign(heat=injected.clip(*injected.values[[100, 300]]))
    assert verdicts(hot, MotorRun(even.name, only_flying), hot)[1] == "right"


def test_the_inner_ring_turns_in_wells_of_the_outer_dipoles():
    """The energy of the whole motor, with the ring turned, against the sums over its dipoles."""
    angles = np.array([0.0, 0.05, np.pi / 20, 0.3])
    turned = Rotation.from_euler("z", angles[:, np.newaxis]).as_quat(scalar_first=True)
    start = start_motor(SCENE, len(angles))
    energy = motor_energy(SCENE, start._replace(ring_orientation=turned[np.newaxis])).ring[0]
    found = cogging(SCENE, angles)
    assert found[2] == pytest.approx(489e-6, rel=1e-3)  # 488.7e-6
    np.testing.assert_allclose(found, energy - energy[0], rtol=0, atol=5e-17)  # 2e-18


def test_a_free_ring_gets_the_axial_part_of_the_noise():
    """Without dipoles that act, in 512 runs: kinetic energies about each of three axes.

    The axial energy is the square of a Gaussian rate, of error sqrt(2/512) = 6 %; the chance that
    it is 4.5 errors off is 1e-5.
    """
    scene = SCENE.replace(coupling=1e-20)
    run = mm.simulate(
        scene, method="variational/baoab", timestep=1.0, duration=100.0, replicas=512,
        record_interval=100,
    ).isel(time=-1)  # fmt: skip
    spins = run.ring_angular_velocity
    along = (run.ring_axis * spins).sum("space")
    across = (spins**2).sum("space") - along**2
    moments = scene.inner_moments
    axial, others = (float((square).mean()) for square in (along**2, across))
    share = moments[2] * axial / (moments[2] * axial + moments[0] * others)
    assert share == pytest.approx(axial_part(scene), rel=4.5 * math.sqrt(2 / 512))  # 3 %


def test_mujocos_ensemble_and_the_references_have_the_same_moments():
    """On the same noise, which tells more than independent samples of any size."""
    first, second = (
        mm.ensemble(
            mm.Motor.paper("uniform-a"), method=method, timestep=0.5, duration=500.0, replicas=16,
            seed=1, sample_interval=1000,
        ).isel(time=-1)
        for method in ("mujoco/baoab", "variational/baoab")
    )  # fmt: skip
    for name in ("mean", "mean_square"):
        scale = np.sqrt(second.mean_square) ** (2 if name == "mean_square" else 1)
        apart = abs(first[name] - second[name]) / scale
        assert apart.size == 7
        assert float(apart.max()) < 2e-13, name  # 8e-15


def flying(seed, mean=5000.0, per_run=4.0):
    """Return 128 runs with Poisson numbers of exponential flights."""
    random = np.random.default_rng(seed)
    counts = random.poisson(per_run, 128)
    found = durations(lambda _, count: random.exponential(size=count), counts.sum(), mean)
    return found._replace(
        first=np.zeros(128), heat_and_work=[HeatAndWork(n, 0, 0, 0, 0, 0) for n in counts]
    )


@pytest.mark.parametrize(
    ("changes", "verdict"),
    [({}, "right"), ({"mean": 8e3}, "wrong"), ({"per_run": 5.5}, "wrong")],
)
def test_a_difference_of_two_engines_is_seen(changes, verdict):
    """Two Gaussian differences; by chance one of 8000 pairs of sets is beyond four errors.

    The larger one is 1.6, 5.6 and 5.9 of them.
    """
    assert claim_of_agreement(flying(1), flying(2, **changes)).verdict == verdict


def test_mujoco_and_the_reference_stay_together_on_one_path():
    """Of the paper's seven runs, chaos parts this one first: 1 nm after 5300 s, 1 mm after 9800."""
    name = "nonuniform-c"
    first, second = (
        mm.simulate(
            mm.Motor.paper(name), method=method, timestep=0.1, duration=4000.0, record_interval=10,
            seed=PAPER[name][2],
        )
        for method in ("mujoco/baoab", "variational/baoab")
    )  # fmt: skip
    assert float(np.abs(first.position - second.position).max()) < 3e-9  # 4.6e-10
