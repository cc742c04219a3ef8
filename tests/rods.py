"""Models of rods with hysteresis, and the numbers of their loop."""

import math

import mujoco

MU0 = 4e-7 * math.pi
COERCIVITY, REMANENCE, MOMENT = 12.0, 0.16, 1.5e-3
B_C = MU0 * COERCIVITY
B_K = B_C * math.sqrt(1 / REMANENCE**2 - 1)
EARTH = 4e-5

PLUGIN = '<plugin plugin="magmotor.forces"><instance name="magnets"/></plugin>'
MODEL = """
<mujoco>
  <option gravity="0 0 0" timestep="{timestep}" integrator="{integrator}"/>
  <extension>{plugin}</extension>
  <custom>
    <text name="magmotor" data="{act}"/>{more}
    <numeric name="field" data="{field}"/>
    <numeric name="loop" data="{loop}"/>
    <tuple name="hysteresis"><element objtype="numeric" objname="loop"/>{rods}</tuple>
  </custom>
  <worldbody>{bodies}</worldbody>
  <actuator>{actuators}</actuator>
</mujoco>"""
ROD = '<element objtype="site" objname="{}"/>'
SATELLITE = f"""
<body name="satellite"><joint type="hinge" axis="0 0 1"/>
  <geom type="box" size=".05 .05 .05" mass="1"/>
  <site name="rod" zaxis="1 0 0" user="{MOMENT}"/></body>"""
DRIVEN = """
<numeric name="field_across" data="0 1e-5 0"/>
<tuple name="field"><element objtype="numeric" objname="field"/>
  <element objtype="actuator" objname="current"/></tuple>"""
CURRENT = '<general name="current" joint="lock" gainprm="0"/>'
LOCKED = f"""
<body><joint name="lock" type="hinge" axis="0 0 1" armature="1e9"/><geom size=".05"/>
  <site name="rod" zaxis="1 0 0" user="{MOMENT}"/></body>"""


def loaded(bodies=SATELLITE, rods=("rod",), **options):
    given = {
        "timestep": 0.01, "integrator": "RK4", "plugin": PLUGIN, "act": "dipoles fields hysteresis",
        "more": "", "field": f"{EARTH} 0 0", "loop": f"{COERCIVITY} {REMANENCE}", "actuators": "",
    } | options  # fmt: skip
    named = "".join(map(ROD.format, rods))
    model = mujoco.MjModel.from_xml_string(MODEL.format(bodies=bodies, rods=named, **given))
    return model, mujoco.MjData(model)
