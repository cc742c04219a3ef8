"""Magnets in MuJoCo Warp: the same forces, fields, noise and motion as in C, world by world."""

import importlib
import warnings
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from refusals import refused

import magmotor as mm

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # of the compiler in Warp
    wp: Any = pytest.importorskip("warp")
    mujoco_warp: Any = pytest.importorskip("mujoco_warp")
    wp.config.log_level = wp.LOG_WARNING

from magmotor.warp import put_model

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
POSES = 20
MODELS = (
    "levitation", "top_magnetic", "top_plane_magnetic", "motor_magnetic", "motor_plane_magnetic",
    "disk_magnetic",
)  # fmt: skip

TABLE = mm.tabulated_field(
    lambda points: 0.01 * np.sin(3 * points[:, [1, 2, 0]] + 1), [-2, -2, -2], [2, 2, 2], (9, 8, 7),
    name="field_table",
)  # fmt: skip

EVERYTHING = f"""
<mujoco>
  <extension>
    <plugin plugin="magmotor.forces"><instance name="magnets"><config key="act"
      value="dipoles couplings noise potentials fields coils iron"/></instance></plugin>
    <plugin plugin="magmotor.magnetometer"/>
  </extension>
  <option timestep="0.004" integrator="RK4"><flag contact="disable"/></option>
  <size nuserdata="5"/>
  <custom>
    <numeric name="magnetic_constant" data="2e-4"/>
    <numeric name="field_even" data="0.01 -0.02 0.03"/>
    <numeric name="field_steep" data="0.01 0.02 -0.01 0.05 0.02 -0.03 0.04 0.01"/>
    {TABLE}
    <numeric name="steel" data="40"/>
    <tuple name="iron"><element objtype="numeric" objname="steel"/>
      <element objtype="geom" objname="floor"/></tuple>
    <tuple name="coupling"><element objtype="body" objname="ball" prm="1.7"/>
      <element objtype="body" objname="needle" prm="1.7"/></tuple>
    <tuple name="coupling of the world"><element objtype="body" objname="world" prm="0"/>
      <element objtype="body" objname="needle" prm="0"/></tuple>
    <tuple name="coil"><element objtype="actuator" objname="current" prm="0.8"/>
      <element objtype="site" objname="coil"/></tuple>
    <tuple name="coil of a body"><element objtype="actuator" objname="slow"/>
      <element objtype="body" objname="arm"/></tuple>
    <tuple name="field of the sled"><element objtype="numeric" objname="field_steep"/>
      <element objtype="body" objname="sled"/></tuple>
    <tuple name="field at a site"><element objtype="numeric" objname="field_table"/>
      <element objtype="site" objname="aside"/>
      <element objtype="actuator" objname="current" prm="0.5"/></tuple>
  </custom>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1" pos="0 0 -0.3" euler="5 10 0"/>
    <site name="fixed" pos="0 0 0.4" user="2"/>
    <site name="probe" pos="0.1 0.1 0.2" euler="20 30 40"/>
    <body name="frame" pos="0.5 0 0.2" mocap="true"><site pos="0 0.1 0" zaxis="1 1 0" user="1"/>
    </body>
    <body name="needle" user="0 0 0 0.01 0 0.02 0 0 0 0 0.03 0">
      <joint name="turn" axis="0 1 0" user="0.1 -0.2 0.05 0.3"/>
      <geom type="capsule" fromto="-0.05 0 0 0.05 0 0" size="0.01" mass="0.05"/>
      <site name="tip" pos="0.05 0 0" zaxis="1 0 0.3" user="1"/>
    </body>
    <body name="ball" pos="0.2 0.1 0.3" user="0 0 0 0 0 0 0.05 0.02 0 0 0.01 0">
      <freejoint/><geom size="0.02" mass="0.1"/>
      <site zaxis="0 1 1" user="1.5"/><site pos="0.01 0 0.02" zaxis="1 0 1" user="-0.8"/>
      <body name="arm" pos="0.1 0 0"><joint axis="1 0 1" pos="0 0.02 0"/>
        <geom size="0.01" pos="0.05 0 0" mass="0.03"/>
        <site pos="0.05 0 0" user="0.6"/><site pos="0.05 0.03 0" zaxis="1 1 1" user="0.4"/>
        <body pos="0.05 0 0.02"><geom size="0.01" mass="0.01"/><site user="0.3" zaxis="0 1 0"/>
        </body>
      </body>
    </body>
    <body name="sled" pos="-0.2 0.05 0.1">
      <joint type="slide" axis="1 0 0" user="0.2 0.1"/><joint type="slide" axis="0 1 1"/>
      <joint type="ball"/><geom type="box" size="0.02 0.03 0.01" mass="0.1"/>
      <site name="coil" zaxis="0 1 1" user="0.7"/><site name="aside" pos="0.06 0 0"/>
    </body>
  </worldbody>
  <actuator>
    <general name="current" site="coil" gainprm="0" ctrlrange="-1 1"/>
    <general name="slow" joint="turn" gainprm="0" dyntype="user" actdim="2"/>
  </actuator>
  <sensor>
    <clock/>
    <plugin plugin="magmotor.magnetometer" objtype="site" objname="probe"/>
    <plugin plugin="magmotor.magnetometer" objtype="site" objname="aside" cutoff="0.03"/>
  </sensor>
</mujoco>
"""

