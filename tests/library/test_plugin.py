"""The engine plugin: the callback's forces as a part of the model, without Python."""

import os
import subprocess
import sys
import textwrap
import tomllib
from pathlib import Path

import mujoco
import mujoco.rollout
import numpy as np
import pytest

import magmotor as mm

ROOT = Path(__file__).parents[2]
SCENES = ("disk", "top", "top_plane", "motor", "motor_plane")
PLUGIN = '<extension><plugin plugin="magmotor.forces">{}</plugin></extension>'
INSTANCE = '<instance name="magnets"/>'

NEEDLES = """
<mujoco>
  {extension}
  <option gravity="0 0 0" integrator="{integrator}"/>
  <size nuserdata="5"/>
  <custom>
    <text name="magmotor" data="all"/>
    <tuple name="coupling of needle and arm">
      <element objtype="body" objname="needle" prm="3"/>
      <element objtype="body" objname="arm" prm="3"/>
    </tuple>
  </custom>
  <worldbody>
    <site pos="0.3 0.1 0.2" zaxis="1 2 3" user="7"/>
    <body name="needle" pos="0 0.1 0" user="0 0 0 0 0.01 0  0.02 0 0 0 0 0">
      <joint type="hinge" axis="0 0 1" user="0.1 0.2" damping="0.01"/>
      <geom type="box" size="0.1 0.01 0.01" pos="0.02 0 0"/>
      <site pos="0.05 0 0" zaxis="1 0 0" user="4"/>
      <body name="arm" pos="0.2 0 0">
        <joint type="ball"/>
        <geom type="capsule" size="0.01 0.05"/>
        <site pos="0 0 0.05" user="3"/>
        <body pos="0 0 0.1">
          <joint type="slide" axis="0 1 0" user="0 0.3"/>
          <geom size="0.02"/>
        </body>
      </body>
    </body>
    <body name="free" pos="0 -0.2 0.1" user="0.1 0 0 0 0 0">
      <freejoint/>
      <geom size="0.05"/>
      <site pos="0.01 0.02 0" zaxis="-1 0 1" user="5"/>
    </body>
  </worldbody>
</mujoco>
"""
INTEGRATORS = ("Euler", "implicitfast", "implicit", "RK4")


MAGNETS = PLUGIN.format(INSTANCE)


def needles(extension=MAGNETS, integrator="Euler"):
    return mujoco.MjModel.from_xml_string(
        NEEDLES.format(extension=extension, integrator=integrator)
    )


def moved(model, steps=200):
    """The state after some steps, on a Brownian path that is not the first."""
    data = mujoco.MjData(model)
    data.userdata[:] = (7, 3, 1, 0, 0)[: model.nuserdata]
    mujoco.mj_step(model, data, nstep=steps)
    return np.concatenate([data.qpos, data.qvel])


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_tree_moves_as_with_the_callback(integrator):
    """Dipoles, couplings, noise and potentials; the forces are added in another order."""
    with mm.magnetism():
        expected = moved(needles("", integrator))
    found = moved(needles(integrator=integrator))
    at_rest = moved(needles("", integrator))
    assert abs(found - at_rest).max() > 0.1
    assert abs(found - expected).max() <= 5e-14 * abs(expected).max()  # measured: 1.9e-15


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("scene", SCENES)
def test_a_scene_moves_as_with_the_callback(scene, integrator):
    """To the bit, but for the motor, in which more than one force acts on a joint."""
    states = []
    for name in (scene, f"{scene}_magnetic"):
        model = mujoco.MjModel.from_xml_path(str(ROOT / "models" / f"{name}.xml"))
        model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
        with mm.magnetism():
            states.append(moved(model, 1000))
    still = np.concatenate([model.qpos0, np.zeros(model.nv)])
    assert abs(states[0] - still).max() > 1e-3
    bound = 2e-16 if scene.startswith("motor") else 0.0  # measured: 6.9e-18
    assert abs(states[1] - states[0]).max() <= bound


def test_the_users_own_forces_and_callback_stay():
    model = needles()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    magnetic, resting = data.qfrc_passive.copy(), data.qacc.copy()
    data.xfrc_applied[:] = np.arange(model.nbody * 6).reshape(-1, 6) / 100
    data.qfrc_applied[:] = 0.1
    given = data.xfrc_applied.copy()
    seen = []
    mujoco.set_mjcb_control(lambda model, data: seen.append(data.time))
    try:
        mujoco.mj_step(model, data)
    finally:
        mujoco.set_mjcb_control(None)
    assert seen == [0.0]
    np.testing.assert_array_equal(data.xfrc_applied, given)
    np.testing.assert_array_equal(data.qfrc_passive, magnetic)
    assert abs(data.qacc - resting).max() > 0.1


def test_forces_do_not_double_inside_a_block_or_with_two_instances():
    expected = moved(needles())
    with mm.magnetism():
        np.testing.assert_array_equal(moved(needles()), expected)
    twice = needles(PLUGIN.format('<instance name="one"/><instance name="two"/>'))
    np.testing.assert_array_equal(moved(twice), expected)


