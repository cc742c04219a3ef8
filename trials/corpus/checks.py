"""What must hold on any model with magnets, and on any model without them."""

import warnings
import zlib
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

import magmotor as mm
from trials.corpus.models import (
    Skipped,
    can_move,
    digest,
    generalized,
    has_user_numbers,
    magnetize,
    opened,
    start,
)
from trials.numpy_twin import apply_magnetism

STEPS = 20
ROUNDING = 1e-12
"""Largest deviation of a motion that counts as rounding."""

SMALLEST = 1e-3
"""Size of the force on a body, over the largest, below which its deviation is not relative."""

BOUNDS = {"callback": 2e-13, "plugin": 5e-13, "third_law": 4e-14, "path": 6e-14}
"""Largest deviations allowed. Measured: 9.1e-15, 2.5e-14, 1.6e-15, 2.8e-15."""

STATE = mujoco.mjtState.mjSTATE_INTEGRATION


@dataclass
class Findings:
    """What was found on a model. Deviations are relative to the largest number of their kind.

    That of the callback is relative to the force or torque on each body; see `worst_deviation`.
    """

    file: Path
    skipped: str = ""
    """Why nothing was checked."""
    digest: str = ""
    repeated: bool = False
    """Whether another file has the same compiled model."""
    refused: str = ""
    """The error that magnets caused."""
    marked: bool = False
    """Whether the model has `user` numbers of its own, and therefore got a mark."""
    unchanged: bool = False
    """Whether the model without magnets moves as it does without magmotor, bit for bit."""
    callback: float = np.nan
    """Deviation of the wrenches by the callback from the independent implementation."""
    plugin: float = np.nan
    """The same for the generalized forces by the plugin."""
    third_law: float = np.nan
    """Deviation of total force and torque from zero; nan if fewer than two rigid bodies move."""
    path: float = np.nan
    """Deviation of the sum of all forces but those of constraints, plugin from callback, at a step.

    Relative to the largest part of that sum.
    """
    motion: float = np.nan
    """The same for the positions after all steps, over their change; 0 is equality bit for bit."""
    amplified: float = np.nan
    """The same between callbacks, if the last bits of the velocities change before each step."""
    states: int = 0
    """Checksum of the states after all steps, by the callback and by the plugin."""

    @property
    def is_checked(self) -> bool:
        return not (self.skipped or self.repeated)

    @property
    def wrong(self) -> str:
        """What should not be."""
        if self.refused:
            return self.refused
        if not self.unchanged:
            return "it moves differently without magnets"
        if self.motion > ROUNDING and self.motion > 30 * self.amplified:
            return f"another motion by the plugin: {self.motion:.1e}, rounding {self.amplified:.1e}"
        found = {name: getattr(self, name) for name in BOUNDS}
        return ", ".join(f"{name} {x:.1e}" for name, x in found.items() if x > BOUNDS[name])


