"""Use everything once that the library contains, so that Numba compiles it.

Two processes share the work, and a folder for code: `everything` finds there what `beside` has
compiled meanwhile.
"""

import gc
from collections.abc import Callable

import numpy as np

import magmotor as mm  # isort: skip  before MuJoCo, for which it chooses an OpenGL library
import mujoco

from magmotor import noise
from magmotor.mjcf import binding, callbacks, late_functions
from magmotor_plugin import slots

NEEDLE = """
<mujoco>
  <extension><plugin plugin="magmotor.forces"><instance name="magnets">
    <config key="act" value="dipoles"/>
  </instance></plugin></extension>
  <option><flag contact="disable"/></option>
  <worldbody>
    <site pos="0 0.1 0" zaxis="0 1 0" user="5"/>
    <body>
      <joint type="hinge" axis="0 0 1" damping="1e-4"/>
      <geom type="capsule" fromto="-0.03 0 0 0.03 0 0" size="0.003"/>
      <site zaxis="1 0 0" user="0.2"/>
    </body>
  </worldbody>
</mujoco>
"""
"""A tree of one joint with a magnet."""


FOR_BOTH = "brownian", "clusters", "tiles"
"""Late functions that the second process compiles."""


def everything(wait: Callable[[], object]) -> None:
    """Load the functions that MuJoCo and other code call, and call those that Python calls.

    Before what `beside` compiles, `wait` is called.
    """
    _alone()
    callbacks.compiled_callback()
    for name in slots.NAMES:
        callbacks.compiled_plugin(name)
    _load(lambda symbol: not any(name in symbol for name in FOR_BOTH))
    _observe_model()
    wait()
    _load(lambda _: True)
    _draw_numbers()
    _run("variational")
    _sample_model()
    _run("mujoco")


def beside() -> None:
    """Compile about half of this: first what needs nothing else, then what `everything` has."""
    _alone()
    _draw_numbers()
    _run("variational")
    callbacks.compiled_callback()
    _load(lambda symbol: any(name in symbol for name in FOR_BOTH))
    _sample_model()
    _run("mujoco")


def _alone() -> None:
    """Compile in this process; another one would compile for this one only."""
    binding._may_start_python = lambda: False
    gc.disable()  # a sixth of the time


def _load(is_wanted: Callable[[str], bool]) -> None:
    for function in late_functions._loaders.values():
        if is_wanted(function._symbol):
            function.load()


def _observe_model() -> None:
    model, data = _needle()
    callbacks.prepare(model._address, data._address, 0)
    mm.field(model, data, np.array([[0.0, 0.0, 0.1]]))
    mm.magnetic_energy(model, data)
    mm.check(model, data)


def _sample_model() -> None:
    model, data = _needle()
    thermostat = mm.Langevin(model, kT=1e-4)
    thermostat.step(data, 2)
    thermostat.sample(0.01, replicas=2, burn_in=1.0)


def _needle() -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(NEEDLE)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def _run(engine: str) -> None:
    surrounded = mm.Motor(drag=1e-3, rotational_drag=1e-6)
    for scene in (mm.Top(), mm.Motor(), surrounded):
        for method in mm.methods(scene):
            if method.startswith(engine):
                mm.simulate(scene, method=method, timestep=1e-4, duration=1e-3)


def _draw_numbers() -> None:
    noise.BrownianPath(timestep=1e-3, seed=0).increments(replica=0, channel=0, steps=2)
    noise.normal(0, 0, 0, 0, 1, 0)
    mm.dipoles.field([0.0, 0.0, 0.1], [[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]])
