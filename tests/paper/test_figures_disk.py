"""Claims about the disk's figures, with data for which they must fail or hold."""

import dataclasses

import numpy as np
import pytest
import xarray as xr

import magmotor as mm
from paper.disk import ergodicity, flight_law, memory, relaxation
from paper.disk.flight_law import Flights, exponent
from paper.disk.flight_theory import FlightLaw, stretched_time
from paper.disk.flights import (
    claim_of_flights,
    claim_of_the_tail,
    claim_of_the_theorem,
    longest_flight,
    slopes,
)
from paper.disk.statistics import claim_of_agreement
from paper.disk.system import System
from paper.disk.systems import Disks

FLIGHTS = 100_000
LAWS = {
    # The tail of an exponential law, or of one with a preferred duration, is not heavy.
    "exponential": (lambda random: random.exponential(1907, FLIGHTS), "wrong"),
    "gamma": (lambda random: random.gamma(3, 1500, FLIGHTS), "wrong"),
    "Pareto": (lambda random: 500 * random.pareto(1.5, FLIGHTS), "right"),
}


@pytest.mark.parametrize("law", LAWS)
def test_a_tail_is_heavy_only_if_it_is(law):
    draw, verdict = LAWS[law]
    begins = np.append(0.0, 2 ** np.arange(0, 20, 0.25))
    ended, _ = np.histogram(draw(np.random.default_rng(0)), np.append(begins, np.inf))
    counts = {"flights": ended, "unfinished_flights": np.zeros_like(ended)}
    run = xr.Dataset({name: ("flight_duration", values) for name, values in counts.items()})
    assert claim_of_the_tail(run.assign_coords(flight_duration=begins)).verdict == verdict


def paths_of(steps):
    """Return paths of x with given steps, shape (replicas, T), recorded every 50."""
    x = np.concatenate([np.zeros((len(steps), 1)), np.cumsum(steps, axis=1)], axis=1)
    times = 50.0 * np.arange(x.shape[1])
    return xr.Dataset({"x": (("replica", "time"), x)}, coords={"time": times})


def test_a_large_brownian_motion_has_no_flights():
    """That 32 of 4000 signs in a row are alike, which would be a flight, has a chance of 1e-6."""
    small, large = (
        paths_of(size * np.random.default_rng(seed).normal(size=(4, 1000)))
        for seed, size in ((0, 1.0), (1, 100.0))
    )
    assert claim_of_flights(large, small).verdict == "wrong"  # 500 against 800
    flying = large.assign(x=large.x + 1e3 * large.time)
    assert longest_flight(flying) == 50_000
    assert claim_of_flights(flying, small).verdict == "right"


def test_the_longest_flight_of_given_steps():
    steps = np.array([[1, 1, -1, -1, -1, 1.0], [1, -1, 1, -1, 1, -1.0]])
    assert longest_flight(paths_of(steps)) == 150
    assert longest_flight(paths_of(-steps[1:])) == 50


@pytest.fixture(scope="module")
def warm():
    """An ensemble that starts in the invariant law and hence is stationary."""
    scene = mm.Disk()
    return mm.ensemble(
        scene, method="variational/baoab", timestep=0.05, duration=500, replicas=1000, seed=2,
        initial=mm.theory.gibbs(scene, 1000, seed=1),
    )  # fmt: skip


def test_slopes_by_the_correlation_are_those_of_the_mean_squares(warm):
    slope, error = slopes(warm)
    by_squares = np.diff(np.log2(warm.mean_square_increment.values))
    np.testing.assert_allclose(slope[:-1], by_squares, atol=0.02)  # 0.003
    np.testing.assert_array_less(error, 0.03)  # 0.01


@pytest.mark.parametrize(("rho", "verdict"), [(0.999, "right"), (0.96, "right"), (0.9, "wrong")])
def test_the_theorem_holds_where_the_slope_may_be_two(warm, rho, verdict):
    run = warm.copy(deep=True)
    run["increment_correlation"] = xr.full_like(run.increment_correlation, rho)
    run["increment_correlation_error"] = xr.full_like(run.increment_correlation, 0.015)
    assert claim_of_the_theorem(run).verdict == verdict


def test_mujocos_ensemble_and_the_references_have_the_same_moments():
    """On the same noise, which tells more than independent samples of any size."""
    for potential in ("symmetric", "flat"):
        first, second = (
            mm.ensemble(
                mm.Disk(potential=potential), method=method, timestep=0.05, duration=50.0,
                replicas=32, seed=1,
            ).isel(time=-1)
            for method in ("mujoco/baoab", "variational/baoab")
        )  # fmt: skip
        for name in ("mean", "mean_square"):
            scale = np.sqrt(second.mean_square) ** (2 if name == "mean_square" else 1)
            apart = abs(first[name] - second[name]) / (1 + scale)  # d is 0 on flat U
            assert apart.size == 7
            assert float(apart.max()) < 3e-10, (potential, name)  # 1.1e-11


def pair(method, seed, noise=5.0):
    """Return a small system, from rest and stationary."""
    scene = mm.Disk(potential="flat", noise=noise)
    numerics = {"timestep": 0.05, "duration": 20.0, "replicas": 256}
    rest = mm.ensemble(scene, method=method, seed=seed, trajectories=256, **numerics)
    return System("flat", rest, rest)


@pytest.mark.parametrize(("noise", "verdict"), [(5.0, "right"), (7.5, "wrong")])
def test_a_difference_of_two_engines_is_seen(noise, verdict):
    """256 replicas each; by chance one of 10 000 pairs is beyond four standard errors."""
    disks = Disks([pair("variational/euler", 1)], [pair("mujoco/baoab", 2, noise)])
    claim = claim_of_agreement(disks)
    assert claim.verdict == verdict, claim  # 0.5 and 12 standard errors


