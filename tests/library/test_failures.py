"""Errors on threads of rollouts and batches: a failed state is NaN, and the process lives."""

import os
import signal
import subprocess
import sys
import time
import warnings
from contextlib import contextmanager, suppress

import mujoco
import mujoco.rollout
import numpy as np
import pytest
from refusals import misdeclared, refused

import magmotor as mm
from magmotor.common.environment import data_folder
from magmotor.mjcf.hooks import errors_raised

PLUGIN = (
    '<extension><plugin plugin="magmotor.forces"><instance name="magnets"/></plugin></extension>'
)
HOOKS = {"callback": "", "plugin": PLUGIN}
INTEGRATORS = ("Euler", "implicitfast", "RK4")

STEP = 2.0**-8
NEEDLE = """
<mujoco>
  {extension}
  <option gravity="0 0 0" timestep="0.00390625" integrator="{integrator}"/>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>
    <body mocap="true" pos="0 0.2 0"><site name="magnet" zaxis="0 1 0" user="5"/></body>
    <body>
      <joint type="hinge" axis="0 0 1"/>
      <geom size="0.1" mass="1"/>
      <site name="needle" zaxis="1 0 0" user="20"/>
    </body>
  </worldbody>
</mujoco>
"""
"""A needle whose dipole is on its axle, and a magnet that each step can move."""

SLIDER = """
<mujoco>
  {extension}
  <option gravity="0 0 0" timestep="0.00390625" integrator="{integrator}"/>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>
    <site name="still" pos="1 0 0" user="1e-3"/>
    <body>
      <joint type="slide" axis="1 0 0"/>
      <geom size="0.1" mass="1"/>
      <site name="moving" user="1e-3"/>
    </body>
  </worldbody>
</mujoco>
"""
"""A dipole that moves past another one."""

COINCIDE = "dipole sites 1 'needle' and 0 'magnet' coincide: their force is undefined"


def compiled(xml, hook, integrator):
    return mujoco.MjModel.from_xml_string(xml.format(extension=HOOKS[hook], integrator=integrator))


@contextmanager
def failing(hook, sentence):
    """Expect an error at the end of a block, or a warning of the plugin, which needs none."""
    if hook == "plugin":
        with pytest.warns(UserWarning, match="the state is set to NaN") as warned:
            yield
        assert {str(each.message) for each in warned} == {f"{sentence}; the state is set to NaN"}
    else:
        with pytest.raises(mujoco.FatalError) as caught, mm.magnetism():
            yield
        assert str(caught.value) == f"{sentence}; the states of these runs are NaN"


def rollout(model, start, magnet=None, *, threads=2):
    """States of replicas from these joint coordinates and velocities; a magnet's places, if any."""
    return rolled(model, [mujoco.MjData(model) for _ in range(threads)], start, magnet)


def rolled(model, data, start, magnet=None):
    states, _ = mujoco.rollout.rollout(
        model,
        data,
        np.insert(start, 0, 0.0, axis=1),
        magnet,
        control_spec=int(mujoco.mjtState.mjSTATE_MOCAP_POS),
        nstep=None if magnet is not None else 6,
    )
    return states


AWAY = np.broadcast_to([0.0, 0.2, 0.0], (5, 6, 3))
"""Places of the magnet in the steps of the replicas."""

START = np.array([(0.0, 1.0), (0.3, 0.0), (0.6, -1.0), (0.9, 0.0), (1.2, 1.0)])
FAILS = 2
LAST = 4
"""The replica that fails, and the number of its steps that succeed."""


@pytest.mark.parametrize("threads", [2, 3])
@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("hook", HOOKS)
def test_a_failed_replica_is_nan_and_the_others_go_on(hook, integrator, threads):
    model = compiled(NEEDLE, hook, integrator)
    with mm.magnetism():
        expected = rollout(model, START, AWAY)
    places = AWAY.copy()
    places[FAILS, LAST] = 0.0
    with failing(hook, COINCIDE):
        states = rollout(model, START, places, threads=threads)
    others = np.arange(5) != FAILS
    np.testing.assert_array_equal(states[others], expected[others])
    np.testing.assert_array_equal(states[FAILS, :LAST], expected[FAILS, :LAST])
    assert np.isnan(states[FAILS, LAST:, 1]).all()
    assert np.ptp(expected[:, -1, 2]) > 1


