"""Ask for advice on the models of public packages: does the error that it promises hold?

    python -m trials.corpus.advice [FOLDER] [--seed SEED] [--models N] [--workers WORKERS]
        [--whole]

The program takes N of the distinct models, a quarter of them with magnets, and starts each from its
first keyframe with random velocities. What it asks of `mm.advise` is also random: error, duration
and quantity. Then plain steps of MuJoCo judge the promise: by the same integrator at a tenth of the
timestep, and by another integrator where that proves itself by halvings. A promise is about each
element over its own range, or, with --whole, about all of them together. The program prints a line
for each model, and tables of promises by what was asked. Its exit code is 1 if fewer than 95 % of
the promises hold by both judges, or if a process does not return.
"""

import argparse
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
from trials.corpus import models  # noqa: E402
from trials.corpus.download import add_folder, folder_of  # noqa: E402
from trials.corpus.judgment import Judgment, judge, movable, quantity_of  # noqa: E402
from trials.corpus.processes import examine_all  # noqa: E402

ERRORS, DURATIONS, SPEEDS = (0.1, 0.01, 1e-3), (0.3, 1.0, 3.0), (0.1, 0.5, 2.0)
"""What is asked for: relative errors and durations in s; standard deviations of the random
velocities in rad/s and m/s."""

QUANTITIES = "positions", "energy", "body", "site"
MAGNETIC = 0.25
"""Part of the models that get magnets."""

BUDGET = 20.0
"""In s."""

SHORTEST = 50
"""Least duration in timesteps of the model."""

WHOLE = 0.999
"""Part of the duration from which on a horizon counts as the whole of it."""


@dataclass(frozen=True)
class Asked:
    """What is asked about a model."""

    quantity: str
    error: float
    duration: float
    speed: float
    magnetic: bool

    @property
    def nominal(self) -> float:
        """The nearest of the durations that are drawn; that of a long timestep is longer."""
        return min(DURATIONS, key=lambda duration: abs(duration - self.duration))

    def __str__(self) -> str:
        magnets = ", magnets" if self.magnetic else ""
        return (
            f"{self.quantity} to {self.error:g} over {self.duration:g} s from {self.speed:g} m/s"
            f"{magnets}"
        )


@dataclass
class Findings:
    """What was found on one file."""

    file: Path
    reason: str = ""
    digest: str = ""
    dof: int = 0
    asked: Asked | None = None
    text: str = ""
    promised: float = np.nan
    horizon: float = np.nan
    """In s."""
    judgment: Judgment = field(default_factory=lambda: Judgment(np.nan))
    seconds: float = np.nan

    @property
    def holds(self) -> bool:
        return self.judgment.holds(self.promised)

    @property
    def whole(self) -> bool:
        """Whether the promise is about the whole duration."""
        return self.asked is not None and self.horizon >= WHOLE * self.asked.duration


def examine(path: Path, seed: int, *, whole: bool) -> Findings:
    """Ask for advice on the model of a file, and judge it; each element, or only the whole."""
    try:
        spec, model = models.opened(path)
    except models.Skipped as reason:
        return Findings(path, reason=str(reason))
    found = Findings(path, digest=models.digest(model), dof=model.nv)
    rng = np.random.default_rng([seed, int(found.digest[:8], 16)])
    asked = found.asked = drawn(model, rng)
    began = time.perf_counter()
    try:
        if asked.magnetic:
            _, model = models.magnetize(spec, model, seed)
        data = started(model, asked.speed, rng)
        advice = mm.advise(
            model, data, quantity=asked.quantity, duration=asked.duration, error=asked.error,
            budget=BUDGET, every_element=not whole,
        )  # fmt: skip
    except ValueError as error:
        found.reason = " ".join(str(error).split())
        return found
    found.seconds = time.perf_counter() - began
    found.text = str(advice).splitlines()[-1]
    found.reason, found.horizon = advice.reason, advice.horizon
    if not advice.method:
        return found
    found.promised = advice.promised
    for name, value in advice.settings.items():
        setattr(model.opt, name, value)
    found.judgment = judge(
        model, data, quantity_of(model, asked.quantity, whole=whole), advice.method,
        advice.timestep, advice.horizon, advice.promised,
    )  # fmt: skip
    return found


