"""Give a temperature to the models of public packages: how many have one, and is it right?

    python -m trials.corpus.acceptance [FOLDER] [--seed SEED] [--workers WORKERS]

As `python -m trials.corpus` does for magnets, the program prints a table of how many models
`mm.Langevin` takes, and with which flags disabled, and what was found on those, and a line for each
model on which a check fails; then its exit code is 1.
"""

import argparse
import os
import re
import sys
import time
from collections import Counter
from functools import partial
from importlib.metadata import version
from pathlib import Path

for name in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
    os.environ[f"{name}_NUM_THREADS"] = "1"  # a process with threads is not forked

import mujoco  # noqa: E402
import numpy as np  # noqa: E402

import magmotor as mm  # noqa: E402
from trials.corpus.download import add_folder, folder_of  # noqa: E402
from trials.corpus.models import packages  # noqa: E402
from trials.corpus.processes import print_table  # noqa: E402
from trials.corpus.temperature import BOUNDS, Findings, examine  # noqa: E402

HINGE = """
<mujoco><worldbody><body><joint damping="1"/><geom size="0.1"/></body></worldbody></mujoco>
"""

COLUMNS = (
    "distinct", "as they are", "friction given", "flags", "refused", *BOUNDS, "too stiff",
    "unstable", "step",
)  # fmt: skip


def main() -> int:
    """Run the program; returns its exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m trials.corpus.acceptance", description=(__doc__ or "").splitlines()[0]
    )
    add_folder(parser)
    parser.add_argument("--seed", type=int, default=0, help="of the positions and velocities")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    options = parser.parse_args()
    folder = folder_of(options)
    begin = time.perf_counter()
    model = mujoco.MjModel.from_xml_string(HINGE)
    # This loads the compiled code before the forks.
    mm.Langevin(model, kT=1.0).step(mujoco.MjData(model))
    print(f"magmotor {mm.__version__}, MuJoCo {version('mujoco')}, seed {options.seed}\n")
    check = partial(examine, seed=options.seed)
    everything: list[Findings] = print_table(
        packages(folder), COLUMNS, row, check, failed, options.workers
    )
    distinct = [each for each in everything if each.is_checked]
    show("disabled", Counter(", ".join(each.flags) for each in distinct if each.flags))
    for flag in sorted({flag for each in distinct for flag in each.flags}):
        reasons = [each.reasons[flag] for each in distinct if flag in each.flags]
        show(f"reason for {flag}", Counter(map(kind, reasons)))
    show("refused", Counter(kind(each.refused) for each in distinct if each.refused))
    wrong = [each for each in distinct if each.wrong]
    for each in wrong:
        print(f"WRONG: {each.file.relative_to(folder)}: {each.wrong}")
    print(f"{time.perf_counter() - begin:.0f} s in all")
    return bool(wrong)


def failed(path: Path, reason: str) -> Findings:
    """Findings on a file whose process did not return any."""
    return Findings(path, failed=reason)


def row(found: list[Findings]) -> str:
    """Cells of a row of the table."""
    distinct = [each for each in found if each.is_checked]
    taken = [each for each in distinct if not each.refused]
    plain = [each for each in taken if not each.flags]
    counts = (
        len(distinct), sum(not each.undamped for each in plain),
        sum(each.undamped for each in plain), len(taken) - len(plain), len(distinct) - len(taken),
    )  # fmt: skip
    worst = [max([x for each in taken if (x := getattr(each, key)) >= 0], default=np.nan)
             for key in BOUNDS]  # fmt: skip
    fast = [sum(getattr(each, key) > 2 for each in taken) for key in ("stiffest", "fastest")]
    costs = [1e6 * each.cost for each in taken if each.cost > 0]
    cost = f"{np.median(costs):.0f} us" if costs else ""
    return (
        " | ".join([*map(str, counts), *(f"{x:.1e}" for x in worst), *map(str, fast), cost]) + " |"
    )


def kind(message: str) -> str:
    """Return a message without the names and values in it, and without its advice at the end."""
    message = re.sub(r" \((disable|splitting)=.*", "", message)
    message = re.sub(r"'[^']*'", "'..'", message)
    message = re.sub(r"(\w+ )('\.\.'|\d+)(?= and|:)", r"\1..", message)
    return re.sub(r" = .*?(?=: )", "", message, count=1)


def show(title: str, counts: Counter[str]) -> None:
    for what, count in counts.most_common():
        print(f"{title}: {count} models, {what}")


if __name__ == "__main__":
    sys.exit(main())
