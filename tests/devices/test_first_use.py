"""What threads call is compiled before, in the main thread, where Ctrl-C ends it."""

import signal
import threading

import mujoco
import numpy as np
import pytest
from brief_runs import BRIEF

import magmotor as mm
from magmotor.devices.ball import rigid_kernel
from magmotor.devices.disk.ensemble import run as ensembles
from magmotor.mjcf.langevin import langevin
from magmotor.numerics.compilation_notice import compile_here

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
@pytest.mark.parametrize(
    ("module", "run"),
    [
        (langevin, sample),
        (langevin, rollout),
        (rigid_kernel, several_motors),
        (ensembles, ensemble),
    ],
)
def test_threads_compile_nothing(module, run, monkeypatch):
    known = {}

    def recorded(function, *arguments):
        assert threading.current_thread() is threading.main_thread()
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
        compile_here(function, *arguments)
        known[function] = {*function.signatures}

    monkeypatch.setattr(module, "compile_here", recorded)
    run()
    assert len(known) == (2 if run is ensemble else 1)
    for function, signatures in known.items():
        assert {*function.signatures} == signatures
