"""What `check` says of applied fields: those of a magnet's own body, and iron too long for them."""

import mujoco
import numpy as np
import pytest

import magmotor as mm
from magmotor.mjcf.checking.field_strengths import applied_field
from magmotor.mjcf.checking.frequencies import frequencies

OWN_FIELD = """
<mujoco>
  <custom><text name="magmotor" data="dipoles fields"/><numeric name="field" data="{}"/>
    <tuple name="field"><element objtype="numeric" objname="field"/>
      <element objtype="{}" objname="{}"/></tuple></custom>
  <worldbody>
    <body name="mount"><joint axis="0 0 1"/><geom size=".01"/>
      <body name="needle" pos="0 0 .01">
        <geom size=".01"/><site name="needle" user="10" zaxis="1 0 0"/>
      </body>
    </body>
    <body name="other" pos="0 0 1"><joint axis="0 1 0"/><geom size=".01"/><site name="other"/>
    </body>
  </worldbody>
</mujoco>"""
LINEAR = "0 1 0 0 0 0 0 0"
TABLE = "4 4 4 -1 -1 -1 2 2 2" + 64 * " 0 1 0"


@pytest.mark.parametrize("numbers", ["0 1 0", LINEAR, TABLE])
@pytest.mark.parametrize("kind", ["body", "site"])
def test_a_field_does_not_act_on_what_it_is_fixed_to(numbers, kind):
    own = mujoco.MjModel.from_xml_string(OWN_FIELD.format(numbers, kind, "needle"))
    (found,) = mm.check(own).findings
    assert found.startswith("nothing acts on this model")
    description = mm.describe(own)
    assert description.acting == ()
    reason = "not acting: the dipoles, since all are on one rigid body, to which the field is fixed"
    assert reason in str(description)
    with mm.magnetism(), pytest.warns(UserWarning, match="all on one rigid body"):
        mujoco.mj_step(own, mujoco.MjData(own))
    others = mujoco.MjModel.from_xml_string(OWN_FIELD.format(numbers, kind, "other"))
    assert "body 'mount' can swing or turn with omega" in mm.check(others).findings[0]
    assert mm.describe(others).acting == ("dipoles", "fields")


# A plunger of weak iron, whose force is known in closed form --------------------------------------

CHI, RADIUS, COIL, HALF = 1e-3, 1e-3, 0.01, 0.02
PLUNGER = """
<mujoco>
  <option gravity="0 0 0"/>
  <custom><text name="magmotor" data="fields iron"/><numeric name="iron" data="{}"/>
    <tuple name="iron"><element objtype="numeric" objname="iron"/>
      <element objtype="geom" objname="plunger"/></tuple></custom>
  <worldbody><body pos="0 0 {}"><freejoint/>
    <geom name="plunger" type="cylinder" size="{} {}"/></body></worldbody>
</mujoco>"""


def on_axis(z):
    """The field of a solenoid on its axis, in T, which is 1 T if it is long."""
    ends = [(z - end) / np.hypot(z - end, COIL) for end in (-HALF, HALF)]
    return (ends[0] - ends[1]) / 2


def solenoid(points):
    """That field, and beside the axis what makes it free of divergence to first order."""
    x, y, z = points.T
    slope = (on_axis(z + 1e-6) - on_axis(z - 1e-6)) / 2e-6
    return np.column_stack([-x * slope / 2, -y * slope / 2, on_axis(z)])


def table(end=0.12):
    text = mm.tabulated_field(solenoid, [-0.004, -0.004, -end], [0.004, 0.004, end], (5, 5, 241))
    return text.split('data="')[1].split('"')[0]


def plunger(height, length, chi=CHI, end=0.12):
    spec = mujoco.MjSpec.from_string(PLUNGER.format(chi, height, RADIUS, length / 2))
    spec.add_numeric(name="field", data=[float(number) for number in table(end).split()])
    return spec.compile()


