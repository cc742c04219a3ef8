"""The magnetometer: the field at a site as MuJoCo's sensor data."""

import mujoco
import mujoco.rollout
import numpy as np
import pytest
from magnetic_energy import flux
from refusals import misdeclared

import magmotor as mm

MODEL = """
<mujoco>
  <extension>{extension}<plugin plugin="magmotor.magnetometer"/></extension>
  <option gravity="0 0 0"/>
  <custom>
    <text name="magmotor" data="dipoles fields coils iron"/>
    <numeric name="field" data="1e-3 2e-3 -1e-3"/>
    <numeric name="soft" data="100"/>
    <tuple name="iron"><element objtype="numeric" objname="soft"/>
      <element objtype="geom" objname="ball"/></tuple>
    <tuple name="coil"><element objtype="actuator" objname="current"/>
      <element objtype="site" objname="magnet"/></tuple>
  </custom>
  <worldbody>
    <site name="magnet" pos="0 0 0.1" user="2" zaxis="1 1 1"/>
    <site name="fixed" pos="0.1 0.02 0.05" euler="10 20 30"/>
    <body pos="-0.1 0 0"><freejoint/><geom name="ball" size="0.01"/>
      <site name="carried" pos="0.02 0.01 0" euler="50 0 0" user="{moment}"/></body>
  </worldbody>
  <actuator><general name="current" site="carried" gainprm="0"/></actuator>
  <sensor>
    <clock/>
    <plugin name="first" plugin="magmotor.magnetometer" objtype="site" objname="fixed"/>
    <plugin name="second" plugin="magmotor.magnetometer" objtype="{kind}" objname="{where}"
      cutoff="{cutoff}"/>
  </sensor>
</mujoco>
"""
RTOL = 3e-3  # 3.2e-4: 0.022 m from the ball, nodes and the gradient of the field are seen
PLUGIN = '<plugin plugin="magmotor.forces"><instance name="m"/></plugin>'


def measured(extension=PLUGIN, moment=0, cutoff=0.0, kind="site", where="carried"):
    model = mujoco.MjModel.from_xml_string(
        MODEL.format(extension=extension, moment=moment, cutoff=cutoff, kind=kind, where=where)
    )
    data = mujoco.MjData(model)
    data.ctrl[0] = 0.7
    data.qvel[:] = 0.1, 0.2, 0.3, 1, 2, 3
    return model, data


def expected(data, site):
    """The field of the coil, the uniform one, and that of the ball that both magnetize."""
    uniform, axes = np.array([1e-3, 2e-3, -1e-3]), data.site(site).xmat.reshape(3, 3)
    magnet, ball, place = (
        each.xpos for each in (data.site("magnet"), data.geom("ball"), data.site(site))
    )
    moment = data.ctrl[0] * 2 * np.ones(3) / np.sqrt(3)
    induced = 4 / 3 * np.pi * 0.01**3 / (4e-7 * np.pi) * 100 / (1 + 100 / 3)
    induced = induced * (uniform + flux(ball, magnet, moment))
    return axes.T @ (uniform + flux(place, magnet, moment) + flux(place, ball, induced))


@pytest.mark.parametrize("extension", [PLUGIN, ""], ids=["plugin", "callback"])
def test_the_data_are_the_field_along_the_axes_of_the_site(extension):
    model, data = measured(extension)
    with mm.magnetism():
        mujoco.mj_step(model, data, nstep=20)
        mujoco.mj_forward(model, data)
    for name, site in (("first", "fixed"), ("second", "carried")):
        np.testing.assert_allclose(data.sensor(name).data, expected(data, site), rtol=RTOL)


def test_no_block_is_needed_to_measure():
    model, data = measured("")
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.sensor("first").data, expected(data, "fixed"), rtol=RTOL)


def test_the_cutoff_is_that_of_sensors():
    model, data = measured(cutoff=2e-3)
    mujoco.mj_forward(model, data)
    field = expected(data, "carried")
    assert abs(field).max() > 2e-3
    clipped = np.clip(field, -2e-3, 2e-3)
    np.testing.assert_allclose(data.sensor("second").data, clipped, rtol=RTOL)


def test_finite_differences_see_the_control():
    model, data = measured()
    size = model.nsensordata
    states, controls = np.zeros((size, 2 * model.nv)), np.zeros((size, 1))
    mujoco.mj_forward(model, data)
    mujoco.mjd_transitionFD(model, data, 1e-6, True, None, None, states, controls)
    start = model.sensor("first").adr[0]
    found = []
    for control in (0.0, 1.0):
        data.ctrl[0] = control
        mujoco.mj_forward(model, data)
        found.append(data.sensor("first").data.copy())
    np.testing.assert_allclose(controls[start : start + 3, 0], found[1] - found[0], rtol=1e-5)
    assert abs(states[start : start + 3, :3]).max() > 1e-6  # iron moves


def test_a_rollout_records_the_field():
    model, data = measured()
    mujoco.mj_step(model, data, nstep=3)
    spec = mujoco.mjtState.mjSTATE_FULLPHYSICS
    initial = np.empty(mujoco.mj_stateSize(model, spec))
    mujoco.mj_getState(model, data, initial, spec)
    _, sensors = mujoco.rollout.rollout(model, [mujoco.MjData(model)] * 1, initial, nstep=5)
    controlled = mujoco.MjData(model)
    mujoco.mj_setState(model, controlled, initial, spec)
    for k in range(5):
        mujoco.mj_step(model, controlled)
        np.testing.assert_array_equal(sensors[0, k], controlled.sensordata)


@pytest.mark.parametrize("steps", [0, 1], ids=["at time 0", "later"])
@pytest.mark.parametrize("field", ["sensor_adr", "sensor_objid"])
@pytest.mark.parametrize("value", [-1, 10**8, 0])
def test_an_index_of_a_sensor_that_leads_out_of_the_model(field, value, steps):
    """Its last place is 4 of 7 data, and its last site 2 of 3."""
    model, data = measured()
    mujoco.mj_step(model, data, nstep=steps)
    outside = {"sensor_adr": model.nsensordata - 2, "sensor_objid": model.nsite}
    getattr(model, field)[2] = value or outside[field]
    with pytest.raises(mujoco.FatalError) as in_a_step:
        mujoco.mj_step(model, data)
    with misdeclared("index", 2) as outside:
        mm.describe(model)
    assert str(outside.value).startswith(f"{field}[2] of the model = ")
    assert str(in_a_step.value) == str(outside.value)


def test_a_model_without_dipoles_measures_nothing():
    text = """
    <mujoco>
      <extension><plugin plugin="magmotor.magnetometer"/></extension>
      <worldbody><body><freejoint/><geom size="1"/><site name="s"/></body></worldbody>
      <sensor><plugin plugin="magmotor.magnetometer" objtype="site" objname="s"/></sensor>
    </mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data)
    np.testing.assert_array_equal(data.sensordata, 0)