NEEDLES = """
<mujoco>
  <extension><plugin plugin="magmotor.forces"><instance name="magnets">
    <config key="act" value="{act}"/></instance></plugin></extension>
  <option timestep="0.005"/>
  {more}
  <worldbody>
    <site name="magnet" pos="0 0.1 0" zaxis="0 1 0" user="5"/>
    {world}
    <body name="needle" {body}>
      <joint axis="0 0 1" damping="1e-4"/>
      <geom type="capsule" fromto="-0.03 0 0 0.03 0 0" size="0.003"/>
      <site name="needle" zaxis="1 0 0" user="0.2"/>
    </body>
  </worldbody>
</mujoco>
"""

PIECE = '<geom name="core" size="0.01" pos="0 0 1" {}/>'
STEEL = """<custom><numeric name="steel" data="{}"/><tuple name="{}">
  <element objtype="numeric" objname="steel"/>
  <element objtype="{}" objname="{}"/></tuple></custom>"""
APART = """<site name="other" pos="0.25 0 0" user="1"/>
  <body name="ball" pos="0.25 0 0.2"><freejoint/><geom size="0.01"/><site user="1"/></body>"""


def needles(act="dipoles", more="", world="", body=""):
    return compiled(NEEDLES.format(act=act, more=more, world=world, body=body))


def compiled(text):
    return mujoco.MjModel.from_xml_string(text)


def states(model, seed=1):
    """The data of random poses, with other controls, and other steps of other paths of noise."""
    rng = np.random.default_rng(seed)
    found = []
    for k in range(POSES):
        data = mujoco.MjData(model)
        mujoco.mj_integratePos(model, data.qpos, rng.normal(0, 0.05, model.nv), 1.0)
        data.ctrl[:], data.act[:] = rng.uniform(-2, 2, model.nu), rng.uniform(-2, 2, model.na)
        data.time = 3 * k * model.opt.timestep
        if model.nuserdata:
            data.userdata[:] = 7, k, 1, 0, 1000
        found.append(data)
    return found


def worlds(m, model, data):
    """One world for each mjData."""
    d = mujoco_warp.make_data(model, nworld=len(data))
    for name in ("qpos", "qvel", "ctrl", "act", "time"):
        getattr(d, name).assign(np.array([getattr(each, name) for each in data]))
    if m.magmotor.noise:
        m.magmotor.noise.paths = np.array([each.userdata for each in data])
    return d


def largest_error(found, expected):
    """Of numbers of any worlds: each over the largest of its column, or a hundredth of any."""
    largest = np.abs(expected).max(axis=0)
    return (np.abs(found - expected) / np.maximum(largest, 0.01 * largest.max())).max()


def compared(model):
    """The largest errors of forces and sensor data, the model and the worlds."""
    data = states(model)
    for each in data:
        mujoco.mj_forward(model, each)
    m = put_model(model)
    d = worlds(m, model, data)
    mujoco_warp.forward(m, d)
    names = ("qfrc_passive", "sensordata") if model.nsensordata else ("qfrc_passive",)
    return (
        {
            name: largest_error(
                getattr(d, name).numpy(), np.array([getattr(e, name) for e in data])
            )
            for name in names
        },
        m,
        d,
    )


