"""Errors on threads of rollouts and batches: a failed state is NaN, and the process lives."""

from contextlib import contextmanager

import mujoco
import mujoco.batch
import mujoco.rollout
import numpy as np
import pytest

import magmotor as mm

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

COINCIDE = r"dipole sites 1 'needle' and 0 'magnet' coincide: their force is undefined"


def compiled(xml, hook, integrator):
    return mujoco.MjModel.from_xml_string(xml.format(extension=HOOKS[hook], integrator=integrator))


@contextmanager
def failing(hook, match):
    """Expect an error at the end of a block, or a warning of the plugin, which needs none."""
    if hook == "plugin":
        with pytest.warns(UserWarning, match=f"{match}; the state is set to NaN"):
            yield
    else:
        with (
            pytest.raises(mujoco.FatalError, match=f"{match}; the states of these runs are NaN"),
            mm.magnetism(),
        ):
            yield


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
    with failing(hook, r"'moving' and 0 'still' coincide: .*"):
        states = rollout(model, start)
    np.testing.assert_array_equal(states[[0, 2]], expected)
    assert np.isnan(states[1, :, 1:]).all()


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("hook", HOOKS)
def test_numbers_that_become_invalid_are_named(hook, integrator):
    model = compiled(NEEDLE, hook, integrator)
    data = [mujoco.MjData(model) for _ in range(2)]  # with the plugin, the next would be an error
    model.site("needle").user[:] = np.nan
    with failing(hook, "site 1 'needle': .* its moment in A m.2, which must be finite"):
        states = rolled(model, data, START, AWAY)
    assert np.isnan(states[..., 1]).all()
    if hook == "plugin":
        with pytest.raises(mujoco.FatalError, match="site 1 'needle'"):
            mujoco.MjData(model)


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("hook", HOOKS)
def test_a_batch_raises_its_own_error_and_keeps_the_state_before(hook, integrator):
    model = compiled(NEEDLE, hook, integrator)

    def batch(fails):
        batch = mujoco.batch.Batch(model, 5, 2)
        batch.qpos[:], batch.qvel[:] = START[:, :1], START[:, 1:]
        if fails:
            batch.mocap_pos[FAILS] = 0.0
        return batch

    whole, failed = batch(False), batch(True)
    with mm.magnetism():
        whole.step(nstep=6)
        with pytest.raises(mujoco.batch.SimulationError, match=COINCIDE) as caught:
            failed.step(nstep=6)
    assert caught.value.ids.tolist() == [FAILS]
    others = np.arange(5) != FAILS
    for name in ("qpos", "qvel"):
        kept, found, expected = (getattr(each, name) for each in (batch(True), failed, whole))
        np.testing.assert_array_equal(found[others], expected[others])
        np.testing.assert_array_equal(found[FAILS], kept[FAILS])
    assert np.ptp(whole.qvel) > 1
    model.site("needle").user[:] = np.nan
    error = ValueError if hook == "plugin" else mujoco.batch.SimulationError
    with mm.magnetism(), pytest.raises(error, match="site 1 'needle'"):
        batch(False).step()


@pytest.mark.parametrize("hook", HOOKS)
def test_where_mujoco_is_called_in_the_same_thread_the_call_raises(hook):
    model = compiled(NEEDLE, hook, "RK4")
    data = mujoco.MjData(model)
    data.mocap_pos[:] = 0.0
    for call in (mujoco.mj_forward, mujoco.mj_step):
        with mm.magnetism(), pytest.raises(mujoco.FatalError, match=f"{COINCIDE}$"):
            call(model, data)
    with mm.magnetism(), pytest.raises(mujoco.FatalError, match=f"{COINCIDE}$"):
        rollout(model, START, 0 * AWAY, threads=1)


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
    match = rf"{COINCIDE} \(and 1 other error\); the states of these runs are NaN"

    def failing_twice():
        with mm.magnetism():
            rollout(needle, START, 0 * AWAY)
            rollout(slider, np.array([(1.0, 0.0), (0.0, 0.0)]))

    with pytest.raises(mujoco.FatalError, match=match):
        failing_twice()
