"""Cost of a step of mm.Langevin on trees, and of one accuracy, compared with MuJoCo's Euler."""

import copy
import os
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import mujoco
import mujoco.rollout
import numpy as np

import magmotor as mm
from benchmarks.harness.tables import Row, show
from benchmarks.harness.timing import in_turns, seconds_of
from magmotor.common.arrays import Array
from magmotor.mjcf.hooks import without_stopwatch

STEPS, TURNS = 2000, 40
MOST, LEAST = 4.0, 10.0
"""Targets: cost of a step in Euler's, and Euler's cost of the same accuracy in BAOAB's."""

NOTE = """\
One thread, the same model for both, from a state at kT: 1 mJ at 1 ms; where hot, 0.5 J, with 20 ms
  for BAOAB, whose free motion is repeated in pieces where it is fast. Contacts are disabled, dry
  friction and servos as well. The humanoid is that of dm_control, without gravity; its limits are
  disabled in the row above the last."""

LINKS, LENGTH, MASS, DAMPING = 6, 0.1, 1.0, 0.2
COLD, THERMAL, SEED = 1e-3, 0.5, 1
"""Temperatures in J, of which the second is half the weight of a link times its length; seed."""

ERROR = 0.01
"""Relative error of the mean potential energy above its minimum that is allowed."""

LONG, SHORT = 0.02, (1e-3, 5e-4)
"""Timesteps in s of BAOAB, and of Euler, whose error at shorter ones is extrapolated."""

SETTLE, DURATION, REPLICAS, CHAINS = 50.0, 1000.0, 16, 64
"""Times in s before the records and of them, replicas of the runs, and chains of the reference."""

HUMANOID = Path(getattr(find_spec("dm_control"), "origin", "")).parent / "suite" / "humanoid.xml"

LINK = """
<body pos="0 0 {pos}">
  {joints}
  <geom type="capsule" fromto="0 0 0 0 0 -{length}" size="0.01" mass="{mass}"/>
  {child}
</body>
"""
HINGE = '<joint type="hinge" axis="{}" damping="{}"/>'
TREE = """
<mujoco>
  <option><flag contact="disable"/></option>
  <worldbody>{}</worldbody>
</mujoco>
"""
ARM = ("0 0 1", "0 1 0", "0 0 1", "0 -1 0", "0 0 1", "0 1 0", "0 0 1")
"""Axes of an arm of seven joints."""

PLANAR = ["0 1 0"] * LINKS
"""Axes of the planar chain."""

STATE = mujoco.mjtState.mjSTATE_INTEGRATION


def main() -> None:
    all_cases = dict(models())
    cases = {
        (name, k): run for name in all_cases for k, run in enumerate(steppers(all_cases[name]))
    }
    with without_stopwatch():
        times = in_turns(cases, TURNS)
    rows = [
        Row(name, times[name, 0], times[name, 1], at_most=None if "hot" in name else MOST)
        for name in all_cases
    ]
    show("A step of BAOAB on trees", NOTE, ("BAOAB", "Euler", "ratio"), rows)
    _show_equal_accuracy()


class Case(NamedTuple):
    """A model, its temperature in J, disabled flags, and the timesteps of BAOAB and Euler in s."""

    model: mujoco.MjModel
    kT: float = COLD
    disable: tuple[str, ...] = ()
    long: float = SHORT[0]
    short: float = SHORT[0]


def models() -> Iterator[tuple[str, Case]]:
    """Yield names and cases."""
    in_space = [["1 0 0", "0 1 0"]] * LINKS
    yield "six links, planar", Case(_chain(PLANAR))
    yield "six links in 3-D, 12 hinges", Case(_chain(in_space))
    yield "arm of 7 joints", Case(_chain(ARM))
    for flags in (("contact", "gravity", "limit"), ("contact", "gravity")):
        name = "humanoid, 27 velocities" + ", limits" * ("limit" not in flags)
        yield name, Case(mujoco.MjModel.from_xml_path(str(HUMANOID)), disable=flags)
    yield "six links, planar, hot", Case(_chain(PLANAR), THERMAL, long=LONG)
    yield "six links in 3-D, hot", Case(_chain(in_space), THERMAL, long=LONG)


def _chain(axes) -> mujoco.MjModel:
    """Return links that hang on each other, by one hinge or several."""
    tree = ""
    for k in reversed(range(len(axes))):
        hinges = [axes[k]] if isinstance(axes[k], str) else axes[k]
        joints = "".join(HINGE.format(axis, DAMPING) for axis in hinges)
        pos = -LENGTH if k else 0
        tree = LINK.format(pos=pos, joints=joints, length=LENGTH, mass=MASS, child=tree)
    return mujoco.MjModel.from_xml_string(TREE.format(tree))


