"""The compiled callback has the same wrench as its NumPy twin for any model, version and thread."""

import copy
import ctypes
import inspect
import pickle
import re
import threading
import warnings

import mujoco
import mujoco.batch
import mujoco.rollout
import numpy as np
import pytest
from numba.core.ccallback import CFunc
from refusals import misdeclared

import magmotor as mm
from magmotor.mjcf import callbacks, error_raising, layout
from magmotor.numerics import c_types, dependencies
from magmotor.numerics.compiled_once import compiled_once
from trials.numpy_twin import apply_magnetism

MARK = '<custom><text name="magmotor" data="dipoles couplings"/></custom>'

COMPASSES = f"""
<mujoco>
  {MARK}
  <option gravity="0 0 0"/>
  <worldbody>
    <site name="plain" pos="1 0 0"/>
    <site name="fixed" pos="0.3 0.1 0.2" zaxis="1 2 3" user="7"/>
    <body name="needle" pos="0 0.1 0">
      <joint type="hinge" axis="0 0 1"/>
      <geom type="box" size="0.1 0.01 0.01" pos="0.02 0 0"/>
      <site name="needle" pos="0.05 0 0" zaxis="1 0 0" user="4"/>
      <body name="tail" pos="-0.1 0 0">
        <geom size="0.01"/>
        <site name="tail" zaxis="0 1 1" user="-2"/>
      </body>
      <body name="arm" pos="0.2 0 0">
        <joint type="ball"/>
        <geom type="capsule" size="0.01 0.05"/>
        <site name="arm" pos="0 0 0.05" user="3"/>
      </body>
    </body>
    <body name="free" pos="0 -0.2 0.1">
      <freejoint/>
      <geom size="0.05"/>
      <site name="unused" user="0"/>
      <site name="free" pos="0.01 0.02 0" zaxis="-1 0 1" user="5"/>
    </body>
    <body name="ring" mocap="true" pos="0 0 0.3">
      <site name="ring0" pos="0.2 0 0" user="2"/>
      <site name="ring1" pos="-0.2 0 0" user="2"/>
    </body>
  </worldbody>
</mujoco>
"""


def chain(count):
    """A model of `count` fixed dipoles and three free ones."""
    rng = np.random.default_rng(count)
    fixed = "".join(
        f'<site pos="{x} {y} {z}" zaxis="{a} {b} 1" user="3"/>'
        for x, y, z, a, b in rng.normal(size=(count, 5))
    )
    free = "".join(
        f'<body pos="{i} 3 0"><freejoint/><geom size="0.1"/><site user="2" pos="0 0.1 0"/></body>'
        for i in range(3)
    )
    return f"<mujoco>{MARK}<worldbody>{fixed}{free}</worldbody></mujoco>"


def coupling(name, *bodies, prm=(2, 2), objtype="body"):
    """A tuple of two bodies, with a factor for each."""
    elements = "".join(
        f'<element objtype="{objtype}" objname="{body}" prm="{factor}"/>'
        for body, factor in zip(bodies, prm, strict=False)
    )
    return f'<custom><tuple name="{name}">{elements}</tuple></custom>'


def motor(custom=""):
    """A ball above a plane, and two rings of dipoles, one of which can rotate about its center."""

    def ring(name, count, radius):
        return "".join(
            f'<site name="{name}{i}" pos="{radius * x} {radius * y} 0" zaxis="{x} {y} 0.3"'
            ' user="1"/>'
            for i in range(count)
            for x, y in [(np.cos(2 * np.pi * i / count), np.sin(2 * np.pi * i / count))]
        )

    return f"""
    <mujoco>
      {MARK}{custom}
      <worldbody>
        <body name="ball" pos="0.1 0.05 -0.7">
          <joint type="slide" axis="1 0 0"/>
          <joint type="slide" axis="0 1 0"/>
          <joint type="ball"/>
          <geom size="0.3"/>
          <site name="ball" user="1"/>
        </body>
        <body name="ring" euler="10 20 0">
          <joint type="ball"/>
          <inertial pos="0 0 0.1" mass="3" diaginertia="1.6875 1.6875 3.375"/>
          {ring("ring", 20, 1.0)}
        </body>
        <body name="outer">{ring("outer", 5, 1.6)}</body>
      </worldbody>
    </mujoco>"""


