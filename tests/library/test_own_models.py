"""Noise and temperature of a user's model, stepped by MuJoCo's functions."""

import mujoco
import mujoco.batch
import mujoco.rollout
import numpy as np
import pytest

import magmotor as mm

NEEDLE = """
<mujoco>
  <size nuserdata="{nuserdata}"/>
  <custom><text name="magmotor" data="noise"/></custom>
  <worldbody>
    <body name="needle" user="0 0 0 0 0 2e-6">
      <joint type="hinge" axis="0 0 1" damping="2e-6"/>
      <geom type="capsule" fromto="-0.03 0 0 0.03 0 0" size="0.003"/>
    </body>
  </worldbody>
</mujoco>
"""
USERDATA = int(mujoco.mjtState.mjSTATE_USERDATA)


def needle(nuserdata=2):
    return mujoco.MjModel.from_xml_string(NEEDLE.format(nuserdata=nuserdata))


def end_of(model, userdata, steps=100):
    data = mujoco.MjData(model)
    data.userdata[:] = userdata
    with mm.magnetism():
        mujoco.mj_step(model, data, nstep=steps)
    return data.qpos[0]


def test_rollouts_and_batches_have_a_path_each_by_the_replica():
    model = needle()
    chosen = np.array([(7, replica) for replica in range(6)], float)
    alone = [end_of(model, userdata) for userdata in chosen]
    assert np.ptp(alone) > 0.1  # rad; 0.37
    start = np.zeros((6, mujoco.mj_stateSize(model, int(mujoco.mjtState.mjSTATE_FULLPHYSICS))))
    for threads in (1, 2):
        data = [mujoco.MjData(model) for _ in range(threads)]
        batch = mujoco.batch.Batch(model, 6, threads)
        batch.userdata[:] = chosen
        with mm.magnetism():
            states, _ = mujoco.rollout.rollout(
                model, data, start, chosen[:, np.newaxis], control_spec=USERDATA, nstep=100
            )
            batch.step(nstep=100)
        np.testing.assert_array_equal(states[:, -1, 1], alone)
        np.testing.assert_array_equal(batch.qpos[:, 0], alone)


def test_without_userdata_the_trajectories_of_a_rollout_have_one_path():
    model = needle()
    data = mujoco.MjData(model)
    data.userdata[:] = 7, 3
    start = np.zeros((6, mujoco.mj_stateSize(model, int(mujoco.mjtState.mjSTATE_FULLPHYSICS))))
    with mm.magnetism():
        states, _ = mujoco.rollout.rollout(model, data, start, nstep=100)
    np.testing.assert_array_equal(states[:, -1, 1], end_of(model, (7, 3)))


def test_a_reset_forgets_the_seed():
    model = needle()
    data = mujoco.MjData(model)
    data.userdata[:] = 7, 3
    mujoco.mj_resetData(model, data)
    with mm.magnetism():
        mujoco.mj_step(model, data, nstep=100)
    assert data.qpos[0] == end_of(model, (0, 0)) != end_of(model, (7, 3))


def torques(model, data, steps):
    found = []
    with mm.magnetism():
        for _ in range(steps):
            mujoco.mj_step(model, data)
            found.append(data.xfrc_applied[1, 5])
    return np.array(found) * np.sqrt(model.opt.timestep)


def test_noise_repeats_when_the_timestep_is_doubled_midway():
    """The number of a step is t/h: it is halved when the timestep is doubled."""
    model = needle()
    data = mujoco.MjData(model)
    before = torques(model, data, 100)
    model.opt.timestep *= 2
    after = torques(model, data, 50)
    np.testing.assert_allclose(after, before[50:], rtol=1e-14)  # 4e-16


@pytest.mark.parametrize(
    ("place", "value"),
    [
        *((0, value) for value in (np.nan, 1e300, -1.5, 0.5, -1.0, 2.0**53, np.inf)),
        (1, 0.5), (2, -1.0), (3, 2.0**25), (3, 1.5), (4, np.nan),
    ],
)  # fmt: skip
def test_invalid_userdata_is_named(place, value):
    """Also by `Langevin`, whose loop must survive the later steps."""
    model = needle(5)
    data = mujoco.MjData(model)
    data.userdata[place] = value
    with mm.magnetism(), pytest.raises(mujoco.FatalError) as first:
        mujoco.mj_step(model, data)
    with pytest.raises(mujoco.FatalError) as second:
        mm.Langevin(model).step(data, nstep=3)
    assert str(first.value) == str(second.value)


