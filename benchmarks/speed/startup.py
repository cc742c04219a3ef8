"""Time of a new process to import magmotor, and to finish its first run."""

import json
import subprocess
import sys
from collections import Counter

from benchmarks.harness.tables import Row, show

PROCESSES = 7
FIRST_RUN = """
import json, time
times = [time.perf_counter()]
import magmotor as mm
times.append(time.perf_counter())
scene = mm.Top()
mm.build(scene)
times.append(time.perf_counter())
with mm.magnetism():
    times.append(time.perf_counter())
mm.simulate(scene, method="mujoco/euler", timestep=0.025, duration=1.0)
times.append(time.perf_counter())
print(json.dumps(times))
"""


def main() -> None:
    _python("-c", FIRST_RUN)  # fills the caches of compiled code
    runs = [json.loads(_python("-c", FIRST_RUN).stdout) for _ in range(PROCESSES)]
    rows = [
        _row("import magmotor", runs, 0, 1, at_most=0.7),
        _row("first simulate, import included", runs, 0, 4, at_most=2.0),
        _row("  of which: first build", runs, 1, 2),
        _row("  callback, from the disk's cache", runs, 2, 3),
        _row("  simulate", runs, 3, 4),
    ]
    note = f"""\
Medians of {PROCESSES} processes with warm caches. Names are imported when they are first used; by
  the end of the run the packages' own code took, in ms: {_imports()}."""
    show("Start-up", note, ("time", "", ""), rows)


def _row(name: str, runs: list[list[float]], begin: int, end: int, at_most: float | None = None):
    return Row(name, [run[end] - run[begin] for run in runs], at_most=at_most)


def _python(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-W", "ignore", *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True)


def _imports() -> str:
    """Return the packages that take longest to import, each without its own imports."""
    report = _python("-X", "importtime", "-c", FIRST_RUN).stderr
    total: Counter[str] = Counter()
    for line in report.splitlines():
        own, *_, name = line.removeprefix("import time:").split("|")
        if own.strip().isdigit():
            total[name.strip().split(".")[0]] += int(own)
    return ", ".join(f"{name} {time / 1e3:.0f}" for name, time in total.most_common(7))