def random_tree(seed, isolated=False):
    """Bodies with 0 to 40 dipoles each; some welded to their parents, some unable to move.

    Sites of a rigid body do not follow each other where a jointed child comes between. All bodies
    are free and nothing else is there if `isolated`.
    """
    rng = np.random.default_rng(seed)
    names = ["world"]

    def sites():
        count = rng.choice([0, 1, 1, 2, 5, 8, 15, 16, 17, 24, 40])
        return "".join(
            f'<site pos="{x} {y} {z}" zaxis="{a} {b} {c}" user="{m}"/>'
            for x, y, z, a, b, c, m in rng.normal(size=(count, 7)) * np.repeat([0.5, 1], [3, 4])
        )

    def body(depth):
        names.append(f"body{len(names)}")
        head = f'<body name="{names[-1]}" pos="{" ".join(map(str, rng.normal(size=3)))}">'
        joints = ["<freejoint/>"] if isolated else ["", "", '<joint type="ball"/>']
        joint = rng.choice(joints if depth or isolated else [*joints, "<freejoint/>"])
        children = (
            "" if isolated else "".join(body(depth + 1) for _ in range(rng.poisson(0.9**depth)))
        )
        return f'{head}{joint}<geom size="0.1" pos="0.1 0 0.2"/>{sites()}{children}</body>'

    bodies = "".join(body(0) for _ in range(7))
    pairs = rng.choice(names[isolated:], size=(12, 2))
    factors = rng.choice([0, 0.5, -1.5, 2], size=12)
    custom = "".join(
        coupling(f"coupling{k}", *pair, prm=(factor, factor))
        for k, (pair, factor) in enumerate(zip(pairs, factors, strict=True))
    )
    fixed = "" if isolated else sites()
    custom = custom if seed % 2 else ""
    overlap = '<option><flag contact="disable"/></option>'
    return f"<mujoco>{overlap}{MARK}{custom}<worldbody>{fixed}{bodies}</worldbody></mujoco>"


def wrenches(model, data):
    """Wrenches by the callback and by the twin, in the same state."""
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    compiled = data.xfrc_applied.copy()
    apply_magnetism(model, data)
    twin = data.xfrc_applied.copy()
    data.xfrc_applied[:] = 0  # the next block would warn of the twin's wrenches
    return compiled, twin


@pytest.mark.parametrize("seed", range(5))
def test_any_model_gets_the_wrench_of_the_twin(seed):
    model = mujoco.MjModel.from_xml_string(COMPASSES)
    data = mujoco.MjData(model)
    rng = np.random.default_rng(seed)
    data.qpos[:] += 0.1 * rng.normal(size=model.nq)
    data.qvel[:] = rng.normal(size=model.nv)
    compiled, twin = wrenches(model, data)
    assert np.abs(twin).max() > 0
    assert apart(compiled, twin) < 2e-14  # measured: 1.2e-15
    still = [model.body(name).id for name in ("world", "ring")]
    assert not compiled[still].any()
    data.xfrc_applied[still] = 1
    assert (wrenches(model, data)[0][still] == 1).all()


def apart(wrench, twin):
    """Largest difference of forces or torques, relative to the largest."""
    forces, torques = (
        np.abs(wrench - twin)[:, part].max() / np.abs(twin[:, part]).max()
        for part in (slice(0, 3), slice(3, 6))
    )
    return max(forces, torques)


@pytest.mark.parametrize("count", [1, 7, 8, 15, 16, 17, 61, 128, 200])
def test_any_number_of_dipoles(count):
    model = mujoco.MjModel.from_xml_string(chain(count))
    compiled, twin = wrenches(model, mujoco.MjData(model))
    assert apart(compiled, twin) < 5e-14  # measured: 2e-15


def test_a_dipole_may_lie_at_the_origin():
    model = mujoco.MjModel.from_xml_string(chain(17))
    data = mujoco.MjData(model)
    data.qpos[:3] = 0, -0.1, 0
    compiled, twin = wrenches(model, data)
    assert apart(compiled, twin) < 5e-15  # measured: 3e-16


@pytest.mark.filterwarnings("ignore:.*mm.check.model. proposes:UserWarning")
@pytest.mark.parametrize("seed", range(24))
def test_any_tree_of_bodies(seed):
    """With couplings if the seed is odd."""
    model = mujoco.MjModel.from_xml_string(random_tree(seed))
    compiled, twin = wrenches(model, mujoco.MjData(model))
    assert np.count_nonzero(model.site_user) > 64
    assert apart(compiled, twin) < 5e-14  # measured: 2.3e-15


