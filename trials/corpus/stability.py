"""Compare limits of stability by theory with those found by runs, on models of public packages.

    python -m trials.corpus.stability [FOLDER] [--seed SEED] [--models N]

The program takes N distinct models in which no constraint acts at rest, and without muscles and
limited activations, so that a step is smooth there. It prints a line for each: the two limits for
each integrator. Pairs of limits of which neither is finite are counted apart. The exit code is 1 if
fewer than 95 % of the other pairs are within 10 %, or if there are none.
"""

import argparse
import math
import sys
import time
import warnings

import mujoco
import numpy as np

from magmotor.advice.paths import INTEGRATORS, OutOfTime, Runs, quiet
from magmotor.advice.stability import Limit, Rest, find_rest, stability_limit
from trials.corpus.advice import started
from trials.corpus.download import add_folder, folder_of
from trials.corpus.models import Skipped, digest, opened, packages

LARGEST, SETTLING, MEASURING = 40, 4.0, 30.0
"""Largest number of degrees of freedom, and times in s to find rest and limits."""

SPEED = 0.1
"""Standard deviation of the velocities in rad/s and m/s from which a model settles."""

NEAR = 0.1
"""Relative deviation with which limits agree."""


def smooth_rest(model: mujoco.MjModel, seed: int) -> Rest | None:
    """State of rest of a model where a step is smooth, if it has one."""
    muscles = model.actuator_dyntype == mujoco.mjtDyn.mjDYN_MUSCLE
    if model.nv > LARGEST or (muscles | (model.actuator_actlimited > 0)).any():
        return None
    try:
        with quiet():
            data = started(model, SPEED, np.random.default_rng(seed))
            rest = find_rest(Runs(model, data), time.perf_counter() + SETTLING)
    except (OutOfTime, ValueError):
        return None
    return None if rest is None or rest.constraints else rest


def limits(rest: Rest) -> dict[str, Limit]:
    """Limits by integrator, as many as there is time for."""
    rest.until = time.perf_counter() + MEASURING
    found = {}
    try:
        for integrator in INTEGRATORS:
            limit = stability_limit(rest, integrator)
            if limit is not None:
                found[integrator] = limit
    except OutOfTime:
        pass
    return found


def is_finite(limit: Limit) -> bool:
    """Whether theory or a run finds a limit."""
    return math.isfinite(limit.theory) or math.isfinite(limit.found)


def agree(limit: Limit) -> bool:
    """Whether both limits are finite and near each other, or both infinite."""
    if not is_finite(limit):
        return True
    return abs(limit.theory / limit.found - 1) <= NEAR


def main() -> int:
    """Run the program; returns its exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m trials.corpus.stability", description=(__doc__ or "").splitlines()[0]
    )
    add_folder(parser)
    parser.add_argument("--seed", type=int, default=0, help="of the order of the models")
    parser.add_argument("--models", type=int, default=50)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    folder = folder_of(options)
    files = [path for paths in packages(folder).values() for path in paths]
    seen, found = set(), []
    models = 0
    for k in np.random.default_rng(options.seed).permutation(len(files)):
        try:
            _, model = opened(files[k])
        except Skipped:
            continue
        if digest(model) in seen:
            continue
        seen.add(digest(model))
        rest = smooth_rest(model, options.seed)
        if rest is None:
            continue
        models += 1
        own = limits(rest)
        found += own.values()
        ratios = " ".join(
            f"{name} {limit.theory:.3g}/{limit.found:.3g}{'' if agree(limit) else ' (!)'}"
            for name, limit in own.items()
        )
        print(f"{models} {files[k].relative_to(folder)}: {ratios}", flush=True)
        if models == options.models:
            break
    finite = [limit for limit in found if is_finite(limit)]
    near = sum(map(agree, finite))
    print(f"{models} models, {len(found)} pairs of limits, of which {len(found) - len(finite)} are")
    print(f"infinite by theory and as found; of the other {len(finite)}, {near} are within 10 %")
    return not finite or near < 0.95 * len(finite)


if __name__ == "__main__":
    sys.exit(main())
