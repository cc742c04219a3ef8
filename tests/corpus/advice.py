"""Ask for advice on the models of public packages: does the error that it promises hold?

    PYTHONPATH=tests python -m corpus.advice FOLDER [--seed SEED] [--models N] [--workers WORKERS]

The program takes N of the distinct models, and prints a line for each: what `mm.advise` says of
its first second from the first keyframe, with random velocities, and the error found by plain steps
of MuJoCo against a tenth of the timestep; and limits of stability by theory over those found. Its
exit code is 1 if fewer than 95 % of the promises hold.
"""

import argparse
import contextlib
import io
import os
import sys
import time
import warnings
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

for name in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
    os.environ[f"{name}_NUM_THREADS"] = "1"  # a process with threads is not forked

import mujoco  # noqa: E402
import numpy as np  # noqa: E402

import magmotor as mm  # noqa: E402
from corpus.models import Skipped, opened, packages  # noqa: E402
from corpus.processes import examine_all  # noqa: E402

ERROR, DURATION, BUDGET = 0.01, 1.0, 20.0
"""What is asked for; error relative, times in s."""

SPEED = 0.1
"""Standard deviation of the random velocities, in rad/s and m/s."""


@dataclass
class Findings:
    """What was found on one file."""

    file: Path
    reason: str = ""
    text: str = ""
    dof: int = 0
    promised: float = np.nan
    found: float = np.nan
    """Error against a tenth of the timestep."""
    other: float = np.nan
    """The same against RK4."""
    own_error: float = np.nan
    gain: float = np.nan
    seconds: float = np.nan
    limits: list[float] = field(default_factory=list)
    """Stability limits by theory over those found, where no constraint acts at rest."""


def examine(path: Path, seed: int) -> Findings:
    """Ask for advice on the model of a file, and judge it."""
    try:
        _, model = opened(path)
    except Skipped as reason:
        return Findings(path, reason=str(reason))
    data = started(model, seed)
    began = time.perf_counter()
    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said):
            advice = mm.advise(model, data, error=ERROR, duration=DURATION, budget=BUDGET)
    except ValueError as error:
        return Findings(path, reason=str(error), dof=model.nv)
    seconds = time.perf_counter() - began
    lines = said.getvalue().strip().splitlines()
    findings = Findings(path, text=lines[-1], dof=model.nv, seconds=seconds)
    if not advice.constraints:
        findings.limits = [
            limit.theory / limit.found
            for limit in advice.limits.values()
            if np.isfinite([limit.theory, limit.found]).all()
        ]
    if advice.own is not None:
        findings.own_error = advice.own.error
    if advice.integrator is None:
        findings.reason = advice.reason
        return findings
    findings.promised = advice.promised
    chosen = next(
        p for p in advice.points
        if (p.integrator, p.timestep) == (advice.integrator, advice.timestep)
    )  # fmt: skip
    if advice.own is not None:
        findings.gain = advice.own.seconds / chosen.seconds
    for name, value in advice.settings.items():
        setattr(model.opt, name, value)
    steps = int(advice.horizon / advice.timestep + 1e-9)
    step = advice.timestep
    path_of = partial(matter, model, data)
    own = path_of(advice.integrator, step, 1, steps)
    findings.found = distance(own, path_of(advice.integrator, step / 10, 10, steps))
    findings.other = distance(own, path_of("RK4", step / 10, 10, steps))
    return findings


def started(model: mujoco.MjModel, seed: int) -> mujoco.MjData:
    """State of the first keyframe, with random velocities."""
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    data.qvel += SPEED * np.random.default_rng(seed).standard_normal(model.nv)
    return data