@pytest.mark.parametrize("seed", range(8))
def test_total_wrench_of_an_isolated_system_vanishes(seed):
    """Newton's third law for forces and torques; with couplings if the seed is odd."""
    model = mujoco.MjModel.from_xml_string(random_tree(seed, isolated=True))
    data = mujoco.MjData(model)
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    force, torque = data.xfrc_applied[:, :3], data.xfrc_applied[:, 3:]
    about = torque + np.cross(data.xipos, force)
    assert np.abs(force.sum(axis=0)).max() < 2e-14 * np.abs(force).max()  # measured: 9e-16
    assert np.abs(about.sum(axis=0)).max() < 2e-14 * np.abs(about).max()  # measured: 1.3e-15


@pytest.mark.parametrize("pair", [("ball", "ring"), ("outer", "ring"), ("ball", "outer")])
@pytest.mark.parametrize("factor", [0.0, 1.0, 2.0])
def test_a_coupling_scales_what_two_bodies_do_to_one_another(pair, factor):
    plain, none, coupled = (
        mujoco.MjModel.from_xml_string(motor(custom))
        for custom in (
            "",
            coupling("coupling of two", *pair, prm=(0, 0)),
            coupling("coupling of two", *pair, prm=(factor, factor)),
        )
    )
    data = mujoco.MjData(plain)
    compiled, twin = wrenches(coupled, data)
    assert apart(compiled, twin) < 2e-14  # measured: 1e-15
    without, full = wrenches(none, data)[0], wrenches(plain, data)[0]
    assert np.abs(full - without).max() > 1e-8  # N; measured: 7e-8 or more
    assert apart(compiled, without + factor * (full - without)) < 5e-15  # measured: 3e-16


def test_a_coupling_may_name_the_world():
    custom = coupling("coupling", "world", "needle", prm=(3, 3))
    model = mujoco.MjModel.from_xml_string(COMPASSES.replace("<worldbody>", custom + "<worldbody>"))
    data = mujoco.MjData(model)
    plain = wrenches(mujoco.MjModel.from_xml_string(COMPASSES), data)[0]
    compiled, twin = wrenches(model, data)
    assert apart(compiled, twin) < 2e-14  # measured: 9e-16
    changed = np.flatnonzero((abs(compiled - plain) > 1e-12 * abs(plain).max()).any(axis=1))
    assert changed.tolist() == [model.body("needle").id]  # not the tail that is welded to it


@pytest.mark.parametrize("name", ["couplin", "Coupling", "my coupling", "c"])
def test_tuples_of_other_names_are_ignored(name):
    plain, other = (
        mujoco.MjModel.from_xml_string(motor(custom))
        for custom in ("", coupling(name, "ball", "ring", prm=(2, 3)) + coupling("x", "ring"))
    )
    found, expected = (wrenches(model, mujoco.MjData(model))[0] for model in (other, plain))
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("surface", ["planar", "plane"])
def test_the_top_gets_the_wrench_of_the_twin(surface):
    model = mm.build(mm.Top(surface=surface))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    compiled, twin = wrenches(model, data)
    assert np.abs(compiled - twin).max() <= 1e-14 * np.abs(twin).max()  # 7e-16


def test_what_was_installed_runs_inside_and_is_restored():
    """In Python or in C, on a model with or without magnets, and before the forces are computed."""
    model = mujoco.MjModel.from_xml_string(BOXES.format(integrator="Euler"))
    data, seen = mujoco.MjData(model), []

    def mine(model, data):
        seen.append((data.time, data.xfrc_applied.any()))

    in_c = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(lambda *_: seen.append(None))
    try:
        for previous in (mine, in_c):
            mujoco.set_mjcb_control(previous)
            with mm.magnetism():
                with mm.magnetism():
                    mujoco.mj_step(model, data)
                mujoco.mj_step(model, data)
            assert mujoco.get_mjcb_control() is previous
            with pytest.raises(KeyError), mm.magnetism():
                raise KeyError
            assert mujoco.get_mjcb_control() is previous
    finally:
        mujoco.set_mjcb_control(None)
    assert seen == [(0.0, False), (model.opt.timestep, True), None, None]
    assert data.xfrc_applied[1:].any(axis=1).tolist() == [False, True, True]
    with mm.magnetism():
        mujoco.mj_step(model, data)
    assert len(seen) == 4


