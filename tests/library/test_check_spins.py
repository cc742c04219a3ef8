"""`check` finds spins that an integrator does not keep, and how fast they grow in MuJoCo."""

import itertools

import mujoco
import numpy as np
import pytest

import magmotor as mm
from magmotor.mjcf.checking.gyroscopic import unkept_spin
from magmotor.mjcf.lookup import INTEGRATORS

BODY = """
<mujoco>
  <option gravity="0 0 0" integrator="{integrator}" timestep="{step}" {option}/>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    {other}<body name="top">
      {joint}<inertial pos="{place}" mass="1" diaginertia="{inertia}" euler="{turned} 0 0"/>
      <geom size="0.1"/>{child}
    </body>
  </worldbody>
</mujoco>
"""
FREE, BALL = "<freejoint/>", '<joint type="ball"/>'
WHEEL = """<body name="wheel" pos="0 0 0.3"><joint axis="0 0 1"/>
<inertial pos="0 0 0" mass="0.5" diaginertia="0.6 0.6 1.1"/><geom size="0.1"/></body>"""
STIFF = '<body><joint damping="5000"/><geom size="0.1" mass="100"/></body>'
GIMBALS = """
<mujoco>
  <option gravity="0 0 0" integrator="{integrator}" timestep="{step}"/>
  <worldbody>
    <body><joint axis="1 0 0"/><inertial pos="0 0 0" mass="1" diaginertia="1e-3 1e-3 1e-3"/>
      <body><joint axis="0 1 0"/><inertial pos="0 0 0" mass="1" diaginertia="1e-3 1e-3 1e-3"/>
        <body name="wheel">
          <joint axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="6e-3 6e-3 8e-3"/>
        </body></body></body>
  </worldbody>
</mujoco>
"""


def load(text=BODY, **parts):
    common = {"integrator": "Euler", "step": 1e-3, "joint": FREE, "inertia": "1 1 1.7",
              "place": "0 0 0", "turned": 0, "option": "", "child": "", "other": ""}  # fmt: skip
    return mujoco.MjModel.from_xml_string(text.format(**common | parts))


def spinning(model, spin):
    """A state whose last velocities are a spin."""
    data = mujoco.MjData(model)
    data.qvel[-len(spin) :] = spin
    return data


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_spin_is_judged_with_each_integrator(integrator):
    model = load(integrator=integrator, step=1e-2)
    (finding,) = mm.check(model, spinning(model, (0, 0, 90))).findings
    assert f"since the integrator {integrator} " in finding


@pytest.mark.parametrize("step", [1e-5, 2e-6])
def test_a_shorter_timestep_is_proposed_however_short_that_of_the_model_is(step):
    model = load(step=step)
    found = mm.check(model, spinning(model, (0, 0, 0.12 / step)))
    assert "or a timestep of at most" in found.findings[0]
    assert "a shorter timestep" not in found.findings[0]


def test_a_keyframe_whose_name_is_no_utf_8_is_named(tmp_path):
    text = CASE.replace('name="spin"', 'name="drehen \xfc"')
    path = tmp_path / "model.xml"
    path.write_bytes(text.encode("latin-1"))
    (finding,) = mm.check(mujoco.MjModel.from_xml_path(str(path))).findings
    assert "in keyframe 'drehen \xfc'" in finding


