"""The Gymnasium environment `magmotor/Levitation-v0`, one at a time and many at once."""

import copy
import importlib
import os
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import mujoco
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import magmotor as mm
from magmotor.gym.levitation import Levitation, LevitationVector

ROOT = Path(__file__).parents[2]
NAME = "magmotor/Levitation-v0"
MU0 = 4e-7 * np.pi


@pytest.fixture
def env():
    made = gymnasium.make(NAME)
    yield made
    made.close()


@pytest.fixture
def controller(monkeypatch):
    """The controller of the example, as a function from observations to actions."""
    monkeypatch.syspath_prepend(ROOT / "examples")
    levitation = importlib.import_module("levitation")

    def make():
        held = levitation.Controller(levitation.load())
        return lambda seen: np.array([held(1e-3 * seen[0], seen[2], 1e-3 * seen[4]) / 6])

    return make


def episode(env, policy, seed):
    """The rewards of an episode, and whether the ball was lost."""
    observation, _ = env.reset(seed=seed)
    rewards = []
    while True:
        observation, reward, lost, late, _ = env.step(policy(observation))
        rewards.append(reward)
        if lost or late:
            return np.array(rewards), lost


def test_gymnasiums_checker_finds_nothing(opengl):
    """Warnings are errors."""
    made = gymnasium.make(NAME, render_mode="rgb_array")
    check_env(made.unwrapped)
    made.reset(seed=1)
    picture = np.asarray(made.render())
    assert picture.shape == (480, 480, 3)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 500  # 2420
    made.close()


def test_it_is_found_by_its_name_and_gymnasium_alone_loads_nothing_of_ours():
    program = f"""
import sys
import gymnasium
assert not {{"magmotor", "mujoco", "numba"}} & sys.modules.keys()
print(gymnasium.make("magmotor.gym:{NAME}").reset(seed=3)[0].tolist())
print(gymnasium.make_vec("{NAME}", 2).reset(seed=3)[0][0].tolist())
"""
    found = subprocess.run(
        [sys.executable, "-W", "error", "-c", program], capture_output=True, text=True, check=False
    )
    assert found.returncode == 0, found.stderr
    here = gymnasium.make(NAME).reset(seed=3)[0].tolist()
    assert found.stdout == 2 * f"{here}\n"


