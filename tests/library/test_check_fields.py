"""What `check` says of given fields: those of a magnet's own body, and iron too long for them."""

import mujoco
import numpy as np
import pytest

import magmotor as mm

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
def test_a_field_does_not_act_on_what_it_is_fixed_to(numbers, kind, capsys):
    own = mujoco.MjModel.from_xml_string(OWN_FIELD.format(numbers, kind, "needle"))
    assert mm.check(own).findings == ()
    assert mm.describe(own).acting == ()
    reason = "not acting: the dipoles, since all are on one rigid body, to which the field is fixed"
    assert reason in capsys.readouterr().out
    with mm.magnetism(), pytest.warns(UserWarning, match="are all on one rigid body"):
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


def plunger(height, length):
    spec = mujoco.MjSpec.from_string(PLUNGER.format(CHI, height, RADIUS, length / 2))
    text = mm.tabulated_field(solenoid, [-0.004, -0.004, -0.12], [0.004, 0.004, 0.12], (5, 5, 241))
    numbers = text.split('data="')[1].split('"')[0]
    spec.add_numeric(name="field", data=[float(number) for number in numbers.split()])
    return spec.compile()


@pytest.mark.parametrize(("length", "findings", "unfound", "largest"), [
    (0.005, 0, 0.08, 0.08), (0.01, 0, 0.26, 0.26), (0.02, 3, 0.43, 0.64), (0.03, 12, 0.0, 0.88),
    (0.06, 13, 0.0, 8.9), (0.08, 13, 0.0, 55),
])  # fmt: skip
def test_iron_over_which_a_field_is_far_from_linear(length, findings, unfound, largest):
    """The force on weak iron is the difference of chi A B^2/(2 mu0) at its ends.

    The last two numbers are errors over the force, where `check` finds nothing and anywhere.
    """
    area, mu0 = np.pi * RADIUS**2, 4e-7 * np.pi
    heights = np.linspace(0, 0.06, 13)
    ends = [on_axis(heights + sign * length / 2) ** 2 for sign in (1, -1)]
    truth = CHI * area / (2 * mu0) * (ends[0] - ends[1])
    found, forces = [], []
    for height in heights:
        model = plunger(height, length)
        data = mujoco.MjData(model)
        with mm.magnetism():
            mujoco.mj_forward(model, data)
        forces.append(data.xfrc_applied[1, 2])
        found.append(any("far from linear" in line for line in mm.check(model).findings))
    errors = abs(forces - truth) / np.maximum(abs(truth), 0.05 * abs(truth).max())
    assert sum(found) == findings
    assert errors[~np.array(found)].max(initial=0) == pytest.approx(unfound, abs=0.02)
    assert errors.max() == pytest.approx(largest, rel=0.02, abs=0.01)