def test_an_error_of_the_users_callback_is_raised():
    def mine(model, data):
        raise KeyError("mine")

    model = mujoco.MjModel.from_xml_string(COMPASSES)
    data = mujoco.MjData(model)
    mujoco.set_mjcb_control(mine)
    try:
        with pytest.raises(KeyError) as caught, mm.magnetism():
            mujoco.mj_step(model, data)
    finally:
        mujoco.set_mjcb_control(None)
    assert caught.value.args == ("mine",)


@pytest.mark.parametrize("callback", [None, lambda *_: None])
def test_a_callback_set_inside_the_block_is_named_at_its_end(callback):
    with pytest.warns(UserWarning, match="set_mjcb_control") as caught, mm.magnetism():
        mujoco.set_mjcb_control(callback)
    assert caught[0].filename == __file__
    assert mujoco.get_mjcb_control() is None


BOXES = """
<mujoco>
  <option gravity="0 0 0" integrator="{integrator}"/>
  <custom><text name="magmotor" data="dipoles noise"/></custom>
  <worldbody>
    <geom type="plane" size="9 9 1" pos="0 0 -0.1"/>
    <site pos="0 0 0.5" user="1"/>
    <body name="plain"><freejoint/><geom size="0.1" contype="0" conaffinity="0"/></body>
    <body name="box" pos="0 1 0"><freejoint/><geom size="0.1" mass="1"/><site user="1"/></body>
    <body name="driven" pos="1 1 0" user="0.1 0 0 0 0 0">
      <freejoint/><geom size="0.1" mass="1"/><site user="1"/>
    </body>
  </worldbody>
</mujoco>
"""
"""One body without magnetism, and two with it, one of them with noise."""


def set_before(model, data):
    data.body("box").xfrc_applied[0] = 1
    mujoco.mj_step(model, data, nstep=3)


def set_later(model, data):
    mujoco.mj_step(model, data, nstep=3)
    data.body("box").xfrc_applied[0] += 1
    mujoco.mj_forward(model, data)
    mujoco.mj_step(model, data, nstep=3)


def set_after_forward(model, data):
    for _ in range(2):
        mujoco.mj_step(model, data, nstep=2)
        mujoco.mj_forward(model, data)
        data.body("box").xfrc_applied[0] += 1


def set_by_the_viewer(model, data):
    perturb = mujoco.MjvPerturb()
    perturb.select, perturb.active, perturb.refquat[0], perturb.localmass = 2, 1, 1, 1
    for _ in range(3):
        mujoco.mj_step(model, data)
        data.xfrc_applied[:] = 0
        mujoco.mjv_applyPerturbForce(model, data, perturb)


def set_by_a_rollout(model, data):
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    start, wrenches = np.zeros(size), np.zeros((3, model.nbody, 6))
    start[1 : 1 + model.nq], wrenches[:, 2, 0] = model.qpos0, 1
    spec = int(mujoco.mjtState.mjSTATE_XFRC_APPLIED)
    mujoco.rollout.rollout(
        model, data, start, wrenches.reshape(3, -1), control_spec=spec, skip_checks=False
    )


INTEGRATORS = ("Euler", "implicitfast", "RK4")


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize(
    "act", [set_before, set_later, set_after_forward, set_by_the_viewer, set_by_a_rollout]
)
def test_a_force_in_xfrc_applied_that_is_overwritten_is_named_once(act, integrator):
    model = mujoco.MjModel.from_xml_string(BOXES.format(integrator=integrator))
    data = mujoco.MjData(model)
    with warnings.catch_warnings(record=True) as caught, mm.magnetism():
        warnings.simplefilter("always")
        act(model, data)
        act(model, data)
    assert [str(each.message).partition(": it sets")[0] for each in caught] == [
        "magnetism() has overwritten the force that was set in xfrc_applied of body 'box'"
    ]


def run_again(model, data):
    mujoco.mj_step(model, data, nstep=3)


def push_others_and_clear(model, data):
    for step in range(6):
        data.body("plain").xfrc_applied[0] = step
        mujoco.mj_step(model, data)
        data.xfrc_applied[2 + step % 2] = 0


def copy_data(model, data):
    mujoco.mj_step(model, data)
    backup = copy.copy(data)
    for _ in range(3):
        mujoco.mj_step(model, data, nstep=3)
        mujoco.mj_copyData(data, model, backup)
        mujoco.mj_step(model, pickle.loads(pickle.dumps(backup)), nstep=3)


