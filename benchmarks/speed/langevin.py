"""Cost of a step of mm.Langevin on trees, and of one accuracy, compared with MuJoCo's Euler."""

from collections.abc import Iterator
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import mujoco
import mujoco.rollout
import numpy as np

import magmotor as mm
from benchmarks.harness.tables import Row, show
from benchmarks.harness.timing import in_turns, seconds_of
from magmotor.mjcf.hooks import without_stopwatch

STEPS, TURNS = 1000, 40
MOST, LEAST = 4.0, 10.0
"""Targets: cost of a step in Euler's, and Euler's cost of the same accuracy in BAOAB's."""

NOTE = """\
One thread, the same model for both. Contacts are disabled, dry friction and servos as well. The
  humanoid is that of dm_control; its limits are disabled in the row above the last."""

LINKS, LENGTH, MASS, DAMPING = 6, 0.1, 1.0, 0.2
THERMAL, SEED = 0.5, 1
"""Temperature in J, in which the weight of a link times its length is twice; seed of the noise."""

ERROR = 0.01
"""Relative error of the mean potential energy above its minimum that is allowed."""

LONG, SHORT = 0.01, (1e-3, 5e-4)
"""Timesteps in s of BAOAB, and of Euler, whose error at shorter ones is extrapolated."""

SETTLE, REPLICAS, CHAINS = 50.0, 16, 64
"""Time in s before the records begin, replicas of the runs, and chains of the reference."""

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


def main() -> None:
    models = dict(_models())
    cases = {(name, k): run for name in models for k, run in enumerate(_steppers(*models[name]))}
    with without_stopwatch():
        times = in_turns(cases, TURNS)
    rows = [Row(name, times[name, 0], times[name, 1], at_most=MOST) for name in models]
    show("A step of BAOAB on trees", NOTE, ("BAOAB", "Euler", "ratio"), rows)
    _show_equal_accuracy(times["six links, planar", 0], times["six links, planar", 1])


def _models() -> Iterator[tuple[str, tuple[mujoco.MjModel, tuple[str, ...]]]]:
    """Yield names and models of trees, with the flags that are disabled."""
    yield "six links, planar", (_chain(["0 1 0"] * LINKS), ())
    yield "six links in 3-D, 12 hinges", (_chain([["1 0 0", "0 1 0"]] * LINKS), ())
    yield "arm of 7 joints", (_chain(ARM), ())
    for disable in (("contact", "limit"), ("contact",)):
        name = "humanoid, 27 velocities" + ", limits" * (len(disable) == 1)
        yield name, (mujoco.MjModel.from_xml_path(str(HUMANOID)), disable)


def _chain(axes) -> mujoco.MjModel:
    """Return links that hang on each other, by one hinge or several."""
    tree = ""
    for k in reversed(range(len(axes))):
        hinges = [axes[k]] if isinstance(axes[k], str) else axes[k]
        joints = "".join(HINGE.format(axis, DAMPING) for axis in hinges)
        pos = -LENGTH if k else 0
        tree = LINK.format(pos=pos, joints=joints, length=LENGTH, mass=MASS, child=tree)
    return mujoco.MjModel.from_xml_string(TREE.format(tree))


def _steppers(model: mujoco.MjModel, disable: tuple[str, ...]):
    """Return functions that measure a step by BAOAB and by Euler."""
    model.opt.timestep = 0.001
    langevin = mm.Langevin(model, kT=1e-3, disable=disable)
    for flag in disable:
        model.opt.disableflags |= int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag.upper()}"))
    steps = (langevin.step, partial(mujoco.mj_step, model))
    return [partial(_seconds_a_step, model, mujoco.MjData(model), step) for step in steps]


def _seconds_a_step(model: mujoco.MjModel, data: mujoco.MjData, step) -> float:
    mujoco.mj_resetData(model, data)
    return seconds_of(partial(step, data, nstep=STEPS)) / STEPS


def _show_equal_accuracy(baoab: list[float], euler: list[float]) -> None:
    """Show the cost of 1 s of the chain at an error of 1 %, from the seconds a step of each."""
    model = _chain(["0 1 0"] * LINKS)
    reference = mm.observables.metropolis(model, THERMAL, samples=4000, replicas=CHAINS, seed=SEED)
    exact, _ = _mean_energy(reference["qpos"].to_numpy())
    model.opt.timestep = LONG
    langevin = mm.Langevin(model, kT=THERMAL, seed=SEED)
    run = langevin.sample(int(1000 / LONG), replicas=REPLICAS, every=5, settle=int(SETTLE / LONG))
    own, spread = _mean_energy(run["qpos"].to_numpy())
    errors, slopes = [], []
    for timestep in SHORT:
        mean, _ = _mean_energy(_by_euler(model, timestep))
        errors.append(mean / exact - 1)
        slopes.append(errors[-1] / timestep)
    longest = ERROR / min(slopes)
    rows = [
        Row("six links", [t / longest for t in euler], [t / LONG for t in baoab], at_least=LEAST)
    ]
    found = ", ".join(f"{e:.1%} at {1e3 * h:g} ms" for e, h in zip(errors, SHORT, strict=True))
    note = f"""\
Planar chain at kT = {THERMAL:g} J, 1 s of motion. Mean potential energy above its minimum: exactly
  {exact:.3f} kT, by BAOAB at {1e3 * LONG:g} ms {own:.3f}({spread:.3f}) kT.
  Errors of Euler with noise that matches the damping, whose cost is left out: {found};
  so {ERROR:.0%} at {1e3 * longest:.2g} ms."""
    show("The same accuracy of the configuration", note, ("Euler", "BAOAB", "ratio"), rows)


def _by_euler(model: mujoco.MjModel, timestep: float) -> np.ndarray:
    """Return positions by Euler, where each joint has the noise of its damping, from `rollout`."""
    model.opt.timestep = timestep
    rng = np.random.default_rng(SEED)
    spec = int(mujoco.mjtState.mjSTATE_QFRC_APPLIED)
    full = int(mujoco.mjtState.mjSTATE_FULLPHYSICS)
    state = np.zeros((REPLICAS, mujoco.mj_stateSize(model, full)))
    data = [mujoco.MjData(model)]
    pieces, piece = [], int(2.0 / timestep)
    for _ in range(int((SETTLE + 250.0) / 2.0)):
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
