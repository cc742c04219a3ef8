"""Coils: moments that follow actuators, in forces, fields and derivatives; switched magnets."""

import copy
import math
import warnings

import mujoco
import numpy as np
import pytest

import magmotor as mm

MODEL = """
<mujoco>
  {extension}
  <option gravity="0 0 0" timestep="1e-3" {integrator}/>
  <custom>
    <text name="magmotor" data="dipoles coils fields"/>
    <numeric name="field" data="0 0 0.002"/>
    <tuple name="field driven"><element objtype="numeric" objname="field"/>
      <element objtype="actuator" objname="other"/></tuple>
    <tuple name="coil of the hand">
      <element objtype="actuator" objname="current" prm="{saturation}"/>
      <element objtype="site" objname="hand"/>
    </tuple>
  </custom>
  <worldbody>
    <site name="hand" pos="0 0 0.1" user="2"/>
    <site pos="0 0.2 0" user="0.5"/>
    <body><freejoint/><geom size="0.01"/><site name="magnet" user="0.3" euler="20 0 0"/></body>
  </worldbody>
  <actuator>
    <general name="current" site="magnet" gainprm="0" {actuator}/>
    <general name="other" site="magnet" gainprm="0" group="2"/>
  </actuator>
</mujoco>
"""
PLUGIN = '<extension><plugin plugin="magmotor.forces"><instance name="m"/></plugin></extension>'
BOTH = pytest.mark.parametrize("extension", ["", PLUGIN], ids=["callback", "plugin"])


def coil(actuator="", saturation=0.0, extension="", integrator=""):
    return mujoco.MjModel.from_xml_string(
        MODEL.format(
            actuator=actuator, saturation=saturation, extension=extension, integrator=integrator
        )
    )


def strength(model, data):
    """The moment of the coil over its `user` number, from its field on its axis."""
    return mm.field(model, data, [0, 0, 0.1 + 1e-4])[2] / (2e-7 * 2 / 1e-4**3)


DRIVES = {
    "control": ("", 0, 0.7, 0.7),
    "negative": ("", 0, -0.7, -0.7),
    "off": ("", 0, 0.0, 0.0),
    "range": ('ctrllimited="true" ctrlrange="-1 0.5"', 0, 0.7, 0.5),
    "saturation": ("", 0.5, 0.7, 0.7 / math.hypot(1, 1.4)),
    "activation": ('dyntype="filter" dynprm="0.05"', 0, 0.7, 0.0),
}


@BOTH
@pytest.mark.parametrize("name", DRIVES)
def test_the_moment_is_the_number_of_the_site_times_the_drive(name, extension):
    actuator, saturation, control, expected = DRIVES[name]
    model = coil(actuator, saturation, extension)
    data = mujoco.MjData(model)
    data.ctrl[0] = control
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    assert strength(model, data) == pytest.approx(expected, abs=3e-9)  # 1e-10, of other fields
    twin = coil(extension=extension)
    twin.site("hand").user[:] *= expected
    other = mujoco.MjData(twin)
    other.ctrl[0] = 1.0
    with mm.magnetism():
        mujoco.mj_forward(twin, other)
    np.testing.assert_allclose(data.qacc, other.qacc, rtol=1e-15, atol=0)  # 0


@BOTH
def test_a_filter_gives_the_rise_time_of_the_coil(extension):
    """1 - exp(-t/tau); MuJoCo integrates the exact filter if told so."""
    model = coil('dyntype="filterexact" dynprm="0.05"', extension=extension)
    data = mujoco.MjData(model)
    data.ctrl[0] = 1.0
    with mm.magnetism():
        for _ in range(100):
            data.qpos[:] = 0, 0, 0, 1, 0, 0, 0
            mujoco.mj_step(model, data)
        data.qpos[:] = 0, 0, 0, 1, 0, 0, 0
        mujoco.mj_forward(model, data)
    assert strength(model, data) == pytest.approx(1 - math.exp(-2), abs=3e-9)  # 1e-10


@BOTH
def test_a_disabled_actuator_is_off(extension):
    """By the flag for all of them, or by its group: here that of the driven field."""
    model = coil(extension=extension)
    data = mujoco.MjData(model)
    data.ctrl[:] = 1.0
    mujoco.mj_kinematics(model, data)
    point, hand = [0, 0, 5.1], 2e-7 * 2 / 5**3
    on = mm.field(model, data, point)
    model.opt.disableactuator = 1 << 2
    np.testing.assert_allclose(on - mm.field(model, data, point), [0, 0, 0.002], atol=1e-17)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
    change = on - mm.field(model, data, point)
    np.testing.assert_allclose(change, [0, 0, 0.002 + hand], rtol=5e-15, atol=1e-17)  # 2e-16


