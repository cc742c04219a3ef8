"""The linear friction of models: C(q) against MuJoCo's own forces, and each refusal."""

import mujoco
import numpy as np
import pytest

from magmotor.mjcf.langevin.friction import friction_matrix, model_friction
from magmotor.mjcf.langevin.supported import check_numbers, check_tree

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


CART = """
<mujoco>
  <option {option}>{flags}</option>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1" {floor}/>
    <body name="cart">
      <joint name="rail" type="slide" axis="1 0 0" {rail}/>
      <geom name="box" type="box" size="0.1 0.1 0.1" {box}/>
      <body name="pole" pos="0 0 0.1">
        <joint name="pin" axis="0 1 0" {pin}/>
        <geom name="rod" type="capsule" fromto="0 0 0 0 0 1" size="0.02"/>
        <site name="top" pos="0 0 1"/>
        <body name="bob" pos="0 0 1.5">
          <joint name="ball" type="ball" {ball}/>
          <geom size="0.1"/>
        </body>
      </body>
    </body>
  </worldbody>
  <contact>{pair}</contact>
  <tendon>
    <fixed name="cord" {cord}><joint joint="rail" coef="1"/><joint joint="pin" coef="2"/></fixed>
  </tendon>
  <equality>{equality}</equality>
  <actuator>{actuator}</actuator>
</mujoco>
"""
PARTS = (
    "option", "flags", "floor", "rail", "box", "pin", "ball", "pair", "cord",
    "equality", "actuator",
)  # fmt: skip


def cart(disable="", **parts):
    flags = f'<flag {disable}="disable"/>' if disable else ""
    text = CART.format(**dict.fromkeys(PARTS, "") | {"flags": flags} | parts)
    return mujoco.MjModel.from_xml_string(text)


SERVO = '<general name="servo" {}="{}" biastype="affine" biasprm="0 0 -2" {}/>'


@pytest.mark.parametrize(
    ("parts", "message", "flag"),
    [
        ({"rail": 'damping="1 0.5"'}, "joint 'rail': dampingpoly", "damper"),
        ({"cord": 'damping="1 0.5"'}, "tendon 'cord': dampingpoly", "damper"),
        ({"actuator": '<motor name="servo" joint="pin" damping="0 1"/>'},
         "actuator 'servo': dampingpoly", "damper"),
        ({"actuator": '<damper name="servo" joint="pin" kv="2" ctrlrange="0 1"/>'},
         r"actuator 'servo': gainprm\[2\]", "actuation"),
        ({"actuator": '<muscle name="servo" joint="pin" lengthrange="0 1"/>'},
         "actuator 'servo': gaintype = 'muscle'", "actuation"),
        ({"actuator": '<general name="servo" joint="pin" gaintype="user"/>'},
         "actuator 'servo': gaintype = 'user'", "actuation"),
        ({"actuator": '<general name="servo" joint="pin" biastype="user"/>'},
         "actuator 'servo': biastype = 'user'", "actuation"),
        ({"actuator": '<general name="servo" joint="pin" dyntype="integrator"/>'},
         "actuator 'servo': dyntype = 'integrator'", "actuation"),
        ({"actuator": '<motor name="servo" joint="pin" delay="0.01" nsample="20"/>'},
         "actuator 'servo': delay", "actuation"),
        ({"actuator": '<general name="servo" joint="pin" biastype="affine" biasprm="0 0 3"/>'},
         r"actuator 'servo': biasprm\[2\] = 3.0", "actuation"),
        ({"actuator": SERVO.format("joint", "pin", 'forcerange="-1 1"')},
         "actuator 'servo': forcerange", "actuation"),
        ({"actuator": SERVO.format("joint", "pin", ""), "pin": 'actuatorfrcrange="-1 1"'},
         "joint 'pin': actfrcrange", "actuation"),
        ({"actuator": SERVO.format("tendon", "cord", ""), "rail": 'actuatorfrcrange="-1 1"'},
         "joint 'rail': actfrcrange", "actuation"),
        ({"actuator": SERVO.format("tendon", "cord", ""), "cord": 'actuatorfrcrange="-1 1"'},
         "tendon 'cord': actfrcrange", "actuation"),
        ({"option": 'density="1"'}, "option density = 1.0", None),
        ({"option": 'viscosity="1" wind="1 0 0"'}, "option wind", None),
    ],
    ids=str,
)  # fmt: skip
def test_friction_without_a_law_is_named(parts, message, flag):
    with pytest.raises(ValueError, match=message) as caught:
        model_friction(cart(**parts))
    if flag:
        assert f"disable the flag {flag}" in str(caught.value)
        model_friction(cart(flag, **parts))