@pytest.mark.parametrize("hook", HOOKS)
def test_a_replica_that_fails_in_a_later_stage_of_rk4_is_nan(hook):
    """After half a step the dipoles coincide."""
    model = compiled(SLIDER, hook, "RK4")
    start = np.array([(0.0, 1.0), (1 - STEP / 2, 1.0), (0.5, 1.0)])
    with mm.magnetism():
        expected = rollout(model, start[[0, 2]])
    with failing(hook, COINCIDE.replace("needle", "moving").replace("magnet", "still")):
        states = rollout(model, start)
    np.testing.assert_array_equal(states[[0, 2]], expected)
    assert np.isnan(states[1, :, 1:]).all()


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("hook", HOOKS)
def test_numbers_that_become_invalid_are_named(hook, integrator):
    model = compiled(NEEDLE, hook, integrator)
    data = [mujoco.MjData(model) for _ in range(2)]  # with the plugin, the next would be an error
    model.site("needle").user[:] = np.nan
    with misdeclared("moment", 1) as outside:
        mm.describe(model)
    with failing(hook, str(outside.value)):
        states = rolled(model, data, START, AWAY)
    assert np.isnan(states[..., 1]).all()
    if hook == "plugin":
        with pytest.raises(mujoco.FatalError) as caught:
            mujoco.MjData(model)
        assert str(caught.value) == str(outside.value)


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("hook", HOOKS)
def test_a_batch_raises_its_own_error_and_keeps_the_state_before(hook, integrator):
    batches = pytest.importorskip("mujoco.batch", reason="new in MuJoCo 3.17")
    model = compiled(NEEDLE, hook, integrator)

    def batch(fails):
        batch = batches.Batch(model, 5, 2)
        batch.qpos[:], batch.qvel[:] = START[:, :1], START[:, 1:]
        if fails:
            batch.mocap_pos[FAILS] = 0.0
        return batch

    whole, failed = batch(False), batch(True)
    with mm.magnetism():
        whole.step(nstep=6)
        with pytest.raises(batches.SimulationError) as caught:
            failed.step(nstep=6)
    assert COINCIDE in str(caught.value)
    assert caught.value.ids.tolist() == [FAILS]
    others = np.arange(5) != FAILS
    for name in ("qpos", "qvel"):
        kept, found, expected = (getattr(each, name) for each in (batch(True), failed, whole))
        np.testing.assert_array_equal(found[others], expected[others])
        np.testing.assert_array_equal(found[FAILS], kept[FAILS])
    assert np.ptp(whole.qvel) > 1
    model.site("needle").user[:] = np.nan
    error = ValueError if hook == "plugin" else batches.SimulationError
    with mm.magnetism(), pytest.raises(error) as caught:
        batch(False).step()
    with misdeclared("moment", 1) as outside:
        mm.describe(model)
    assert str(outside.value) in str(caught.value)


@pytest.mark.parametrize("hook", HOOKS)
def test_where_mujoco_is_called_in_the_same_thread_the_call_raises(hook):
    model = compiled(NEEDLE, hook, "RK4")
    data = mujoco.MjData(model)
    data.mocap_pos[:] = 0.0
    for call in (mujoco.mj_forward, mujoco.mj_step):
        with mm.magnetism(), pytest.raises(mujoco.FatalError) as caught:
            call(model, data)
        assert str(caught.value) == COINCIDE
    with mm.magnetism(), pytest.raises(mujoco.FatalError) as caught:
        rollout(model, START, 0 * AWAY, threads=1)
    assert str(caught.value) == COINCIDE


def test_an_error_belongs_to_the_block_in_which_it_occurred():
    model = compiled(NEEDLE, "callback", "Euler")

    def interrupted():
        with mm.magnetism():
            rollout(model, START, 0 * AWAY)
            raise KeyError

    with pytest.raises(KeyError):
        interrupted()
    with mm.magnetism():
        assert np.isfinite(rollout(model, START, AWAY)).all()


