"""What a model's mark lets act, and what is left alone without one."""

import subprocess
import sys
import warnings

import mujoco
import numpy as np
import pytest
from refusals import misdeclared

import magmotor as mm
from magmotor.noise import BrownianPath

SEPARATE = """
<mujoco>
  <extension><plugin plugin="magmotor.forces">{instance}</plugin></extension>
  <option gravity="0 0 0"/>
  <custom>
    {text}
    <tuple name="coupling of magnet and needle">
      <element objtype="body" objname="magnet" prm="3"/>
      <element objtype="body" objname="needle" prm="3"/>
    </tuple>
  </custom>
  <default><geom size="0.01" mass="1" contype="0" conaffinity="0"/></default>
  <worldbody>
    <body name="magnet" pos="0 0.1 0"><site zaxis="0 1 0" user="5"/></body>
    <body name="needle">
      <joint type="hinge" axis="0 0 1"/>
      <geom/>
      <site zaxis="1 0 0" user="0.2"/>
    </body>
    <body user="7 0 0 0 0 0"><joint type="slide" axis="1 0 0"/><geom/></body>
    <body><joint type="hinge" axis="0 0 1" user="0.3 0.1"/><geom/></body>
  </worldbody>
</mujoco>
"""
"""A dipole, a noise and a potential act on a joint each."""

TEXT = '<text name="magmotor" data="{}"/>'
CONFIG = '<instance name="magnets"><config key="act" value="{}"/></instance>'
HOOKS = {
    "callback": lambda words: {"text": TEXT.format(words), "instance": ""},
    "plugin, by its config": lambda words: {"text": "", "instance": CONFIG.format(words)},
    "plugin, by a text": lambda words: {
        "text": TEXT.format(words),
        "instance": '<instance name="magnets"/>',
    },
}

DIPOLE = 0.2 * 1e-7 * 2 * 5 / 0.1**3
NOISE = 7 * BrownianPath(0, 0.002).increments(1)[0] / 0.002
POTENTIAL = -0.3


def separate(text="", instance=""):
    return mujoco.MjModel.from_xml_string(SEPARATE.format(text=text, instance=instance))


def generalized(model):
    """All generalized forces on a model at rest; the block does nothing if there is a plugin."""
    data = mujoco.MjData(model)
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    return data.qfrc_smooth


@pytest.mark.parametrize("hook", HOOKS)
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("dipoles", (DIPOLE, 0, 0)),
        ("couplings dipoles", (3 * DIPOLE, 0, 0)),
        ("noise", (0, NOISE, 0)),
        ("potentials", (0, 0, POTENTIAL)),
        ("noise noise  potentials ", (0, NOISE, POTENTIAL)),
        ("noise&#9;&#10;potentials&#13;", (0, NOISE, POTENTIAL)),
        ("couplings noise", (0, NOISE, 0)),
        ("all", (3 * DIPOLE, NOISE, POTENTIAL)),
        ("dipoles all", (3 * DIPOLE, NOISE, POTENTIAL)),
        ("dipoles couplings noise potentials", (3 * DIPOLE, NOISE, POTENTIAL)),
    ],
)
def test_each_word_lets_only_its_forces_act(hook, words, expected):
    found = generalized(separate(**HOOKS[hook](words)))
    np.testing.assert_allclose(found, expected, rtol=1e-14, atol=0)  # measured: 8e-16


@pytest.mark.parametrize(
    ("words", "expected"), [("all", (1, 1, 1)), ("noise", (0, 1, 0)), ("dipoles", (1, 0, 0))]
)
def test_baoab_and_the_energy_follow_the_mark(words, expected):
    model = separate(TEXT.format(words))
    data = mujoco.MjData(model)
    mm.Langevin(model).step(data)
    assert ((data.qvel != 0) == np.array(expected)).all()
    assert (mm.magnetic_energy(model, data) != 0) == expected[0]
    assert mm.field(model, data, [0, 0, 1]).any() == expected[0]


def test_the_word_couplings_alone_lets_nothing_act():
    with pytest.warns(UserWarning, match="nothing acts"):
        found = generalized(separate(TEXT.format("couplings")))
    assert not found.any()


