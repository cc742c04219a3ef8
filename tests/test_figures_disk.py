"""Claims on the disk's figures, of data for which they must fail, or hold."""

import numpy as np
import pytest
import xarray as xr

from magmotor.figures.disk.flights import claim_of_the_tail

FLIGHTS = 100_000
LAWS = {
    # Of an exponential law, and of one with a preferred duration, the tail is not heavy.
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