def drawn(model: mujoco.MjModel, rng: np.random.Generator) -> Asked:
    """Draw what is asked about a model."""
    moving = movable(model)
    sites = [model.site(k).name for k in np.flatnonzero(moving[model.site_bodyid])]
    elements = {
        "body": [model.body(k).name for k in np.flatnonzero(moving)],
        "site": [name for name in sites if name],
    }
    elements["body"] = [name for name in elements["body"] if name]
    kinds = [kind for kind in QUANTITIES if elements.get(kind, True)]
    quantity = str(rng.choice(kinds))
    if quantity in elements:
        quantity = f"{quantity} {rng.choice(elements[quantity])}"
    shortest = SHORTEST * model.opt.timestep
    return Asked(
        quantity,
        float(rng.choice(ERRORS)),
        max(shortest, float(rng.choice(DURATIONS))),
        float(rng.choice(SPEEDS)),
        bool(model.nbody > 2 and rng.random() < MAGNETIC),
    )


def started(model: mujoco.MjModel, speed: float, rng: np.random.Generator) -> mujoco.MjData:
    """State of the first keyframe, with random velocities."""
    data = models.start(model)
    data.qvel += speed * rng.standard_normal(model.nv)
    return data


def failed(path: Path, reason: str) -> Findings:
    """Findings on a file whose process did not return any."""
    return Findings(path, reason=f"FAILED: {reason}")


def line(each: Findings, folder: Path) -> str:
    """Return the findings on one model as a line."""
    name = f"{each.file.relative_to(folder)}: {each.dof} dof, {each.asked}, {each.seconds:.0f} s"
    if not np.isfinite(each.promised):
        return f"{name}; {each.text or each.reason}"
    found, horizon = each.judgment, "" if each.whole else f" up to {each.horizon:.3g} s only"
    other = f"{found.other:.2g} ± {found.doubt:.1g} against {found.by}"
    return (
        f"{name}; {each.text}; promised {each.promised:.2g}{horizon}, found {found.own:.2g},"
        f" {other if found.by else 'no other judge'}: {'held' if each.holds else 'BROKEN'}"
    )


def table(found: list[Findings]) -> list[str]:
    """Return a table of the promises by what was asked."""
    groups: dict[str, list[Findings]] = {"all": found}
    for each in found:
        asked = each.asked
        assert asked is not None, "every model that was found was asked about"
        kinds = (
            f"{asked.quantity.split()[0]}", f"error {asked.error:g}",
            f"speed {asked.speed:g}", "magnets" if asked.magnetic else "no magnets",
            f"duration {asked.nominal:g} s",
        )  # fmt: skip
        for kind in kinds:
            groups.setdefault(kind, []).append(each)
    rows = [
        "| asked | models | promises | over a part | hold | by another integrator, too |",
        "|---|---|---|---|---|---|",
    ]
    for kind in ("all", *sorted(set(groups) - {"all"})):
        promises = [each for each in groups[kind] if np.isfinite(each.promised)]
        held = sum(each.holds for each in promises)
        part = sum(not each.whole for each in promises)
        judged = [each for each in promises if each.judgment.by]
        also = f"{sum(each.holds for each in judged)} of {len(judged)}"
        rows.append(
            f"| {kind} | {len(groups[kind])} | {len(promises)} | {part} | {held} | {also} |"
        )
    return rows


def main() -> int:
    """Run the program; returns its exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m trials.corpus.advice", description=(__doc__ or "").splitlines()[0]
    )
    add_folder(parser)
    parser.add_argument("--seed", type=int, default=0, help="of the models and what is asked")
    parser.add_argument("--models", type=int, default=100)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--whole", action="store_true", help="errors of elements do not count")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    with mm.magnetism():  # loads the compiled code before the forks
        mujoco.MjData(mujoco.MjModel.from_xml_string(models.PLUGIN))
    folder = folder_of(options)
    files = [path for paths in models.packages(folder).values() for path in paths]
    chosen = [files[k] for k in np.random.default_rng(options.seed).permutation(len(files))]
    found: dict[str, Findings] = {}
    failures = 0
    check = partial(examine, seed=options.seed, whole=options.whole)
    for each in examine_all(chosen, check, failed, options.workers):
        if each.reason.startswith("FAILED"):
            failures += 1
            print(each.file.relative_to(folder), each.reason, flush=True)
        elif each.digest and each.digest not in found:
            found[each.digest] = each
            print(f"{len(found)} {line(each, folder)}", flush=True)
        if len(found) == options.models:
            break
    print("", *table([*found.values()]), "", sep="\n")
    promises = [each for each in found.values() if np.isfinite(each.promised)]
    held = sum(each.holds for each in promises)
    print(f"{len(found)} models, {len(promises)} promises, of which {held} hold")
    return failures > 0 or held < 0.95 * len(promises)


if __name__ == "__main__":
    sys.exit(main())