@pytest.mark.parametrize(
    ("field", "name"), [("dof_damping", "joint 'rail'"), ("tendon_damping", "tendon 'cord'")]
)
def test_negative_damping_is_named(field, name):
    model = cart()
    getattr(model, field)[0] = -0.1
    with pytest.raises(ValueError, match=f"{name}: damping = -0.1: negative damping"):
        model_friction(model)


RUBBING = 'contype="1" conaffinity="1"'


@pytest.mark.parametrize(
    ("parts", "message", "flag"),
    [
        ({"rail": 'frictionloss="1"'}, "joint 'rail': frictionloss", "frictionloss"),
        ({"cord": 'frictionloss="1"'}, "tendon 'cord': frictionloss", "frictionloss"),
        ({"cord": 'armature="1"'}, "tendon 'cord': armature", None),
        ({"actuator": '<motor name="servo" tendon="cord" armature="1"/>'},
         "actuator 'servo': armature", None),
        ({"box": RUBBING, "floor": RUBBING}, "geom 'floor' and geom 'box': condim = 3", "contact"),
        ({"box": f'{RUBBING} condim="1"', "floor": f'{RUBBING} condim="3"'},
         "geom 'floor' and geom 'box': condim = 3", "contact"),
        ({"pair": '<pair name="p" geom1="box" geom2="floor"/>'}, "pair 'p': condim = 3", "contact"),
        ({"pair": '<pair name="p" geom1="box" geom2="floor" friction="1e6 1e6"/>'},
         "pair 'p': friction = 1000000.0: .* without kT", "contact"),
        ({"actuator": '<adhesion name="servo" body="cart" ctrlrange="0 1"/>'},
         "actuator 'servo': transmission = 'body'", "actuation"),
        ({"actuator": '<position name="servo" joint="ball" kp="1"/>'},
         "actuator 'servo': transmission = 'joint'", "actuation"),
        ({"actuator": '<general name="servo" site="top" biastype="affine" biasprm="1 0 0"/>'},
         "actuator 'servo': transmission = 'site'", "actuation"),
        ({"actuator": '<position name="servo" tendon="cord" kp="1"/>',
          "pin": 'actuatorfrcrange="-1 1"'}, "joint 'pin': actfrcrange", "actuation"),
    ],
    ids=str,
)  # fmt: skip
def test_what_a_tree_at_temperature_must_not_have_is_named(parts, message, flag):
    with pytest.raises(ValueError, match=message):
        check_tree(cart(**parts))
    if flag:
        check_tree(cart(flag, **parts))


@pytest.mark.parametrize(
    "parts",
    [
        {},
        {"rail": 'range="-1 1" limited="true" damping="1" stiffness="3"'},
        {"box": f'{RUBBING} condim="1"', "floor": f'{RUBBING} condim="1"'},
        {"box": f'{RUBBING} condim="1" priority="1"', "floor": f'{RUBBING} condim="3"'},
        {"pair": '<pair geom1="box" geom2="floor" condim="1"/>', "box": RUBBING, "floor": RUBBING},
        {"equality": '<joint joint1="rail" joint2="pin"/><connect body1="bob" anchor="0 0 0"/>'},
        {"actuator": '<position joint="pin" kp="3" kv="1"/><motor site="top" gear="1 0 0 0 0 0"/>'},
        {"actuator": '<position joint="pin" kp="3" forcerange="-1 1"/>'},
        {"option": 'viscosity="1"', "ball": 'armature="0.1" damping="1"'},
    ],
    ids=str,
)  # fmt: skip
def test_what_a_tree_at_temperature_may_have(parts):
    check_tree(cart(**parts))
    model_friction(cart(**parts))


def check(model):
    check_numbers(model)
    check_tree(model)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda model: model.dof_armature.__setitem__(3, 1.0), "joint 'ball': armature"),
        (lambda model: model.jnt_stiffness.__setitem__(0, np.nan), "jnt_stiffness of the model"),
        (lambda model: setattr(model.opt, "timestep", 0.0), "timestep = 0.0"),
        (lambda model: setattr(model.opt, "enableflags", int(mujoco.mjtEnableBit.mjENBL_SLEEP)),
         "flag sleep"),
    ],
)  # fmt: skip
def test_numbers_that_a_tree_at_temperature_must_not_have(change, message):
    model = cart()
    change(model)
    with pytest.raises(ValueError, match=message):
        check(model)