@pytest.mark.parametrize("length", [0.005, 0.01, 0.02, 0.03, 0.06, 0.08])
def test_iron_along_which_a_field_is_far_from_linear(length):
    """The force on weak iron is the difference of chi A B^2/(2 mu0) at its ends."""
    area, mu0 = np.pi * RADIUS**2, 4e-7 * np.pi
    heights = np.linspace(0, 0.06, 13)
    ends = [on_axis(heights + sign * length / 2) ** 2 for sign in (1, -1)]
    truth = CHI * area / (2 * mu0) * (ends[0] - ends[1])
    forces = []
    for height in heights:
        model = plunger(height, length)
        data = mujoco.MjData(model)
        with mm.magnetism():
            mujoco.mj_forward(model, data)
        forces.append(data.xfrc_applied[1, 2])
    errors = abs(forces - truth) / np.maximum(abs(truth), 0.05 * abs(truth).max())
    assert errors.max() < 0.05


def test_a_driven_field_counts_at_its_largest_drive():
    """At control 0, as in the default state, the field is 0."""
    spec = mujoco.MjSpec.from_string(OWN_FIELD.format("0 1 0", "body", "other"))
    driven = spec.add_actuator(name="coil", target="", gaintype=mujoco.mjtGain.mjGAIN_FIXED)
    driven.trntype, driven.target = mujoco.mjtTrn.mjTRN_BODY, "mount"
    driven.ctrllimited, driven.ctrlrange = True, np.array([-3.0, 2.0])
    spec.tuples[0].objtype = [mujoco.mjtObj.mjOBJ_NUMERIC, mujoco.mjtObj.mjOBJ_ACTUATOR]
    spec.tuples[0].objname, spec.tuples[0].objprm = ["field", "coil"], [0.0, 0.0]
    (found,) = mm.check(spec.compile()).findings
    (still,) = mm.check(
        mujoco.MjModel.from_xml_string(OWN_FIELD.format("0 1 0", "body", "other"))
    ).findings
    omega = [float(text.split("omega = ")[1].split()[0]) for text in (found, still)]
    assert omega[0] / omega[1] == pytest.approx(3**0.5, rel=0.01)
    assert "at drive 1" not in found + still


MOUNT = """
<body name="mount"><joint/><geom size=".01" pos="1 0 0"/></body><body name="other" pos"""
OWN_IRON = PLUNGER.replace("<body pos", MOUNT).replace(
    "</custom>",
    """
  <numeric name="field" data="NODES"/>
  <tuple name="field"><element objtype="numeric" objname="field"/>
    <element objtype="body" objname="mount"/></tuple></custom>""",
)


def test_a_field_does_not_act_on_iron_of_its_own_body():
    text = OWN_IRON.format(CHI, 0.02, RADIUS, 0.03).replace("NODES", table())
    others = mujoco.MjModel.from_xml_string(text)
    assert mm.describe(others).acting == ("fields", "iron")
    own = mujoco.MjModel.from_xml_string(text.replace('objname="mount"', 'objname="other"'))
    description = mm.describe(own)
    assert description.acting == ()
    reason = "not acting: the iron, since all are on one rigid body, to which the field is fixed"
    assert reason in str(description)
    (found,) = mm.check(own).findings
    assert found.startswith("nothing acts on this model")


DIPOLE_AND_IRON = """
<mujoco>
  <custom><text name="magmotor" data="dipoles fields iron"/><numeric name="field" data="0 .01 0"/>
    <numeric name="iron" data="100"/>
    <tuple name="iron"><element objtype="numeric" objname="iron"/>
      <element objtype="geom" objname="iron"/></tuple></custom>
  <worldbody><body><freejoint/><geom name="iron" size=".005"/><site user=".01"/></body></worldbody>
</mujoco>"""
SMALL = "4 4 4 1 1 1 1 1 1" + 64 * " 0 1 0"


@pytest.mark.parametrize(("xml", "idle"), [
    (OWN_FIELD.format(SMALL, "body", "needle"), 1),
    (DIPOLE_AND_IRON.replace('<site', '<site pos="0 0 .02"'), 0),
])  # fmt: skip
def test_fields_are_asked_only_where_they_act(xml, idle):
    """The table does not contain the dipole of its own body; a dipole is on the body of iron."""
    found = mm.check(mujoco.MjModel.from_xml_string(xml)).findings
    assert [finding.startswith("nothing acts on this model") for finding in found] == idle * [True]


