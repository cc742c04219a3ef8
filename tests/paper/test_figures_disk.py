"""Claims about the disk's figures, with data for which they must fail or hold."""

import numpy as np
import pytest
import xarray as xr
from agreement import scores

import magmotor as mm
from magmotor.devices.disk.system import System
from paper.disk.flights import claim_of_the_tail, claim_of_the_theorem, slopes
from paper.disk.statistics import claim_of_agreement
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


@pytest.fixture(scope="module")
def warm():
    """An ensemble that starts in the invariant law and hence is stationary."""
    scene = mm.Disk()
    return mm.ensemble(
        scene, method="variational/baoab", timestep=0.05, duration=500, replicas=1000, seed=2,
        initial=mm.gibbs(scene, 1000, seed=1),
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
    """Independent seeds, 1024 replicas each; 28 differences of means, each Gaussian.

    The chance that one of them is beyond 4.5 standard errors is 2e-4.
    """
    for potential in ("symmetric", "flat"):
        first, second = (
            mm.ensemble(
                mm.Disk(potential=potential), method=method, timestep=0.05, duration=50.0,
                replicas=1024, seed=seed,
            ).isel(time=-1)
            for method, seed in (("mujoco/baoab", 1), ("variational/baoab", 2))
        )  # fmt: skip
        for score in scores(first, second):
            assert score.size == 7
            assert float(score.max()) < 4.5, potential  # 2.1


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
