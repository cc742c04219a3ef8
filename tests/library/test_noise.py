"""Brownian increments: known answers of the generator, moments, independence, and views."""

import signal
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit
from numpy.typing import NDArray
from scipy import stats

from magmotor import noise
from magmotor.noise import BrownianPath
from magmotor.numerics import elementary

COMPILED: list[Any] = [
    njit(function.py_func)  # for calls from Python
    for function in (noise.threefry, elementary.cosine, elementary.sine, elementary.logarithm)
]
threefry, cosine, sine, logarithm = COMPILED
MAX = 2**64 - 1
KNOWN_ANSWERS = [
    ((0, 0, 0, 0), (0xF167B032C3B480BD, 0xE91F9FEE4B7A6FB5)),
    ((MAX, MAX, MAX, MAX), (0xCCDEC5C917A874B1, 0x4DF53ABCA26CEB01)),
    (
        (0x243F6A8885A308D3, 0x13198A2E03707344, 0xA4093822299F31D0, 0x082EFA98EC4E6C89),
        (0xC3AAC71561042993, 0x3FE7AE8801AFF316),
    ),
]
SAMPLES = 200_000


@pytest.mark.parametrize(("counter_and_key", "answer"), KNOWN_ANSWERS)
def test_threefry_gives_the_published_vectors(counter_and_key, answer):
    """Known-answer vectors of Threefry-2x64 with 13 rounds, published with Random123."""
    words = threefry(*np.array(counter_and_key, np.uint64))
    assert tuple(int(word) for word in words) == answer


def test_a_normal_number_is_box_muller_of_threefry():
    """Compare with NumPy's functions applied to Threefry's words, which are tested above."""
    seed, replica, step, channel = 12345, 67, 8, 9
    words = threefry(*np.array([step // 2, channel, seed, replica], np.uint64))
    x, y = (int(word) for word in words)
    radius = np.sqrt(-2 * np.log(1 - (x >> 12) / 2**52))
    angle = np.pi * ((y >> 12) / 2**52 - 0.5)
    sign = -1 if y & 1 else 1
    even, odd = (noise.normal(seed, replica, step + k, channel, 1, 0) for k in (0, 1))
    assert even == pytest.approx(sign * radius * np.cos(angle), abs=1e-15)  # 0, or rounding
    assert odd == pytest.approx(radius * np.sin(angle), abs=1e-15)  # 6e-17


def test_elementary_functions_are_good_to_the_last_places():
    turns = np.concatenate([np.linspace(-2, 2, 4001), 1e4 + np.linspace(0, 1, 101)])
    exact = 2 * np.pi * (turns - np.rint(turns))
    cosines = np.array([cosine(t) for t in turns])
    sines = np.array([sine(t) for t in turns])
    assert np.abs(cosines - np.cos(exact)).max() < 1e-15  # 4e-16
    assert np.abs(sines - np.sin(exact)).max() < 1e-15  # 4e-16
    numbers = np.concatenate([np.geomspace(2.0**-52, 1, 1000), 1 - np.geomspace(1e-15, 0.5, 1000)])
    logs = np.array([logarithm(u) for u in numbers])
    exact = np.log(numbers)
    assert np.abs(logs / np.where(exact == 0, 1, exact) - (exact != 0)).max() < 1e-15  # 4e-16


STREAMS: dict[str, Callable[[int], NDArray[np.float64]]] = {
    "steps": lambda n: BrownianPath(1, 1.0).increments(n),
    "steps, far on": lambda n: BrownianPath(1, 1.0).increments(n, first=10**13 + 1),
    "channels": lambda n: np.array([noise.normal(1, 0, 5, c, 1, 0) for c in range(n)]),
    "replicas": lambda n: np.array([noise.normal(1, r, 5, 0, 1, 0) for r in range(n)]),
    "seeds": lambda n: np.array([noise.normal(s, 0, 5, 0, 1, 0) for s in range(n)]),
    "coarsened": lambda n: BrownianPath(2, 1.0).coarsened(3).increments(n) / np.sqrt(3),
    "refined": lambda n: BrownianPath(3, 1.0).refined(5).increments(n) * np.sqrt(32),
}


@pytest.mark.parametrize("stream", STREAMS)
def test_numbers_are_normal_and_independent_along_each_index(stream):
    """Moments, law and correlations at lags 1 to 8, each at 4.5 sigma.

    Sample size 200 000; 12 statistics a stream, 7 streams: false alarm rate 84 x 7e-6 = 6e-4.
    """
    numbers: Any = STREAMS[stream](SAMPLES)
    root = np.sqrt(SAMPLES)
    scores = [
        numbers.mean() * root,
        (np.mean(numbers**2) - 1) * root / np.sqrt(2),
        np.mean(numbers**3) * root / np.sqrt(15),
        (np.mean(numbers**4) - 3) * root / np.sqrt(96),
    ]
    scores += [np.mean(numbers[k:] * numbers[:-k]) * root for k in range(1, 9)]
    assert np.abs(scores).max() < 4.5
    assert stats.kstest(numbers, "norm").pvalue > 1e-4


def test_no_two_indices_are_correlated():
    """Products between neighbors in every pair of indices; 4.5 sigma, false alarm 3e-5 a pair."""
    steps = 20_000
    rows = np.array(
        [
            BrownianPath(seed, 1.0).increments(steps, replica=replica, channel=channel)
            for seed in (0, 1)
            for replica in (0, 1)
            for channel in (0, 1)
        ]
    )
    pairs = np.triu_indices(len(rows), 1)
    correlations = np.asarray(np.corrcoef(rows))[pairs]
    assert np.abs(correlations).max() * np.sqrt(steps) < 4.5
    squares = np.asarray(np.corrcoef(rows**2))[pairs]
    assert np.abs(squares).max() * np.sqrt(steps) < 4.5


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, noise.LARGEST_SEED - 1),
    replica=st.integers(0, 10**6),
    first=st.integers(0, 10**9),
    factor=st.integers(1, 50),
)
def test_a_coarse_increment_is_the_sum_of_the_fine(seed, replica, first, factor):
    fine = BrownianPath(seed, 0.25)
    coarse = fine.coarsened(factor)
    sums = fine.increments(3 * factor, first=first * factor, replica=replica).reshape(3, -1)
    found = coarse.increments(3, first=first, replica=replica)
    np.testing.assert_allclose(found, sums.sum(axis=1), rtol=0, atol=5e-14)  # 4e-15


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 1000), first=st.integers(0, 10**9), level=st.integers(1, 12))
def test_refined_increments_add_up_to_the_coarse(seed, first, level):
    path = BrownianPath(seed, 0.25)
    fine = path.refined(level)
    found = fine.increments(2 << level, first=first << level, channel=3).reshape(2, -1)
    own = path.increments(2, first=first, channel=3)
    np.testing.assert_allclose(found.sum(axis=1), own, rtol=0, atol=2e-14)  # 8e-16
    assert fine.coarsened(1 << level) == path


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, noise.LARGEST_SEED - 1),
    step=st.integers(0, noise.LARGEST_STEP - 1),
    channel=st.integers(0, noise.BRIDGES - 1),
    level=st.integers(1, noise.FINEST),
)
def test_a_refined_number_is_levy_s_construction(seed, step, channel, level):
    """The halves are (parent +- bridge)/sqrt 2; level k uses bridge channels from 2^32 k on."""
    value = noise.normal(seed, 7, step >> level, channel, 1, 0)
    for k in range(1, level + 1):
        parent, right = divmod(step >> (level - k), 2)
        bridge = noise.normal(seed, 7, parent, 2**32 * k + channel, 1, 0)
        value = (value - bridge if right else value + bridge) / np.sqrt(2)
    assert noise.normal(seed, 7, step, channel, 1, level) == pytest.approx(
        value, rel=0, abs=2e-14
    )  # 7e-16