def test_fields_of_every_kind_are_those_that_act():
    """What the check takes is the field that the model has, for frames that are turned."""
    xml = """
    <mujoco>
      <custom><text name="magmotor" data="dipoles fields"/>
        <numeric name="field_1" data="1 2 3"/>
        <numeric name="field_2" data=".1 .2 .3 1 2 3 4 5"/>
        <numeric name="field_3" data="{}"/>
        <tuple name="field_1"><element objtype="numeric" objname="field_2"/>
          <element objtype="body" objname="turned"/></tuple>
        <tuple name="field_2"><element objtype="numeric" objname="field_3"/>
          <element objtype="site" objname="turned"/></tuple></custom>
      <worldbody>
        <body name="turned" pos=".1 .2 .3" euler="30 40 50"><joint/><geom size=".1"/>
          <site name="turned" pos=".1 0 0" euler="10 20 30"/></body>
        <body><freejoint/><geom size=".1"/><site user="1"/></body>
      </worldbody>
    </mujoco>"""
    rng = np.random.default_rng(0)
    nodes = " ".join(f"{number:.6f}" for number in rng.standard_normal(3 * 4 * 5 * 6))
    model = mujoco.MjModel.from_xml_string(xml.format(f"4 5 6 -1 -1 -1 .6 .5 .4 {nodes}"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    points = rng.uniform(-0.2, 0.2, (20, 3))
    taken = applied_field(model, data, points, np.full(20, 2))
    model.site_user[:] = 0
    np.testing.assert_allclose(taken, mm.field(model, data, points), atol=6e-14)  # 2e-15


# Magnets that swing where an applied field varies -------------------------------------------------

TRAP = """
<mujoco>
  <option gravity="0 0 0"/>
  <custom><text name="magmotor" data="dipoles fields"/>{field}</custom>
  <worldbody><body name="magnet">{joint}
    <inertial pos="0 0 0" mass="2e-3" diaginertia="1e-8 1e-8 1e-8"/><geom size=".004"/>
    <site name="magnet" user=".25"/></body></worldbody>
</mujoco>"""
BEND = 2000.0


def bent(points):
    """A field without sources, which is strongest at the origin on its axis; B'' = -BEND."""
    x, y, z = points.T
    along = 0.1 - BEND * (z**2 / 2 - (x**2 + y**2) / 4)
    return np.stack([BEND * x * z / 2, BEND * y * z / 2, along], axis=-1)


def found_and_true(field, joint, true):
    """The frequency that `check` bounds over the true one."""
    model = mujoco.MjModel.from_xml_string(TRAP.format(field=field, joint=joint))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return frequencies(model, data)[1] / true


def test_the_frequency_of_a_magnet_in_a_field_that_is_bent():
    """On a rail, omega^2 = m B''/M."""
    field = mm.tabulated_field(bent, (-0.006, -0.006, -0.02), (0.006, 0.006, 0.02), (6, 6, 81))
    rail = '<joint type="slide" axis="0 0 1"/>'
    assert 1 <= found_and_true(field, rail, np.sqrt(0.25 * BEND / 2e-3)) < 1.2  # 1.11


def test_the_frequency_of_a_magnet_where_a_field_has_a_gradient():
    """At B = 0, a turn by t moves the force by m G t, so that omega^2 = m G/(M I)^(1/2)."""
    field = '<numeric name="field" data="0 0 0 30 0 0 -30 0"/>'
    true = np.sqrt(0.25 * 30 / np.sqrt(2e-3 * 1e-8))
    assert found_and_true(field, "<freejoint/>", true) == pytest.approx(1)
    uniform = '<numeric name="field" data="0 0 .1"/>'
    assert found_and_true(uniform, "<freejoint/>", np.sqrt(0.25 * 0.1 / 1e-8)) == pytest.approx(1)
