"""The compiled callback: same wrench as its NumPy twin, on any model, version and thread."""

import subprocess
import sys
import textwrap
import threading
import warnings

import mujoco
import mujoco.batch
import mujoco.rollout
import numpy as np
import pytest
from numpy_twin import apply_magnetism

import magmotor as mm
from magmotor.engines.mujoco import callback, layout

COMPASSES = """
<mujoco>
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
    """A model of `count` fixed dipoles and three free ones, to cross the kernel's tiles."""
    rng = np.random.default_rng(count)
    fixed = "".join(
        f'<site pos="{x} {y} {z}" zaxis="{a} {b} 1" user="3"/>'
        for x, y, z, a, b in rng.normal(size=(count, 5))
    )
    free = "".join(
        f'<body pos="{i} 3 0"><freejoint/><geom size="0.1"/><site user="2" pos="0 0.1 0"/></body>'
        for i in range(3)
    )
    return f"<mujoco><worldbody>{fixed}{free}</worldbody></mujoco>"


def wrenches(model, data):
    """By the callback and by the twin, in the same state."""
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    compiled = data.xfrc_applied.copy()
    apply_magnetism(model, data)
    return compiled, data.xfrc_applied.copy()


@pytest.mark.parametrize("seed", range(5))
def test_any_model_gets_the_wrench_of_the_twin(seed):
    model = mujoco.MjModel.from_xml_string(COMPASSES)
    data = mujoco.MjData(model)
    rng = np.random.default_rng(seed)
    data.qpos[:] += 0.1 * rng.normal(size=model.nq)
    data.qvel[:] = rng.normal(size=model.nv)
    compiled, twin = wrenches(model, data)
    assert np.abs(twin).max() > 0
    for part in (slice(0, 3), slice(3, 6)):
        error = np.abs(compiled - twin)[:, part].max()
        assert error <= 1e-12 * np.abs(twin[:, part]).max()  # measured: 1.2e-15
    still = [model.body(name).id for name in ("world", "ring")]
    assert not compiled[still].any()


@pytest.mark.parametrize("count", [1, 61, 62, 128, 200])
def test_many_dipoles_cross_tiles(count):
    model = mujoco.MjModel.from_xml_string(chain(count))
    compiled, twin = wrenches(model, mujoco.MjData(model))
    assert np.abs(compiled - twin).max() <= 1e-12 * np.abs(twin).max()


@pytest.mark.parametrize("surface", ["planar", "plane"])
def test_the_top_gets_the_wrench_of_the_twin(surface):
    model = mm.build(mm.Top(surface=surface))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    compiled, twin = wrenches(model, data)
    assert np.abs(compiled - twin).max() <= 1e-12 * np.abs(twin).max()


def test_what_was_installed_is_restored():
    def mine(model, data):
        pass

    mujoco.set_mjcb_control(mine)
    try:
        with mm.magnetism():
            with mm.magnetism():
                assert mujoco.get_mjcb_control() is not mine
            assert mujoco.get_mjcb_control() is not mine
        assert mujoco.get_mjcb_control() is mine
        with pytest.raises(KeyError), mm.magnetism():
            raise KeyError
        assert mujoco.get_mjcb_control() is mine
    finally:
        mujoco.set_mjcb_control(None)


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


def test_a_model_on_which_nothing_acts_warns_once():
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    zero = mujoco.MjModel.from_xml_string(COMPASSES.replace('user="', 'user="0 '))
    for each in (model, zero):
        data = mujoco.MjData(each)
        with warnings.catch_warnings(record=True) as caught, mm.magnetism():
            warnings.simplefilter("always")
            mujoco.mj_step(each, data, nstep=3)
        assert [w.category for w in caught] == [UserWarning]
        assert "nothing acts on this model" in str(caught[0].message)


def test_coinciding_dipoles_are_named():
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><worldbody><site name="left" pos="0 0 1" user="1"/>
        <body><freejoint/><geom size="0.1"/><site name="right" user="1"/></body>
        </worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    with mm.magnetism():
        mujoco.mj_step(model, data)
        data.qpos[:3] = 0, 0, 1
        with pytest.raises(mujoco.FatalError, match=r"'right'.*'left' coincide"):
            mujoco.mj_step(model, data)


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


def test_cache_key_follows_the_layout():
    """Other offsets must be compiled anew, never read from another version's cache."""
    offsets = layout.current()
    first, same = (callback.compile_callback(offsets, 1) for _ in range(2))
    moved = callback.compile_callback(offsets._replace(xipos=offsets.xipos + 8), 1)
    edited = callback.compile_callback(offsets, 2)
    assert same.cache_hits == 1
    assert _key(first) == _key(same)
    assert len({_key(first), _key(moved), _key(edited)}) == 3


def _key(compiled):
    codegen = compiled._compiler.targetdescr.target_context.codegen()
    return compiled._cache._index_key(compiled._sig, codegen)


def test_a_second_process_loads_the_callback_from_disk():
    code = """
        from magmotor.engines.mujoco import callback
        print(callback.compiled_callback().cache_hits)
    """
    command = [sys.executable, "-c", textwrap.dedent(code)]
    hits = [
        subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
        for _ in range(2)
    ]
    assert hits[1] == "1"