@BOTH
def test_an_unclamped_control_is_beyond_its_range(extension):
    model = coil('ctrllimited="true" ctrlrange="-1 0.5"', extension=extension)
    data = mujoco.MjData(model)
    data.ctrl[0] = 0.7
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CLAMPCTRL
    mujoco.mj_kinematics(model, data)
    assert strength(model, data) == pytest.approx(0.7, abs=3e-9)  # 1e-10


@BOTH
@pytest.mark.parametrize("integrator", ["Euler", "implicitfast"])
@pytest.mark.parametrize("actuator", ["", 'dyntype="filter" dynprm="0.01"'])
def test_finite_differences_of_mujoco_see_the_drive(actuator, integrator, extension):
    """`mjd_transitionFD` against steps of nearby controls and activations."""
    model = coil(actuator, 1.5, extension, f'integrator="{integrator}"')
    data = mujoco.MjData(model)
    data.ctrl[:] = 0.6, 0.3
    data.act[:] = 0.4
    data.qvel[:] = 0.1
    size = 2 * model.nv + model.na
    state, control = np.zeros((size, size)), np.zeros((size, model.nu))
    step = 1e-5
    with mm.magnetism():
        mujoco.mj_forward(model, data)
        mujoco.mjd_transitionFD(model, data, step, True, state, control, None, None)

        def after(name, i, shift):
            other = mujoco.MjData(model)
            for part in ("qpos", "qvel", "act", "ctrl"):
                getattr(other, part)[:] = getattr(data, part)
            getattr(other, name)[i] += shift
            mujoco.mj_step(model, other)
            return np.concatenate([other.qvel, other.act])

        for name, matrix, columns in (("ctrl", control, model.nu), ("act", state, model.na)):
            first = 0 if name == "ctrl" else 2 * model.nv
            for i in range(columns):
                expected = (after(name, i, step) - after(name, i, -step)) / (2 * step)
                found = matrix[model.nv :, first + i]
                error = abs(found - expected).max()
                assert error < 5e-15 * max(1, abs(expected).max())  # 2e-16
    driven = state[model.nv :, -1] if actuator else control[model.nv :, 0]
    assert abs(driven[: model.nv]).max() > 0.1  # 0.2


BESIDE = """
<mujoco>
  <option><flag clampctrl="{clamp}"/></option>
  <custom>
    <text name="magmotor" data="dipoles coils"/>
    <tuple name="coil"><element objtype="actuator" objname="coil"/>
      <element objtype="site" objname="coil"/></tuple>
  </custom>
  <worldbody><site name="coil" user="1"/><body pos="0 0 99">
    <joint name="slide" type="slide"/><geom size="1"/></body></worldbody>
  <actuator>
    <general name="coil" site="coil" gainprm="0" {limits}/>
    <motor joint="slide" {limits}/>
    <motor joint="slide"/>
  </actuator>
</mujoco>"""


@pytest.mark.parametrize("limits", [
    "", 'ctrlrange="-1 0.5"', 'ctrlrange="-1 0.5" ctrllimited="false"'
])  # fmt: skip
@pytest.mark.parametrize("clamp", ["enable", "disable"])
@pytest.mark.parametrize("third", [0.0, math.nan, -math.inf])
def test_a_control_is_what_it_is_for_other_actuators(limits, clamp, third):
    """MuJoCo clamps first, and takes all controls for 0 if one of them is bad even so."""
    model = mujoco.MjModel.from_xml_string(BESIDE.format(limits=limits, clamp=clamp))
    data = mujoco.MjData(model)
    for control in (math.nan, math.inf, -math.inf, 1e11, -1e11, 1e10, 0.3, 0.7, -2.0):
        data.ctrl[:] = control, control, third
        mujoco.mj_forward(model, data)
        drive = mm.field(model, data, [0, 0, 1])[2] / 2e-7
        assert drive == pytest.approx(data.actuator_force[1], rel=9e-15, abs=0)  # 3e-16


def test_derivatives_do_not_depend_on_the_hook():
    found = []
    for extension in ("", PLUGIN):
        model = coil(extension=extension)
        data = mujoco.MjData(model)
        data.ctrl[:] = 0.6, 0.3
        control = np.zeros((2 * model.nv, model.nu))
        with mm.magnetism():
            mujoco.mj_forward(model, data)
            mujoco.mjd_transitionFD(model, data, 1e-5, True, None, control, None, None)
        found.append(control)
    np.testing.assert_allclose(found[0], found[1], rtol=0, atol=1e-12 * abs(found[0]).max())