def steppers(case: Case) -> list[Callable[[], float]]:
    """Return functions that measure a step by BAOAB and by Euler, from a state at kT."""
    model = case.model
    model.opt.timestep = case.long
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*nothing damps")  # a humanoid as a whole
        langevin = mm.Langevin(model, kT=case.kT, disable=case.disable, seed=SEED)
    data = mujoco.MjData(model)
    langevin.step(data, nstep=round(SETTLE / case.long))
    state = np.empty(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, state, STATE)
    other = copy.copy(model)
    other.opt.timestep = case.short
    for flag in case.disable:
        other.opt.disableflags |= int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag.upper()}"))
    steps = ((model, langevin.step), (other, partial(mujoco.mj_step, other)))
    return [partial(_seconds_a_step, one, mujoco.MjData(one), state, step) for one, step in steps]


def _seconds_a_step(model: mujoco.MjModel, data: mujoco.MjData, state: Array, step) -> float:
    mujoco.mj_setState(model, data, state, STATE)
    return seconds_of(partial(step, data, nstep=STEPS)) / STEPS


def _show_equal_accuracy() -> None:
    """Show the cost of 1 s of the chain at an error of 1 %."""
    model = _chain(PLANAR)
    reference = mm.metropolis(model, THERMAL, samples=8000, replicas=CHAINS, seed=SEED)
    exact, uncertain = _mean_energy(reference["qpos"].to_numpy())
    model.opt.timestep = LONG
    langevin = mm.Langevin(model, kT=THERMAL, seed=SEED)
    steps, before = int(4 * DURATION / LONG), int(SETTLE / LONG)
    run = langevin.sample(
        steps * langevin.timestep,
        replicas=REPLICAS,
        record_interval=5,
        burn_in=before * langevin.timestep,
    )
    own, spread = _mean_energy(run["qpos"].to_numpy())
    if abs(own / exact - 1) > ERROR:
        raise ArithmeticError(f"BAOAB's mean is {own:.3f}({spread:.3f}) kT, not {exact:.3f} kT")
    errors, slopes = [], []
    for timestep in SHORT:
        mean, scatter = _mean_energy(_by_euler(model, timestep))
        errors.append((mean / exact - 1, np.hypot(scatter, uncertain) / exact, timestep))
        slopes.append(errors[-1][0] / timestep)
    longest = ERROR / min(slopes)
    baoab, euler = steppers(Case(_chain(PLANAR), THERMAL, long=LONG, short=longest))
    with without_stopwatch():
        times = in_turns({"BAOAB": baoab, "Euler": euler}, TURNS)
    per_second = [[t / longest for t in times["Euler"]], [t / LONG for t in times["BAOAB"]]]
    found = ", ".join(f"{e:.1%} ± {s:.1%} at {1e3 * h:g} ms" for e, s, h in errors)
    cost = " and ".join(f"{1e6 * min(times[name]):.2g} µs by {name}" for name in times)
    note = f"""\
Planar chain at kT = {THERMAL:g} J, 1 s of motion. From a state at kT, a step takes
  {cost}. Mean potential energy above its minimum:
  exactly {exact:.3f} ± {uncertain:.3f} kT,
  by BAOAB at {1e3 * LONG:g} ms {own:.3f} ± {spread:.3f} kT.
  Errors of Euler with noise that matches the damping, whose cost is left out:
  {found}; so {ERROR:.0%} at {1e3 * longest:.2g} ms."""
    rows = [Row("six links", *per_second, at_least=LEAST)]
    show("The same accuracy of the configuration", note, ("Euler", "BAOAB", "ratio"), rows)


def _by_euler(model: mujoco.MjModel, timestep: float) -> np.ndarray:
    """Return positions by Euler, where each joint has the noise of its damping, from `rollout`."""
    model.opt.timestep = timestep
    rng = np.random.default_rng(SEED)
    spec = int(mujoco.mjtState.mjSTATE_QFRC_APPLIED)
    full = int(mujoco.mjtState.mjSTATE_FULLPHYSICS)
    state = np.zeros((REPLICAS, mujoco.mj_stateSize(model, full)))
    data = [mujoco.MjData(model) for _ in range(os.cpu_count() or 1)]
    pieces, piece = [], int(2.0 / timestep)
    for _ in range(int((SETTLE + DURATION) / 2.0)):
        size = np.sqrt(2 * THERMAL * DAMPING / timestep)
        noise = size * rng.standard_normal((REPLICAS, piece, model.nv))
        states, _ = mujoco.rollout.rollout(model, data, state, noise, control_spec=spec)
        state = states[:, -1].copy()
        pieces.append(states[:, :: int(0.05 / timestep), 1 : 1 + model.nq])
    return np.concatenate(pieces[int(SETTLE / 2.0) :], axis=1)


def _mean_energy(qpos: np.ndarray) -> tuple[float, float]:
    """Return the mean potential energy above its minimum in kT, and its standard error."""
    weights = MASS * 9.81 * LENGTH * (np.arange(LINKS, 0, -1) - 0.5)
    energies = (1 - np.cos(np.cumsum(qpos, axis=-1))) @ weights / THERMAL
    means = energies.mean(axis=1)
    return float(means.mean()), float(means.std(ddof=1) / np.sqrt(len(means)))
