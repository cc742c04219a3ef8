"""What acts no longer leaves no wrench in `xfrc_applied`; what others set there stays."""

import mujoco
import numpy as np
import pytest

import magmotor as mm

MODEL = """
<mujoco>
  <option gravity="0 0 0" timestep="1e-3"/>
  <size nuserdata="5"/>
  <custom>
    <text name="magmotor" data="dipoles fields iron noise"/>
    <numeric name="soft" data="100"/>
    <tuple name="iron">
      <element objtype="numeric" objname="soft"/><element objtype="geom" objname="pole"/>
    </tuple>
    <numeric name="field" data="0.01 0 0.02 0.1 0 0 0 0"/>
    <tuple name="field">
      <element objtype="numeric" objname="field"/><element objtype="body" objname="owner"/>
    </tuple>
  </custom>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <site user="1" zaxis="1 0 0"/>
    <body name="magnet" pos="0.2 0 0">
      <freejoint/><geom size="0.01" mass="1"/><site name="tip" user="1" zaxis="1 0 0"/>
    </body>
    <body name="iron" pos="0 0.3 0"><freejoint/><geom name="pole" size="0.02" mass="1"/></body>
    <body name="warm" pos="0 0 2" user="1e-3 0 0 0 0 0">
      <freejoint/><geom size="0.01" mass="1"/>
    </body>
    <body name="owner" pos="0 0 0.5"><freejoint/><geom size="0.01" mass="1"/></body>
    <body name="other" pos="0 0 3"><freejoint/><geom size="0.01" mass="1"/></body>
  </worldbody>
</mujoco>
"""

BODIES = "magnet", "iron", "warm", "owner"

OFF = {
    "magnet": lambda model: model.site_user.fill(0.0),
    "iron": lambda model: model.numeric("soft").data.fill(0.0),
    "warm": lambda model: model.body_user.fill(0.0),
    "owner": lambda model: model.numeric("field").data.fill(0.0),
}
"""How each body stops to be acted on."""


@pytest.fixture
def running():
    """A model and its data after some steps within a block, with another's wrench on a body."""
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    data.body("other").xfrc_applied[2] = 0.5
    with mm.magnetism():
        mujoco.mj_step(model, data, nstep=5)
        assert all(data.body(name).xfrc_applied.any() for name in BODIES)
        yield model, data
        assert data.body("other").xfrc_applied.tolist() == [0, 0, 0.5, 0, 0, 0]


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
def test_a_body_that_is_switched_off_coasts(running, name, integrator):
    model, data = running
    model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    OFF[name](model)
    mujoco.mj_step(model, data, nstep=3)
    assert not data.body(name).xfrc_applied.any()
    others = [each for each in BODIES if each != name]
    assert all(data.body(each).xfrc_applied.any() for each in others)


def test_nothing_is_left_of_a_model_that_is_switched_off(running):
    model, data = running
    for off in OFF.values():
        off(model)
    mujoco.mj_step(model, data, nstep=3)
    assert not any(data.body(name).xfrc_applied.any() for name in BODIES)
    model.site_user[:] = 1.0
    mujoco.mj_step(model, data)
    assert data.body("magnet").xfrc_applied.any()


def test_a_wrench_that_a_user_sets_on_a_former_magnet_stays(running):
    model, data = running
    for off in OFF.values():
        off(model)
    mujoco.mj_step(model, data)
    data.body("magnet").xfrc_applied[:] = 1, 2, 3, 4, 5, 6
    mujoco.mj_step(model, data, nstep=3)
    assert data.body("magnet").xfrc_applied.tolist() == [1, 2, 3, 4, 5, 6]


def test_the_dipoles_of_a_model_without_a_mark_may_stop_to_act():
    """One row of numbers of sites is taken for moments only while they look like these."""
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option gravity="0 0 0"/><worldbody><site user="1" zaxis="1 0 0"/>'
        '<body name="magnet" pos="0.2 0 0"><freejoint/><geom size="0.01"/>'
        '<site name="tip" user="1" zaxis="1 0 0"/></body></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    with mm.magnetism():
        mujoco.mj_step(model, data)
        assert data.body("magnet").xfrc_applied.any()
        model.site("tip").user[:] = np.nan
        mujoco.mj_step(model, data, nstep=3)
    assert not data.body("magnet").xfrc_applied.any()