def restore_states(model, data):
    spec, other = int(mujoco.mjtState.mjSTATE_INTEGRATION), mujoco.MjData(model)
    state = np.empty(mujoco.mj_stateSize(model, spec))
    for _ in range(3):
        mujoco.mj_step(model, data, nstep=2)
        mujoco.mj_getState(model, data, state, spec)
        for each in (other, data):
            mujoco.mj_step(model, each)
            mujoco.mj_setState(model, each, state, spec)
            mujoco.mj_step(model, each)


def restore_after_forward(model, data):
    spec = int(mujoco.mjtState.mjSTATE_INTEGRATION)
    state = np.empty(mujoco.mj_stateSize(model, spec))
    for _ in range(3):
        mujoco.mj_step(model, data, nstep=2)
        mujoco.mj_getState(model, data, state, spec)
        for shift in (0.1, 0.2):
            data.qpos[7] -= shift
            mujoco.mj_forward(model, data)
            mujoco.mj_setState(model, data, state, spec)
        data.qpos[7] -= 0.1
        mujoco.mj_step(model, data)


def restore_twice(model, data):
    spec = int(mujoco.mjtState.mjSTATE_INTEGRATION)
    state = np.empty(mujoco.mj_stateSize(model, spec))
    for _ in range(3):
        mujoco.mj_step(model, data)
        mujoco.mj_getState(model, data, state, spec)
        mujoco.mj_step(model, data, nstep=2)
        for _ in range(3):
            mujoco.mj_setState(model, data, state, spec)
            mujoco.mj_step(model, data)


def load_checkpoints(model, data):
    spec = int(mujoco.mjtState.mjSTATE_FULLPHYSICS | mujoco.mjtState.mjSTATE_USER)
    state = np.empty(mujoco.mj_stateSize(model, spec))
    for _ in range(3):
        mujoco.mj_step(model, data, nstep=5)
        mujoco.mj_getState(model, data, state, spec)
        other = mujoco.MjData(model)
        for each in (other, data):
            mujoco.mj_resetData(model, each)
            mujoco.mj_setState(model, each, state, spec)
            mujoco.mj_step(model, each)


def share_data(model, _data):
    batch = mujoco.batch.Batch(model, 5, 2)
    batch.qpos[:, 7] += np.arange(5) / 10
    for step in range(6):
        batch.xfrc_applied[:, 1, 0] = step
        batch.step()


def pull_by_our_own_function(model, data):
    perturb = mujoco.MjvPerturb()
    perturb.select, perturb.active = 2, 1
    for _ in range(3):
        mm.apply_perturbation(model, data, perturb)
        mujoco.mj_step(model, data)


def evaluate_and_reset(model, data):
    for step in range(3):
        mujoco.mj_step(model, data)
        data.qpos[7:10], data.qvel[:] = step, step
        mujoco.mj_forward(model, data)
        mujoco.mj_step1(model, data)
        mujoco.mj_step2(model, data)
    mujoco.mj_resetData(model, data)


def push_between_halves(model, data):
    for _ in range(3):
        mujoco.mj_step1(model, data)
        ours = data.xfrc_applied[1].copy()
        data.xfrc_applied[1, 2] += 1.0
        mujoco.mj_step2(model, data)
        data.xfrc_applied[1] = ours
        mujoco.mj_step1(model, data)
        data.xfrc_applied[1, 2] += 1.0
        mujoco.mj_step2(model, data)


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize(
    "act",
    [
        push_between_halves,
        run_again,
        push_others_and_clear,
        copy_data,
        restore_states,
        restore_after_forward,
        restore_twice,
        load_checkpoints,
        share_data,
        pull_by_our_own_function,
        evaluate_and_reset,
    ],
)
def test_what_the_block_left_in_xfrc_applied_is_never_taken_for_the_users(act, integrator):
    """A warning is an error; the second block begins with the wrenches of the first."""
    model = mujoco.MjModel.from_xml_string(BOXES.format(integrator=integrator))
    data = mujoco.MjData(model)
    for _ in range(2):
        with mm.magnetism():
            act(model, data)
        mujoco.mj_step(model, data, nstep=2)