@pytest.mark.parametrize("name", MODELS)
def test_forces_are_those_of_the_plugin(name):
    model = mujoco.MjModel.from_xml_path(str(ROOT / "models" / f"{name}.xml"))
    errors, _, _ = compared(model)
    assert errors["qfrc_passive"] < 3e-6  # 1.2e-6
    assert errors.get("sensordata", 0.0) < 3e-6  # 3.0e-7


def test_forces_and_sensors_of_one_model_with_everything():
    errors, m, d = compared(compiled(EVERYTHING))
    assert errors["qfrc_passive"] < 3e-6  # 8.8e-7
    assert errors["sensordata"] < 3e-6  # 7.4e-7
    measured = np.abs(d.sensordata.numpy()[:, 4:])
    assert measured.max() == np.float32(0.03)  # the cutoff
    assert measured.min() < 0.03
    before = d.sensordata.numpy().copy()
    m.callback.sensor(m, d, mujoco.mjtStage.mjSTAGE_ACC)
    assert (d.sensordata.numpy() == before).all()


def test_a_model_with_everything_moves_as_in_c():
    """With the noise of the same steps, also in the later stages of RK4."""
    model = compiled(EVERYTHING)
    m, data = put_model(model), states(model)
    d = worlds(m, model, data)
    start = d.qpos.numpy().copy()
    for _ in range(10):
        mujoco_warp.step(m, d)
        for each in data:
            mujoco.mj_step(model, each)
    expected = np.array([each.qpos for each in data])
    assert (np.abs(expected - start).max(axis=0) > 1e-3).all()
    assert np.abs(d.qpos.numpy() - expected).max() < 1e-4  # 4.0e-6


def captured(m, d):
    """A graph of a step of data whose kernels are loaded; it has not been launched."""
    m.magmotor.prepare(d)
    with wp.ScopedCapture() as capture:
        mujoco_warp.step(m, d)
    return capture.graph


def test_the_top_acquires_the_same_spin():
    """The paper's case 4; MuJoCo's disabled springs and dampers do not disable the hook."""
    model = mm.build(mm.Top.paper(4))
    model.opt.timestep, model.opt.integrator = 0.025, mujoco.mjtIntegrator.mjINT_RK4
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    m, d = put_model(model), mujoco_warp.put_data(model, data)
    m.opt.tolerance.fill_(0.0)
    m.opt.warn_overflow = 0  # one iteration is enough for the exact solution
    mujoco_warp.step(m, d)
    d = mujoco_warp.put_data(model, data)
    graph, spins = captured(m, d), []
    with mm.magnetism():
        for _ in range(2400):
            wp.capture_launch(graph)
            mujoco.mj_step(model, data)
            spins.append((d.qvel.numpy()[0, -1], data.qvel[-1]))
    found, expected = np.abs(spins).T
    peak = found.argmax()
    assert found[peak] == pytest.approx(7.169, abs=5e-4)
    assert 0.025 * (peak + 1) == pytest.approx(21.62, abs=0.03)
    assert np.abs(found - expected).max() < 1e-4  # rad/s; 7.1e-6


def test_a_coil_holds_a_magnet_for_a_while_as_in_c():
    model = mujoco.MjModel.from_xml_path(str(ROOT / "models" / "levitation.xml"))
    data = mujoco.MjData(model)
    data.ctrl[0] = 2.0
    m, d = put_model(model), mujoco_warp.put_data(model, data, nworld=2)
    heights = []
    for _ in range(50):
        mujoco_warp.step(m, d)
        mujoco.mj_step(model, data)
        heights.append((d.qpos.numpy()[1, 2], data.qpos[2]))
    found, expected = np.array(heights).T
    assert np.ptp(expected) > 1e-3  # m
    assert np.abs(found - expected).max() < 3e-6 * np.ptp(expected)  # 2.2e-7