def test_several_errors_are_counted():
    needle, slider = compiled(NEEDLE, "callback", "Euler"), compiled(SLIDER, "callback", "Euler")

    def failing_twice():
        with mm.magnetism():
            rollout(needle, START, 0 * AWAY)
            rollout(slider, np.array([(1.0, 0.0), (0.0, 0.0)]))

    with pytest.raises(mujoco.FatalError) as caught:
        failing_twice()
    assert str(caught.value).startswith(f"{COINCIDE} (and 1 other error); ")


def fail_in_rollouts(model, replicas=2):
    """Roll out on two threads, each of which meets two dipoles that coincide."""
    data = [mujoco.MjData(model) for _ in range(2)]
    start = np.tile(np.concatenate([[0.0], model.qpos0, np.zeros(model.nv)]), (replicas, 1))
    start[:, 1] = 1.0
    return mujoco.rollout.rollout(model, data, start, nstep=3)[0]


def test_a_warning_that_is_an_error_does_not_crash(capfd):
    """Nothing can be raised there; the sentence is printed."""
    model = compiled(SLIDER, "plugin", "Euler")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        states = fail_in_rollouts(model)
    assert np.isnan(states[:, :, 1]).all()
    assert "magmotor: dipole sites 1 'moving' and 0 'still' coincide" in capfd.readouterr().err


def test_an_error_is_not_lost_while_another_thread_is_inside_baoab():
    """That thread's handler of errors serves the process, but not the threads of a rollout."""
    model = compiled(SLIDER, "callback", "Euler")
    for _ in range(5):
        with pytest.raises(mujoco.FatalError), mm.magnetism(), errors_raised():
            assert np.isnan(fail_in_rollouts(model)[:, :, 1]).all()
    with errors_raised():
        pass


def test_errors_are_raised_in_each_block_during_which_they_were_recorded():
    model = compiled(SLIDER, "callback", "Euler")
    inner, outer = (pytest.raises(mujoco.FatalError) for _ in range(2))
    with outer, mm.magnetism(), inner, mm.magnetism():
        fail_in_rollouts(model)


def test_errors_of_a_block_that_ends_by_an_exception_are_a_warning():
    model = compiled(SLIDER, "callback", "Euler")

    def fail():
        with mm.magnetism():
            fail_in_rollouts(model)
            raise KeyError

    with pytest.warns(UserWarning, match="coincide"), pytest.raises(KeyError):
        fail()
    with mm.magnetism():
        pass


@pytest.mark.parametrize("hook", HOOKS)
def test_an_error_in_a_later_stage_of_rk4_leaves_the_stack_empty(hook):
    model = compiled(SLIDER, hook, "RK4")
    data = mujoco.MjData(model)
    data.qpos[0], data.qvel[0] = 1 - STEP / 2 * 8.0, 8.0
    with mm.magnetism(), pytest.raises(mujoco.FatalError):
        mujoco.mj_step(model, data)
    assert data.qpos[0] == 1.0
    assert (data.pstack, data.pbase) == (0, 0)


@pytest.mark.parametrize("hook", HOOKS)
@pytest.mark.parametrize("time", [np.nan, np.inf, -1e300, 2.0**53])
def test_noise_needs_a_time_that_has_a_step(hook, time):
    text = SLIDER.replace('data="dipoles"', 'data="noise"').replace(
        "<joint", '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><joint'
    )
    text = text.replace("<body>", '<body user="1 0 0 0 0 0">')
    model = compiled(text, hook, "Euler")
    data = mujoco.MjData(model)
    data.time = time * model.opt.timestep
    with mm.magnetism(), pytest.raises(mujoco.FatalError) as caught:
        mujoco.mj_forward(model, data)
    assert str(caught.value).startswith(f"time = {data.time:g}: ")