def test_blocks_may_overlap_in_threads():
    first_in, second_in, first_out = (threading.Event() for _ in range(3))
    seen = []

    def first():
        with mm.magnetism():
            first_in.set()
            second_in.wait(10)
        first_out.set()

    def second():
        first_in.wait(10)
        with mm.magnetism():
            second_in.set()
            first_out.wait(10)
            seen.append(mujoco.get_mjcb_control())

    threads = [threading.Thread(target=f) for f in (first, second)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert seen[0] is not None
    assert mujoco.get_mjcb_control() is None


TWO_NEEDLES = f"""
<mujoco>
  {MARK}
  <custom/>
  <worldbody>
    <site name="fixed" pos="0 0 1" user="1"/>
    <body name="base"><geom size="0.1"/><site name="base" user="1"/></body>
    <body name="needle" pos="1 0 0">
      <freejoint/>
      <geom size="0.1"/>
      <site name="needle" zaxis="1 1 0" user="1"/>
      <body name="tail" pos="0.5 0 0">
        <geom size="0.1"/>
        <site name="tail" zaxis="1 0 1" user="1"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
"""Two rigid bodies of two bodies each; one of them can move."""

INERT = """
<mujoco>
  <custom>
    <text name="magmotor" data="{}"/>
    <numeric name="field" data="0 0 1"/>
    <numeric name="material" data="{}"/>
    <tuple name="iron"><element objtype="numeric" objname="material"/>
      <element objtype="geom" objname="piece"/></tuple>
  </custom>
  <worldbody>
    <geom name="piece" size="0.1" pos="0 0 2"/>
    <body><freejoint/><geom size="0.1"/><site user="1"/>{}</body>
  </worldbody>
</mujoco>
"""
"""A free dipole, a field and fixed iron, all of which must be named."""

OFF = "".join(
    f'<tuple name="coupling {a} {b}"><element objtype="body" objname="{a}"/>'
    f'<element objtype="body" objname="{b}"/></tuple>'
    for a in ("world", "base")
    for b in ("needle", "tail")
)
"""Couplings, without a factor, of all bodies that could act."""


@pytest.mark.parametrize(
    ("xml", "why"),
    [
        ("<mujoco/>", "neither a mark nor a site with a user number names dipoles"),
        (f"<mujoco>{MARK}</mujoco>", "it has no dipole sites"),
        (TWO_NEEDLES.replace('user="1"', 'user="0"'), "it has no dipole sites"),
        (TWO_NEEDLES.replace("<freejoint/>", ""), "all on one rigid body"),
        (
            TWO_NEEDLES.replace('name="fixed" pos="0 0 1" user="1"', "").replace(
                'name="base" user="1"', ""
            ),
            "all on one rigid body",
        ),
        (
            TWO_NEEDLES.replace("<freejoint/>", "").replace(
                '<body name="needle"', '<body mocap="true" name="needle"'
            ),
            "none of the bodies with dipole sites can move",
        ),
        (TWO_NEEDLES.replace("<custom/>", f"<custom>{OFF}</custom>"), "prm is 0, the default"),
        (INERT.format("dipoles", 5, ""), "it declares fields and iron, but no mark names them"),
        (INERT.format("fields", 5, ""), "it declares dipoles and iron, but no mark names them"),
        (
            INERT.format("dipoles iron", 0, "").replace("field", "other"),
            "the susceptibility of its iron is 0",
        ),
        (
            INERT.format("dipoles", 5, "<site/>").replace('"iron"', '"n"').replace("field", "f"),
            r"all on one rigid body, .*; sites without a user number \(1\) are no dipoles",
        ),
    ],
)
def test_a_model_on_which_nothing_acts_warns_once_and_says_why(xml, why):
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    data.xfrc_applied[:] = 1.0
    with warnings.catch_warnings(record=True) as caught, mm.magnetism():
        warnings.simplefilter("always")
        mujoco.mj_step(model, data, nstep=3)
    said = [str(each.message) for each in caught]
    said = [sentence for sentence in said if "set in xfrc_applied" not in sentence]
    assert len(said) == 1
    assert re.match(f"nothing acts on this model: .*{why}", said[0])


@pytest.mark.parametrize("left_out", ["", "world needle", "world tail", "base needle", "base tail"])
def test_one_pair_that_acts_is_enough(left_out):
    custom = re.sub(f'<tuple name="coupling {left_out}">.*?</tuple>', "", OFF) if left_out else ""
    model = mujoco.MjModel.from_xml_string(TWO_NEEDLES.replace("<custom/>", custom and (
        f"<custom>{custom}</custom>"
    )))  # fmt: skip
    data = mujoco.MjData(model)
    with mm.magnetism():  # a warning is an error here
        mujoco.mj_forward(model, data)
    compiled, twin = wrenches(model, data)
    assert np.abs(twin).max() > 1e-8  # N or N m; 2.5e-8 or more
    assert apart(compiled, twin) < 2e-14  # 8e-16


def test_padded_site_numbers_are_allowed():
    xml = COMPASSES.replace("<worldbody>", '<size nuser_site="6"/><worldbody>', 1)
    plain, padded = (mujoco.MjModel.from_xml_string(each) for each in (COMPASSES, xml))
    found, expected = (wrenches(each, mujoco.MjData(each))[0] for each in (padded, plain))
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("custom", ["", coupling("coupling", "world", "ball")])
def test_coinciding_dipoles_are_named(custom):
    """The fixed one has a second dipole, so that it is the source of a coupled pair."""
    mark = '<custom><text name="magmotor" data="dipoles couplings"/></custom>'
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco>{mark}{custom}<worldbody><site name="left" pos="0 0 1" user="1"/>
        <site pos="0 0 9" user="1"/>
        <body name="ball"><freejoint/><geom size="0.1"/><site name="right" user="1"/></body>
        </worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    with mm.magnetism():
        mujoco.mj_step(model, data)
        data.qpos[:3] = 0, 0, 1
        with pytest.raises(mujoco.FatalError) as in_a_step:
            mujoco.mj_step(model, data)
    assert data.pstack == 0
    with misdeclared("coincidence", model.site("right").id) as outside:
        mm.magnetic_energy(model, data)
    assert str(in_a_step.value) == str(outside.value)


def test_dipoles_that_coincide_without_acting_are_not_named_in_place_of_those_that_act():
    """The first two coincide, too, but their coupling is 0."""
    body = (
        '<body name="{0}" pos="{1} 0 0"><freejoint/><geom size="0.1"/><site name="{0}" user="1"/>'
    )
    pairs = ("one", 0), ("other", 0), ("left", 1), ("right", 1)
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco>
        <custom><text name="magmotor" data="dipoles couplings"/></custom>
        {coupling("coupling", "one", "other", prm=(0, 0))}
        <worldbody>{"".join(body.format(*each) + "</body>" for each in pairs)}</worldbody>
        </mujoco>"""
    )
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    with misdeclared("coincidence", model.site("right").id) as outside:
        mm.magnetic_energy(model, data)
    with mm.magnetism(), pytest.raises(mujoco.FatalError) as in_a_step:
        mujoco.mj_forward(model, data)
    assert str(in_a_step.value) == str(outside.value)