def test_a_captured_graph_replays_to_the_bit():
    model = compiled(EVERYTHING)
    m, start = put_model(model), states(model)
    names = ("qpos", "qvel", "act", "time", "sensordata")

    def steps(step, d):
        found = []
        for _ in range(8):
            step()
            found.append(np.hstack([getattr(d, name).numpy().reshape(POSES, -1) for name in names]))
        return np.array(found)

    d, other = worlds(m, model, start), worlds(m, model, start)
    eager = steps(lambda: mujoco_warp.step(m, d), d)
    graph = captured(m, other)
    replayed = steps(lambda: wp.capture_launch(graph), other)
    assert np.isfinite(eager).all()
    assert (np.ptp(eager, axis=0) > 0).all(axis=0).sum() > 30  # of 43 columns
    assert (replayed == eager).all()


def test_arrays_must_be_made_before_a_capture():
    model = needles()
    m, d = put_model(model), mujoco_warp.make_data(model)
    with pytest.raises(RuntimeError, match="step d once, or call"), wp.ScopedCapture():
        mujoco_warp.step(m, d)


SLIDE = """
<mujoco>
  <extension><plugin plugin="magmotor.forces"><instance name="noise">
    <config key="act" value="noise"/></instance></plugin></extension>
  <option timestep="0.0005" gravity="0 0 0" integrator="{integrator}"/>
  <worldbody><body user="0.5 0 0 0 0 0 0 2 0 0 0 0">
    <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
    <geom size="0.1" mass="1"/>
  </body></worldbody>
</mujoco>
"""
AMPLITUDES = np.array([0.5, 2.0])


def slid(integrator="RK4", path=None, nworld=3):
    """A body on which two channels of noise act along two axes."""
    model = compiled(SLIDE.format(integrator=integrator))
    return put_model(model, path), mujoco_warp.make_data(model, nworld=nworld)


def drawn(m, d, steps):
    """Increments by the forces in some steps, shape (steps, worlds, channels)."""
    h, found = m.opt.timestep.numpy()[0], []
    for _ in range(steps):
        mujoco_warp.step(m, d)
        found.append(d.qfrc_passive.numpy() / AMPLITUDES * h)
    return np.array(found)


def increments(path, steps, first=0, replicas=3):
    """The same by the path itself, of replicas in place of worlds."""
    columns = [
        [path.increments(steps, first=first, replica=r, channel=c) for c in range(2)]
        for r in range(replicas)
    ]
    return np.transpose(columns, (2, 0, 1))


WHITE = mm.noise.BrownianPath(seed=2**52 + 12345, timestep=0.0005)


@pytest.mark.parametrize(
    "path",
    [
        WHITE,
        mm.noise.BrownianPath(5, 0.000125).coarsened(4),
        mm.noise.BrownianPath(5, 0.004).refined(3),
        WHITE.held(3),
        WHITE.held(2, window=5),
    ],
    ids=["white", "coarsened", "refined", "held", "with a window"],
)
@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
def test_noise_has_the_numbers_of_the_path_in_each_step(path, integrator):
    found = drawn(*slid(integrator, path), 9)
    expected = increments(path, 9)
    assert np.abs(found / expected - 1).max() < 1e-6  # 1.2e-7, of single precision


def test_a_step_that_is_computed_again_has_the_same_noise():
    m, d = slid(path=WHITE)
    before = drawn(m, d, 3)
    mujoco_warp.forward(m, d)
    mujoco_warp.forward(m, d)
    after = drawn(m, d, 3)
    mujoco_warp.reset_data(m, d)
    again = drawn(m, d, 6)
    assert (again == np.concatenate([before, after])).all()


def test_worlds_may_follow_other_paths_from_other_steps():
    m, d = slid()
    other = mm.noise.BrownianPath(9, 0.0005)
    m.magmotor.noise.paths = [[*(WHITE.seed, 2), 1, 0, 0], [9, 0, 1, 0, 10**12], [9, 1, 1, 0, 4]]
    found = drawn(m, d, 4)
    expected = (
        increments(WHITE, 4)[:, 2], increments(other, 4, 10**12)[:, 0],
        increments(other, 4, 4)[:, 1],
    )  # fmt: skip
    assert found == pytest.approx(np.stack(expected, axis=1), rel=1e-6)


