"""Brownian rows and joint noise: their covariance is 2 kT C(q), with C from MuJoCo's own forces."""

import warnings

import mujoco
import numpy as np
import pytest

import magmotor as mm

TREE = """
<mujoco>
  <option gravity="0 0 0" {option}/>
  <custom><text name="magmotor" data="noise"/></custom>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <body name="base" pos="0 0 1">
      {base}
      <geom type="box" size="0.1 0.05 0.02"/>
      <geom size="0.02" pos="0.1 0.02 0.01" mass="0" {shape}/>
      <body name="link" pos="0.2 0 0">
        <joint name="elbow" axis="1 2 0" damping="{elbow}" pos="0.01 0 0"/>
        <geom type="capsule" size="0.02 0.1" pos="0.02 0.01 0.1"/>
      </body>
    </body>
    <body name="other" pos="0 0.5 1">
      <joint name="pivot" axis="0 0.3 1" pos="0.04 0.02 0" damping="{pivot}"/>
      <geom type="capsule" size="0.03 0.08"/>
    </body>
  </worldbody>
  <tendon>{tendon}</tendon>
  <actuator>{actuator}</actuator>
</mujoco>
"""
DEFAULTS = {
    "option": "", "base": "<freejoint/>", "elbow": "0", "pivot": "0", "shape": "", "tendon": "",
    "actuator": "",
}  # fmt: skip

HINGE = '<joint name="axle" axis="0 1 0" damping="0.3" pos="0.03 0 0"/>'
SLIDES = '<joint type="slide" axis="1 0 0" damping="0.2"/><joint type="slide" damping="0.3"/>'
TENDON = """<fixed name="cord" damping="1">
<joint joint="{}" coef="2"/><joint joint="{}" coef="1"/></fixed>"""


def tree(**parts):
    return mujoco.MjSpec.from_string(TREE.format(**DEFAULTS | parts))


def with_rows(spec, kT):
    """Return the model with the rows, as a user adds them."""
    for body, row in zip(spec.bodies, mm.brownian_rows(spec.compile(), kT), strict=True):
        body.userdata = row
    return spec.compile()


def random_states(model, count):
    """Yield `MjData` in configurations that the package does not choose."""
    generator, data = np.random.default_rng(5), mujoco.MjData(model)
    for _ in range(count):
        mujoco.mj_resetData(model, data)
        mujoco.mj_integratePos(model, data.qpos, generator.normal(size=model.nv), 1.0)
        yield data


def damping_of(model, data):
    """Return C by differences of MuJoCo's own forces; they are linear in the velocity."""

    def force(qvel):
        data.qvel[:] = qvel
        mujoco.mj_forward(model, data)
        return data.qfrc_passive + data.qfrc_actuator

    return np.array([force(-unit) - force(unit) for unit in np.eye(model.nv)]).T / 2


def covariance_of_rows(model, data):
    """Return J^T w w^T J, by `mj_applyFT` of each row."""
    total = np.zeros((model.nv, model.nv))
    for body, row in enumerate(model.body_user):
        for wrench in row.reshape(-1, 6):
            force = np.zeros(model.nv)
            mujoco.mj_applyFT(
                model, data, wrench[:3], wrench[3:], data.xipos[body].copy(), body, force
            )
            total += np.outer(force, force)
    return total


