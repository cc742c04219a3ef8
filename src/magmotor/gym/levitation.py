"""A magnet below a coil, whose current must hold it: a Gymnasium environment, and many at once."""

import math
import operator
from collections.abc import Sequence
from typing import Any

import gymnasium
import mujoco
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Box
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from mujoco.batch import Batch
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.common.checks import check_array, check_floats, check_integer, elements
from magmotor.common.environment import data_folder
from magmotor.common.exceptions import ArgumentError
from magmotor.dipoles import PERMEABILITY_OVER_4PI

Flags = NDArray[np.bool_]

LOST = 0.012
"""Height in m, upwards or downwards, at which an episode ends."""

START, TARGETS = 0.002, 0.004
"""Largest height in m at the start, and largest set point."""

TOLERANCE = 0.005
"""Distance in m from the set point at which there is no reward."""

HEIGHT = 2
"""Its place in `qpos`."""

NOT_RESET = "call reset before step"

FIELD, FIELD_BEFORE, CURRENT, CURRENT_BEFORE, TARGET = range(5)
"""The elements of an observation."""


class Levitation(gymnasium.Env):
    """Hold a magnet below a coil at a given height: `magmotor/Levitation-v0`.

    A ball of NdFeB, 12 mm wide, floats 40 mm below the center of a coil. A constant current cannot
    hold it: the attraction increases as the ball rises, and its distance from the equilibrium grows
    by a factor of e in 32 ms. No force needs to act to the sides, where it is stable. The current
    follows the action with a rise time of 5 ms. A magnetometer below the ball measures the field of
    the ball and the coil together.

    A step lasts 2 ms. An episode starts at rest, at a random height within 2 mm of the middle, with
    the current that would hold the ball there and a random set point within 4 mm.

    Parameters
    ----------
    render_mode : {"rgb_array"}, optional

    Attributes
    ----------
    model : mujoco.MjModel
        `models/levitation.xml`.
    data : mujoco.MjData
        The true state; z of the ball is its height.
    observation_space : gymnasium.spaces.Box
        Five numbers (see Notes).
    action_space : gymnasium.spaces.Box
        One number from -1 to 1: the voltage of the coil over the largest one, with which the
        current tends to 6 A. 2 A hold the ball in the middle.

    Notes
    -----
    The observation contains, in this order:

    1. the upward field at the magnetometer in mT, with a noise of 0.01 mT, at most 50 mT;
    2. the same, as it was measured a step before;
    3. the current in the coil in A, with a noise of 1 mA;
    4. the same, as it was measured a step before;
    5. the set point in mm.

    What is measured is the state at the beginning of the step that ends now.

    The reward of a step is 1 - |height - set point|/(5 mm), but not less than 0. The episode ends
    where the ball is more than 12 mm above or below the middle. Gymnasium truncates an episode
    after 1000 steps.

    Examples
    --------
    >>> import gymnasium
    >>> env = gymnasium.make("magmotor.gym:magmotor/Levitation-v0")
    >>> observation, _ = env.reset(seed=1)
    >>> observation.shape
    (5,)
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 500}  # noqa: RUF012 - as in the base

    def __init__(self, render_mode: str | None = None):
        self.render_mode = _render_mode(render_mode)
        self._task = _Task()
        self.model = self._task.model
        self.data = mujoco.MjData(self.model)
        self.observation_space, self.action_space = self._task.spaces()
        self._observation: Array | None = None
        self._camera = _Camera(self.model)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Begin an episode; return the first observation and an empty dictionary."""
        super().reset(seed=None if seed is None else _seed(seed))
        height, target = _draw_start(self.np_random)
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[HEIGHT] = height
        self.data.act[:] = self.data.ctrl[:] = self._task.holding_current(height)
        mujoco.mj_forward(self.model, self.data)
        noise = self.np_random.standard_normal(2)
        self._observation = self._task.first(self.data.sensordata, noise, target)
        return self._observation, {}

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Apply an action for 2 ms; return observation, reward, terminated, False and {}."""
        if self._observation is None:
            raise ResetNeeded(NOT_RESET)
        self.data.ctrl[:] = self._task.control(check_array("action", action, 1))
        mujoco.mj_step(self.model, self.data)
        noise = self.np_random.standard_normal(2)
        self._observation = self._task.next(self._observation, self.data.sensordata, noise)
        height = self.data.qpos[HEIGHT]
        lost = _is_lost(height)
        return self._observation, float(_reward(height, self._observation)), bool(lost), False, {}

    def render(self) -> Array | None:
        """Return a picture, shape (480, 480, 3), if the render mode is rgb_array."""
        return None if self.render_mode is None else self._camera.picture(self.data.qpos)

    def close(self) -> None:
        """Release the renderer."""
        self._camera.close()


class LevitationVector(VectorEnv):
    """Many environments `Levitation` at once, on all processors by `mujoco.batch`.

    `gymnasium.make_vec("magmotor.gym:magmotor/Levitation-v0", num_envs=...)` makes one. Its
    numbers are bit for bit those of `SyncVectorEnv`. An environment whose episode has ended is
    reset by the next step, which ignores its action (`AutoresetMode.NEXT_STEP`).

    Parameters
    ----------
    num_envs : int
        Number of environments.
    max_episode_steps : int
        Number of steps after which an episode is truncated.
    threads : int
        Number of threads; 0 for the number of processors.
    render_mode : {"rgb_array"}, optional
    """

    metadata = Levitation.metadata | {"autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        num_envs: int = 1,
        max_episode_steps: int = 1000,
        threads: int = 0,
        render_mode: str | None = None,
    ):
        self.render_mode = _render_mode(render_mode)
        self.num_envs = check_integer("num_envs", num_envs, at_least=1)
        self._limit = check_integer("max_episode_steps", max_episode_steps, at_least=1)
        self._task = _Task()
        self._camera = _Camera(self._task.model)
        self.single_observation_space, self.single_action_space = self._task.spaces()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._make_batch(threads)
        self._randoms: list[np.random.Generator] = []
        self._observations = np.zeros((num_envs, 5))
        self._steps = np.zeros(num_envs, int)
        self._over = np.zeros(num_envs, bool)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Array, dict[str, Any]]:
        """Begin all episodes; return the first observations and an empty dictionary.

        A seed s stands for s, s + 1, ... of the environments. An array of bools
        `options["reset_mask"]` selects the environments whose episodes begin; those of the others
        go on.
        """
        begins = _reset_mask(options, self.num_envs)
        if not self._randoms and not begins.all():
            raise ResetNeeded("call reset for all environments before a part of them")
        for i, one in enumerate(_seeds(seed, self.num_envs)):
            if i == len(self._randoms):
                self._randoms.append(seeding.np_random(one)[0])
            elif one is not None and begins[i]:
                self._randoms[i] = seeding.np_random(one)[0]
        self._begin(np.flatnonzero(begins))
        return self._observations.copy(), {}

    def step(self, actions: Array) -> tuple[Array, Array, Flags, Flags, dict[str, Any]]:
        """Apply actions, shape (num_envs, 1), for 2 ms, or reset where the episode is over."""
        if not self._randoms:
            raise ResetNeeded(NOT_RESET)
        going, over = np.flatnonzero(~self._over), np.flatnonzero(self._over)
        applied = check_floats("actions", actions, self.num_envs, 1)[going]
        self._batch.ctrl[going] = self._task.control(check_array("actions", applied))
        self._batch.step(going)
        self._steps[going] += 1
        before, noise = self._observations[going], self._noise(going)
        self._observations[going] = self._task.next(before, self._sensordata[going], noise)
        height = self._batch.qpos[:, HEIGHT]
        rewards, lost = _reward(height, self._observations), _is_lost(height)
        rewards[over], lost[over] = 0.0, False
        if over.size:
            self._begin(over)
        late = self._steps >= self._limit
        self._over = lost | late
        return self._observations.copy(), rewards, lost, late, {}

    def render(self) -> tuple[Array, ...] | None:  # type: ignore[override] - the base has Any
        """Return a picture of each environment, shape (480, 480, 3), if the mode is rgb_array."""
        if self.render_mode is None:
            return None
        return tuple(self._camera.picture(qpos) for qpos in self._batch.qpos)

    def close_extras(self, **kwargs: Any) -> None:
        """Release the renderer."""
        self._camera.close()

    def __getstate__(self) -> dict[str, Any]:
        """Return what copies and pickles contain: of the batch, the number of threads and state."""
        batch = self._batch.nthread, self._batch.state.copy()
        return self.__dict__ | {"_batch": batch, "_sensordata": None}

    def __setstate__(self, saved: dict[str, Any]) -> None:
        """Set the attributes of a copy."""
        self.__dict__.update(saved)
        threads, state = saved["_batch"]
        self._make_batch(threads)
        self._batch.state[:] = state

    def _make_batch(self, threads: int) -> None:
        self._batch = Batch(self._task.model, self.num_envs, threads)
        self._sensordata = self._batch.bind("sensordata")

    def _begin(self, which: np.ndarray) -> None:
        """Begin episodes of some environments."""
        start, target = np.array([_draw_start(self._randoms[i]) for i in which]).T
        self._batch.reset(which, stage=int(mujoco.mjtStage.mjSTAGE_NONE))
        self._batch.qpos[which, HEIGHT] = start
        current = self._task.holding_current(start)[:, None]
        self._batch.act[which], self._batch.ctrl[which] = current, current
        self._batch.forward(which)
        noise, measured = self._noise(which), self._sensordata[which]
        self._observations[which] = self._task.first(measured, noise, target)
        self._steps[which], self._over[which] = 0, False

    def _noise(self, which: np.ndarray) -> Array:
        return np.array([self._randoms[i].standard_normal(2) for i in which]).reshape(-1, 2)


def _render_mode(mode: str | None) -> str | None:
    if not isinstance(mode, str | None) or mode not in (None, "rgb_array"):
        raise ArgumentError("render_mode", mode, "must be 'rgb_array' or None")
    return mode


def _seed(seed: Any) -> int:
    return check_integer("seed", seed, at_least=0, at_most=math.inf)


def _reset_mask(options: dict[str, Any] | None, count: int) -> Flags:
    """Return which environments a reset is for."""
    mask = (options or {}).get("reset_mask")
    if mask is None:
        return np.ones(count, bool)
    sentence = f"must be an array of {count} bools, one of which at least is True"
    bools = isinstance(mask, np.ndarray) and mask.dtype == bool and mask.shape == (count,)
    if not (bools and mask.any()):
        raise ArgumentError('options["reset_mask"]', mask, sentence)
    return mask


def _seeds(seed: Any, count: int) -> Sequence[int | None]:
    """Return the seeds of some environments, of which one stands for itself and the next ones."""
    if seed is None:
        return [None] * count
    try:
        first = operator.index(seed)
    except TypeError:
        pass
    else:
        return range(_seed(seed), first + count)
    sentence = f"must be one integer, or {count} of them"
    seeds = [*elements("seed", seed, sentence)]
    if len(seeds) != count:
        raise ArgumentError("seed", seed, sentence)
    return [None if one is None else _seed(one) for one in seeds]


class _Camera:
    """Pictures of the ball."""

    def __init__(self, model: mujoco.MjModel):
        self._data = mujoco.MjData(model)
        self._model = model
        self._renderer: mujoco.Renderer | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        """Make copies begin without a renderer."""
        return _Camera, (self._model,)

    def picture(self, qpos: Array) -> Array:
        """Return a picture, shape (480, 480, 3)."""
        if self._renderer is None:
            self._renderer = mujoco.Renderer(self._model, 480, 480)
        self._data.qpos[:] = qpos
        mujoco.mj_forward(self._model, self._data)
        self._renderer.update_scene(self._data, "front")
        return self._renderer.render()

    def close(self) -> None:
        """Release the renderer."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None