def test_steps_are_counted_where_single_precision_cannot_tell_them_apart():
    """At 500 s, a step of 0.5 ms takes 0.488 ms: the time is two steps late after a hundred."""
    m, d = slid(path=WHITE)
    d.time.fill_(500.0)
    found = drawn(m, d, 100)
    assert found == pytest.approx(increments(WHITE, 100, 1_000_000), rel=1e-6)
    assert d.time.numpy()[0] < 500.05 - 2 * 0.0005


def test_noise_is_nan_where_time_stands_still():
    m, d = slid()
    d.time.assign(np.array([0.0, 20000.0, 0.0], np.float32))
    found = drawn(m, d, 1)[0]
    assert (np.isnan(found).all(axis=1) == [False, True, False]).all()


def test_worlds_may_have_other_numbers():
    """Each world as a model in C with these numbers; world 2 takes those of world 0 again."""
    model = compiled(EVERYTHING)
    m, data = put_model(model), states(model)[:3]
    magnets, d = m.magmotor, worlds(m, model, data)
    magnets.noise.paths = np.array([data[k % 2].userdata for k in range(2)])
    rng = np.random.default_rng(2)
    copies = [compiled(EVERYTHING) for _ in range(2)]

    sites = magnets.dipoles.sites
    moments = np.tile(model.site_user[sites, 0], (2, 1)) * rng.uniform(0.5, 1.5, (2, len(sites)))
    for copy, new in zip(copies, moments, strict=True):
        copy.site_user[sites, 0] = new
    magnets.dipoles.moments = moments
    for name, field in magnets.fields.items():
        numbers = np.tile(model.numeric(name).data, (2, 1))
        numbers[1, 9 * (name == "field_table") :] *= 1.3
        copies[1].numeric(name).data[:] = numbers[1]
        field.numbers = numbers
    joints = magnets.potentials.joints
    waves = model.jnt_user[joints][None] * rng.uniform(0.5, 1.5, (2, len(joints), 4))
    for copy, new in zip(copies, waves, strict=True):
        copy.jnt_user[joints] = new
    magnets.potentials.waves = waves
    rows = magnets.noise.rows.numpy() * rng.uniform(0.5, 1.5, (2, 3, 6))
    for copy, new in zip(copies, rows, strict=True):
        acting = copy.body_user.reshape(copy.nbody, -1, 6)
        acting[acting.any(axis=2)] = new
    magnets.noise.rows = rows
    mujoco_warp.forward(m, d)
    expected = []
    for k, each in enumerate(data):
        each.userdata[:] = data[k % 2].userdata
        mujoco.mj_forward(copies[k % 2], each)
        expected.append(np.concatenate([each.qfrc_passive, each.sensordata[1:]]))
    found = np.hstack([d.qfrc_passive.numpy(), d.sensordata.numpy()[:, 1:]])
    assert largest_error(found, np.array(expected)) < 5e-6  # 1.1e-6


def errors_at(places, model):
    """The largest error of forces where a ball, in each world elsewhere, is a magnet."""
    m, d = put_model(model), mujoco_warp.make_data(model, nworld=len(places))
    d.qpos.assign(np.array([[*place, 1, 0, 0, 0, 0] for place in places]))
    mujoco_warp.forward(m, d)
    expected = []
    for place in places:
        data = mujoco.MjData(model)
        data.qpos[:3] = place
        mujoco.mj_forward(model, data)
        expected.append(data.qfrc_passive)
    return largest_error(d.qfrc_passive.numpy(), np.array(expected))


def test_tables_are_interpolated_up_to_their_edges():
    """The outermost cells are most of this table."""
    waves = np.array([[2, 1, -1], [1, -2, 2], [-1, 1, 2]])
    table = mm.tabulated_field(lambda x: np.sin(x @ waves), [-1] * 3, [1] * 3, (4, 5, 6))
    places = np.random.default_rng(3).uniform(-0.25, 0.25, (POSES, 3))
    places = np.where(places > 0, 0.75 + places, -0.75 + places)
    places[:4] = np.linspace([-1, -1, -1], [1, 1, 1], 4)  # with two corners, which count as inside
    model = needles("dipoles fields", f"<custom>{table}</custom>", APART)
    assert errors_at(places, model) < 3e-6  # 4.8e-7