def test_userdata_of_a_model_without_noise_are_the_users_own():
    model = needle(1)
    model.body_user[:] = 0.0
    data = mujoco.MjData(model)
    data.userdata[0] = np.nan
    with mm.magnetism(), pytest.warns(UserWarning, match="nothing acts"):
        mujoco.mj_step(model, data)


MASSES = 100


def dampers(kind, decay, masses=MASSES):
    """Unit masses on slides, at kT = 1, whose velocities decay at this rate; a step is 1 s."""
    joints, tendons = (decay, 0.0) if kind == "joint" else (0.0, decay)
    bodies = "".join(
        f'''<body user="{np.sqrt(2 * decay)} 0 0 0 0 0">
          <joint name="x{i}" type="slide" axis="1 0 0" damping="{joints}"/>
          <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>'''
        for i in range(masses)
    )
    fixed = "".join(
        f'<fixed damping="{tendons}"><joint joint="x{i}" coef="1"/></fixed>' for i in range(masses)
    )
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco><custom><text name="magmotor" data="noise"/></custom>
        <option gravity="0 0 0" timestep="1"/><worldbody>{bodies}</worldbody>
        <tendon>{fixed}</tendon></mujoco>"""
    )


EXPLICIT, IMPLICIT, RK4 = "explicit", "implicit", "rk4"
GROWTH = {
    EXPLICIT: lambda z: 1 - z,
    IMPLICIT: lambda z: 1 / (1 + z),
    RK4: lambda z: 1 - z + z**2 / 2 - z**3 / 6 + z**4 / 24,
}
"""Fraction of a velocity that remains after a step of lambda h = z."""


@pytest.mark.parametrize("decay", [0.3, 1.0, 1.9])
@pytest.mark.parametrize(
    ("integrator", "damper", "treated"),
    [
        ("EULER", "joint", IMPLICIT),
        ("IMPLICITFAST", "joint", IMPLICIT),
        ("RK4", "joint", RK4),
        ("EULER", "tendon", EXPLICIT),
        ("IMPLICITFAST", "tendon", IMPLICIT),
        ("RK4", "tendon", RK4),
    ],
)
def test_temperature_of_a_damper(integrator, damper, treated, decay):
    """T/kT = 2 (1 - R)/(z (1 + R)), at z = lambda h, where a step multiplies a velocity by R.

    A step does v -> R v + (1 - R)/z sqrt(2 z kT/m) xi; the variance that stays is that.
    """
    model = dampers(damper, decay)
    model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}")
    kept = GROWTH[treated](decay)
    theory = 2 * (1 - kept) / (decay * (1 + kept))
    data = mujoco.MjData(model)
    squares = []
    with mm.magnetism():
        mujoco.mj_step(model, data, nstep=100)
        for _ in range(2000):
            mujoco.mj_step(model, data)
            squares.append(data.qvel**2)
    each = np.mean(squares, axis=0)  # of independent masses
    error = each.std(ddof=1) / np.sqrt(MASSES)
    assert error < 0.012 * theory  # 0.011
    assert abs(each.mean() - theory) < 4 * error  # 1.7 errors at the most


@pytest.mark.parametrize(
    ("integrator", "decay", "bears"),
    [("EULER", 2.8, True), ("EULER", 30.0, True), ("RK4", 2.77, True), ("RK4", 2.8, False)],
)
def test_stability_of_a_damped_joint(integrator, decay, bears):
    """Implicit damping is always stable, Runge-Kutta for lambda h < 2.785."""
    model = dampers("joint", decay, masses=1)
    model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}")
    data = mujoco.MjData(model)
    data.qvel[:] = 1e4
    with mm.magnetism():
        mujoco.mj_step(model, data, nstep=200)
    assert (abs(data.qvel[0]) < 1e4) == bears  # 0.7, 0.3, 99; 8.4e5