@pytest.mark.parametrize("letter", ["e", "é", "漢", "%"])
def test_a_long_name_does_not_hide_an_error(letter):
    text = SLIDER.replace('name="moving"', f'name="{letter * 600}"')
    model = compiled(text, "callback", "Euler")
    model.site_user[1, 0] = np.nan
    data = mujoco.MjData(model)
    with misdeclared("moment", 1) as outside:
        mm.describe(model)
    sentence = str(outside.value)
    assert sentence.startswith(f"site 1 '{letter * 60}...': ")
    with mm.magnetism(), pytest.raises(mujoco.FatalError) as in_a_step:
        mujoco.mj_forward(model, data)
    assert str(in_a_step.value) == sentence
    with pytest.raises(mm.InputError) as of_langevin:
        mm.Langevin(model)
    assert str(of_langevin.value).startswith(sentence)
    with pytest.raises(ValueError) as by_mujoco:  # noqa: PT011 - MuJoCo's
        compiled(text.replace('user="1e-3"', 'user="inf"'), "plugin", "Euler")
    assert sentence.partition("': ")[2] in str(by_mujoco.value)


def test_baoab_names_a_memory_that_is_too_small():
    sites = "".join(f'<site pos="{k} 0 0" user="1"/>' for k in range(300))
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco><size memory="1K"/><worldbody>{sites}<body pos="0 1 0">
<joint type="slide"/><geom size="0.1"/><site user="1"/></body></worldbody></mujoco>""")
    with pytest.raises(mujoco.FatalError):
        mm.Langevin(model).step(mujoco.MjData(model))


def test_a_rollout_by_baoab_takes_each_mjdata_once():
    model = compiled(SLIDER, "callback", "Euler")
    data, start = mujoco.MjData(model), np.zeros((2, 3))
    with refused("data"):
        mm.Langevin(model).rollout([data, data], start, None, control_spec=0, nstep=1)


FORK = """
import os, sys, threading, time
import magmotor, magmotor_plugin, mujoco
path = sys.argv[1]
compiling = threading.Thread(target=lambda: mujoco.MjModel.from_xml_path(path))
compiling.start()
while not magmotor_plugin.slots._forces.loading:
    time.sleep(0.001)
child = os.fork()
if child == 0:
    try:
        mujoco.MjModel.from_xml_path(path)
    except ValueError:
        os._exit(7)
    os._exit(0)
compiling.join()
print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""


def test_a_fork_while_the_code_is_being_loaded_is_an_error_in_the_child():
    """A lock that a thread of the parent holds would never be released there."""
    path = str(data_folder("models") / "top_magnetic.xml")
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", FORK, path],
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.stdout.strip() == "7", done.stderr
    assert "forked while another thread loaded" in done.stderr


INTERRUPTED = """
import os, signal, sys, time
from functools import partial
import magmotor, magmotor_plugin, mujoco
from magmotor.mjcf import callbacks

def slow(name):
    os.kill(os.getpid(), signal.SIGINT)
    while True:
        time.sleep(0.01)

def passive(model):
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data)
    return data.qfrc_passive.any()

path = sys.argv[1]
real, callbacks.compiled_plugin = callbacks.compiled_plugin, slow
for load in (partial(mujoco.MjModel.from_xml_path, path), mujoco.MjSpec.from_file(path).compile):
    try:
        load()
        time.sleep(60)
    except KeyboardInterrupt:
        print("interrupted")
callbacks.compiled_plugin = real
magmotor_plugin.c_callbacks.interrupted.set()  # as for the moment until it is raised
model = mujoco.MjModel.from_xml_path(path)
data = mujoco.MjData(model)
magmotor_plugin.c_callbacks.interrupted.clear()
mujoco.mj_forward(model, data)
print(data.qfrc_passive.any(), passive(model), passive(mujoco.MjModel.from_xml_path(path)))
"""


def test_ctrl_c_ends_the_loading_and_the_next_one_works():
    """A model that was made in between gets its forces with its first step."""
    path = str(data_folder("models") / "top_magnetic.xml")
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED, path], capture_output=True, text=True, timeout=120,
        check=False,
    )  # fmt: skip
    assert done.stdout.split() == ["interrupted", "interrupted", "True", "True", "True"], (
        done.stderr
    )
    assert done.stderr == ""