def measured_growth(model, data, duration):
    """The rate at which a small disturbance of a steady spin grows in MuJoCo, in 1/s."""
    still = data.qvel[-3:] == 0
    data.qvel[-3:] += 1e-7 * np.linalg.norm(data.qvel) * np.array([0.7, 0.6, 0.5])
    growing = []
    for _ in range(int(duration / model.opt.timestep)):
        mujoco.mj_step(model, data)
        growing.append(np.linalg.norm(data.qvel[-3:][still]))
    later = growing[len(growing) // 2 :]  # where the fastest mode is the largest
    return np.polyfit(model.opt.timestep * np.arange(len(later)), np.log(later), 1)[0]


DAMPED = '<joint type="free" damping="{}"/>'
SPINS = [
    ({}, (0, 0, 50)),
    ({"inertia": "1 1.3 1.8"}, (0, 0, 60)),
    ({"inertia": "1 1.3 1.8"}, (60, 0, 0)),
    ({"inertia": "1 1.2 0.5"}, (0, 0, 40)),
    ({"place": "0.1 0.2 0.3"}, (0, 0, 50)),
    ({"joint": BALL, "step": 4e-3}, (0, 0, 100)),
    ({"joint": BALL, "integrator": "implicitfast"}, (0, 0, 50)),
    ({"child": WHEEL}, (0, 0, 0, 80)),
    ({"child": WHEEL, "integrator": "implicitfast"}, (0, 0, 0, 80)),
    ({"text": GIMBALS}, (0, 0, 50)),
    ({"integrator": "implicit"}, (0, 0, 50)),
    ({"integrator": "implicit", "joint": BALL}, (0, 0, 50)),
    ({"integrator": "implicitfast"}, (0, 0, 50)),
    ({"integrator": "RK4", "step": 3e-2}, (0, 0, 50)),
    ({"integrator": "discrete"}, (0, 0, 50)),
    ({"integrator": "discrete", "joint": BALL}, (0, 0, 50)),
    ({"integrator": "discrete", "child": WHEEL}, (0, 0, 0, 80)),
]
if "discrete" not in INTEGRATORS:  # before MuJoCo 4
    SPINS = SPINS[:-3]


@pytest.mark.parametrize(("parts", "spin"), SPINS)
def test_the_growth_is_that_of_the_motion(parts, spin):
    model = load(**parts)
    found = unkept_spin(model, spinning(model, spin))
    assert found
    rate = measured_growth(model, spinning(model, spin), 6 / abs(found.rate))
    assert found.rate == pytest.approx(rate, rel=0.02)  # 0.012


@pytest.mark.parametrize("parts", [{"joint": DAMPED.format(0.05)}, {"option": 'viscosity="2e-3"'}])
def test_damping_lowers_the_growth(parts):
    """The spin of 80 rad/s decays within the 10,000 timesteps that count."""
    model = load(**parts)
    data = spinning(model, (1e-9, 0, 80))
    found, free = unkept_spin(model, data), unkept_spin(load(), data)
    assert found
    assert free
    mujoco.mj_step(model, data, nstep=10000)
    growth = np.log(np.linalg.norm(data.qvel[3:5]) / 1e-9) / 10
    assert found.rate == pytest.approx(growth, rel=0.01)  # 7e-4
    assert found.rate < 0.9 * free.rate


@pytest.mark.parametrize("inertia", ["1 1 1.7", "1 1.3 1.8", "1 2 2.9", "1 1.05 1.9"])
def test_the_formula_for_three_moments_of_inertia(inertia):
    """sum over the axes k of (I_k - I_i)(I_k - I_j)/(I_i I_j) w_k^2 h/2, for spins about one."""
    moments = np.array(inertia.split(), float)
    for k, (i, j) in enumerate([(1, 2), (2, 0), (0, 1)]):
        product = (moments[k] - moments[i]) * (moments[k] - moments[j]) / moments[i] / moments[j]
        for speed, step in itertools.product((30.0, 100.0), (1e-3, 1e-4)):
            model = load(inertia=inertia, step=step)
            found = unkept_spin(model, spinning(model, speed * np.eye(3)[k]))
            rate = product * speed**2 * step / 2
            if rate * step > 1.1e-4:  # e-fold within 10,000 steps
                assert found
                assert found.speed == pytest.approx(speed, rel=1e-12)
                expected = np.log1p(2 * rate * step) / (2 * step)
                assert found.rate == pytest.approx(expected, rel=2e-11)  # 7e-13
            elif product >= 0:
                assert not found


@pytest.mark.parametrize("inertia", ["1 1.3 1.8", "1 2 2.9", "1 1.8 1.9"])
def test_bodies_that_tumble(inertia):
    """The growth of the angular momentum, which the true motion keeps; the estimate is rough."""
    moments = np.array(inertia.split(), float)
    for direction in ([0, 1, 1e-3], [1, 1, 0], [0, 1, 1], [1, 0, 1], [1, 1, 1]):
        model = load(inertia=inertia)
        spin = 60 * np.array(direction) / np.linalg.norm(direction)
        found = unkept_spin(model, spinning(model, spin))
        data = spinning(model, spin)
        mujoco.mj_step(model, data, nstep=1500)
        rate = (
            np.log(np.linalg.norm(moments * data.qvel[3:]) / np.linalg.norm(moments * spin)) / 1.5
        )
        if found:
            assert 0.25 < found.rate / rate < 4  # 0.27 to 3.3
        else:
            assert rate < 0.1  # 0.08


@pytest.mark.parametrize(("inertia", "duration"), [("1 1.3 1.8", 0.5), ("1 2 2.9", 0.3)])
def test_spins_about_the_middle_axis_tumble(inertia, duration):
    """The angular momentum grows although w x I w is nearly 0 at first."""
    moments, spin = np.array(inertia.split(), float), 200 * np.array([1e-3, 1, 1e-3])
    model = load(inertia=inertia)
    found, data = unkept_spin(model, spinning(model, spin)), spinning(model, spin)
    mujoco.mj_step(model, data, nstep=round(duration / model.opt.timestep))
    growth = np.linalg.norm(moments * data.qvel[3:]) / np.linalg.norm(moments * spin)
    assert found
    assert found.rate == pytest.approx(np.log(growth) / duration, rel=0.5)  # 0.32


@pytest.mark.parametrize("joint", [FREE, BALL])
@pytest.mark.parametrize("integrator", ["Euler", "implicit", "implicitfast"])
def test_bodies_that_tumble_at_long_timesteps(integrator, joint):
    """They turn by 1 rad in a timestep; explicit methods let them speed up, others brake them."""
    model = load(joint=joint, integrator=integrator, inertia="1 1.7 2", step=0.018)
    moments, spin = np.array([1, 1.7, 2]), np.array([-36.8, 42, -21.7])
    found, data = unkept_spin(model, spinning(model, spin)), spinning(model, spin)
    mujoco.mj_step(model, data, nstep=10)
    growth = np.linalg.norm(moments * data.qvel[-3:]) / np.linalg.norm(moments * spin)
    assert found
    assert found.rate == pytest.approx(np.log(growth) / 0.18, rel=0.5)  # 0.32


@pytest.mark.parametrize(
    ("parts", "spin"),
    [
        ({"integrator": "RK4"}, (0, 0, 50)),
        ({"integrator": "RK4", "text": GIMBALS}, (0, 0, 50)),
        ({"inertia": "1 1 1"}, (300, 200, 100)),
        ({"inertia": "1 1 1.7"}, (500, 0, 0)),
        ({"joint": '<joint axis="0 0 1"/>'}, (0, 0, 500)[2:]),
        ({}, (0, 0, 15)),
        ({"joint": DAMPED.format(2)}, (0, 0, 50)),
        ({"option": 'viscosity="3"'}, (0, 0, 50)),
    ],
)
def test_spins_that_stay_are_no_finding(parts, spin):
    model = load(**parts)
    assert not unkept_spin(model, spinning(model, spin))
    assert mm.check(model, spinning(model, spin)).findings == ()
    data = spinning(model, spin)
    data.qvel[-3:] *= 1 + 1e-3 * np.array([0.7, 0.6, 0.5][-len(spin) :])
    before = abs(data.qvel).max()
    mujoco.mj_step(model, data, nstep=3000)
    assert abs(data.qvel).max() < 1.01 * before


@pytest.mark.parametrize(
    ("field", "value"),
    [("body_dofadr", 2), ("body_jntadr", 2), ("tree_dofadr", -1), ("tree_dofnum", 7)],
)
def test_a_model_whose_parts_are_not_in_order_is_an_error(field, value):
    """MuJoCo's own functions, which take them as sorted, could crash."""
    model = load(other=STIFF)
    data = spinning(model, (0, 0, 50))
    getattr(model, field)[0] = value
    with pytest.raises(mm.InputError):
        mm.check(model, data)


def test_joints_that_move_alike_are_left_out():
    """Their inertia is singular."""
    joints = 2 * '<joint axis="0 0 1"/>' + '<joint axis="1 0 0"/><joint axis="0 1 0"/>'
    model = load(joint=joints)
    assert not unkept_spin(model, spinning(model, (10, 20, 30, 40)))


CASE = """
<mujoco>
  <option gravity="0 0 0"/>
  <custom>
    <text name="magmotor" data="dipoles fields"/><numeric name="field" data="0 0 2e-3"/>
  </custom>
  <worldbody>
    <body name="top"><freejoint/>
      <inertial pos="0 0 0" mass="0.022" diaginertia="1.32e-6 1.32e-6 2.2e-6"/>
      <geom type="cylinder" size="0.014 0.003"/><site user="0.65"/></body>
  </worldbody>
  <keyframe>
    <key name="rest"/>
    <key name="spin" qpos="0 0 0 0.9999875 0.005 0 0" qvel="0 0 0 0 0 157.08"/>
  </keyframe>
</mujoco>"""


def largest_tilt(model, duration=2.0):
    """In degrees, from the keyframe that spins."""
    data, cosine = mujoco.MjData(model), 1.0
    mujoco.mj_resetDataKeyframe(model, data, 1)
    with mm.magnetism():
        while data.time < duration and abs(data.qvel).max() < 1e6:
            mujoco.mj_step(model, data)
            cosine = min(cosine, data.xmat[1, 8])
    return np.degrees(np.arccos(cosine))


def test_a_spinning_magnet_stays_upright_with_what_is_proposed():
    model = mujoco.MjModel.from_xml_string(CASE)
    assert largest_tilt(model) > 90
    found = mm.check(model)
    (finding,) = found.findings
    assert finding.startswith("body 'top' spins at 157 rad/s in keyframe 'spin'")
    assert finding.endswith("take the integrator RK4 or a timestep of at most 9.1e-06 s")
    assert (found.integrator, found.timestep) == ("RK4", 2e-3)
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_EULER
    assert mm.check(model, fix=True).settings == ("set: integrator RK4",)
    assert (model.opt.integrator, model.opt.timestep) == (mujoco.mjtIntegrator.mjINT_RK4, 2e-3)
    assert mm.check(model).findings == ()
    assert largest_tilt(model) < 0.6  # 0.573, as at the start
    model.opt.integrator, model.opt.timestep = mujoco.mjtIntegrator.mjINT_EULER, 9.1e-6
    assert mm.check(model).findings == ()
    assert largest_tilt(model, 0.3) < 0.6  # 0.573


@pytest.mark.parametrize(
    ("parts", "speed", "integrator", "step"),
    [
        ({}, 30, "", 4.5e-4),  # a little shorter is cheaper than RK4
        ({"step": 1e-2}, 300, "RK4", 1.7e-3),  # RK4 must resolve the wobble, too
        ({"step": 2e-2, "integrator": "RK4"}, 300, "", 1.5e-3),
        ({"other": STIFF, "step": 2e-3}, 200, "RK4", 2e-4),  # RK4 is explicit in damping
    ],
)
def test_the_cheaper_remedy_is_proposed(parts, speed, integrator, step):
    model = load(**parts)
    data = spinning(model, (0, 0, speed))
    found = mm.check(model, data, fix=True)
    assert (found.integrator, found.timestep) == (integrator, step)
    assert mm.check(model, data).findings == ()


ROTOR = """
<mujoco>
  <option gravity="0 0 0">{flag}</option>
  <custom><text name="magmotor" data="dipoles {kinds}"/>{custom}</custom>
  <worldbody>
    <body name="rotor" pos="0 0 0.1">
      <joint name="axle" damping="1e-4" {limit}/><geom size="0.01"/>
      <site zaxis="{axis}" user="{moment}"/>{child}
    </body>
    <body name="disk">
      {joint}<geom type="cylinder" size="0.014 0.003" density="7500"/>
      <site zaxis="1 0 0" user="1e-3"/>
    </body>
  </worldbody>
  <actuator><general joint="axle" gear="2e-2" {range}/></actuator>
</mujoco>
"""
ROTOR_PARTS = dict.fromkeys(("kinds", "custom", "flag", "range", "limit", "child"), "")
ROTOR_PARTS |= {"axis": "1 0 0", "moment": 1e-3, "joint": FREE}
OWNED = """<numeric name="field" data="1e-3 0 0"/><tuple name="field">
<element objtype="numeric" objname="field"/><element objtype="body" objname="rotor"/></tuple>"""
TWO_MOTORS = 'ctrlrange="-0.5 0.5"/><motor joint="axle" gear="-2e-2" ctrlrange="-0.5 0.5"'


@pytest.mark.parametrize(
    ("parts", "speed"),
    [
        ({}, 200),
        ({"range": 'ctrlrange="-0.5 0.2"'}, 100),
        ({"range": 'ctrlrange="-1 1" forcerange="-0.3 0.3"'}, 60),
        ({"range": 'ctrlrange="-1 1" forcerange="-0.3 0.3" gainprm="-1"'}, 60),
        ({"range": 'ctrlrange="-0.1 0.1" biastype="affine" biasprm="-0.4"'}, 100),
        ({"range": TWO_MOTORS}, 200),
        ({"flag": '<flag actuation="disable"/>'}, None),
        ({"flag": '<flag clampctrl="disable"/>'}, None),
        ({"moment": 0, "kinds": "fields", "custom": OWNED}, 200),
        ({"axis": "0 0 1"}, None),
        ({"axis": "1 0 2"}, 200),
        ({"limit": 'range="-90 90"'}, None),
        ({"child": '<body><joint axis="1 0 0"/><geom size="0.01"/></body>'}, None),
        ({"joint": '<joint axis="0 0 1"/>'}, None),
        ({"range": 'ctrlrange="-0.01 0.01"'}, None),
    ],
)
def test_magnets_that_follow_what_an_actuator_turns(parts, speed):
    text = ROTOR_PARTS | {"range": 'ctrlrange="-1 1"'} | parts
    model = mujoco.MjModel.from_xml_string(ROTOR.format(**text))
    found = [each for each in mm.check(model).findings if "wobble" in each]
    assert len(found) == (speed is not None)
    if speed:
        assert found[0].startswith(f"body 'disk' can spin at {speed} rad/s as it follows a magnet")


TURNED = """
<mujoco>
  <option gravity="0 0 0" integrator="{integrator}" timestep="{step}"/>
  <custom>
    <text name="magmotor" data="dipoles fields"/><numeric name="field" data="0 0 1e-3"/>
  </custom>
  <worldbody>
    <body name="disk">
      <joint name="joint" type="{kind}" damping="{damping}"/>
      <geom type="cylinder" size="0.014 0.003" density="7500" zaxis="{axis}"/>
      <site name="site" user="1e-3"/>
    </body>
  </worldbody>
  <actuator><general {acts} {range}/></actuator>
  <keyframe><key ctrl="-1"/></keyframe>
</mujoco>
"""
WITHIN = 'ctrlrange="-1 1"'
SATURATED = 'gainprm="1" ctrlrange="-300 300" forcerange="-2e-4 2e-4"'
DAMPS = pytest.mark.skipif(
    not hasattr(mujoco.MjModel, "actuator_damping"), reason="actuators of this MuJoCo do not damp"
)


@pytest.mark.parametrize(
    ("kind", "acts", "range"),
    [
        ("ball", 'joint="joint" gear="0 0 2e-4"', ""),
        ("ball", 'joint="joint" gear="0 0 2e-4"', WITHIN),
        ("ball", 'jointinparent="joint" gear="0 0 2e-4"', WITHIN),
        ("free", 'joint="joint" gear="0 0 0 0 0 2e-4"', WITHIN),
        ("free", 'site="site" gear="0 0 0 0 0 2e-4"', ""),
        ("ball", 'joint="joint" gear="0 0 1" biastype="affine" biasprm="0 0 -1e-5"', SATURATED),
        ("ball", 'joint="joint" gear="0 0 2e-4" biasprm="50 0 0"', WITHIN),
        ("free", 'site="site" gear="0 0 0 0 0 4e-4" biastype="affine" biasprm="0 0 -6.25"', WITHIN),
        pytest.param("ball", 'joint="joint" gear="4e-4 0 0" damping="6.25"', WITHIN, marks=DAMPS),
    ],
)
def test_the_speed_that_actuators_give_is_that_of_the_motion(kind, acts, range):
    """The disk turns about the axis of its torque, which damping balances after 40 s."""
    parts = {"kind": kind, "acts": acts, "range": range, "damping": 1e-6}
    parts["axis"] = "1 0 0" if 'gear="4e-4 0' in acts else "0 0 1"
    slow = mujoco.MjModel.from_xml_string(TURNED.format(integrator="RK4", step=5e-3, **parts))
    data = mujoco.MjData(slow)
    data.ctrl[:] = -300 if range == SATURATED else -1
    mujoco.mj_step(slow, data, 8000)
    euler = mujoco.MjModel.from_xml_string(TURNED.format(integrator="Euler", step=2e-3, **parts))
    [said] = mm.check(euler).findings
    assert said.startswith("body 'disk' can spin at")
    speed = float(said.split(" can spin at ")[1].split()[0])
    assert speed == pytest.approx(np.linalg.norm(data.qvel[-3:]), rel=1e-5)  # 8e-7
    state = mujoco.MjData(euler)
    mujoco.mj_forward(euler, state)
    found = unkept_spin(euler, state)
    assert found
    data = spinning(euler, np.round(data.qvel[-3:], 6))
    data.ctrl[:] = -300 if range == SATURATED else -1
    rate = measured_growth(euler, data, 6 / found.rate)
    assert found.rate == pytest.approx(rate, rel=0.03)  # 0.013


@pytest.mark.parametrize(
    ("damping", "notes"),
    [
        (0, ["spins of body 'disk', whose speed under its actuators is unknown, are not judged"]),
        (1e-6, []),
    ],
)
def test_a_spin_that_nothing_bounds_is_a_note(damping, notes):
    text = TURNED.format(integrator="RK4", step=2e-3, kind="ball", damping=damping,
                         acts='joint="joint" gear="0 0 2e-4"', range="", axis="0 0 1")  # fmt: skip
    _, *found = mm.check(mujoco.MjModel.from_xml_string(text)).notes
    assert found == [f"{note}: give a keyframe with the spin" for note in notes]


TWO_COILS = """
<mujoco>
  <custom>
    <text name="magmotor" data="dipoles fields"/>
    <numeric name="field_x" data="1e-3 0 0"/><numeric name="field_y" data="0 1e-3 0"/>
    <tuple name="field_x">
      <element objtype="numeric" objname="field_x"/><element objtype="actuator" objname="x"/>
    </tuple>
    <tuple name="field_y">
      <element objtype="numeric" objname="field_y"/><element objtype="actuator" objname="{y}"/>
    </tuple>
  </custom>
  <worldbody>
    <body name="needle">
      <joint type="{kind}" damping="1e-4"/><geom size="0.01"/><site user="1e-3"/>
    </body>
    <body pos="1 0 0"><joint name="idle" damping="1"/><geom size="0.01"/></body>
  </worldbody>
  <actuator>
    <general name="x" joint="idle" gainprm="0"/><general name="y" joint="idle" gainprm="0"/>
  </actuator>
</mujoco>
"""


@pytest.mark.parametrize(("kind", "y"), [("ball", "y"), ("ball", "x"), ("hinge", "y")])
def test_magnets_in_fields_that_turn_are_a_note(kind, y):
    model = mujoco.MjModel.from_xml_string(TWO_COILS.format(kind=kind, y=y))
    _, *found = mm.check(model).notes
    turning = (kind, y) == ("ball", "y")
    said = "spins of magnets in the fields of actuator 'x' and actuator 'y' are not judged"
    assert [note for note in found if note.startswith("spins")] == [
        f"{said}: give a keyframe with the spin"
    ] * turning


def test_a_stiff_servo_that_turns_a_disk_slowly_is_no_finding():
    """Its damping of the spin is no wobble."""
    servo = 'joint="joint" gear="0 0 1" biastype="affine" biasprm="0 0 -1e-4" gainprm="1e-4"'
    text = TURNED.format(integrator="Euler", step=2e-3, kind="ball", damping=1e-6, axis="0 0 1",
                         acts=servo, range='ctrlrange="-.01 .01"')  # fmt: skip
    assert mm.check(mujoco.MjModel.from_xml_string(text)).findings == ()


@pytest.mark.parametrize(
    "actuator",
    ['motor joint="joint" gear="0 0 2e-4"',
     'general joint="joint" gear="0 0 2e-4" dyntype="integrator" ctrlrange="-1 1"',
     'general joint="joint" gear="0 0 2e-4" gaintype="affine" gainprm="1 0 -1"'],
)  # fmt: skip
def test_a_speed_that_the_model_does_not_tell_is_a_note(actuator):
    text = TURNED.format(integrator="RK4", step=2e-3, kind="ball", damping=1e-6, axis="0 0 1",
                         acts="", range="")  # fmt: skip
    text = text.replace("<general  />", f"<{actuator}/>").replace('<key ctrl="-1"/>', "")
    _, *found = mm.check(mujoco.MjModel.from_xml_string(text)).notes
    said = "spins of body 'disk', whose speed under its actuators is unknown, are not judged"
    assert found == [f"{said}: give a keyframe with the spin"]


AXLE = """
<mujoco>
  <option gravity="0 0 0"><flag {flag}/></option>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>
    <body name="ship"><freejoint/><geom size=".1"/><site user=".01"/>
      <body name="wheel" pos="0 0 .2">
        <joint name="axle" axis="0 0 1" {joint}/>
        <geom type="cylinder" size=".1 .01" density="3000"/></body></body>
    <body pos="1 0 0"><site user=".01"/></body>
  </worldbody>
  <tendon><fixed name="cord"><joint joint="axle" coef="1"/></fixed></tendon>
  <actuator><{motor}/>{more}</actuator>
</mujoco>"""
MOTOR = 'motor joint="axle" gear=".1" ctrlrange="-1 1"'
SPEED, UNKNOWN = "can spin at 1e+03 rad/s", "whose speed under its actuators is unknown"


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ({}, SPEED),
        ({"joint": 'damping="1e-4" range="-1 1"'}, ""),
        ({"joint": 'damping="1e-4" range="-1 1"', "flag": 'limit="disable"'}, SPEED),
        ({"joint": 'damping="1e-4" stiffness="1"'}, ""),
        ({"joint": 'damping="1e-4" stiffness="1e-3"'}, SPEED),  # yields by 100 rad
        ({"joint": 'damping="1e-4" stiffness="1"', "flag": 'spring="disable"'}, SPEED),
        ({"joint": 'damping="1e-4" frictionloss="1"'}, ""),
        ({"joint": 'damping="1e-4" frictionloss="1"', "flag": 'frictionloss="disable"'}, SPEED),
        ({"joint": 'damping="1"', "flag": 'damper="disable"'}, UNKNOWN),
        ({"joint": 'damping="1e-4" actuatorfrcrange="-.05 .05"'}, "can spin at 500 rad/s"),
        ({"motor": MOTOR.replace("joint", "tendon").replace("axle", "cord")}, UNKNOWN),
        ({"motor": 'intvelocity joint="axle" kp=".5" actrange="-9 9" ctrlrange="-1 1"'}, UNKNOWN),
        ({"more": '<position joint="axle" kp="1"/>'}, ""),
        ({"more": '<position joint="axle" kp="1" forcerange="-.05 .05"/>'}, SPEED),
        ({"more": '<damper joint="axle" kv="1e-4" ctrlrange="0 1"/>'}, SPEED),
        ({"motor": 'damper joint="axle" kv="1e-4" ctrlrange="0 1"'}, ""),
    ],
)
def test_what_holds_a_rotor_and_what_drives_it(parts, said):
    """A motor of 0.1 N m turns a wheel on a free body, whose bearing damps it."""
    defaults = {"flag": "", "joint": 'damping="1e-4"', "motor": MOTOR, "more": ""}
    checked = mm.check(mujoco.MjModel.from_xml_string(AXLE.format(**defaults | parts)))
    spins = [each for each in (*checked.findings, *checked.notes) if "spin" in each]
    assert [said in each for each in spins] == [True] * bool(said)