def test_a_plane_of_iron_pulls_as_in_c():
    plane = '<geom name="p" type="plane" size="1 1 1" pos="0 0 -.05" euler="0 20 0"/>'
    model = needles("dipoles iron", STEEL.format("9", "iron", "geom", "p"), plane + APART)
    places = np.random.default_rng(4).uniform([0.1, -0.2, 0.1], [0.3, 0.2, 0.2], (POSES, 3))
    assert errors_at(places, model) < 3e-6  # 4.9e-7


def test_numbers_of_another_shape_are_refused():
    magnets = put_model(compiled(EVERYTHING)).magmotor
    moments = magnets.dipoles.moments
    for wrong in (np.ones(9), np.ones((2, 10)), np.ones((0, 9)), wp.zeros((1, 9), dtype=int)):
        with refused("shape of moments"):
            magnets.dipoles.moments = wrong
    assert magnets.dipoles.moments is moments
    with refused("shape of rows"):
        magnets.noise.rows = np.ones((1, 3))
    with pytest.raises(mm.ArgumentError, match=r"\(1, 3\): must be \(1 or nworld, 3, 6\), of "):
        magnets.noise.rows = np.ones((1, 3))
    with refused("shape of numbers"):
        magnets.fields["field_even"].numbers = np.ones((4, 8))
    magnets.noise.rows = wp.ones((4, 3), dtype=wp.spatial_vector)


@pytest.mark.parametrize(
    ("act", "more", "world", "height", "freedoms"),
    [
        ("dipoles", "", APART, 0.0, 6),
        ("dipoles", "", APART, 5e-10, 6),
        (
            "dipoles fields",
            f"<custom>{mm.tabulated_field(abs, [-1, -1, -1], [1, 1, 1], (4, 4, 4))}</custom>",
            APART,
            1.1,
            6,
        ),
        (
            "dipoles iron",
            STEEL.format("9", "iron", "geom", "p"),
            f'<geom name="p" type="plane" size="1 1 1" pos="0 0 -.5"/>{APART}',
            -0.6,
            7,
        ),
    ],
    ids=["coincident", "nearly coincident", "outside", "below"],
)
def test_what_is_an_error_in_c_is_nan_in_that_world(act, more, world, height, freedoms):
    """Below the plane, also the forces on all others are."""
    model = needles(act, more, world)
    m, d = put_model(model), mujoco_warp.make_data(model, nworld=3)
    qpos = d.qpos.numpy()
    qpos[1, 2] = height
    d.qpos.assign(qpos)
    mujoco_warp.forward(m, d)
    assert np.isnan(d.qfrc_passive.numpy()).sum(axis=1).tolist() == [0, freedoms, 0]
    data = mujoco.MjData(model)
    data.qpos[:] = qpos[1]
    with pytest.raises(mujoco.FatalError):
        mujoco.mj_forward(model, data)


def test_dipoles_that_a_coupling_turns_off_may_coincide():
    off = """<custom><tuple name="coupling"><element objtype="body" objname="world" prm="0"/>
      <element objtype="body" objname="ball" prm="0"/></tuple></custom>"""
    d = mujoco_warp.make_data(model := needles("dipoles couplings", off, APART))
    d.qpos.assign(np.array([[0.25, 0, 0, 1, 0, 0, 0, 0]]))
    mujoco_warp.forward(put_model(model), d)
    assert np.isfinite(d.qfrc_passive.numpy()).all()


COIL = """<custom><tuple name="coil"><element objtype="actuator" objname="current"/>
  <element objtype="site" objname="magnet"/></tuple></custom>
  <actuator><general name="current" site="magnet" gainprm="0" group="3" {more}/></actuator>"""


def torques(model, *controls):
    """The torque on the needle in worlds with these controls of a coil."""
    m, d = put_model(model), mujoco_warp.make_data(model, nworld=len(controls))
    d.ctrl.assign(np.array(controls, np.float32)[:, None])
    mujoco_warp.forward(m, d)
    return d.qfrc_passive.numpy()[:, 0]


