"""Each public function that needs compiled code says how to install the compiler."""

import inspect
import json
import os
import subprocess
import sys

import pytest

import magmotor as mm
from magmotor.numerics import native_library

PROGRAM = """
import json
import os
import sys
sys.modules["numba"] = sys.modules["llvmlite"] = None
import magmotor as mm
import mujoco

PENDULUM = '''<mujoco><custom><text name="magmotor" data="dipoles"/></custom>
<worldbody><site user="1"/><body pos="0 0 1"><joint axis="0 1 0" damping="1"/><geom size="0.1"/>
<site user="1"/></body></worldbody></mujoco>'''
model = mujoco.MjModel.from_xml_string(PENDULUM)
data = mujoco.MjData(model)
data.qvel[0] = 1.0
mujoco.mj_forward(model, data)
view, points = mujoco.MjvScene(model, 100), [[0.0, 0.0, 0.5]]
noisy = mm.Disk(friction=0.1, noise=0.1)

def simulated(scene, method):
    return lambda: mm.simulate(scene, method=method, timestep=1e-3, duration=1e-2)

def stepped():
    with mm.magnetism():
        mujoco.mj_step(model, data)

calls = {
    "advise": lambda: mm.advise(model, data, duration=1.0, budget=1.0),
    "check": lambda: mm.check(model),
    "describe": lambda: mm.describe(model),
    "dipoles.field": lambda: mm.dipoles.field(points, [[0, 0, 0]], [[0, 0, 1]]),
    "draw_field": lambda: mm.draw_field(view, model, data, points),
    "draw_moments": lambda: mm.draw_moments(view, model, data),
    "ensemble": lambda: mm.ensemble(
        noisy, method="variational/baoab", timestep=0.1, duration=8.0, replicas=2
    ),
    "field": lambda: mm.field(model, data, points),
    "Langevin": lambda: mm.Langevin(model, kT=1.0).sample(0.01, replicas=2),
    "magnetic_energy": lambda: mm.magnetic_energy(model, data),
    "save_responses": lambda: mm.save_responses(model, os.devnull),
    "magnetism": stepped,
    "metropolis": lambda: mm.metropolis(model, 1.0, samples=2, replicas=2, burn_in=1),
    "noise.normal": lambda: mm.noise.normal(1, 2, 3, 4, 1, 0),
    "noise.BrownianPath": lambda: mm.noise.BrownianPath(timestep=1e-3, seed=1).increments(9),
}
for scene in (mm.Disk(), mm.Motor(), mm.Top()):
    for method in mm.methods(scene):
        calls[f"simulate {type(scene).__name__} {method}"] = simulated(scene, method)
said = {}
for name, call in calls.items():
    try:
        call()
        said[name] = ""
    except Exception as error:
        said[name] = f"{type(error).__name__}: {error}"
print(json.dumps(said))
"""

SENTENCE = 'MissingExtra: numba is not installed: pip install "magmotor[numba]"'

FREE = {
    "add_coil", "add_conductor", "add_dipole", "add_field", "add_hysteresis", "add_iron",
    "add_magnet", "add_magnetism", "apply_perturbation", "brownian_rows", "build",
    "configurational_temperature", "kinetic_temperature", "magnet", "methods", "read_scene",
    "recommend", "scene_of", "tabulated_field", "to_table", "write_scene",
}  # fmt: skip
"""Public functions that run no compiled code; `rerun` calls `simulate` or `ensemble`."""


def said(**environment):
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], env=os.environ | environment, capture_output=True,
        text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_without_a_library_each_says_how_to_install_numba():
    found = said(MAGMOTOR_LIBRARY="0")
    assert {name for name, sentence in found.items() if sentence != SENTENCE} == set()
    functions = {name for name in dir(mm) if inspect.isfunction(getattr(mm, name))}
    assert functions - FREE - {"rerun"} <= {name.split()[0] for name in found}


@pytest.mark.skipif(native_library.library() is None, reason="there is no library")
def test_with_a_library_few_need_numba():
    found = said()
    assert {*found.values()} == {"", SENTENCE}
    needing = {name for name, sentence in found.items() if sentence}
    variational = {f"simulate Disk {name}" for name in mm.methods(mm.Disk()) if "varia" in name}
    assert needing == {"ensemble", "simulate Top scipy/dop853", *variational}