def test_refinement_draws_what_no_channel_has():
    """Bridges of channel 0 and numbers of channels 0 to 3; 4.5 sigma, false alarm 1e-4."""
    path, steps = BrownianPath(1, 1.0), 20_000
    halves = path.refined(1).increments(2 * steps).reshape(-1, 2)
    bridge = halves[:, 0] - halves[:, 1]
    quarters = path.refined(2).increments(4 * steps).reshape(-1, 2)
    lower = (quarters[:, 0] - quarters[:, 1])[:steps]
    for channel in range(4):
        own = path.increments(steps, channel=channel)
        for found in (bridge, lower):
            assert abs(np.corrcoef(found, own)[0, 1]) * np.sqrt(steps) < 4.5, channel


def test_views_of_a_path():
    path = BrownianPath(1, 0.5)
    assert path.coarsened(6).refined(1) == path.coarsened(3)
    assert path.coarsened(2).coarsened(3) == path.coarsened(6)
    assert path.refined(3).coarsened(2) == path.refined(2)


def test_ctrl_c_is_checked_between_pieces_and_pieces_change_no_bit(monkeypatch):
    path = BrownianPath(5, 0.1).coarsened(3)
    whole = path.increments(100, first=7, replica=2, channel=1)
    monkeypatch.setattr(noise, "PIECE", 12)
    fill, calls = noise._fill_normals, []

    def watched(*arguments):
        calls.append(arguments)
        fill(*arguments)
        if len(calls) == 40:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(noise, "_fill_normals", watched)
    np.testing.assert_array_equal(path.increments(100, first=7, replica=2, channel=1), whole)
    with pytest.raises(KeyboardInterrupt):
        path.increments(100)
    assert len(calls) == 25 + 15
