"""The linear friction of models: C(q) against MuJoCo's own forces."""

import mujoco
import numpy as np
import pytest

from magmotor.mjcf.langevin.friction import friction_matrix, model_friction

TREE = """
<mujoco>
  <option viscosity="0.3" gravity="0 0 -9.8"/>
  <default><geom contype="0" conaffinity="0" density="700"/></default>
  <worldbody>
    <site name="anchor" pos="0.4 0.1 1"/>
    <body name="floating" pos="0 0 1">
      <freejoint name="free"/>
      <geom type="box" size="0.1 0.05 0.02"/>
      <site name="hull" pos="0.1 0 0.02" euler="20 10 50"/>
      <body name="arm" pos="0.2 0 0" euler="10 20 30">
        <joint name="ball" type="ball" damping="0.04" pos="0 0 0.02"/>
        <geom name="rod" type="capsule" size="0.02 0.1" pos="0.02 0.01 0.1" fluidshape="ellipsoid"/>
        <geom name="knob" type="sphere" size="0.03" pos="0 0 0.2" fluidshape="ellipsoid"/>
        <site name="elbow" pos="0 0 0.2"/>
        <body name="hand" pos="0 0 0.2" euler="0 40 10">
          <joint name="wrist" axis="1 0.3 0" damping="0.02"/>
          <joint name="reach" type="slide" axis="0 0.2 1" damping="0.5"/>
          <geom type="cylinder" size="0.03 0.06" pos="0 0.05 0" fluidshape="ellipsoid"/>
          <geom type="ellipsoid" size="0.03 0.06 0.02" pos="0 0 0.05" fluidshape="ellipsoid"/>
          <site name="tip" pos="0 0.1 0.05" euler="0 30 0"/>
          <body name="welded" pos="0.1 0 0"><geom type="box" size="0.02 0.03 0.04"/></body>
        </body>
      </body>
      <body name="leg" pos="-0.2 0 0">
        <joint name="hip" axis="0 1 0.5" damping="0.03" pos="0.01 0 0"/>
        <geom type="box" size="0.02 0.04 0.1"/>
        <site name="foot" pos="0 0 -0.1"/>
      </body>
    </body>
    <body name="other" pos="0 0.5 1">
      <joint name="pivot" axis="0 0 1" damping="0.01"/>
      <geom name="post" type="cylinder" size="0.03 0.08" pos="0.05 0 0"/>
      <site name="crank" pos="0.08 0 0"/>
      <site name="slider" pos="0 0 0.3" euler="0 90 0"/>
    </body>
    <body mocap="true"><geom size="0.1"/></body>
  </worldbody>
  <tendon>
    <fixed name="fixed" damping="0.2">
      <joint joint="wrist" coef="0.7"/><joint joint="hip" coef="-1.2"/>
    </fixed>
    <spatial name="spatial" damping="0.6">
      <site site="anchor"/><site site="hull"/><geom geom="post"/><site site="tip"/>
      <pulley divisor="2"/><site site="foot"/><site site="crank"/>
    </spatial>
    <spatial name="undamped"><site site="anchor"/><site site="elbow"/></spatial>
  </tendon>
  <actuator>
    <velocity joint="wrist" kv="0.3" gear="2"/>
    <position joint="hip" kp="2" kv="0.2"/>
    <motor joint="reach" gear="3" damping="0.4"/>
    <motor joint="reach" gear="2" damping="0.1"/>
    <general joint="ball" gear="0.3 0.1 0.7" biastype="affine" biasprm="0 0 -0.5"/>
    <general jointinparent="ball" gear="0.2 0.5 0.1" biastype="affine" biasprm="0 0 -0.4"/>
    <general joint="free" gear="1 0 2 0.3 0.1 0.7" biastype="affine" biasprm="0 0 -0.5"/>
    <velocity tendon="spatial" kv="0.3" gear="1.5" damping="0.2"/>
    <velocity tendon="undamped" kv="0.3"/>
    <general site="tip" gear="1 0 2 0.3 0 0.1" biastype="affine" biasprm="1 0 -0.2"/>
    <general site="tip" refsite="hull" gear="1 0 2 0 0 0.1" biastype="affine" biasprm="0 0 -0.2"/>
    <general cranksite="crank" slidersite="slider" cranklength="0.5"
             biastype="affine" biasprm="1 2 -0.2"/>
    <general joint="hip" gaintype="affine" gainprm="1 2 0" biasprm="0 0 7"/>
    <velocity joint="wrist" kv="0.3" group="3"/>
  </actuator>
</mujoco>
"""
"""A branched tree with joints of every type, an unattached body, and every damper that is linear.

One actuator's `biasprm` has no effect, since its `biastype` is none.
"""


def finite_differences(model: mujoco.MjModel, qpos: np.ndarray) -> np.ndarray:
    """Return -df/dv of MuJoCo's forces, by central differences; exact where f is linear in v."""
    data = mujoco.MjData(model)

    def force(qvel):
        data.qpos[:], data.qvel[:] = qpos, qvel
        mujoco.mj_forward(model, data)
        return data.qfrc_passive + data.qfrc_actuator

    return np.array([force(-unit) - force(unit) for unit in np.eye(model.nv)]).T / 2


def friction_at(model: mujoco.MjModel, qpos: np.ndarray) -> np.ndarray:
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_fwdPosition(model, data)
    return friction_matrix(model, data, model_friction(model))


def random_positions(model: mujoco.MjModel, count: int, seed: int):
    """Yield configurations that differ from `qpos0` by random velocities."""
    generator = np.random.default_rng(seed)
    for _ in range(count):
        qpos = model.qpos0.copy()
        mujoco.mj_integratePos(model, qpos, generator.normal(size=model.nv), 1.0)
        yield qpos


@pytest.mark.parametrize(
    "flags", [(), ("damper",), ("actuation",), ("spring",), ("spring", "damper")], ids=str
)
def test_matrix_agrees_with_the_forces_of_mujoco(flags):
    model = mujoco.MjModel.from_xml_string(TREE)
    for flag in flags:
        model.opt.disableflags |= getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag.upper()}")
    for qpos in random_positions(model, 10, seed=1):
        expected = finite_differences(model, qpos)
        scale = abs(expected).max()
        assert scale > 0.1
        assert abs(friction_at(model, qpos) - expected).max() < 4e-15 * scale  # 4e-16


def test_a_disabled_group_of_actuators_does_not_damp():
    model = mujoco.MjModel.from_xml_string(TREE)
    whole = friction_at(model, model.qpos0)
    model.opt.disableactuator = 1 << 3
    expected = finite_differences(model, model.qpos0)
    wrist = model.joint("wrist").dofadr[0]
    assert whole[wrist, wrist] - expected[wrist, wrist] == pytest.approx(0.3, rel=1e-13)
    assert abs(friction_at(model, model.qpos0) - expected).max() < 4e-15 * abs(expected).max()
