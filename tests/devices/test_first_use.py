"""What threads call is compiled before, in the main thread, where Ctrl-C ends it."""

import signal
import threading

import mujoco
import numpy as np
import pytest
from brief_runs import BRIEF

import magmotor as mm
from magmotor.numerics.compiled_once import CompiledFunction
from magmotor.numerics.native_calls import NativeFunction

MODEL = """
<mujoco>
  <worldbody>
    <body><joint type="slide" damping="1" stiffness="{}"/><geom size="0.1"/></body>
  </worldbody>
</mujoco>
"""


def sample():
    model = mujoco.MjModel.from_xml_string(MODEL.format(1))
    mm.Langevin(model, kT=1.0).sample(4 * model.opt.timestep, replicas=2)


def rollout():
    model = mujoco.MjModel.from_xml_string(MODEL.format(0))
    data, start = [mujoco.MjData(model), mujoco.MjData(model)], np.zeros((2, 3))
    mm.Langevin(model).rollout(data, start, None, control_spec=0, nstep=2)


def several_motors():
    mm.simulate(mm.Motor(), method="variational/baoab", timestep=0.5, duration=1.0, replicas=2)


def ensemble():
    mm.ensemble(
        mm.Disk(noise=1.0), method="variational/baoab", timestep=0.05, duration=5.0, replicas=9,
        sample_interval=10,
    )  # fmt: skip


@BRIEF
@pytest.mark.parametrize("run", [sample, rollout, several_motors, ensemble])
def test_threads_compile_nothing(run, monkeypatch):
    """Here, by Numba, as without the library."""
    known, compile_for = {}, CompiledFunction.compile_for

    def recorded(function, *arguments):
        assert threading.current_thread() is threading.main_thread()
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
        compile_for(function, *arguments)
        known[function] = {*function.signatures}

    monkeypatch.setattr(NativeFunction, "call_with", lambda *_: None)
    monkeypatch.setattr(CompiledFunction, "compile_for", recorded)
    run()
    assert len(known) == (2 if run is ensemble else 1)
    for function, signatures in known.items():
        assert {*function.signatures} == signatures
