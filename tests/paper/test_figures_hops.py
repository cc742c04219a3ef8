"""The motor's hops and flights: the rotor as null, barriers, and the laws of flights."""

import numpy as np
import pytest

from paper.motor.rotor import rotor


@pytest.mark.parametrize("steps", [np.full(100, 60.0), np.tile([5.0, 235.0], 25)])
def test_a_rotor_moves_as_an_ornstein_uhlenbeck_process_does(steps):
    """Mean squares over 40 000 rotors; their standard error is sqrt(2/40 000) = 0.7 %.

    The chance that one of 3 Gaussian scores is beyond 4.5 errors is 2e-5.
    """
    rate, memory = 3e-3, 3300.0
    times = np.append(0.0, np.cumsum(steps))
    azimuths = rotor(rate, memory, times, 40_000, seed=1)
    assert azimuths.shape == (40_000, len(times))
    assert not azimuths[:, 0].any()
    for k in (1, len(times) // 2, len(times) - 1):
        t = times[k] / memory
        expected = 2 * (rate * memory) ** 2 * (t - 1 + np.exp(-t))
        score = ((azimuths[:, k] ** 2).mean() / expected - 1) / np.sqrt(2 / 40_000)
        assert abs(score) < 4.5
    again = rotor(rate, memory, times, 40_000, seed=1)
    np.testing.assert_array_equal(again, azimuths)