def _draw_start(random: np.random.Generator) -> tuple[float, float]:
    """Draw a height and a set point."""
    return random.uniform(-START, START), random.uniform(-TARGETS, TARGETS)


def _is_lost(height: Any) -> Any:
    return ~(abs(height) <= LOST)


def _reward(height: Any, observation: Array) -> Any:
    error = abs(height - 1e-3 * observation[..., TARGET])
    return np.maximum(0.0, 1.0 - error / TOLERANCE)


class _Task:
    """The model, and what is computed in the same way for one environment and for many."""

    def __init__(self) -> None:
        self.model = mujoco.MjModel.from_xml_path(str(data_folder("models") / "levitation.xml"))
        model = self.model
        self._noise = model.numeric("noise").data
        self._most = np.array([model.sensor("field").cutoff[0], model.actuator_ctrlrange[0, 1]])
        self._coil = model.site("coil").pos[2]
        moments = model.site("coil").user[0] * model.site("ball").user[0]
        weight = -model.opt.gravity[2] * model.body("ball").mass[0]
        self._current = weight / (6 * PERMEABILITY_OVER_4PI * moments)

    def spaces(self) -> tuple[Box, Box]:
        """Return the spaces of observations and actions."""
        field, current = 1e3 * self._most[0], self._most[1]
        high = np.array([field, field, current, current, 1e3 * TARGETS])
        return Box(-high, high, dtype=np.float64), Box(-1.0, 1.0, (1,))

    def holding_current(self, height: Any) -> Any:
        """Return the current in A whose attraction, 3 mu0 m m'/(2 pi d^4), is the weight."""
        square = (self._coil - height) * (self._coil - height)
        return self._current * square * square

    def control(self, action: Array) -> Array:
        """Return the controls in A that actions from -1 to 1 stand for."""
        return self._most[1] * np.asarray(action, np.float64)

    def first(self, sensordata: Array, noise: Array, target: Any) -> Array:
        """Return observations at the start, shape (..., 5), from the sensors, shape (..., 4)."""
        observation = np.empty((*noise.shape[:-1], 5))
        observation[..., TARGET] = 1e3 * target
        observation[..., [FIELD, CURRENT]] = self._measure(sensordata, noise)
        return self._shifted(observation)

    def next(self, observation: Array, sensordata: Array, noise: Array) -> Array:
        """Return observations one step after others."""
        observation = self._shifted(observation)
        observation[..., [FIELD, CURRENT]] = self._measure(sensordata, noise)
        return observation

    def _shifted(self, observation: Array) -> Array:
        observation = observation.copy()
        observation[..., [FIELD_BEFORE, CURRENT_BEFORE]] = observation[..., [FIELD, CURRENT]]
        return observation

    def _measure(self, sensordata: Array, noise: Array) -> Array:
        """Return what the sensors say with their noise, in mT and A."""
        exact = sensordata[..., [2, 3]]
        return np.clip(exact + self._noise * noise, -self._most, self._most) * (1e3, 1.0)
