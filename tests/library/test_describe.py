"""`describe` names what acts on a model, its temperature, and what does not act."""

import re

import mujoco
import numpy as np
import pytest

import magmotor as mm

MARK = '<custom><text name="magmotor" data="{}"/></custom>'
PLUGIN = '<extension><plugin plugin="magmotor.forces"><instance name="{}"/></plugin></extension>'
PAIR = """
<mujoco>
  {head}
  <worldbody>
    <body name="left" pos="-0.1 0 0"><freejoint/><geom size="0.01"/><site user="1"/></body>
    <body name="right" pos="0.1 0 0">
      <joint name="turn" type="hinge" damping="0.5"/>
      <geom size="0.01"/>
      <site user="2"/>
      <site pos="0 0 0.01" user="-2"/>
    </body>
  </worldbody>
</mujoco>
"""
COUPLING = """<custom><tuple name="coupling"><element objtype="body" objname="left" prm="{0}"/>
<element objtype="body" objname="right" prm="{0}"/></tuple></custom>"""


def described(text, capsys):
    """The description of a model, and the text that was printed."""
    found = mm.describe(mujoco.MjModel.from_xml_string(text))
    printed = capsys.readouterr().out.strip()
    assert printed == str(found)
    return found, printed


def test_dipoles_and_pairs(capsys):
    found, text = described(PAIR.format(head=MARK.format("dipoles")), capsys)
    assert found.acting == ("dipoles",)
    assert found.marked
    assert not found.plugin
    assert found.dipoles == {"left": 1, "right": 2}
    assert found.pairs == {("left", "right"): 1.0}
    assert found.idle == ()
    assert text.splitlines() == [
        "acting: dipoles, inside magmotor.magnetism()",
        "dipoles: left 1, right 2",
        "pairs: left and right",
    ]


@pytest.mark.parametrize(("factor", "pairs"), [(3, {("left", "right"): 3.0}), (0, {})])
def test_couplings(factor, pairs, capsys):
    head = MARK.format("dipoles couplings") + COUPLING.format(factor)
    found, text = described(PAIR.format(head=head), capsys)
    assert found.pairs == pairs
    assert ("times 3" in text) == (factor == 3)
    assert ("switch all pairs off" in text) == (factor == 0)


@pytest.mark.parametrize(
    ("head", "line"),
    [
        ("", "acting: dipoles, inside magmotor.magnetism(); the model has no mark"),
        (COUPLING.format(2), "not acting: tuples named coupling..., since there is no mark"),
        (MARK.format("noise"), "not acting: user numbers of sites, since the mark does not name"),
        (PLUGIN.format("magnets"), "acting: dipoles, by the plugin magmotor.forces"),
        (PLUGIN.format('a"/><instance name="b'), "not acting: further instances of magmotor"),
        ('<option><flag actuation="disable"/></option>', "not acting: magnetism(), since MuJoCo"),
        (
            PLUGIN.format("a") + '<option><flag spring="disable" damper="disable"/></option>',
            "not acting: magmotor.forces, since MuJoCo skips it",
        ),
        (
            PLUGIN.format("a") + '<option><flag sleep="enable"/></option>',
            "not acting: magmotor.forces on sleeping bodies",
        ),
    ],
)  # fmt: skip
@pytest.mark.filterwarnings("ignore:.*MuJoCo skips the plugin:UserWarning")
@pytest.mark.filterwarnings("ignore:a sleeping body is not woken:UserWarning")
def test_what_acts_and_what_does_not(head, line, capsys):
    _, text = described(PAIR.format(head=head), capsys)
    assert line in text


def test_user_numbers_of_others_are_left_alone(capsys):
    found, _ = described(
        PAIR.format(head="").replace('name="turn"', 'name="turn" user="1123"'), capsys
    )
    assert found.acting == ()
    assert found.idle == (
        "user numbers of sites, since there is no mark",
        "user numbers of joints, since there is no mark",
    )


@pytest.mark.parametrize(
    ("scene", "kT"),
    [
        (mm.Motor.paper("uniform-a"), mm.Motor.paper("uniform-a").kT),
        (mm.Disk(), 1 / mm.Disk().beta),
        (mm.Disk(noise=1.0), 1 / mm.Disk(noise=1.0).beta),
    ],
)
def test_the_temperature_of_a_scene(scene, kT, capsys):
    found = mm.describe(mm.build(scene))
    assert found.kT == pytest.approx((kT, kT), rel=1e-14)  # measured: 4e-16
    assert re.search(r"temperature: kT = [\d.e-]+ J$", capsys.readouterr().out, re.MULTILINE)


def test_a_ring_with_noise_alone_has_no_temperature(capsys):
    """At nonuniform temperature, the motor's ring has noise but no friction."""
    found = mm.describe(mm.build(mm.Motor.paper("nonuniform-a")))
    assert found.kT == (0.0, np.inf)
    assert "unbounded, since noise drives a motion that is not damped" in capsys.readouterr().out


CHAIN = """
<mujoco>
  <custom><text name="magmotor" data="noise"/></custom>
  <worldbody>
    <body name="upper" user="{upper}">
      <joint type="hinge" damping="{damping}"/>
      <geom type="capsule" fromto="0 0 0 1 0 0" size="0.1"/>
      <body name="lower" pos="1 0 0" user="{lower}">
        <joint type="hinge" damping="0.2"/><geom type="capsule" fromto="0 0 0 1 0 0" size="0.1"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def test_noise_of_the_world_does_not_match_damping_between_the_bodies_of_a_tree(capsys):
    """Torques about z: J = [[1, 0], [1, 1]]; kT are the eigenvalues of C^-1 J^T s^2 J/2."""
    row = "0 0 0 0 0 0.6"
    text = CHAIN.format(upper=row, lower=row, damping=0.2)
    found, printed = described(text, capsys)
    noise = 0.6**2 / 2 * np.array([[2.0, 1.0], [1.0, 1.0]])
    assert found.kT == pytest.approx(np.linalg.eigvalsh(noise / 0.2), rel=1e-12)  # 3e-15
    assert "not uniform, kT from 0.3438 J to 2.356 J" in printed


def test_noise_without_damping(capsys):
    found, text = described(CHAIN.format(upper="0 0 0 0 0 1", lower="0", damping=0), capsys)
    assert found.kT == (0.0, np.inf)
    assert "temperature: unbounded, since noise drives a motion that is not damped" in text


def test_potentials_keep_inner_zeros(capsys):
    text = PAIR.format(head=MARK.format("potentials")).replace(
        'name="turn"', 'name="turn" user="0 0 0 0.5 0 0"'
    )
    found, printed = described(text, capsys)
    np.testing.assert_array_equal(found.potentials["turn"], [0, 0, 0, 0.5])
    assert "Fourier terms: turn 2" in printed


def test_a_wrong_mark_is_an_error():
    model = mujoco.MjModel.from_xml_string(PAIR.format(head=MARK.format("dipols")))
    with pytest.raises(
        ValueError, match="text 'magmotor' = 'dipols': must be one or more of the words"
    ):
        mm.describe(model)