def test_two_marks_of_one_model_name_the_same():
    both = {"text": TEXT.format("noise dipoles"), "instance": CONFIG.format("dipoles noise")}
    np.testing.assert_array_equal(
        generalized(separate(**both)), generalized(separate(TEXT.format("dipoles noise")))
    )


PID = """<plugin plugin="mujoco.pid"><instance name="first"/></plugin>
<plugin plugin="magmotor.forces">"""
ACTUATOR = """
  <actuator><plugin joint="turn" plugin="mujoco.pid" instance="first"/></actuator>
</mujoco>"""


@pytest.mark.parametrize("hook", HOOKS)
def test_a_plugin_of_mujoco_s_own_comes_first(hook):
    """It is neither taken for ours, nor does it hide ours."""
    text = SEPARATE.replace(
        '<joint type="hinge" axis="0 0 1"/>', '<joint name="turn" axis="0 0 1"/>'
    )
    text = text.replace('<plugin plugin="magmotor.forces">', PID).replace("</mujoco>", ACTUATOR)
    model = mujoco.MjModel.from_xml_string(text.format(**{"text": ""} | HOOKS[hook]("dipoles")))
    assert model.nplugin == 1 + (hook != "callback")
    found = generalized(model)
    np.testing.assert_allclose(found, (DIPOLE, 0, 0), rtol=1e-14, atol=0)  # measured: 8e-16


@pytest.mark.parametrize("name", ["magmotor_notes", "magmoto", "Magmotor"])
def test_a_text_of_another_name_is_no_mark(name):
    model = separate(TEXT.format("magnets").replace("magmotor", name) + TEXT.format("dipoles"))
    found = generalized(model)
    np.testing.assert_allclose(found, (DIPOLE, 0, 0), rtol=1e-14, atol=0)  # measured: 8e-16
    assert not mm.describe(separate(TEXT.format("dipoles").replace("magmotor", name))).marked


BODY = '<body name="{}"{}>{}<geom size="0.01" pos="0.1 0 0"/>{}</body>'
FOREIGN = {
    "numbers of a joint": (
        BODY.format("hand", "", '<joint axis="0 1 0" user="1123 0"/>', '<site user="5"/>')
    ),
    "nine numbers of a body": (
        BODY.format("hand", ' user="1 2 3 4 5 6 7 8 9"', "<freejoint/>", '<site user="5"/>')
    ),
    "six numbers of a body": (
        BODY.format("hand", ' user="1 2 3 4 5 6"', "<freejoint/>", '<site user="5"/>')
    ),
    "consecutive numbers of sites": "".join(
        BODY.format(name, "", "<freejoint/>", f'<site user="{number}" pos="{number} 0 0"/>')
        for number, name in enumerate(("hand", "finger", "thumb"), start=4)
    ),
    "vectors of sites": BODY.format("hand", "", "<freejoint/>", '<site user="0 0 1"/>'),
    "a site's nan": BODY.format("hand", "", "<freejoint/>", '<site user="nan"/>'),
}
"""Bodies whose `user` numbers mean something else, beside a fixed site with a number."""


