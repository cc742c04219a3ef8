"""The library compared with Numba's code: the same work in two processes, which take turns."""

import json
import os
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path

import mujoco
import numpy as np

import magmotor as mm
from benchmarks.harness import timing
from benchmarks.harness.stepping import Stepper
from benchmarks.harness.tables import Row, show
from benchmarks.harness.timing import seconds_of
from benchmarks.speed import fields, langevin, rigid
from magmotor.common.environment import data_folder

ROUNDS, TURNS, REPEATS = 3, 4, 5
"""Pairs of processes, since two processes with the same code differ by 2 %; turns and repeats."""

MOST = 1.03
FROM_PYTHON = "  from Python: "
NOTE = """\
Processor time of forces by the callback without MuJoCo's own work, of whole steps of MuJoCo with
  the plugin, of mm.Langevin and of the reference integrators, and of a noise path. A call from
  Python has no target: Numba reads NumPy's arrays in C, the library in Python, at 2 µs each."""


def main() -> None:
    """Show the table."""
    times: dict[str, tuple[list[float], list[float]]] = {}
    for _ in range(ROUNDS):
        for name, pair in _measured().items():
            for kept, found in zip(times.setdefault(name, ([], [])), pair, strict=True):
                kept += found
    rows = [
        Row(name, *pair, at_most=None if name.startswith(FROM_PYTHON) else MOST)
        for name, pair in times.items()
    ]
    show("The library against Numba's code", NOTE, ("library", "Numba", "ratio"), rows)


def _measured() -> dict[str, tuple[list[float], list[float]]]:
    """Return the times of each case by the library and by Numba, in two new processes."""
    both = [_start(MAGMOTOR_LIBRARY=value) for value in ("1", "0")]
    times = {name: ([], []) for name in [_answer(process) for process in both][-1]}
    for _ in range(TURNS):
        for name, pair in times.items():
            for process, found in zip(both, pair, strict=True):
                found.append(_answer(process, name))
    for process in both:
        process.communicate()
    return times


def _start(**environment: str) -> subprocess.Popen[str]:
    command = sys.executable, "-c", f"from {__name__} import serve; serve()"
    return subprocess.Popen(
        command, cwd=Path(__file__).parents[2], env=os.environ | environment, text=True,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    )  # fmt: skip


def _answer(process: subprocess.Popen[str], name: str = ""):
    """Return what a process says next, after it was told the name of a case, if there is one."""
    assert process.stdin
    assert process.stdout
    if name:
        print(name, file=process.stdin, flush=True)
    return json.loads(process.stdout.readline())


def serve() -> None:
    """Print the names of all cases, and the least seconds of each case that is asked for."""
    timing.clock = time.process_time  # other processes then disturb less
    warnings.simplefilter("ignore")
    cases = _of_forces() | _of_steps() | _of_python()
    for case in cases.values():
        case()  # compiles
    print(json.dumps([*cases]), flush=True)
    for line in sys.stdin:
        print(min(cases[line.rstrip("\n")]() for _ in range(REPEATS)), flush=True)


def _of_forces() -> dict[str, Callable[[], float]]:
    """Return calls of the callback, for models of some magnets with this and that."""
    fields.bind()
    custom, magnets = fields.custom_of(10), {f"{n} magnets": (n, "") for n in fields.COUNTS}
    others = {f"10 magnets, {name}": (10, text) for name, text in custom.items() if text}
    tolerance = '<numeric name="magnetic_tolerance" data="{}"/>'.format
    many = {"tiles": (1000, tolerance(0)), "clusters": (2000, tolerance(0.03))}
    models = {
        name: fields.model_of(count, text)
        for name, (count, text) in (magnets | others | many).items()
    }
    return {name: partial(fields.seconds, *model) for name, model in models.items()}


def _of_steps() -> dict[str, Callable[[], float]]:
    """Return steps of MuJoCo with the plugin, of `mm.Langevin` and of the reference integrators."""
    cases = {}
    for name in ("top_magnetic", "motor_magnetic", "disk_magnetic", "levitation"):
        model = mujoco.MjModel.from_xml_path(str(data_folder("models") / f"{name}.xml"))
        stepper = Stepper(model, timestep=model.opt.timestep)
        cases[f"plugin, {name}"] = partial(stepper.seconds, magnetic=False)
    for name, case in langevin.models():
        cases[f"Langevin, {name}"] = langevin.steppers(case)[0]
    for scheme in rigid.SCHEMES:
        cases[f"motor, {scheme}"] = partial(rigid.run_motor, scheme)
        cases[f"top, {scheme}"] = partial(rigid.run_top, scheme)
    return cases


def _of_python() -> dict[str, Callable[[], float]]:
    """Return calls from Python of functions in the library."""
    path = mm.noise.BrownianPath(timestep=1e-3, seed=0)
    model = fields.model_of(10, "")
    points = np.zeros((1, 3)) + 0.05
    return {
        "noise, 10,000 numbers": lambda: seconds_of(partial(path.increments, 10_000)),
        f"{FROM_PYTHON}a number": lambda: seconds_of(
            partial(mm.noise.normal, 1, 2, 3, 4, 1, 0), 1000
        ),
        f"{FROM_PYTHON}field": lambda: seconds_of(partial(mm.field, *model, points), 100),
        f"{FROM_PYTHON}energy": lambda: seconds_of(partial(mm.magnetic_energy, *model), 100),
        f"{FROM_PYTHON}dipoles.field": lambda: seconds_of(
            partial(mm.dipoles.field, points, 2 * points, points), 100
        ),
    }
