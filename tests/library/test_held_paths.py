"""Held paths: samples, spectrum, variance, other timesteps, and the same path in every engine."""

import dataclasses
import json
from typing import Any

import mujoco
import numpy as np
import pytest
from brief_runs import BRIEF
from refusals import refused

import magmotor as mm
from magmotor import noise
from magmotor.device import job as jobs
from magmotor.noise import BrownianPath

PATH = BrownianPath(seed=3, timestep=0.25)
SLIDE = """
<mujoco><size nuserdata="5"/><option gravity="0 0 0" timestep="0.25"/><worldbody><body>
<joint type="slide" damping="1e-4"/><geom size="0.1" mass="1" contype="0" conaffinity="0"/>
</body></worldbody></mujoco>
"""


def samples(steps: int, window: int, first: int, count: int) -> np.ndarray:
    """Standard normal numbers that a held path of `PATH` holds, by NumPy."""
    white = BrownianPath(PATH.seed, 1.0).increments(first + count + window)[first:]
    return (white[window:] - white[:count]) / np.sqrt(2) if window else white


@pytest.mark.parametrize(("steps", "window"), [(1, None), (1, 5), (4, None), (4, 1), (7, 3)])
def test_increments_are_repeated_samples(steps, window):
    first, count = 11, 40
    found = PATH.held(steps, window).increments(count * steps, first=first * steps)
    twin = np.sqrt(PATH.timestep / steps) * samples(steps, window or 0, first, count)
    np.testing.assert_allclose(found, np.repeat(twin, steps), rtol=5e-15)  # 2e-16
    inside = PATH.held(steps, window).increments(3, first=first * steps + steps - 1)
    np.testing.assert_array_equal(inside, found[steps - 1 : steps + 2])


def test_one_step_is_the_white_path_to_the_bit():
    assert PATH.held(1) == PATH
    view = 1, noise.HELD  # as a model's user data may have it
    held = [noise.normal(3, 2, step, 1, *view) for step in range(50)]
    assert held == [noise.normal(3, 2, step, 1, 1, 0) for step in range(50)]


def test_at_the_ends_of_the_holds_it_is_a_white_path():
    ends = PATH.held(8).increments(80).reshape(10, 8).sum(axis=1)
    white = BrownianPath(PATH.seed, 8 * PATH.timestep).increments(10)
    np.testing.assert_allclose(ends, white, rtol=5e-15)  # 2e-16


@pytest.mark.parametrize("window", [None, 16])
def test_the_spectrum_is_that_of_a_zero_order_hold_and_a_comb(window):
    """Means of the periodogram over its expectation in 12 bands; 4.5 sigma, false alarm 1e-4.

    Each of the 12 x 2731 ratios is exponential with mean 1. White noise, the null, is off by more
    than 100 sigma.
    """
    steps, count = 8, 2**15
    h = PATH.timestep
    frequency = np.fft.rfftfreq(steps * count, h)[1 : count + 1]
    sinc = np.sin(np.pi * frequency * steps * h) / np.sin(np.pi * frequency * h) / steps
    expected = sinc**2
    if window:
        expected = expected * 2 * np.sin(np.pi * frequency * steps * h * window) ** 2
    half = np.argmin(abs(frequency - 0.443 / (steps * h)))
    assert sinc[half] ** 2 == pytest.approx(0.5, rel=0.03, abs=0)  # 0.5 %
    bands = np.array_split(np.arange(count), 12)
    deviations = {}
    for name, path in (("held", PATH.held(steps, window)), ("white", PATH)):
        rate = path.increments(steps * count) / h
        power = h / (steps * count) * np.abs(np.fft.rfft(rate)[1 : count + 1]) ** 2
        # A band's sum weighs its frequencies by the spectrum, which has zeros.
        deviations[name] = [
            (power[band].sum() - expected[band].sum()) / np.sqrt(np.sum(expected[band] ** 2))
            for band in bands
        ]
    assert np.abs(deviations["held"]).max() < 4.5
    assert np.abs(deviations["white"]).max() > 100


def test_a_window_bounds_the_displacement():
    """The variance of W about its middle is window H/2; 4000 independent values, 4.5 sigma."""
    steps, window, count = 2, 20, 4000
    W = np.cumsum(PATH.held(steps, window).increments(steps * window * count))
    apart = W[steps * window - 1 :: steps * window]
    expected = window * steps * PATH.timestep / 2
    assert abs(np.var(apart) / expected - 1) < 4.5 * np.sqrt(2 / count)
    assert np.var(np.cumsum(PATH.held(steps).increments(steps * window * count))) > 100 * expected