def test_switching_a_magnet_off_does_not_warn():
    """Neither by its coil nor by its moment; a model on which nothing ever acted still does."""
    lines = [line for line in MODEL.splitlines() if "0.5" not in line and "field" not in line]
    lines = [line for line in lines if '"other"' not in line]
    text = "\n".join(lines).format(actuator="", saturation=0, extension="", integrator="")
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    with warnings.catch_warnings(), mm.magnetism():
        warnings.simplefilter("error")
        mujoco.mj_step(model, data)
        data.ctrl[0] = 1
        mujoco.mj_step(model, data)
        assert data.xfrc_applied.any()
        model.site("magnet").user[:] = 0
        mujoco.mj_step(model, data)
    with pytest.warns(UserWarning, match="nothing acts"), mm.magnetism():
        mujoco.mj_step(model, data)


@BOTH
@pytest.mark.parametrize("before", [0.0, 0.3])
def test_copied_data_know_the_drive_of_their_passive_forces(before, extension):
    """Data copied between the two halves of a step, then a control that the target knew before."""
    model = coil(extension=extension)
    source, used = mujoco.MjData(model), mujoco.MjData(model)
    with mm.magnetism():
        for data, control in ((source, 0.7), (used, before)):
            data.ctrl[:] = control
            mujoco.mj_step1(model, data)
        mujoco.mj_copyData(used, model, source)
        copies = [used, copy.copy(source)]
        for data in (source, *copies):
            data.ctrl[:] = before
            mujoco.mj_step2(model, data)
    for data in copies:
        np.testing.assert_array_equal(data.qvel, source.qvel)


def test_the_plugin_sees_a_control_that_is_set_between_the_halves_of_a_step():
    """The block does not: MuJoCo calls its callback in the first half."""
    for extension in ("", PLUGIN):
        model = coil(extension=extension)
        whole, halves, old = (mujoco.MjData(model) for _ in range(3))
        whole.ctrl[:] = 0.7
        with mm.magnetism():
            mujoco.mj_step(model, whole)
            mujoco.mj_step(model, old)
            mujoco.mj_step1(model, halves)
            halves.ctrl[:] = 0.7
            mujoco.mj_step2(model, halves)
        np.testing.assert_array_equal(halves.qvel, (whole if extension else old).qvel)
        assert (whole.qvel != old.qvel).any()


def test_sites_that_a_user_moves_to_other_bodies():
    """Compiled models have their sites sorted by bodies; this one does not any more."""
    coils = "".join(
        f'<tuple name="coil_{k}"><element objtype="actuator" objname="u{k}"/>'
        f'<element objtype="{kind}" objname="{name}"/></tuple>'
        for k, (kind, name) in enumerate([("body", "b2"), ("site", "s3")])
    )
    bodies = "".join(
        f'<body name="b{k}" pos="0 0 {k}"><freejoint/><geom size=".1"/>'
        f'<site name="s{k}" user="1"/></body>'
        for k in (1, 2, 3)
    )
    model = mujoco.MjModel.from_xml_string(f"""
    <mujoco><custom><text name="magmotor" data="dipoles coils"/>{coils}</custom>
      <worldbody><site user="1"/>{bodies}</worldbody>
      <actuator><general name="u0" site="s1" gainprm="0"/>
        <general name="u1" site="s1" gainprm="0"/></actuator>
    </mujoco>""")
    data = mujoco.MjData(model)
    model.site_bodyid[1], model.site_bodyid[2] = 2, 1
    data.ctrl[:] = 3, 5
    mujoco.mj_forward(model, data)
    driven = [
        np.linalg.norm(mm.field(model, data, data.site_xpos[k] + [0.01, 0, 0])) for k in (1, 2, 3)
    ]
    own = 1e-7 / 0.01**3
    np.testing.assert_allclose(driven, own * np.array([3, 1, 5]), rtol=1e-4)  # 1e-5


def test_describe_names_coils(capsys):
    found = mm.describe(coil())
    print(found)
    assert found.coils == {"coil of the hand": ("current", 1)}
    assert found.fields == {"field": "uniform, driven by other"}
    assert found.acting == ("dipoles", "fields", "coils")
    assert "coils, magnets and actuator: coil of the hand (1, current)" in capsys.readouterr().out