def test_rollouts_and_batches_follow_mj_step():
    model = needles()
    expected = moved(model, 50)
    data = [mujoco.MjData(model) for _ in range(2)]
    start = np.tile(np.concatenate([[0.0], model.qpos0, np.zeros(model.nv)]), (4, 1))
    paths = np.tile([7.0, 3, 1, 0, 0], (4, 1, 1))
    states, _ = mujoco.rollout.rollout(
        model, data, start, paths, control_spec=int(mujoco.mjtState.mjSTATE_USERDATA), nstep=50
    )
    for replica in range(4):
        np.testing.assert_array_equal(states[replica, -1, 1:], expected)
    batches = pytest.importorskip("mujoco.batch", reason="new in MuJoCo 3.17")
    batch = batches.Batch(model, 4, 2)
    batch.userdata[:] = paths[:, 0]
    batch.step(nstep=50)
    np.testing.assert_array_equal(np.hstack([batch.qpos, batch.qvel]), np.tile(expected, (4, 1)))


def test_finite_differences_of_a_step_know_the_magnets():
    """`mjd_transitionFD` agrees with differences of `mj_step`; without magnets it does not."""
    model = needles(integrator="implicitfast")
    data = mujoco.MjData(model)
    size = 2 * model.nv
    found = {}
    for name, used in (("magnetic", model), ("plain", needles("", "implicitfast"))):
        found[name] = np.empty((size, size))
        mujoco.mjd_transitionFD(
            used, mujoco.MjData(used), 1e-6, True, found[name], None, None, None
        )
    differences = np.empty((size, size))
    for k in range(size):
        ends = []
        for sign in (1, -1):
            mujoco.mj_resetData(model, data)
            if k < model.nv:
                mujoco.mj_integratePos(model, data.qpos, 1e-5 * sign * np.eye(model.nv)[k], 1.0)
            else:
                data.qvel[k - model.nv] = 1e-5 * sign
            mujoco.mj_step(model, data)
            ends.append((data.qpos.copy(), data.qvel.copy()))
        change = np.empty(model.nv)
        mujoco.mj_differentiatePos(model, change, 1.0, ends[1][0], ends[0][0])
        differences[:, k] = np.concatenate([change, ends[0][1] - ends[1][1]]) / 2e-5
    scale = abs(differences).max()
    assert abs(found["magnetic"] - differences).max() < 1.5e-6 * scale  # measured: 5.4e-8
    assert abs(found["plain"] - differences).max() > 0.1 * scale  # measured: 1


@pytest.mark.parametrize("flag", ["spring", "damper"])
def test_one_disabled_flag_of_two_is_no_reason_to_warn(flag):
    """Warnings are errors."""
    text = NEEDLES.format(extension=MAGNETS, integrator="Euler")
    option = f'<option><flag {flag}="disable"/></option><option'
    model = mujoco.MjModel.from_xml_string(text.replace("<option", option, 1))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert abs(data.qfrc_passive).max() > 0