def test_other_timesteps_follow_the_same_path():
    held = PATH.held(12, 3)
    whole = held.increments(240)
    for factor in (2, 3, 12):
        coarse = held.coarsened(factor)
        assert coarse.timestep == factor * 0.25
        sums = whole.reshape(-1, factor).sum(axis=1)
        np.testing.assert_allclose(coarse.increments(240 // factor), sums, rtol=1e-14)  # 4e-16
    fine = held.refined(2)
    sums = fine.increments(960).reshape(-1, 4).sum(axis=1)
    np.testing.assert_allclose(sums, whole, rtol=1e-15)  # 0
    assert fine.coarsened(4) == held
    assert PATH.held(4).coarsened(4) == BrownianPath(3, 1.0)


MOTOR: dict[str, Any] = {"timestep": 0.1, "duration": 200.0, "record_interval": 50, "replicas": 2}
MOTOR_PATH = BrownianPath(5, 0.1).held(7, 4)


def test_engines_follow_one_held_path():
    """White noise of the same seed, the null, leads elsewhere."""
    positions = [
        mm.simulate(mm.Motor(), method=method, path=path, **MOTOR).position
        for method, path in (
            ("mujoco/baoab", MOTOR_PATH),
            ("variational/baoab", MOTOR_PATH),
            ("variational/baoab", BrownianPath(5, 0.1)),
        )
    ]
    assert abs(positions[0] - positions[1]).max() < 1e-13  # 5e-15
    assert abs(positions[0] - positions[2]).max() > 1e-3


def test_a_disk_follows_a_held_path_in_both_engines():
    numerics: dict[str, Any] = {"timestep": 0.05, "duration": 20.0, "path": MOTOR_PATH.refined()}
    one, other = (
        mm.simulate(mm.Disk(), method=f"{engine}/baoab", **numerics)
        for engine in ("mujoco", "variational")
    )
    np.testing.assert_allclose(one.x, other.x, rtol=0, atol=3e-12)  # 1e-13


def test_a_run_is_reproduced_and_resumed_with_its_held_path(tmp_path, monkeypatch):
    monkeypatch.setattr(jobs, "CHUNK", 20)
    arguments: dict[str, Any] = {"method": "variational/baoab", "path": MOTOR_PATH, **MOTOR}
    whole = mm.simulate(mm.Motor(), **arguments)
    assert json.loads(whole.attrs["path"]) == dataclasses.asdict(MOTOR_PATH)
    assert mm.rerun(whole).identical(whole)
    first = mm.simulate(mm.Motor(), **(arguments | {"duration": 101.0, "record_interval": 10}))
    rest = mm.simulate(
        mm.Motor(), **(arguments | {"duration": 99.0, "record_interval": 10}), initial=first
    )
    np.testing.assert_array_equal(rest.position[:, -1], whole.position[:, -1])
    checkpoint = tmp_path / "run.checkpoint"
    mm.simulate(mm.Motor(), **arguments, checkpoint=checkpoint)
    other: dict[str, Any] = arguments | {"path": BrownianPath(5, 0.1).held(7, 5)}
    with refused("checkpoint"):
        mm.simulate(mm.Motor(), **other, checkpoint=checkpoint)


@BRIEF
@pytest.mark.parametrize("splitting", ["middle", "obabo"])
def test_langevin_follows_a_held_path(splitting):
    """A slide with hardly any friction adds up the noise; both halves of a step are held."""
    model = mujoco.MjModel.from_xml_string(SLIDE)
    path = PATH.held(3)
    langevin = mm.Langevin(model, kT=0.3, splitting=splitting, path=path)
    run = langevin.sample(30 * langevin.timestep, initial=mujoco.MjData(model))
    gained = np.sqrt(2 * 0.3 * 1e-4) * path.increments(30)
    v = np.cumsum(gained)
    x = 0.25 * np.cumsum(v - gained / 2)  # a bridge would divide the increment otherwise
    np.testing.assert_allclose(run.qvel[0, :, 0], v, rtol=0, atol=3e-5)  # 4e-6
    np.testing.assert_allclose(run.qpos[0, :, 0], x, rtol=0, atol=3e-5)  # 8e-6