def test_coils_are_off_with_their_actuators():
    model = needles("dipoles coils", COIL.format(more=""))
    whole = torques(model, 1.0, -0.5)
    assert whole[0] == pytest.approx(-2 * whole[1])
    assert whole[0] > 1e-5
    model.opt.disableactuator = 1 << 3
    assert not torques(model, 1.0).any()
    model.opt.disableactuator = 1 << 2
    assert torques(model, 1.0)[0] == whole[0]
    model.opt.disableflags = mujoco.mjtDisableBit.mjDSBL_ACTUATION
    assert not torques(model, 1.0).any()


def test_a_bad_control_concerns_its_world_and_ranges_clamp():
    model = needles("dipoles coils", COIL.format(more='ctrlrange="-1 1"'))
    found = torques(model, 1.0, np.nan, 5.0)
    assert np.isnan(found).tolist() == [False, True, False]
    assert found[0] == found[2]
    model.opt.disableflags = mujoco.mjtDisableBit.mjDSBL_CLAMPCTRL
    assert torques(model, 5.0)[0] == pytest.approx(5 * found[0])


def test_a_control_callback_drives_what_is_measured_at_once_and_forces_in_the_next_step():
    model = mujoco.MjModel.from_xml_path(str(ROOT / "models" / "levitation.xml"))
    model.actuator_dyntype[:] = mujoco.mjtDyn.mjDYN_NONE
    model.actuator_actnum[:] = 0
    m, d = put_model(model), mujoco_warp.make_data(model)
    m.callback.control = lambda m, d: d.ctrl.fill_(3.0)
    seen = []
    for _ in range(2):
        mujoco_warp.forward(m, d)
        seen.append((d.sensordata.numpy()[0, 2], d.qfrc_passive.numpy()[0, 2]))
    (early, none), (late, force) = seen
    assert early == late != 0
    assert none == 0
    assert force > 0.01


def test_steps_allocate_nothing_and_read_nothing_back(monkeypatch):
    model = compiled(EVERYTHING)
    m, d = put_model(model), mujoco_warp.make_data(model)
    m.magmotor.prepare(d)

    def forbidden(*_, **__):
        raise AssertionError

    for name in ("array", "clone", "copy", "empty", "full", "ones", "zeros", "synchronize"):
        monkeypatch.setattr(wp, name, forbidden)
    monkeypatch.setattr(type(d.qpos), "numpy", forbidden)
    m.callback.passive(m, d)
    m.callback.sensor(m, d, mujoco.mjtStage.mjSTAGE_ACC)


def test_two_models_may_step_the_same_worlds_in_turn():
    """The second one has more dipoles, and needs more room."""
    more = "".join(f'<site user="{{0}}" pos="0 {k} 1"/>' for k in range(1, 5))
    few, many = (needles(world=more.format(moment)) for moment in (0, 3))
    d, expected = mujoco_warp.make_data(few), []
    for model in (few, many):
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        expected.append(data.qfrc_passive[0])
    for _ in range(2):
        for model, torque in zip((few, many), expected, strict=True):
            mujoco_warp.forward(put_model(model), d)
            assert d.qfrc_passive.numpy()[0, 0] == pytest.approx(torque, rel=1e-6)


def test_a_model_with_a_mark_and_without_the_plugin_acts():
    text = NEEDLES.format(act="dipoles", more="", world="", body="")
    first, last = text.index("<extension>"), text.index("</extension>") + len("</extension>")
    mark = '<custom><text name="magmotor" data="dipoles"/></custom>'
    m = put_model(compiled(text[:first] + mark + text[last:]))
    d = mujoco_warp.make_data(needles())
    mujoco_warp.forward(m, d)
    plugin = put_model(needles())
    other = mujoco_warp.make_data(needles())
    mujoco_warp.forward(plugin, other)
    assert d.qfrc_passive.numpy()[0, 0] == other.qfrc_passive.numpy()[0, 0] != 0


def saved(model):
    buffer = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return buffer.tobytes()


