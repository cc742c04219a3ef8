"""What most models do not need is compiled when a model first needs it."""

import itertools
import os
import threading
import time
import warnings

import mujoco
import numpy as np
import pytest

import magmotor as mm
from magmotor.mjcf import late_functions
from magmotor.mjcf.declarations import all_elements
from magmotor.mjcf.forces import all_forces, brownian_wrenches, dipole_wrenches

FIELD = """
<mujoco>
  <option gravity="0 0 0"/>
  <custom>
    <text name="magmotor" data="dipoles fields noise"/>
    <numeric name="field{}" data="0 0.1 0"/>
  </custom>
  <worldbody>
    <body user="{}">
      <joint axis="0 0 1" damping="0.1"/>
      <geom size="0.1"/>
      <site user="1" zaxis="1 0 0"/>
    </body>
  </worldbody>
</mujoco>"""

LATE = {
    "forces": all_forces._all_forces,
    "elements": all_elements._read_late,
    "noise": brownian_wrenches._late,
}


NUMBERS = itertools.count()

attempts = []
"""One entry for each time that the function of `unloaded` was compiled."""


def started():
    """Return a model of a structure of its own, which has no table yet, and its data."""
    xml = FIELD.format(next(NUMBERS), "0 0 0 0 0 1e-9")
    model = mujoco.MjModel.from_xml_string(xml)
    return model, mujoco.MjData(model)


def torque(model, data):
    mujoco.mj_step(model, data)
    return data.xfrc_applied[1, 5]


def step_for_long(model, data):
    for _ in range(10**7):
        mujoco.mj_step(model, data)


@pytest.fixture
def unloaded(request, monkeypatch):
    """A late function that must be loaded again, and what it raises then."""
    with mm.magnetism():
        torque(*started())
    function = LATE[request.param]
    before = function._address.value
    assert before
    function._address.value = 0
    raised = []
    attempts.clear()

    def compiled():
        attempts.append(function)
        if raised:
            raise raised[0]
        return type("Compiled", (), {"address": before})

    monkeypatch.setattr(function, "_compiled", compiled)
    yield raised
    function._address.value, late_functions._failed.value = before, 0


@pytest.mark.parametrize("unloaded", LATE, indirect=True)
def test_it_is_loaded_within_a_step(unloaded):
    with mm.magnetism():
        assert torque(*started()) == pytest.approx(0.1, abs=1e-6)


@pytest.mark.parametrize("unloaded", LATE, indirect=True)
def test_an_error_of_the_compiler_is_an_error_of_the_step(unloaded, capsys):
    unloaded.append(OSError("no space"))
    model, data = started()
    with mm.magnetism(), pytest.raises(mujoco.FatalError, match="code of magmotor could not be"):
        mujoco.mj_step(model, data)
    assert "OSError: no space" in capsys.readouterr().err
    unloaded.clear()
    with mm.magnetism():
        assert torque(*started()) == pytest.approx(0.1, abs=1e-6)


@pytest.mark.parametrize("unloaded", LATE, indirect=True)
def test_ctrl_c_ends_the_compilation_and_then_the_program(unloaded):
    unloaded.append(KeyboardInterrupt())
    model, data = started()
    with pytest.raises(KeyboardInterrupt), mm.magnetism():
        step_for_long(model, data)
    assert len(attempts) == 1
    unloaded.clear()
    mujoco.mj_resetData(model, data)
    with mm.magnetism():
        assert torque(model, data) == pytest.approx(0.1, abs=1e-6)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system has no fork")
def test_a_child_that_is_forked_meanwhile_can_load():
    """The fork waits until no thread compiles; else the child would wait for a lock for ever."""
    begun = threading.Event()

    def compile_for_long():
        with late_functions._lock:
            begun.set()
            time.sleep(0.5)

    thread = threading.Thread(target=compile_for_long)
    thread.start()
    begun.wait()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of a fork beside threads
        child = os.fork()
    if child == 0:
        # Not in a new thread, which may get the identity of the one that is gone.
        os._exit(0 if late_functions._lock.acquire(timeout=5) else 1)
    _, status = os.waitpid(child, 0)
    thread.join()
    assert status == 0


@pytest.mark.parametrize("count", [300, 1100])
def test_many_dipoles_have_the_same_forces_where_their_code_is_missing(count, monkeypatch):
    """If it cannot be loaded, they are computed one by one, within rounding or the tolerance."""
    bodies = "".join(
        f'<body pos="{k % 10} {k // 10} 0"><freejoint/><geom size="0.1"/><site user="1"/></body>'
        for k in range(count)
    )
    model = mujoco.MjModel.from_xml_string(f"""
        <mujoco>
          <custom>
            <text name="magmotor" data="dipoles"/>
            <numeric name="magnetic_tolerance" data="{1e-3 * (count > 1000)}"/>
          </custom>
          <worldbody>{bodies}</worldbody>
        </mujoco>""")
    forces = []
    for _ in range(2):
        data = mujoco.MjData(model)
        with mm.magnetism():
            mujoco.mj_forward(model, data)
        forces.append(data.xfrc_applied.copy())
        for function in (dipole_wrenches._tiles, dipole_wrenches._clusters):
            monkeypatch.setattr(function, "_compiled", lambda: 1 / 0)
            monkeypatch.setattr(function._address, "value", 0)
    assert 0 < abs(forces[0] - forces[1]).max() < 1e-3 * np.sqrt((forces[0] ** 2).mean())