def foreign(bodies, custom=""):
    """A model without a mark, with a tuple that is no coupling of bodies."""
    return mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <custom>{custom}
        <tuple name="coupling_gears"><element objtype="body" objname="hand" prm="2"/></tuple>
      </custom>
      <size nuserdata="5"/>
      <worldbody><site user="3" pos="0 0 0.3"/>{bodies}</worldbody>
    </mujoco>""")


def after_20_steps(model):
    data = mujoco.MjData(model)
    data.qvel[:] = 0.1
    data.userdata[:] = np.nan
    mujoco.mj_step(model, data, nstep=20)
    return np.concatenate([data.qpos, data.qvel, data.xfrc_applied.ravel()])


@pytest.mark.parametrize("kind", FOREIGN)
def test_foreign_numbers_are_left_alone(kind):
    model = foreign(FOREIGN[kind])
    expected = after_20_steps(model)
    with warnings.catch_warnings(record=True) as caught, mm.magnetism():
        warnings.simplefilter("always")
        found = after_20_steps(model)
    np.testing.assert_array_equal(found, expected)
    assert [str(w.message).partition(";")[0] for w in caught] == [
        "nothing acts on this model: its user numbers may have another meaning"
    ]
    data = mujoco.MjData(model)
    assert not mm.field(model, data, [1, 2, 3]).any()


@pytest.mark.parametrize(
    ("numbers", "act"), [((5, 6), True), ((4, 5, 6), False), ((4, 5, 7), True)]
)
def test_three_consecutive_numbers_or_more_count_sites(numbers, act):
    """Two may as well be moments."""
    bodies = "".join(
        BODY.format(f"b{number}", "", "<freejoint/>", f'<site user="{number}"/>')
        for number in numbers
    )
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
    assert (mm.describe(model).acting == ("dipoles",)) == act


def test_baoab_leaves_foreign_numbers_alone():
    """The noise of a body without a mark would move it."""
    model = foreign(
        '<body name="hand" user="1 2 3 4 5 6"><joint axis="0 1 0" user="1123 0"/>'
        '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>'
    )
    data = mujoco.MjData(model)
    mm.Langevin(model).step(data, 20)
    assert data.qvel == 0
    marked = foreign(
        '<body name="hand" user="1 2 3 4 5 6"><joint axis="0 1 0" user="1123 0"/>'
        '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>',
        TEXT.format("noise"),
    )
    data = mujoco.MjData(marked)
    mm.Langevin(marked).step(data, 20)
    assert data.qvel != 0


@pytest.mark.parametrize(
    ("kind", "wrong"),
    [
        ("nine numbers of a body", "wrench"),
        ("vectors of sites", "moment"),
        ("a site's nan", "moment"),
    ],
)
def test_foreign_numbers_with_a_mark_are_errors(kind, wrong):
    model = foreign(FOREIGN[kind], TEXT.format("dipoles noise potentials"))
    with misdeclared(wrong, 1) as outside:
        mm.describe(model)
    with mm.magnetism(), pytest.raises(mujoco.FatalError) as in_a_step:
        mujoco.mj_forward(model, mujoco.MjData(model))
    assert str(in_a_step.value) == str(outside.value)


def test_couplings_without_a_mark_are_ignored():
    """A tuple that would be an error has no effect on plain dipoles."""
    free = BODY.format("hand", "", "<freejoint/>", '<site user="5"/>')
    forces, marked = (generalized(foreign(free, custom)) for custom in ("", TEXT.format("dipoles")))
    assert forces.any()
    np.testing.assert_array_equal(forces, marked)
    model = foreign(free, TEXT.format("dipoles couplings"))
    with misdeclared("coupling", 0) as outside:
        mm.describe(model)
    with mm.magnetism(), pytest.raises(mujoco.FatalError) as in_a_step:
        mujoco.mj_forward(model, mujoco.MjData(model))
    assert str(in_a_step.value) == str(outside.value)


@pytest.mark.parametrize("plugin", [False, True])
def test_dipoles_without_a_mark_are_said_once_per_process(plugin):
    extension = (
        '<extension><plugin plugin="magmotor.forces"><instance name="m"/></plugin></extension>'
    )
    program = f"""
import magmotor as mm
import mujoco
import numpy as np
text = '''<mujoco>{extension if plugin else ""}<worldbody><site user="5"/><body pos="0 1 0">
    <freejoint/><geom size="0.1"/><site user="2"/><site user="0"/></body></worldbody></mujoco>'''
for _ in range(2):
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    for _ in range(2):
        with mm.magnetism():
            mujoco.mj_step(model, data, nstep=3)
print(abs(data.qfrc_smooth[:2]).max() > 0)
"""
    command = [sys.executable, "-W", "ignore:X11", "-c", program]
    found = subprocess.run(command, capture_output=True, text=True, check=True)
    assert found.stdout == "True\n"
    lines = [line for line in found.stderr.splitlines() if line.startswith("magmotor: ")]
    lines = [line for line in lines if not line.startswith("magmotor: compiling")]
    said = (
        "magmotor: 2 sites that each have one user number act as dipoles; to confirm or change"
        ' this, add <custom><text name="magmotor" data="dipoles"/></custom> to the model'
    )
    assert lines == [said]