def test_dipoles_that_coincide_must_act_on_one_another():
    """The ball's dipole coincides with one of the ring, and two immovable ones coincide as well."""
    twins = '<body mocap="true"><site name="t{0}" pos="9 9 9" user="1"/></body>'
    twins = "<worldbody>" + twins.format(0) + twins.format(1)
    for custom in ("", coupling("coupling", "ball", "ring", prm=(0, 0))):
        model = mujoco.MjModel.from_xml_string(motor(custom).replace("<worldbody>", twins))
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        model.body("ball").pos = data.site("ring3").xpos
        with mm.magnetism():
            if custom:
                mujoco.mj_forward(model, data)
                assert np.isfinite(data.xfrc_applied).all()
            else:
                with pytest.raises(mujoco.FatalError) as in_a_step:
                    mujoco.mj_forward(model, data)
                with misdeclared("coincidence", model.site("ring3").id) as outside:
                    mm.magnetic_energy(model, data)
                assert str(in_a_step.value) == str(outside.value)


def test_rk4_stages_see_their_own_forces():
    """A compass needle's libration: RK4 must converge at fourth order."""
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><option integrator="RK4" gravity="0 0 0"/><worldbody>
        <site pos="0 0.2 0" zaxis="0 1 0" user="10"/>
        <body><joint type="hinge" axis="0 0 1"/>
        <inertial pos="0 0 0" mass="1" diaginertia="1e-3 1e-3 1e-3"/>
        <site zaxis="1 0 0" user="10"/></body></worldbody></mujoco>"""
    )
    final = []
    with mm.magnetism():
        for n in (50, 100, 200, 400):
            model.opt.timestep = 1.0 / n
            data = mujoco.MjData(model)
            data.qvel[0] = 0.5
            mujoco.mj_step(model, data, nstep=n)
            final.append(data.qpos[0])
    errors = np.abs(np.diff(final))
    orders = np.log2(errors[:-1] / errors[1:])
    assert np.abs(orders - 4).max() < 0.15  # measured: 0.012


def batch_states(nthread):
    model = mm.build(mm.Top())
    model.opt.timestep = 0.01
    start = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, start, 0)
    with mm.magnetism():
        batch = mujoco.batch.Batch(model, 64, nthread)
        batch.qpos[:] = start.qpos
        batch.qpos[:, 0] += np.linspace(0, 0.1, 64)
        batch.step(nstep=200)
        return batch.qpos.copy()


def test_batch_is_bit_identical_on_any_number_of_threads():
    one, two = batch_states(1), batch_states(2)
    np.testing.assert_array_equal(one, two)
    assert np.ptp(one[:, 2:]) > 0.1


def test_rollout_follows_mj_step():
    model = mm.build(mm.Top())
    model.opt.timestep = 0.01
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    initial = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, initial, kind)
    with mm.magnetism():
        states, _ = mujoco.rollout.rollout(model, data, initial, nstep=100)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        mujoco.mj_step(model, data, nstep=100)
    np.testing.assert_array_equal(states[0, -1, 1 : 1 + model.nq], data.qpos)


def test_cache_key_follows_the_layout(monkeypatch):
    """Other offsets must be compiled anew, never read from another version's cache.

    Keys are known before anything is compiled, which takes seconds.
    """
    monkeypatch.setattr(CFunc, "compile", lambda self: None)
    offsets = layout.current()
    moved = offsets._replace(xipos=offsets.xipos + 8)
    first, same, moved, edited = (
        _compiled(*one, monkeypatch)
        for one in ((offsets, 1), (offsets, 1), (moved, 1), (offsets, 2))
    )
    assert _key(first) == _key(same)
    assert len({_key(first), _key(moved), _key(edited)}) == 3
    assert len({_index(first), _index(moved), _index(edited)}) == 3


def _compiled(offsets, checksum, monkeypatch):
    monkeypatch.setattr(dependencies, "checksum_of", lambda function: checksum)
    signature = c_types.void(c_types.int64, c_types.int64)
    again = compiled_once(signature, error_model="numpy")
    return again(inspect.unwrap(callbacks._callback))(offsets)


def _key(compiled):
    codegen = compiled._compiler.targetdescr.target_context.codegen()
    return compiled._cache._index_key(compiled._sig, codegen)


def _index(compiled):
    return compiled._cache.files.stem


def test_a_new_model_where_an_older_one_was_is_not_taken_for_it(monkeypatch):
    """Nothing acts on it, although something acted on the other one, which had its address."""
    model = mujoco.MjModel.from_xml_string(f"<mujoco>{MARK}</mujoco>")
    data = mujoco.MjData(model)
    with mm.magnetism():
        monkeypatch.setattr(error_raising._acted, "value", model._address)
        with pytest.warns(UserWarning, match="nothing acts"):
            mujoco.mj_step(model, data)


@pytest.mark.parametrize("tuples", ["", OFF])
@pytest.mark.parametrize(("bodies", "sites"), [(15, 4), (15, 16), (3, 40)])
def test_sites_need_not_be_sorted_by_bodies(bodies, sites, tuples):
    """Python may assign any order. Every sixteenth site belongs to the same body here."""
    rng = np.random.default_rng(bodies)
    dipoles = "".join(
        f'<site pos="{x} {y} {z}" zaxis="{u} {v} 1" user="{m}"/>'
        for x, y, z, u, v, m in rng.normal(size=(sites, 6)) * (0.05, 0.05, 0.05, 1, 1, 1)
    )
    each = '<body pos="{} 0 0"><freejoint/><geom size=".01"/>{}</body>'
    world = "".join(each.format(0.5 * k, dipoles) for k in range(bodies))
    world += '<body name="needle"/><body name="base"/><body name="tail"/>' if tuples else ""
    custom = MARK.replace("</custom>", f"{tuples}</custom>")
    xml = f"<mujoco>{custom}<worldbody>{world}</worldbody></mujoco>"
    model = mujoco.MjModel.from_xml_string(xml)
    model.site_bodyid[:] = model.site_bodyid.reshape(bodies, sites).T.ravel()
    data, expected = mujoco.MjData(model), mujoco.MjData(model)
    mujoco.mj_kinematics(model, expected)
    mujoco.mj_comPos(model, expected)
    apply_magnetism(model, expected)
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    size = abs(expected.xfrc_applied).max()
    np.testing.assert_allclose(
        data.xfrc_applied, expected.xfrc_applied, rtol=0, atol=2e-14 * size  # 4e-15
    )  # fmt: skip
