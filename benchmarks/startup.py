"""How long a new process takes until it has magmotor, and until its first run is done."""

import json
import subprocess
import sys
from collections import Counter

from table import Row, show

PROCESSES = 7
FIRST_RUN = """
import json, time
times = [time.perf_counter()]
import magmotor as mm
times.append(time.perf_counter())
for name in mm.__all__:
    getattr(mm, name)
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
PARTS = ("import magmotor", "  all its names", "  first build", "  callback from disk", "  simulate")


def main() -> None:
    _python("-c", FIRST_RUN)  # fills the caches of compiled code
    runs = [json.loads(_python("-c", FIRST_RUN).stdout) for _ in range(PROCESSES)]
    rows = [
        Row(name, [run[i + 1] - run[i] for run in runs], at_most=0.7 if i == 0 else None)
        for i, name in enumerate(PARTS)
    ]
    rows.insert(1, Row("first simulate, import included", [r[-1] - r[0] for r in runs], at_most=2))
    note = f"Medians of {PROCESSES} processes with warm caches. Imports take, in ms: {_imports()}."
    show("Start-up", note, ("time", "", ""), rows)


def _python(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-W", "ignore", *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True)


def _imports() -> str:
    """The packages that take longest to import, each without what it imports in turn."""
    report = _python("-X", "importtime", "-c", FIRST_RUN).stderr
    lines = [line.removeprefix("import time:").split("|") for line in report.splitlines()[1:]]
    total: Counter[str] = Counter()
    for line in lines:
        if len(line) == 3 and line[0].strip().isdigit():
            total[line[2].strip().split(".")[0]] += int(line[0])
    return ", ".join(f"{name} {time / 1e3:.0f}" for name, time in total.most_common(8))
