"""Time of a new process to import magmotor, to finish its first run, and to compile its code."""

import json
import os
import subprocess
import sys
import tempfile
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
FIRST_USE = """
import time
import magmotor as mm
begin = time.perf_counter()
{}
print(time.perf_counter() - begin)
"""
MAGNETISM = "with mm.magnetism():\n    pass"
LANGEVIN = """\
import mujoco
model = mujoco.MjModel.from_xml_string(
    '<mujoco><worldbody><body><joint damping="1"/><geom size="1"/></body></worldbody></mujoco>'
)
mm.Langevin(model, kT=1.0)"""
REFERENCE = 'mm.simulate(mm.Top(), method="variational/verlet", timestep=0.025, duration=1.0)'


def main() -> None:
    _python("-c", FIRST_RUN)  # fills the caches of compiled code
    runs = [json.loads(_python("-c", FIRST_RUN).stdout) for _ in range(PROCESSES)]
    rows = [
        _row("import magmotor", runs, 0, 1, at_most=0.7),
        _row("first simulate, import included", runs, 0, 4, at_most=2.0),
        _row("  of which: first build", runs, 1, 2),
        _row("  callback, from the disk's cache", runs, 2, 3),
        _row("  simulate", runs, 3, 4),
        Row("first use ever: magnetism()", [_first_use(MAGNETISM)], at_most=60.0),
        Row("  Langevin", [_first_use(LANGEVIN)]),
        Row("  a reference integrator", [_first_use(REFERENCE)]),
    ]
    note = f"""\
Medians of {PROCESSES} processes with warm caches. Names are imported when they are first used; by
  the end of the run the packages' own code took, in ms: {_imports()}.
  The first use ever includes compilation, and is measured once."""
    show("Start-up", note, ("time", "", ""), rows)


def _row(name: str, runs: list[list[float]], begin: int, end: int, at_most: float | None = None):
    return Row(name, [run[end] - run[begin] for run in runs], at_most=at_most)


def _first_use(statement: str) -> float:
    """Return the time of a statement for which nothing has been compiled."""
    with tempfile.TemporaryDirectory() as folder:
        program = FIRST_USE.format(statement)
        return float(_python("-c", program, NUMBA_CACHE_DIR=folder).stdout)


def _python(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-W", "ignore", *arguments]
    return subprocess.run(
        command, check=True, capture_output=True, text=True, env=os.environ | environment
    )


def _imports() -> str:
    """Return the packages that take longest to import, each without its own imports."""
    report = _python("-X", "importtime", "-c", FIRST_RUN).stderr
    total: Counter[str] = Counter()
    for line in report.splitlines():
        own, *_, name = line.removeprefix("import time:").split("|")
        if own.strip().isdigit():
            total[name.strip().split(".")[0]] += int(own)
    return ", ".join(f"{name} {time / 1e3:.0f}" for name, time in total.most_common(7))