def examine(path: Path, seed: int = 0) -> Findings:
    """Check one file."""
    found = Findings(path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of MuJoCo's compiler; and nothing acts
        try:
            spec, model = opened(path)
        except Skipped as reason:
            found.skipped = str(reason)
            return found
        found.digest, found.marked = digest(model), has_user_numbers(model)
        try:
            found.unchanged = is_unchanged(model)
            without, with_plugin = magnetize(spec, model, seed)
            found.callback = callback_deviation(without)
            found.plugin = plugin_deviation(without, with_plugin)
            found.third_law = third_law_deviation(without)
            found.path = path_deviation(without, with_plugin)
            with mm.magnetism():
                by_callback = moved(without)
            by_plugin = moved(with_plugin)
            found.motion, found.amplified = motion_deviations(without, by_callback, by_plugin)
            both = state(without, by_callback), state(with_plugin, by_plugin)
            found.states = zlib.crc32(b"".join(each.tobytes() for each in both))
        except Exception as error:
            found.refused = f"{type(error).__name__}: {error}"
    return found


def is_unchanged(model: mujoco.MjModel) -> bool:
    outside = state(model, moved(model))
    with mm.magnetism():
        inside = state(model, moved(model))
    return outside.tobytes() == inside.tobytes()


def moved(model: mujoco.MjModel) -> mujoco.MjData:
    """State after some steps."""
    data = start(model)
    mujoco.mj_step(model, data, nstep=STEPS)
    return data


def jittered(model: mujoco.MjModel, seed: int) -> mujoco.MjData:
    """State after the same steps, if the last bits of the velocities change before each."""
    rng = np.random.default_rng(seed)
    data = start(model)
    for _ in range(STEPS):
        data.qvel += 1e-16 * (1 + np.abs(data.qvel)) * rng.standard_normal(model.nv)
        mujoco.mj_step(model, data)
    return data


def state(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """Every number that determines the rest of a run."""
    numbers = np.zeros(mujoco.mj_stateSize(model, int(STATE)))
    mujoco.mj_getState(model, data, numbers, int(STATE))
    return numbers


def callback_deviation(model: mujoco.MjModel) -> float:
    data, expected = start(model), start(model)
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    mujoco.mj_forward(model, expected)
    apply_magnetism(model, expected)
    found, expected = data.xfrc_applied, expected.xfrc_applied
    return max(worst_deviation(found[:, k : k + 3], expected[:, k : k + 3]) for k in (0, 3))


def worst_deviation(found: np.ndarray, expected: np.ndarray) -> float:
    """Deviation of the vector on any body (nbody, 3), relative to itself.

    A vector is a sum of parts that may cancel, which leaves the rounding of the parts; so it counts
    as at least `SMALLEST` of the largest.
    """
    sizes = np.max(np.abs(expected), axis=1)
    floor = SMALLEST * np.max(sizes)
    return float(np.max(np.max(np.abs(found - expected), axis=1) / np.maximum(sizes, floor)))


def deviation(found: np.ndarray, expected: np.ndarray) -> float:
    return float(np.max(np.abs(found - expected)) / np.max(np.abs(expected)))


def plugin_deviation(without: mujoco.MjModel, with_plugin: mujoco.MjModel) -> float:
    """Deviation at rest, without springs, weight and wind, whose forces would add rounding."""
    data = []
    for model in (without, with_plugin):
        flags, wind = model.opt.disableflags, model.opt.wind.copy()
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SPRING
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_GRAVITY
        model.opt.wind[:] = 0.0
        data.append(start(model))
        data[-1].qvel[:] = 0.0
        mujoco.mj_forward(model, data[-1])
        model.opt.disableflags, model.opt.wind[:] = flags, wind
    own = data[0].qfrc_passive
    apply_magnetism(without, data[0])
    expected = generalized(without, data[0], data[0].xfrc_applied)
    return deviation(data[1].qfrc_passive - own, expected)


def third_law_deviation(model: mujoco.MjModel) -> float:
    """Deviation from zero of total force and torque; the dipoles that cannot move are left out."""
    moments = model.site_user.copy()
    model.site_user[~can_move(model, model.site_bodyid)] = 0.0
    data = start(model)
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    model.site_user[:] = moments
    force, torque = np.split(data.xfrc_applied, 2, axis=1)
    if not force.any():
        return np.nan
    arms = np.cross(data.xipos, force)
    return max(
        float(np.max(np.abs(np.sum(parts, axis=(0, 1)))) / np.max(np.abs(parts)))
        for parts in (np.array([force]), np.array([torque, arms]))
    )


def path_deviation(without: mujoco.MjModel, with_plugin: mujoco.MjModel) -> float:
    """Deviation at the worst of several states, from each of which both models do a step."""
    worst = 0.0
    expected, found = start(without), start(with_plugin)
    with mm.magnetism():
        for _ in range(STEPS):
            mujoco.mj_setState(with_plugin, found, state(without, expected), int(STATE))
            found.xfrc_applied[:] = 0.0
            mujoco.mj_step(without, expected)
            mujoco.mj_step(with_plugin, found)
            parts = expected.qfrc_smooth, expected.qfrc_passive, expected.qfrc_bias
            difference = np.max(np.abs(found.qfrc_smooth - expected.qfrc_smooth))
            worst = max(worst, float(difference / np.max(np.abs(parts))))
    return worst


def motion_deviations(
    without: mujoco.MjModel, by_callback: mujoco.MjData, by_plugin: mujoco.MjData
) -> tuple[float, float]:
    """Deviations from the motion by the callback: by the plugin, and by rounding."""
    expected, found = by_callback.qpos, by_plugin.qpos
    change = np.max(np.abs(expected - start(without).qpos))
    with mm.magnetism():
        amplified = max(
            float(np.max(np.abs(jittered(without, seed).qpos - expected)) / change)
            for seed in range(5)
        )
    if found.tobytes() == expected.tobytes():
        return 0.0, amplified
    return float(np.max(np.abs(found - expected)) / change), amplified