COLD = """
import sys, time
import magmotor, mujoco
print("begins", flush=True)
mujoco.MjModel.from_xml_path(sys.argv[1])
time.sleep(60)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT for one process")
def test_ctrl_c_ends_a_compilation_that_takes_a_minute(tmp_path):
    path = str(data_folder("models") / "top_magnetic.xml")
    program = subprocess.Popen(
        [sys.executable, "-c", COLD, path], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}, start_new_session=True,
    )  # fmt: skip
    assert program.stdout is not None
    program.stdout.readline()
    time.sleep(3)
    program.send_signal(signal.SIGINT)
    said = program.communicate(timeout=20)[1]  # 0.5 to 2 s
    assert said.splitlines()[-1].startswith("KeyboardInterrupt")
    # 1 where the thread that compiles runs `exec` meanwhile: CPython then forgets the interrupt.
    assert program.returncode in (-signal.SIGINT, 1)
    until = time.monotonic() + 10
    with suppress(ProcessLookupError):
        while not os.killpg(program.pid, 0):  # the process that compiles the forces ends, too
            assert time.monotonic() < until
            time.sleep(0.05)
    assert [path for path in tmp_path.rglob("*") if path.is_file() and path.suffix != ".nbc"] == []


WITHOUT_THE_PRIVATE_FUNCTION = """
import sys
import mujoco, mujoco.rollout, numpy as np
import magmotor as mm
from magmotor.mjcf import error_raising

whole = error_raising.library()

class Library:
    def __getattr__(self, name):
        if name == "_mjPRIVATE_setTlsLogHandler":
            raise AttributeError(name)
        return getattr(whole, name)

error_raising.library = Library
model = mujoco.MjModel.from_xml_string(sys.argv[1])
data = [mujoco.MjData(model) for _ in range(2)]
for threads in (1, 2):
    try:
        with mm.magnetism():
            states, _ = mujoco.rollout.rollout(model, data[:threads], np.zeros((4, 3)), nstep=3)
            print(threads, np.isnan(states[:, :, 1]).all())
    except mujoco.FatalError as error:
        print(threads, error)
mujoco.mj_resetData(model, data[0])
try:
    with mm.magnetism():
        mujoco.mj_step(model, data[0])
except mujoco.FatalError as error:
    print(error)
try:
    mm.magnetic_energy(model, data[0])
except ValueError as error:
    print(error)
"""


def test_a_mujoco_without_the_private_function_does_not_end_the_process():
    """Then the threads that Python entered handle errors, and those of a rollout do not."""
    xml = SLIDER.format(extension="", integrator="Euler").replace('pos="1 0 0"', 'pos="0 0 0"')
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_THE_PRIVATE_FUNCTION, xml],
        capture_output=True, text=True, check=True, env=os.environ,
    )  # fmt: skip
    here, nan, pool, step, energy = done.stdout.splitlines()
    assert here.startswith("1 dipole sites 1 'moving' and 0 'still' coincide")
    assert (nan, "these runs are NaN" in pool) == ("2 True", True)
    assert step.endswith("their force is undefined")
    assert energy == step


@pytest.mark.parametrize("hook", HOOKS)
@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("site_bodyid", -1),
        ("site_bodyid", 3),
        ("body_weldid", 2),
        ("name_textadr", -1),
        ("text_adr", 2**31 - 1),
        ("geom_bodyid", -1),
    ],
)
def test_an_index_out_of_range_is_named(field, value, hook):
    model = compiled(NEEDLE, hook, "Euler")
    data = mujoco.MjData(model)
    element = 1 if field == "body_weldid" else getattr(model, field).size - 1
    getattr(model, field)[element] = value
    for call in (mm.describe, mm.check, lambda model: mm.field(model, data, [1.0, 2.0, 3.0])):
        with misdeclared("index", element) as outside:
            call(model)
        sentence = str(outside.value)
        assert sentence.startswith(f"{field}[{element}] of the model = {value}: ")
    with mm.magnetism(), pytest.raises(mujoco.FatalError) as caught:
        mujoco.mj_step(model, data)
    assert str(caught.value) == sentence
    if hook == "plugin":
        with pytest.raises(mujoco.FatalError) as caught:
            mujoco.MjData(model)
        assert str(caught.value) == sentence