def test_the_model_is_left_as_it_is():
    model = mujoco.MjModel.from_xml_path(str(ROOT / "models" / "levitation.xml"))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_MIDPHASE
    before = saved(model)
    m = put_model(model, batch_sizes={"geom_size": 3})
    assert m.geom_size.shape[0] == 3
    assert saved(model) == before
    mujoco.mj_step(model, mujoco.MjData(model))


def flagged(flags, enabled: Any = 0):
    model = needles()
    model.opt.disableflags |= flags
    model.opt.enableflags |= enabled
    return model


PLATE = '<geom name="plate" type="plane" size="1 1 1" pos="0 0 -1"/>'
SPRING, DAMPER = mujoco.mjtDisableBit.mjDSBL_SPRING, mujoco.mjtDisableBit.mjDSBL_DAMPER
IN_C = "step the model with mujoco.mj_step"
NOTHING = """nothing of magmotor acts on the model: use mujoco_warp.put_model, or see what\
 magmotor.describe(model) says"""
REFUSED = {
    "magmotor.warp has no iron but planes, which geom 'core' is not: " + IN_C: lambda: needles(
        "dipoles iron", STEEL.format("9", "iron", "geom", "core"), PIECE.format("")
    ),
    f"magmotor.warp has no magnets by their geom, such as geom 'core': {IN_C}, or let sites be"
    " dipoles, as those of magmotor.magnet": lambda: needles(
        "dipoles magnets", world=PIECE.format('user="0 0 1"')
    ),
    "magmotor.warp has no conductors, such as geom 'plate': " + IN_C: lambda: needles(
        "dipoles conductors", STEEL.format("1e7", "conductor", "geom", "plate"), PLATE
    ),
    "magmotor.warp has no hysteresis, as that of site 'needle': " + IN_C: lambda: needles(
        "dipoles hysteresis", STEEL.format("9 .2", "hysteresis", "site", "needle")
    ),
    "magmotor.warp needs the flag spring or damper: MuJoCo Warp computes no passive forces, among"
    " which are those of magmotor, while both are disabled": lambda: flagged(SPRING | DAMPER),
    "magmotor.warp supports no plugins but its own: " + IN_C: lambda: needles(
        more="""<extension><plugin plugin="mujoco.pid"><instance name="pid"/></plugin></extension>
          <actuator><plugin plugin="mujoco.pid" instance="pid" site="magnet"/></actuator>"""
    ),
    "magmotor.warp does not wake bodies that sleep: do not enable the flag sleep, or "
    + IN_C: lambda: flagged(0, mujoco.mjtEnableBit.mjENBL_SLEEP),
    "site 1 'needle': its only user number must be its moment in A m^2, which must be finite; the"
    " direction is its z axis": lambda: changed_moment(np.nan),
    NOTHING: lambda: compiled("<mujoco><worldbody><site user='1'/></worldbody></mujoco>"),
}


def changed_moment(moment):
    model = needles()
    model.site("needle").user[0] = moment
    return model


@pytest.mark.parametrize("sentence", REFUSED)
def test_what_is_not_supported_is_refused(sentence):
    with pytest.raises(mm.InputError) as error:
        put_model(REFUSED[sentence]())
    assert str(error.value) == sentence


def test_a_model_without_anything_magnetic_is_refused():
    with pytest.raises(mm.InputError, match="nothing of magmotor acts"):
        put_model(
            compiled(
                "<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody></mujoco>"
            )
        )


def test_only_models_are_put():
    path: Any = "needle.xml"
    with refused("model"):
        put_model(path)
    with refused("timestep of path"):
        put_model(needles("all", body='user="0 0 0 0 0 1"'), mm.noise.BrownianPath(1, 0.1))


def test_kernels_compile_for_gpus(tmp_path):
    """Without one: the compiler of CUDA is a part of Warp for Linux and Windows."""
    if not wp.get_cuda_supported_archs():
        pytest.skip("this Warp has no compiler for GPUs")
    names = ("bodies", "dipoles", "drives", "fields", "magnetometers", "mirrors", "noise",
             "potentials")  # fmt: skip
    for name in names:
        module = importlib.import_module(f"magmotor.warp.{name}")
        wp.compile_aot_module(module, arch=75, module_dir=tmp_path, use_ptx=True)
    assert len([*tmp_path.glob("*.ptx")]) == len(names)
