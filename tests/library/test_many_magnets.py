"""Hundreds of magnets: each pair is computed once, with the same bits on any number of threads."""

import mujoco
import mujoco.rollout
import numpy as np
import pytest
from refusals import misdeclared

import magmotor as mm
from magmotor.mjcf.forces.magnetic_state import stack_bytes
from trials.numpy_twin import apply_magnetism

HEAD = '<custom><text name="magmotor" data="dipoles couplings"/></custom>'
PLUGIN = '<extension><plugin plugin="magmotor.forces"><instance name="p"/></plugin></extension>'


def site(rng, name="", spread=0.0):
    at, quat = spread * rng.normal(size=3), rng.normal(size=4)
    name = f' name="{name}"' if name else ""
    moment = rng.uniform(0.5, 2)
    return f'<site{name} pos="{spaced(at)}" quat="{spaced(quat)}" user="{moment}"/>'


def spaced(numbers):
    return " ".join(map(repr, map(float, numbers)))


def gas(count, seed=0, more="", head=HEAD, option='integrator="Euler"', each=lambda k: 1):
    """`count` free bodies at random, each with `each(k)` dipoles."""
    rng = np.random.default_rng(seed)
    bodies = ""
    for k in range(count):
        sites = "".join(site(rng, f"d{k}.{i}", 0.01) for i in range(each(k)))
        at = rng.uniform(-1, 1, 3) * 0.1 * count ** (1 / 3)
        bodies += (
            f'<body name="b{k}" pos="{spaced(at)}"><freejoint/>'
            f'<geom size="0.02"/><site pos="0.03 0 0"/>{sites}</body>'
        )
    return mujoco.MjModel.from_xml_string(
        f'<mujoco>{head}<option gravity="0 0 0" timestep="1e-7" {option}>'
        '<flag contact="disable"/></option>'
        f"<worldbody>{more}{bodies}</worldbody></mujoco>"
    )


def mixed(seed=0, head=HEAD):
    """Free bodies with up to 15 dipoles, among fixed, mocap, jointed, welded and coupled ones."""
    rng = np.random.default_rng(seed)
    fixed = "".join(site(rng, "", 2.0) for _ in range(9))
    ring = "".join(site(rng, "", 1.0) for _ in range(20))
    more = f"""{fixed}
      <body name="hand" mocap="true">{site(rng, "", 2.0)}</body>
      <body name="ring" pos="5 0 0"><freejoint/><geom size="1"/>{ring}</body>
      <body name="arm" pos="0 3 0"><joint type="ball"/><geom size="0.1"/>{site(rng)}
        <body pos="0.3 0 0"><joint type="hinge"/><geom size="0.1"/>{site(rng)}</body>
        <body pos="0 0.3 0"><geom size="0.1"/>{site(rng)}</body>
      </body>
      <body name="left" pos="0 -3 0"><freejoint/><geom size="0.1"/>{site(rng)}</body>"""
    head += """<custom><tuple name="coupling"><element objtype="body" objname="left" prm="2"/>
      <element objtype="body" objname="b3" prm="2"/></tuple></custom>"""
    return gas(130, seed, more, head, each=lambda k: 1 + k * k % 5)


def wrenches(model, data, threads=0):
    """Wrenches by the callback, with a pool of worker threads."""
    mujoco.mju_threadpool(data, threads)
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    mujoco.mju_threadpool(data, 0)
    return data.xfrc_applied.copy()


def apart(model, data):
    """Largest difference from the twin, relative to the largest force or torque."""
    found = wrenches(model, data)
    apply_magnetism(model, data)
    twin = data.xfrc_applied
    return max(
        np.abs(found - twin)[:, part].max() / np.abs(twin[:, part]).max()
        for part in (slice(0, 3), slice(3, 6))
    )


@pytest.mark.parametrize("count", [255, 256, 257, 264, 385, 512, 777])
def test_any_number_of_free_magnets_has_the_wrenches_of_the_twin(count):
    model = gas(count, count)
    assert apart(model, mujoco.MjData(model)) < 3e-14  # 3e-15


@pytest.mark.parametrize("seed", range(3))
def test_magnets_of_all_kinds_have_the_wrenches_of_the_twin(seed):
    model = mixed(seed)
    data = mujoco.MjData(model)
    rng = np.random.default_rng(seed)
    mujoco.mj_integratePos(model, data.qpos, rng.normal(size=model.nv), 0.1)
    assert apart(model, data) < 3e-14  # 3e-15


