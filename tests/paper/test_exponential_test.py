"""The test for an exponential distribution: statistic, level and power."""

import numpy as np
import pytest
from scipy import stats

from paper.motor.exponential_test import exponential_test, squared_variation

OTHERS = {"gamma": stats.gamma(2), "pareto": stats.lomax(2.5), "itself": stats.expon()}


def censored(law, shape, limit, seed):
    """Draw durations of mean 1; return them censored at a limit, which are, and the limits."""
    drawn = law.rvs(size=shape, random_state=np.random.default_rng(seed)) / law.mean()
    return np.minimum(drawn, limit), drawn > limit, np.full(shape, limit)


def test_without_censoring_it_is_the_squared_coefficient_of_variation():
    values = np.random.default_rng(1).gamma(3, size=(4, 50))
    found = squared_variation(values, np.zeros_like(values, dtype=bool))
    expected = values.var(axis=1) / values.mean(axis=1) ** 2
    np.testing.assert_allclose(found, expected, rtol=1e-14)  # 4e-16


@pytest.mark.parametrize("limit", [1.0, 3.0, 100.0])
def test_it_is_one_for_exponential_durations_with_any_censoring(limit):
    exponential, gamma, pareto = (
        squared_variation(*censored(law, (400, 1000), limit, 2)[:2]).mean()
        for law in (stats.expon(), *list(OTHERS.values())[:2])
    )
    assert exponential == pytest.approx(1.0, abs=0.01)  # 0.002
    assert gamma < 0.9  # 0.81, 0.54, 0.50
    assert pareto > 1.05  # 1.11, 1.46, 3.6


def test_level_and_power():
    """The rejection rate among 200 samples is the power."""
    power = exponential_test(*censored(stats.expon(), 60, 3.0, 0), OTHERS).power
    assert power["itself"] < 0.03  # 0.013
    assert power["gamma"] > 0.5  # 0.66
    for name, law in OTHERS.items():
        samples = [censored(law, 60, 3.0, seed) for seed in range(200)]
        rejected = [exponential_test(*sample, {}, draws=500).rejected for sample in samples]
        assert np.mean(rejected) == pytest.approx(power[name], abs=0.12)  # 0.08


def test_p_values_of_exponential_durations_are_uniform_in_the_mean():
    samples = [censored(stats.expon(), 20, 3.0, seed) for seed in range(200)]
    values = np.array([exponential_test(*sample, {}, draws=200).p_value for sample in samples])
    assert np.mean(values) == pytest.approx(0.5, abs=0.06)  # 0.01


def test_few_durations_which_may_all_be_censored_in_a_draw():
    found = exponential_test([1.0, 2.0], [False, False], [2.5, 2.5], {"gamma": OTHERS["gamma"]})
    assert 0.1 < found.p_value < 1  # 0.53
    assert 0 < found.power["gamma"] < 0.05  # 0.006
    assert np.isnan(squared_variation([1.0, 2.0], [True, True]))