def matter(
    model: mujoco.MjModel, data: mujoco.MjData, integrator: str, step: float, every: int, count: int
) -> np.ndarray:
    """Four points of equal mass of each body, at all times, by plain steps; NaN when not finite.

    They have the body's mass and inertia: the vertices of a tetrahedron in its principal frame.
    """
    model.opt.timestep = step
    model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    run = mujoco.MjData(model)
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_INTEGRATION)
    state = np.empty(size)
    mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
    mujoco.mj_setState(model, run, state, mujoco.mjtState.mjSTATE_INTEGRATION)
    vertices = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    mass = model.body_mass[:, None]
    half = model.body_inertia.sum(axis=1, keepdims=True) / 2 - model.body_inertia
    radii = np.sqrt(np.maximum(half, 0) / np.maximum(mass, 1e-300))
    moving = np.zeros(model.nbody, bool)
    for body in range(1, model.nbody):
        moving[body] = moving[model.body_parentid[body]] or model.body_dofnum[body] > 0
    weight = np.sqrt(mass / mass[moving].sum() / 4)
    rows = []
    for k in range(count + 1):
        if k:
            mujoco.mj_step(model, run, nstep=every)
        mujoco.mj_kinematics(model, run)
        frames = run.ximat.reshape(-1, 3, 3)
        corners = np.einsum("bij,vj->bvi", frames * radii[:, None, :], vertices)
        places = (run.xipos[:, None, :] + corners) * weight[:, None]
        rows.append(places[moving].ravel())
    return np.array(rows)


def distance(own: np.ndarray, truth: np.ndarray) -> float:
    """Largest distance of two paths over the diagonal of the box around the second one."""
    if not np.isfinite(truth).all():
        return np.nan
    return float(np.linalg.norm(own - truth, axis=1).max() / np.linalg.norm(np.ptp(truth, axis=0)))


def failed(path: Path, reason: str) -> Findings:
    """Findings on a file whose process did not return any."""
    return Findings(path, reason=f"FAILED: {reason}")


def line(each: Findings, folder: Path) -> str:
    """Return the findings on one model as a line."""
    name = f"{each.file.relative_to(folder)}: {each.dof} dof, {each.seconds:.0f} s"
    if not np.isfinite(each.promised):
        return f"{name}; {each.text or each.reason}"
    held = "held" if each.found <= each.promised else "BROKEN"
    return (
        f"{name}; {each.text}; promised {each.promised:.2g}, found {each.found:.2g},"
        f" against RK4 {each.other:.2g}: {held}; limits by theory over those found:"
        f" {' '.join(f'{ratio:.2f}' for ratio in each.limits) or 'none'}"
    )


def main() -> int:
    """Run the program; returns its exit code."""
    parser = argparse.ArgumentParser(
        prog="corpus.advice", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=0, help="of the models and their velocities")
    parser.add_argument("--models", type=int, default=100)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    folder = options.folder.absolute()
    files = [path for paths in packages(folder).values() for path in paths]
    order = np.random.default_rng(options.seed).permutation(len(files))
    chosen = [files[k] for k in order]
    check = partial(examine, seed=options.seed)
    found: list[Findings] = []
    seen = set()
    for each in examine_all(chosen, check, failed, options.workers):
        key = (each.dof, round(each.own_error, 12), each.reason)
        if each.dof and key not in seen:
            seen.add(key)
            found.append(each)
            print(f"{len(found)} {line(each, folder)}", flush=True)
        elif each.reason.startswith("FAILED"):
            print(each.file.relative_to(folder), each.reason, flush=True)
        if len(found) == options.models:
            break
    promised = [each for each in found if np.isfinite(each.promised)]
    held = [each for each in promised if each.found <= each.promised]
    print(f"{len(found)} models, {len(promised)} promises, of which {len(held)} hold")
    limits = [ratio for each in found for ratio in each.limits]
    near = [ratio for ratio in limits if abs(ratio - 1) <= 0.1]
    print(
        f"{len(limits)} limits without constraints, of which {len(near)} are within 10 % of theory"
    )
    return len(held) < 0.95 * len(promised)


if __name__ == "__main__":
    sys.exit(main())