@pytest.mark.parametrize(
    "parts",
    [
        {"option": 'viscosity="0.4"'},
        {"option": 'viscosity="0.4"', "base": HINGE, "pivot": 0.1},
        {"option": 'viscosity="0.4"', "base": '<joint type="ball" damping="0.2"/>'},
        {"base": '<freejoint name="f"/>', "pivot": 0.2},
        {"base": SLIDES},
        {"base": SLIDES + '<joint axis="0 0 1" damping="0.5"/>'},
        {"base": HINGE, "actuator": '<velocity joint="axle" kv="0.4" gear="3"/>'},
        {"base": SLIDES.replace("<joint type", '<joint name="a" type', 1).replace(
            '<joint type', '<joint name="b" type'), "tendon": TENDON.format("a", "b")},
        {"option": 'viscosity="1"', "base": SLIDES, "shape": 'fluidshape="ellipsoid"'},
        {"option": 'viscosity="1"', "base": '<joint axis="0 1 0"/>',
         "shape": 'fluidshape="ellipsoid"'},
    ],
    ids=str,
)  # fmt: skip
def test_rows_have_the_covariance_of_the_damping(parts):
    model = with_rows(tree(**parts), kT=0.3)
    for data in random_states(model, 5):
        expected = 0.6 * damping_of(model, data)
        assert expected.any()
        error = abs(covariance_of_rows(model, data) - expected).max()
        assert error < 3e-14 * expected.max()  # measured: 1e-15
    assert mm.describe(model).kT == pytest.approx((0.3, 0.3), rel=1e-12)


EVERY_DAMPER = {
    "option": 'viscosity="0.4"', "base": HINGE, "elbow": 0.2,
    "tendon": TENDON.format("elbow", "pivot"),
    "actuator": '<velocity joint="elbow" kv="0.4" gear="3"/>',
}  # fmt: skip


def test_joint_noise_has_the_covariance_of_the_damping():
    """20000 forces; the error of each element over sqrt(a b) is below 4.9/sqrt(20000).

    The normalized elements have standard errors of at most sqrt(2/20000). Six different ones give
    a false alarm with a chance of 6 6e-4 = 0.3 % for a deviation of 3.5 sqrt(2/20000); seed 3.
    """
    model = tree(**EVERY_DAMPER).compile()
    data = next(random_states(model, 1))
    noise = mm.JointNoise(model, kT=0.3, seed=3)
    forces = np.empty((20000, model.nv))
    for k, force in enumerate(forces):
        data.time = k * model.opt.timestep
        force[:] = noise.force(data)
    expected = 0.6 * damping_of(model, data) / model.opt.timestep
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    errors = (forces.T @ forces / len(forces) - expected) / scale
    assert abs(errors).max() < 3.5 * np.sqrt(2 / 20000)


def test_joint_noise_depends_on_seed_replica_and_step_only():
    model = tree(**EVERY_DAMPER).compile()
    data = next(random_states(model, 1))

    def force(step=4, **path):
        data.time = step * model.opt.timestep
        return mm.JointNoise(model, 1.0, **path).force(data)

    assert np.array_equal(force(seed=1), force(seed=1))
    for path in ({"seed": 2}, {"seed": 1, "replica": 1}, {"seed": 1, "step": 5}):
        assert (force(**path) != force(seed=1)).all()


FLOOR = "<geom name='floor' type='plane' size='1 1 1' contype='3' conaffinity='3'{}/>"


@pytest.mark.parametrize(
    ("text", "is_dry"),
    [
        ('<joint name="elbow" frictionloss="0.1"', True),
        ('<fixed name="cord" frictionloss="0.1"', True),
        (FLOOR.format(""), True),
        (FLOOR.format(" condim='1'"), False),
    ],
)
def test_joint_noise_warns_once_of_dry_friction(text, is_dry):
    cord = TENDON.format("elbow", "pivot")
    xml = TREE.format(**DEFAULTS | {"elbow": "0.1", "tendon": cord})
    if text.startswith("<geom"):
        condim = "" if is_dry else ' condim="1"'
        xml = xml.replace("<worldbody>", "<worldbody>" + text)
        xml = xml.replace('conaffinity="0"/>', f'conaffinity="1"{condim}/>')
    else:
        xml = xml.replace(" ".join(text.split()[:2]), text)
    model = mujoco.MjModel.from_xml_string(xml)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        mm.JointNoise(model, 1.0).force(mujoco.MjData(model))
    assert [one.filename for one in caught] == [__file__] * is_dry