def test_without_gymnasium_the_error_names_the_extra(tmp_path):
    (tmp_path / "gymnasium.py").write_text('raise ModuleNotFoundError(name="gymnasium")')
    where = os.pathsep.join([str(tmp_path), str(ROOT / "src")])
    found = subprocess.run(
        [sys.executable, "-c", "import magmotor.gym"], env={**os.environ, "PYTHONPATH": where},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    last = found.stderr.strip().splitlines()[-1]
    assert last.endswith('gymnasium is not installed: pip install "magmotor[gym]"')


def test_an_episode_is_determined_by_its_seed(env):
    actions = np.random.default_rng(1).uniform(-0.3, 0.6, (20, 1))

    def observations(seed):
        return np.array([env.reset(seed=seed)[0], *(env.step(a)[0] for a in actions)])

    np.testing.assert_array_equal(observations(5), observations(5))
    assert (observations(5)[0] != observations(6)[0]).all()
    env.reset(seed=5)
    following = env.reset()[0]
    assert (following != observations(5)[0]).all()


def test_observations_are_what_the_sensors_show(env):
    """Against the fields of dipoles on their axis, and the noise of 2000 readings.

    Standard deviations are within five of their own errors, 1.6 %: one in a million seeds fails.
    """
    data = env.unwrapped.data
    errors = []
    for seed in range(1000, 1100):
        seen, _ = env.reset(seed=seed)
        assert abs(data.qacc[2]) < 4e-13  # 1.4e-14: the current holds the ball
        for step in range(20):
            height, current = data.qpos[2], data.act[0]
            exact = MU0 / (2 * np.pi) * (0.936 / (height + 0.03) ** 3 + 0.15 * current / 0.07**3)
            before = seen
            seen, *_ = env.step(np.array([0.3 if step % 2 else 0.4]))
            errors.append((1e-3 * seen[0] - exact, seen[2] - current))
            assert (seen[1], seen[3], seen[4]) == (before[0], before[2], before[4])
    field, current = np.mean(errors, axis=0)
    assert abs(field) < 6e-7  # 2e-8
    assert abs(current) < 1.1e-4  # 2e-5
    assert np.std(errors, axis=0) == pytest.approx([1e-5, 1e-3], rel=0.08)  # 0.7 %, 1.5 %


@pytest.mark.parametrize("height", [-0.0121, -0.0119, -0.003, 0.0, 0.0042, 0.0119, 0.0121])
def test_the_reward_is_for_what_is_near_the_set_point(env, height):
    seen, _ = env.reset(seed=1)
    env.unwrapped.data.qpos[2] = height
    seen, reward, lost, late, _ = env.step(np.array([0.3]))
    now = env.unwrapped.data.qpos[2]
    assert lost == (abs(now) > 0.012)
    assert not late
    expected = 0 if lost else max(0, 1 - abs(now - 1e-3 * seen[4]) / 5e-3)
    assert reward == pytest.approx(expected, abs=1e-15)


def test_chance_loses_the_ball_and_the_example_holds_it(env, controller):
    random = np.random.default_rng(2)
    by_chance = [episode(env, lambda _: random.uniform(-1, 1, 1), seed) for seed in range(40)]
    assert all(lost for _, lost in by_chance)
    assert max(len(rewards) for rewards, _ in by_chance) < 100  # 43: 0.09 s
    for seed in range(5):
        rewards, lost = episode(env, controller(), seed)
        assert not lost
        assert len(rewards) == 1000
        assert rewards.sum() > 960  # 989 or more
        assert rewards[100:].mean() > 0.97  # 0.997


def test_a_constant_current_cannot_hold_it(env):
    """It leaves as exp(31.3 t)."""
    for seed in range(3):
        current = episode(env, lambda seen: np.array([seen[2] / 6]), seed)
        assert current[1]
        assert len(current[0]) < 300  # 156


@pytest.mark.parametrize("longest", [1000, 60])
def test_many_at_once_have_the_numbers_of_single_ones(longest):
    """To the bit, over episodes that end and episodes that are truncated."""
    pair = [
        gymnasium.make_vec(NAME, 6, vectorization_mode=mode, max_episode_steps=longest)
        for mode in ("vector_entry_point", "sync")
    ]
    assert isinstance(pair[0].unwrapped, LevitationVector)
    assert pair[0].metadata["autoreset_mode"] == pair[1].metadata["autoreset_mode"]
    assert pair[0].observation_space == pair[1].observation_space
    assert pair[0].action_space == pair[1].action_space
    random = np.random.default_rng(4)
    ends = np.zeros(2, int)
    seeds: Any = (7, None, [3, 1, 4, 1, 5, 9])
    for seed in seeds:
        ours, theirs = (one.reset(seed=seed)[0] for one in pair)
        np.testing.assert_array_equal(ours, theirs)
        for _ in range(120):
            actions = random.uniform(0, 0.7, (6, 1)).astype(np.float32)
            ours, theirs = (one.step(actions)[:4] for one in pair)
            for one, other in zip(ours, theirs, strict=True):
                np.testing.assert_array_equal(one, other)
                assert one.dtype == other.dtype
            ends += ours[2].sum(), ours[3].sum()
    assert ends[0] > 5  # 31, 27
    assert (ends[1] > 5) == (longest == 60)  # 10
    for one in pair:
        one.close()


def test_observations_that_were_returned_do_not_change(env):
    many = gymnasium.make_vec(NAME, 3)
    for one, action in ((env, np.array([0.5])), (many, np.full((3, 1), 0.5))):
        first, _ = one.reset(seed=1)
        kept = first.copy()
        one.step(action)
        np.testing.assert_array_equal(first, kept)


def test_pictures_of_many_are_those_of_single_ones(opengl):
    pictures = []
    for mode in ("vector_entry_point", "sync"):
        many = gymnasium.make_vec(NAME, 2, vectorization_mode=mode, render_mode="rgb_array")
        assert many.render_mode == "rgb_array"
        many.reset(seed=1)
        many.step(np.full((2, 1), 0.9, np.float32))
        pictures.append(np.asarray(many.render()))
        many.close()
    assert pictures[0].shape == (2, 480, 480, 3)
    np.testing.assert_array_equal(*pictures)
    assert (pictures[0][0] != pictures[0][1]).any()


def test_a_part_of_many_is_reset():
    """As `SyncVectorEnv` does, with seeds and without, also after episodes have ended."""
    pair = [
        gymnasium.make_vec(NAME, 4, vectorization_mode=mode)
        for mode in ("vector_entry_point", "sync")
    ]
    random = np.random.default_rng(3)
    for one in pair:
        one.reset(seed=2)
    for k in range(200):
        actions = random.uniform(-1, 1, (4, 1)).astype(np.float32)
        ours, theirs = (one.step(actions) for one in pair)
        for part in range(4):
            np.testing.assert_array_equal(ours[part], theirs[part])
        if k % 7 == 0:
            mask, seed = random.permutation([True, False, True, False]), [None, k][k % 2]
            ours, theirs = (one.reset(seed=seed, options={"reset_mask": mask})[0] for one in pair)
            np.testing.assert_array_equal(ours, theirs)


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
@pytest.mark.parametrize("make", [Levitation, lambda: LevitationVector(3, max_episode_steps=12)])
def test_a_copy_goes_on_as_the_original(make, duplicate):
    env = make()
    env.reset(seed=4)
    actions = np.full((16, *env.action_space.shape), 0.35)
    for action in actions[:8]:
        env.step(action)
    other = duplicate(env)
    for action in actions[8:]:
        for one, same in zip(env.step(action)[:4], other.step(action)[:4], strict=True):
            np.testing.assert_array_equal(one, same)


def test_integers_of_any_kind_and_size_are_seeds():
    arrays: Any = [(np.array([5, 7]), [5, 7]), ([2**64, 2**53 + 1], (2**64, 2**53 + 1))]
    scalars: Any = [(np.int64(3), 3), (np.array(7), 7), (2**53 + 1, 2**53 + 1)]
    cases = (Levitation(), scalars), (LevitationVector(2), scalars + arrays)
    for one, seeds in cases:
        for seed, same in seeds:
            np.testing.assert_array_equal(one.reset(seed=seed)[0], one.reset(seed=same)[0])


@pytest.mark.parametrize("make", [Levitation, LevitationVector])
def test_a_step_needs_a_reset(make):
    with pytest.raises(gymnasium.error.ResetNeeded):
        make().step(np.zeros(1))


def test_an_action_that_is_not_finite_is_an_error_but_where_it_is_ignored():
    single, many = Levitation(), LevitationVector(2, max_episode_steps=3)
    single.reset(seed=1)
    many.reset(seed=1)
    with pytest.raises(mm.InputError):
        single.step(np.array([np.nan]))
    with pytest.raises(mm.InputError):
        many.step(np.array([[0.0], [np.nan]]))
    for _ in range(3):
        many.step(np.zeros((2, 1)))
    many.step(np.full((2, 1), np.nan))  # begins new episodes


def test_the_coil_is_nearly_a_dipole():
    """On the axis of a thin winding of its shape: the field, and its derivative at the ball."""
    model = mujoco.MjModel.from_xml_path(str(ROOT / "models" / "levitation.xml"))
    radius, half, _ = model.geom("coil").size
    moment = model.site("coil").user[0]
    assert 477 * np.pi * radius**2 == pytest.approx(moment, rel=2e-3)  # 1e-3

    def excess(z):
        ends = [(z + sign * half) / np.hypot(z + sign * half, radius) for sign in (1, -1)]
        winding = MU0 * moment / (4 * np.pi * radius**2 * half) * (ends[0] - ends[1])
        return MU0 * moment / (2 * np.pi * z**3) - winding, winding

    (far, field), (further, weaker) = excess(0.16), excess(0.32)
    assert far / field / (further / weaker) == pytest.approx(16, rel=0.1)  # 5e-3
    at, step = model.site("coil").pos[2], 1e-5
    (low, weak), (high, strong) = excess(at + step), excess(at - step)
    assert abs((high - low) / (strong - weak)) < 0.03  # 0.018