SLEEPERS = """
<mujoco>
  <option><flag sleep="enable"/></option>
  <extension><plugin plugin="magmotor.forces"><instance name="magnets"/></plugin></extension>
  <custom><text name="magmotor" data="dipoles potentials"/></custom>
  <worldbody>
    <geom type="plane" size="1 1 0.1"/>
    <site user="1" pos="0 0 -0.2"/>
    <body pos="0 0 0.05">
      <freejoint/>
      <geom type="box" size="0.05 0.05 0.05" mass="1"/>
      <site user="1e-3"/>
    </body>
    <body pos="1 0 1">
      <joint type="hinge" axis="0 0 1" frictionloss="1" user="0.1 0.1"/>
      <geom size="0.1"/>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.mark.filterwarnings("ignore:a sleeping body is not woken:UserWarning")
def test_forces_on_sleeping_bodies_do_not_add_up():
    """MuJoCo clears the passive forces only of those that are awake."""
    model = mujoco.MjModel.from_xml_string(SLEEPERS)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=400)
    np.testing.assert_array_equal(data.body_awake[1:], int(mujoco.mjtSleepState.mjS_ASLEEP))
    asleep = data.qfrc_passive.copy()
    assert abs(asleep[2]) > 1e-8
    assert abs(asleep[6]) > 0.05
    mujoco.mj_step(model, data, nstep=400)
    np.testing.assert_array_equal(data.qfrc_passive, asleep)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_an_error_in_a_step_leaves_the_stack_as_it_was(integrator):
    """Else later steps by RK4 would take all of their stages for later ones."""
    model = needles(integrator=integrator)
    data = mujoco.MjData(model)
    data.userdata[0] = -1
    with pytest.raises(mujoco.FatalError):
        mujoco.mj_step(model, data)
    assert data.pstack == 0
    mujoco.mj_resetData(model, data)
    data.userdata[0] = 7
    data.userdata[1] = 3
    mujoco.mj_step(model, data, nstep=200)
    np.testing.assert_array_equal(np.concatenate([data.qpos, data.qvel]), moved(model))


def run(program, folder, *path):
    """Output of a program in a new process, in which an installed entry point names the plugin."""
    metadata = folder / "installed-1.dist-info"
    metadata.mkdir()
    points = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["entry-points"]
    lines = [f"{name} = {value}" for name, value in points["mujoco.plugins"].items()]
    (metadata / "entry_points.txt").write_text("\n".join(["[mujoco.plugins]", *lines]))
    (metadata / "METADATA").write_text("Name: installed\nVersion: 1\n")
    where = os.pathsep.join([*map(str, path), str(folder), str(ROOT / "src")])
    return subprocess.run(
        [sys.executable, "-W", "error::RuntimeWarning", "-c", textwrap.dedent(program)],
        env={**os.environ, "PYTHONPATH": where}, capture_output=True, text=True, check=False,
    )  # fmt: skip


needs_entry_points = pytest.mark.skipif(
    int(mujoco.__version__.split(".")[0]) < 4, reason="MuJoCo 3 loads no entry points"
)


@needs_entry_points
def test_mujoco_alone_knows_the_plugin_and_compiles_nothing(tmp_path):
    program = f"""
    import sys
    import mujoco
    assert "magmotor_plugin" in sys.modules
    assert not {{"magmotor", "numba"}} & sys.modules.keys()
    path = {str(ROOT / "models" / "top_magnetic.xml")!r}
    model = mujoco.MjModel.from_xml_path(path)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=1000)
    print(repr(data.qpos.tolist()))
    """
    found = run(program, tmp_path)
    assert found.returncode == 0, found.stderr
    model = mujoco.MjModel.from_xml_path(str(ROOT / "models" / "top_magnetic.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=1000)
    assert found.stdout.strip() == repr(data.qpos.tolist())


@needs_entry_points
def test_binary_models_in_a_new_process(tmp_path):
    """Those that are invalid are errors for their first data, which load the plugin's code."""
    text = NEEDLES.format(extension=MAGNETS, integrator="Euler")
    model = mujoco.MjModel.from_xml_string(text.replace('"all"', '"couplings dipoles"'))
    right, wrong = tmp_path / "right.mjb", tmp_path / "wrong.mjb"
    mujoco.mj_saveModel(model, str(right), None)
    wrong.write_bytes(right.read_bytes().replace(b"couplings dipoles", b"couplings dipolez"))
    program = f"""
    import mujoco
    right = mujoco.MjModel.from_binary_path({str(right)!r})
    number = mujoco.MjModel.from_binary_path({str(right)!r})
    number.site_user[2] = float("inf")
    for model in (mujoco.MjModel.from_binary_path({str(wrong)!r}), number):
        for _ in range(2):
            try:
                mujoco.MjData(model)
                print("no error")
            except mujoco.FatalError as error:
                print(error)
    data = mujoco.MjData(right)
    mujoco.mj_forward(right, data)
    print(repr(data.qfrc_passive.tolist()))
    """
    found = run(program, tmp_path)
    assert found.returncode == 0, found.stderr
    sentence = "text 'magmotor' = 'couplings dipolez': must be one or more"
    assert found.stdout.count(sentence) == 2, found.stdout
    assert found.stdout.count("site 2 '': its only user number must be") == 2, found.stdout
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert abs(data.qfrc_passive).max() > 0
    assert found.stdout.splitlines()[-1] == repr(data.qfrc_passive.tolist())


def test_code_that_cannot_be_loaded_is_an_error(tmp_path, monkeypatch):
    """Never a model without forces."""
    monkeypatch.setenv("MAGMOTOR_LIBRARY", "0")
    (tmp_path / "broken" / "numba").mkdir(parents=True)
    (tmp_path / "broken" / "numba" / "__init__.py").write_text('raise ImportError("no numba here")')
    program = f"""
    import magmotor_plugin
    import mujoco
    magmotor_plugin.register()
    mujoco.MjModel.from_xml_path({str(ROOT / "models" / "top_magnetic.xml")!r})
    """
    found = run(program, tmp_path, tmp_path / "broken")
    assert found.returncode == 1
    _, error, reason = found.stderr.rpartition("ValueError: ")
    assert error, found.stderr
    assert "no numba here" in reason


@pytest.mark.skipif(
    int(mujoco.__version__.split(".")[0]) >= 4, reason="MuJoCo 4 registers the plugin itself"
)
def test_the_slot_does_not_depend_on_what_is_imported_first(tmp_path):
    """Else a binary model would name another plugin."""
    slots = set()
    for order in ("magmotor, mujoco", "mujoco, magmotor", "magmotor_plugin, mujoco, magmotor"):
        folder = tmp_path / order.replace(", ", "-")
        folder.mkdir()
        found = run(f"import {order}, magmotor_plugin as m; print(m.register())", folder)
        assert found.returncode == 0, found.stderr
        slots.add(int(found.stdout))
    assert len(slots) == 1
    assert slots.pop() > 0