FLYWHEEL = """
<mujoco>
  <option integrator="{}" gravity="0 0 0"/>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>
    <body name="wheel"><joint axis="0 0 1" damping="1e-4"/>
      <geom type="cylinder" size=".05 .005" mass=".2"/><site pos=".04 0 0" zaxis="1 0 0" user="1"/>
    </body>
    <body name="follower" pos="0 0 .06"><joint type="ball" damping="1e-7"/>
      <geom type="cylinder" size=".015 .003" mass=".02"/><site zaxis="1 0 0" user=".5"/></body>
  </worldbody>
  <actuator><motor joint="{}" gear="{}" ctrlrange="-1 1"/></actuator>
</mujoco>"""


def test_drag_slows_what_follows_a_magnet_that_turns():
    """The motion never exceeds the speed at which drag balances m B across the axis."""
    text = FLYWHEEL.replace('axis="0 0 1"', 'name="spin" axis="0 0 1"')
    (said,) = (each for each in mm.check(
        mujoco.MjModel.from_xml_string(text.format("Euler", "spin", 0.02))
    ).findings if "follower" in each)  # fmt: skip
    speed = float(said.split("can spin at ")[1].split()[0])
    across = 1e-7 * (3 * 0.04**2 / 0.0052 - 1) / 0.0052**1.5  # of 1 A m^2 at (0.04, 0, -0.06) m
    assert speed == pytest.approx(0.5 * abs(across) / 1e-7, rel=0.01)
    model = mujoco.MjModel.from_xml_string(text.format("RK4", "spin", 0.02))
    data, fastest = mujoco.MjData(model), 0.0
    data.ctrl[:] = 1.0
    with mm.magnetism():
        for _ in range(5000):
            mujoco.mj_step(model, data)
            fastest = max(fastest, abs(data.qvel[3]))
    assert data.qvel[0] > 150
    assert fastest < speed


def test_what_euler_lets_grow_of_a_body_that_tumbles():
    model = load(inertia="1 1.3 1.8", step=5e-3)
    (finding,) = mm.check(model, spinning(model, (0, 60, 0))).findings
    assert "its angular momentum, as it tumbles, grows by a factor of e" in finding


def test_the_control_of_the_state_counts_where_nothing_limits_it():
    model = mujoco.MjModel.from_xml_string(ROTOR.format(**ROTOR_PARTS))
    data = mujoco.MjData(model)
    data.ctrl[:] = -0.5
    assert mm.check(model).findings == ()
    assert "can spin at 100 rad/s" in mm.check(model, data).findings[0]
