"""Add magnets to the models of public packages, and check the forces, the motion and the rest.

    python -m trials.corpus [FOLDER] [--seed SEED] [--workers WORKERS]

FOLDER is where pip installed the packages; without it, they are downloaded. Any
other folder with MJCF will do. The program prints a table of what was found, and a line for each
model on which a check fails; then its exit code is 1. Each model is checked in a process of its
own, a fork of this one.
"""

import argparse
import os
import sys
import time
import zlib
from collections import Counter
from functools import partial
from importlib.metadata import version
from pathlib import Path

for name in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
    os.environ[f"{name}_NUM_THREADS"] = "1"  # a process with threads is not forked

import mujoco  # noqa: E402
import numpy as np  # noqa: E402

import magmotor as mm  # noqa: E402
from trials.corpus.checks import BOUNDS, ROUNDING, STEPS, Findings, examine  # noqa: E402
from trials.corpus.download import add_folder, folder_of  # noqa: E402
from trials.corpus.models import PLUGIN, packages  # noqa: E402
from trials.corpus.processes import print_table  # noqa: E402

COLUMNS = (
    "files", "compile", "move", "distinct", "refused", "changed", "callback", "plugin", "third law",
    "path", "same motion", "states",
)  # fmt: skip


def main() -> int:
    """Run the program; returns its exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m trials.corpus", description=(__doc__ or "").splitlines()[0]
    )
    add_folder(parser)
    parser.add_argument("--seed", type=int, default=0, help="of the bodies, sites and moments")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    options = parser.parse_args()
    folder = folder_of(options)
    begin = time.perf_counter()
    with mm.magnetism():  # loads the compiled code before the forks
        mujoco.MjData(mujoco.MjModel.from_xml_string(PLUGIN))
    print(f"magmotor {mm.__version__}, MuJoCo {version('mujoco')}, seed {options.seed}\n")
    check = partial(examine, seed=options.seed)
    everything: list[Findings] = print_table(
        packages(folder), COLUMNS, row, check, failed, options.workers
    )
    distinct = [each for each in everything if each.is_checked]
    marked = sum(each.marked for each in distinct)
    print(f"\nmodels with user numbers of bodies, joints or sites, which got a mark: {marked}")
    third = sum(np.isfinite(each.third_law) for each in distinct)
    print(f"models of which two rigid bodies or more move, for the third law: {third}")
    same, close = (sum(each.motion <= bound for each in distinct) for bound in (0.0, ROUNDING))
    print(f"motions of {STEPS} steps, plugin against callback: {same} equal bit for bit,")
    print(
        f"    {close - same} to {ROUNDING:g}, {len(distinct) - close} that amplify rounding further"
    )
    reasons = Counter(each.skipped for each in everything if each.skipped)
    for reason, count in reasons.most_common():
        print(f"skipped: {count} files, {reason}")
    wrong = [each for each in distinct if each.wrong]
    for each in wrong:
        print(f"WRONG: {each.file.relative_to(folder)}: {each.wrong}")
    print(f"{time.perf_counter() - begin:.0f} s in all")
    return bool(wrong)


def failed(path: Path, reason: str) -> Findings:
    """Findings on a file whose process did not return any."""
    return Findings(path, refused=reason)


def row(found: list[Findings]) -> str:
    """Cells of a row of the table."""
    distinct = [each for each in found if each.is_checked]
    moving = sum(not each.skipped for each in found)
    still = sum(each.skipped == "nothing moves" for each in found)
    counts = (
        len(found), moving + still, moving, len(distinct),
        sum(bool(each.refused) for each in distinct), sum(not each.unchanged for each in distinct),
    )  # fmt: skip
    worst = [
        max((getattr(each, name) for each in distinct if getattr(each, name) >= 0), default=np.nan)
        for name in BOUNDS
    ]
    same = sum(each.motion <= ROUNDING for each in distinct)
    states = zlib.crc32(np.array([each.states for each in distinct], np.uint32).tobytes())
    cells = [*map(str, counts), *(f"{x:.1e}" for x in worst), str(same), f"{states:08x}"]
    return " | ".join(cells) + " |"


if __name__ == "__main__":
    sys.exit(main())
