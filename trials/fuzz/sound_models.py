"""The sound models that `binaries` damages, and what is wrong with the forces on damaged ones."""

from typing import NamedTuple

import mujoco
import numpy as np

from trials.numpy_twin import apply_magnetism, potential_forces

MODEL = """
<mujoco>
  <option timestep="1e-3"/>
  <size nuserdata="5"/>
  <extension>
    {plugin}
    <plugin plugin="magmotor.magnetometer"><instance name="hall"/></plugin>
  </extension>
  <custom>
    <text name="other" data="words"/>
    <text name="magmotor" data="{kinds}"/>
    <numeric name="{tolerance}" data="1e-3"/>
    <numeric name="field_up" data="0 0 1e-3 0 0 0 0 0"/>
    <numeric name="steel" data="1000 1.5e6"/>
    <tuple name="field of the rail">
      <element objtype="numeric" objname="field_up"/>
      <element objtype="actuator" objname="current"/>
      <element objtype="site" objname="end"/>
    </tuple>
    <tuple name="coil">
      <element objtype="actuator" objname="drive" prm="2"/>
      <element objtype="body" objname="rotor"/>
      <element objtype="site" objname="free"/>
    </tuple>
    <tuple name="coupling">
      <element objtype="body" objname="rotor" prm="2"/>
      <element objtype="body" objname="ball" prm="2"/>
    </tuple>
    <tuple name="iron">
      <element objtype="numeric" objname="steel"/>
      <element objtype="geom" objname="core"/>
    </tuple>
  </custom>
  <asset><mesh name="block" vertex="0 0 0 .02 0 0 0 .02 0 0 0 .02 .02 .02 .02"/></asset>
  <worldbody>
    <light pos="0 0 2"/><camera mode="targetbody" target="ball" pos="0 -1 0"/>
    <geom name="core" type="box" size=".02 .02 .02" pos="0 0 -.3"/>
    <site name="end" pos="1 0 0"/>
    <body name="base" pos="0 0 .1">
      <geom size=".02"/>
      <body name="rotor">
        <joint name="axle" type="hinge" damping="1e-3" user="1e-3 0 0 2e-3"/>
        <geom size=".03"/>
        {sites}
      </body>
    </body>
    <body name="ball" pos=".3 0 0" user="0 0 1e-4 0 0 0">
      <freejoint/>
      <geom size=".02"/>
      <site name="free" user=".3"/>
    </body>
    <body pos="0 .4 0"><joint type="slide" user="1e-3 0"/>
      <geom name="block" type="mesh" mesh="block"/><site pos=".01 .01 .01" user="1"/></body>
  </worldbody>
  <actuator>
    <general name="drive" joint="axle" gainprm="0" ctrlrange="-1 1"/>
    <general name="current" joint="axle" gainprm="0" dyntype="filter" dynprm="1e-2"/>
  </actuator>
  <contact><pair geom1="block" geom2="core"/><exclude body1="base" body2="rotor"/></contact>
  <equality><connect body1="ball" body2="base" anchor="0 0 0" active="false"/></equality>
  <tendon><spatial><site site="end"/><site site="free"/></spatial></tendon>
  <keyframe><key name="start"/><key name="spin" qvel="1 0 0 0 0 9 9 0"/></keyframe>
  <sensor><plugin name="probe" instance="hall" objtype="site" objname="end"/></sensor>
</mujoco>"""
FORCES = """<plugin plugin="magmotor.forces">
<instance name="m"><config key="act" value="{kinds}"/></instance></plugin>"""
SITES = "".join(f'<site pos="{k / 100} 0 0" zaxis="1 {k} 0" user=".1"/>' for k in range(20))
COMPARED = "dipoles couplings potentials"
"""What acts on a model whose forces plain NumPy knows."""

ACCURACY = 1e-10
"""Largest error of a force, over the largest force."""


class Sound(NamedTuple):
    """Which model is damaged."""

    plugin: bool
    """Whether it has the plugin; if not, it is used inside `magnetism()`."""
    compared: bool
    """Whether only `COMPARED` acts, or everything."""

    @property
    def model(self) -> mujoco.MjModel:
        """The model, of which the caller may change the arrays."""
        kinds = COMPARED if self.compared else "all"
        return mujoco.MjModel.from_xml_string(
            MODEL.format(
                plugin=FORCES.format(kinds=kinds) if self.plugin else "",
                kinds=kinds,
                tolerance="other_tolerance" if self.compared else "magnetic_tolerance",
                sites=SITES,
            )
        )


def wrong_forces(model: mujoco.MjModel, data: mujoco.MjData) -> str:
    """Compare the forces on the joints with those of plain NumPy, if all bodies are awake."""
    of = mujoco.mjtObj.mjOBJ_TEXT
    marked = "magmotor" in [mujoco.mj_id2name(model, of, k) for k in range(model.ntext)]
    if not data.body_awake.all() or not (marked or model.nplugin > 1):
        return ""
    found, expected = data.qfrc_passive + data.qfrc_applied, potential_forces(model, data)
    twin = mujoco.MjData(model)
    twin.site_xpos[:], twin.site_xmat[:], twin.xipos[:] = data.site_xpos, data.site_xmat, data.xipos
    apply_magnetism(model, twin)
    for wrenches, total in ((data.xfrc_applied, found), (twin.xfrc_applied, expected)):
        for body in np.flatnonzero(wrenches.any(axis=1)).tolist():
            force, torque = np.split(wrenches[body], 2)
            mujoco.mj_applyFT(model, data, force, torque, data.xipos[body], body, total)
    error = abs(found - expected).max(initial=0)
    if error <= ACCURACY * abs(expected).max(initial=0):
        return ""
    return f"the forces are {found}, not {expected}"