def test_forces_are_opposite():
    """Of two bodies that are far from all others, and of all bodies together."""
    model = gas(400)
    data = mujoco.MjData(model)
    data.qpos[:7] += [1e9, 0, 0, 0, 0, 0, 0]
    data.qpos[7 * 300 : 7 * 300 + 3] = data.qpos[:3] + np.array([0.02, 0.03, -0.05])
    found = wrenches(model, data)
    assert np.abs(found[1, :3]).max() > 1e-3
    assert (found[1, :3] == -found[301, :3]).all()
    assert np.abs(found[:, :3].sum(axis=0)).max() < 5e-15 * np.abs(found[:, :3]).sum()  # 2e-16


@pytest.mark.parametrize("build", [lambda: gas(400), lambda: gas(1100), mixed])
def test_the_bits_are_those_of_one_thread(build):
    model = build()
    data = mujoco.MjData(model)
    found = [wrenches(model, data, threads).tobytes() for threads in (0, 1, 2, 4)]
    assert len(set(found)) == 1


def test_the_plugin_moves_magnets_as_the_callback_does():
    """Bit by bit, since nothing but the magnets acts on these bodies."""
    ends = []
    for head, threads in ((HEAD, 0), (PLUGIN + HEAD, 0), (PLUGIN + HEAD, 3)):
        model = gas(300, head=head, option='integrator="RK4"')
        data = mujoco.MjData(model)
        mujoco.mju_threadpool(data, threads)
        with mm.magnetism():
            mujoco.mj_step(model, data, nstep=3)
        mujoco.mju_threadpool(data, 0)
        ends.append(np.concatenate([data.qpos, data.qvel]))
    assert (ends[0] == ends[1]).all()
    assert (ends[1] == ends[2]).all()
    assert np.abs(ends[0] - np.concatenate([model.qpos0, 0 * data.qvel])).max() > 1e-6


def test_a_rollout_has_the_states_of_single_steps():
    model = gas(300)
    data = mujoco.MjData(model)
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    state = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, state, kind)
    with mm.magnetism():
        ends, _ = mujoco.rollout.rollout(
            model, [mujoco.MjData(model) for _ in range(2)], np.stack([state, state]), nstep=3
        )
        mujoco.mju_threadpool(data, 2)
        mujoco.mj_step(model, data, nstep=3)
    mujoco.mju_threadpool(data, 0)
    mujoco.mj_getState(model, data, state, kind)
    assert (ends[:, -1] == state).all()


@pytest.mark.parametrize("threads", [0, 2])
@pytest.mark.parametrize(("one", "other"), [(3, 5), (3, 250), (390, 391), (140, 270)])
def test_coinciding_magnets_are_named(one, other, threads):
    model = gas(400)
    data = mujoco.MjData(model)
    for k in (one, other):
        model.site(f"d{k}.0").pos = 0
    data.qpos[7 * other : 7 * other + 3] = data.qpos[7 * one : 7 * one + 3]
    with pytest.raises(mujoco.FatalError) as in_a_step:
        wrenches(model, data, threads)
    assert data.pstack == 0
    with misdeclared("coincidence", model.site(f"d{other}.0").id) as outside:
        mm.magnetic_energy(model, data)
    assert str(in_a_step.value) == str(outside.value)


def test_dipoles_of_one_body_may_coincide():
    model = gas(200, each=lambda k: 2)
    for k in range(200):
        model.site(f"d{k}.1").pos = model.site(f"d{k}.0").pos
    assert apart(model, mujoco.MjData(model)) < 3e-14  # 3e-15


def test_the_stack_suffices_as_stated():
    model = gas(600)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    before = data.maxuse_arena
    wrenches(model, data, 2)
    used = stack_bytes(model)
    assert data.maxuse_arena <= max(before, data.narena, used)
    assert 0.5 * used < data.maxuse_stack <= used + 1024


def test_too_little_memory_is_an_error_that_names_the_remedy():
    head = HEAD + '<size memory="200K"/>'
    model = gas(100, head=head, each=lambda k: 10)
    data = mujoco.MjData(model)
    with mm.magnetism(), pytest.raises(mujoco.FatalError):
        mujoco.mj_forward(model, data)
