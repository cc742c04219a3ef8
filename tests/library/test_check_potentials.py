"""`check` of periodic potentials of joints, against MuJoCo's motion at the same timesteps."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

import magmotor as mm
from magmotor.mjcf.checking.check import SOUND
from magmotor.mjcf.checking.frequencies import largest_stiffness
from magmotor.mjcf.checking.motion_findings import fast_joints

ROTOR = """
<mujoco>
  <option gravity="0 0 0" {option}/>
  <extension><plugin plugin="magmotor.forces"><instance name="m">
    <config key="act" value="{act}"/></instance></plugin></extension>
  <worldbody><body>
    <joint name="rotor" {joint} axis="0 0 1" user="{user}"/>
    <geom type="cylinder" size=".008 .002" density="7500"/>{more}
  </body></worldbody>
</mujoco>"""
STEEP = "0 0 0 0 0 0 0 -0.02"
"""-0.02 J cos 4q, whose stiffness is 0.32 J at q = 0."""
LINK = """<body pos=".03 0 0"><joint axis="0 0 1"/>
<geom type="capsule" size=".002" fromto="0 0 0 .02 .01 0" density="2000"/></body>"""


NOISY = '<body pos="0 0 .01" user="0 0 0 0 0 1e-6"><geom size=".001"/></body>'


def rotor(user=STEEP, joint="", option="", act="potentials", more=""):
    return mujoco.MjModel.from_xml_string(
        ROTOR.format(user=user, joint=joint, option=option, act=act, more=more)
    )


def farthest(model, steps=3000):
    """How far the joint goes from rest after a small kick."""
    data, largest = mujoco.MjData(model), 0.0
    data.qpos[0] = 1e-5
    for _ in range(steps):
        mujoco.mj_step(model, data)
        largest = max(largest, abs(data.qpos[0]))
    return largest


def response(model):
    """The inverse inertia of the joint."""
    data, row = mujoco.MjData(model), np.eye(model.nv)[:1].copy()
    mujoco.mj_forward(model, data)
    found = np.empty_like(row)
    mujoco.mj_solveM(model, data, found, row)
    return found[0, 0]


@pytest.mark.parametrize("more", ["", LINK])
@pytest.mark.parametrize("integrator", ["Euler", "implicitfast"])
def test_a_rotor_that_its_potential_turns_too_fast(more, integrator):
    """MuJoCo's motion grows just above omega h = 2 and not just below, also with a free link."""
    model = rotor(more=more, option=f'integrator="{integrator}" timestep="4e-3"')
    omega = np.sqrt(0.32 * response(model))
    found = mm.check(model)
    (finding,) = found.findings
    assert finding == (
        f"joint 'rotor' can swing or turn with omega = {omega:.3g} rad/s at most in its potential,"
        f" so that omega h = {4e-3 * omega:.3g} exceeds 2; take a timestep of at most"
        f" {found.timestep:g} s"
    )
    assert 0.45 < found.timestep * omega < 0.5
    for product, stable in ((0.5, True), (1.95, True), (2.05, False)):
        model.opt.timestep = product / omega
        assert (mm.check(model).findings == ()) == stable
        assert (farthest(model) < 1e-3) == stable
    assert str(mm.check(model, fix=True)).endswith(f"set: timestep {found.timestep:g} s")
    assert str(mm.check(model)) == SOUND
    assert farthest(model) < 2e-5


def test_the_rotor_of_a_user():
    model = rotor(joint='damping="1e-7"')
    (finding,) = mm.check(model).findings
    assert "omega h = 2.58 exceeds 2; take a timestep of at most 0.00038 s" in finding


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "implicit"])
@pytest.mark.parametrize("damping", [0.99, 1.01])
def test_damping_that_keeps_a_rotor_stable_is_no_finding(integrator, damping):
    """It is implicit: the motion is stable for h^2 omega^2 < 4 + 2 h c/I."""
    plain, step = rotor(), 2e-3
    inverse = response(plain)
    least = (0.32 * inverse * step**2 - 4) / (2 * step * inverse)
    option = f'integrator="{integrator}" timestep="{step}"'
    model = rotor(joint=f'damping="{damping * least}"', option=option)
    assert (mm.check(model).findings == ()) == (damping > 1)
    assert (farthest(model) < 1e-3) == (damping > 1)


def test_explicit_damping_keeps_no_rotor_stable():
    for option in ('integrator="RK4">', '><flag eulerdamp="disable"/></option><statistic'):
        text = ROTOR.format(user=STEEP, joint='damping="1"', option="{}", act="potentials", more="")
        text = text.replace("{}/>", option + ("</option>" if "RK4" in option else "/>"))
        (finding,) = mm.check(mujoco.MjModel.from_xml_string(text)).findings
        assert "in its potential, so that omega h = 2.58 exceeds 2" in finding


@pytest.mark.parametrize(
    "options",
    [
        {"user": "0 0 0 0 0 0 0 -0.01"},
        {"user": "-0.02 0.02"},
        {"act": "noise", "more": NOISY},
    ],
)
def test_potentials_that_are_weak_or_do_not_act_are_no_finding(options):
    assert not any("potential," in finding for finding in mm.check(rotor(**options)).findings)


@pytest.mark.parametrize("user", ["0 1e300", "0 1e-300 0 1e308"])
def test_potentials_that_overflow(user):
    found = mm.check(rotor(user))
    assert "joint 'rotor'" in found.findings[0]
    assert found.timestep == 2e-3


def test_joints_that_are_alike_are_one_finding():
    joint = '<joint type="hinge" axis="0 0 1" user="0 0 0 0 0 0 0 -0.02"/>'
    body = f'<body pos="{{}} 0 0">{joint}<geom size=".005" density="7500"/></body>'
    text = ROTOR.format(user=STEEP, joint="", option="", act="potentials", more="")
    bodies = "".join(body.format(place) for place in range(1, 4))
    text = text.replace("<worldbody>", f"<worldbody>{bodies}")
    findings = mm.check(mujoco.MjModel.from_xml_string(text)).findings
    assert len(findings) == 2
    assert findings[0].startswith("joint 0 (and 2 more like it) can swing or turn with omega")


def test_the_largest_stiffness_against_a_fine_grid():
    rng = np.random.default_rng(1)
    q = np.linspace(0, 2 * np.pi, 200001)[:, np.newaxis]
    for terms in (1, 2, 3, 7):
        waves, k = rng.normal(size=(terms, 2)), np.arange(1, terms + 1)
        curvature = -(np.sin(k * q) @ (k**2 * waves[:, 0]) + np.cos(k * q) @ (k**2 * waves[:, 1]))
        assert largest_stiffness(waves.ravel()) == pytest.approx(curvature.max(), rel=2e-3)
    assert largest_stiffness(np.array([0.0, -3.0, 0.0])) == pytest.approx(3)  # a lone zero
    assert largest_stiffness(np.zeros(1)) == 0


def test_the_shipped_models_have_no_such_finding():
    root = Path(mm.__file__).parents[2]
    files = [*(root / "models").glob("*.xml"), *(root / "examples").glob("*.xml")]
    files = [file for file in files if "hand/coil" not in file.read_text()]  # a part of a model
    models = [mujoco.MjModel.from_xml_path(str(file)) for file in files]
    for model in (*models, mm.build(mm.Disk())):
        state = mujoco.MjData(model)
        mujoco.mj_fwdPosition(model, state)
        assert [*fast_joints(model, state)] == []
    assert len(files) > 10