def cold_flights(durations):
    """Return an ensemble of the cold disk with these flights in place of its own."""
    run = mm.ensemble(
        flight_law.COLD, method="variational/baoab", timestep=0.1, duration=4e4, replicas=8,
        sample_interval=10,
    )  # fmt: skip
    edges = np.append(run.flight_duration.values, np.inf)
    run["flights"] = ("flight_duration", np.histogram(durations, edges)[0])
    run["unfinished_flights"] = xr.zeros_like(run.flights)
    return Flights({"paper": run, "cold": run}, flight_law.QUICK_OCTAVES)


def of_the_reduced_equation(random):
    """Draw durations with the survival of the reduced equation, by inversion."""
    t = np.geomspace(1, 4e4, 2000)
    survival = FlightLaw(flight_law.COLD).survival(t)
    return np.exp(np.interp(-np.log(random.uniform(size=4_000_000)), -np.log(survival), np.log(t)))


@pytest.mark.parametrize(("law", "verdict"), [
    (of_the_reduced_equation, "right"),
    (lambda random: random.exponential(400, 4_000_000), "wrong"),
    (lambda random: random.pareto(1.7, 4_000_000), "wrong"),
], ids=["reduced", "exponential", "power"])  # fmt: skip
def test_the_end_of_flights_is_told_from_other_laws(law, verdict):
    claim = flight_law.claim_of_the_end(cold_flights(law(np.random.default_rng(5))))
    assert claim.verdict == verdict, claim


@pytest.mark.parametrize("q", [0.25, 0.5, 1.0])
def test_the_exponent_of_a_stretched_exponential(q):
    t = 7.0 * np.array([1, 4, 16])
    found, error = exponent(-1.3 - 0.2 * q * t**q, np.full(3, 0.01), 4)
    assert found == pytest.approx(q, rel=3e-13, abs=0)  # 1.3e-14
    assert error > 0


def test_flights_by_the_reduced_equation_are_those_of_a_simulation_with_constant_diffusion():
    """On flat U with drag, d is an Ornstein-Uhlenbeck process: in the end, an exponential law.

    The standard errors of the two slopes are 1.4 %; 10 % by chance are impossible.
    """
    scene = mm.Disk(potential="flat", drag=1e-2, rotational_drag=5e-3)
    run = mm.ensemble(
        scene, method="variational/baoab", timestep=0.1, duration=4e3, replicas=2048, seed=7,
        sample_interval=2, initial=mm.theory.gibbs(scene, 2048, seed=8),
    )  # fmt: skip
    begins = 0.2 * 2**9, 0.2 * 2**10
    slopes, _ = flight_law.measured_slopes(run, begins)
    expected = flight_law.expected_slopes(FlightLaw(scene), begins)
    np.testing.assert_allclose(slopes, expected, rtol=0.1)  # 0.02
    assert expected[1] / expected[0] > 1.7  # 1.89: 2 in the end


def test_the_time_of_the_stretched_exponential():
    """The slope of the reduced equation is that of exp[-(t/tau)^(1/2)], up to a power of t."""
    for scene, t in ((mm.Disk(), 3e7 * np.array([1, 3])), (flight_law.COLD, 1e5 * np.ones(2))):
        late = t * np.array([1, 3]) if t[0] == t[1] else t
        steeper = np.diff(FlightLaw(scene).slope(late))[0]
        expected = -np.diff(np.sqrt(late / stretched_time(scene)))[0] / 2
        assert steeper == pytest.approx(expected, rel=0.1)  # 0.02, 0.02


def test_scatter_of_averages_against_closed_forms():
    """For long times it is sqrt(2 memory/T), with memories m <1/D> of d and <d^2/D>/2 of d^2."""
    model = mm.theory.ReducedDisk(mm.Disk())
    diffusion = mm.theory.d_diffusion(model.scene, model.d)
    memories = model.correlation_time, float(model.probability @ (model.d**2 / diffusion)) / 2
    for odd, time in zip((True, False), memories, strict=True):
        found = float(relaxation.expected_scatter(odd, np.array([1e14]))[0])
        assert found == pytest.approx((2 * time / 1e14) ** 0.5, rel=0.02)  # 0.003
    t = np.array([10.0, 6684.0, 1e6])
    expected = model.d_correlation(t) / model.mean_square
    np.testing.assert_allclose(relaxation.expected_correlation(t), expected, rtol=1e-6)  # 4e-8


def test_averages_off_gibbs_are_seen():
    found = ergodicity.compute(True)
    assert [claim.verdict for claim in ergodicity.claims(found)] == ["right"] * 3
    hot = {name: 1.2 * each for name, each in found.squares.items()}
    same = dict.fromkeys(found.kept, found.kept[1.0])  # as with a spectral gap
    worse = {"squares": hot, "correlation": found.correlation + 0.5, "kept": same}
    for number, (name, value) in enumerate(worse.items()):
        claim = ergodicity.claims(dataclasses.replace(found, **{name: value}))[number]
        assert claim.verdict == "wrong", claim


def test_a_memory_that_needs_the_potential_would_be_seen():
    found = memory.compute(True)
    assert [claim.verdict for claim in memory.claims(found)] == ["wrong", *["right"] * 3]
    swapped = found.correlation | {
        memory.FLAT: np.zeros_like(found.lags),
        memory.DRAGGED: found.correlation[memory.PAPERS],
    }
    claims = memory.claims(dataclasses.replace(found, correlation=swapped))
    assert [claim.verdict for claim in claims] == ["right", "wrong", "wrong", "right"]
