"""Models that use every function of the library that MuJoCo calls, each in another way."""

import random
from pathlib import Path

import magmotor as mm  # isort: skip  before MuJoCo, for which it chooses an OpenGL library
import mujoco
from messages.declarations import field, group, iron, numeric

ROOT = Path(__file__).parents[1]
STEPS, OF_MANY = 300, 2
"""Steps of most models, and of those with many magnets."""

METER = '<plugin plugin="magmotor.magnetometer"{}/>'
HEAD = """
<mujoco>
  <extension>
    <plugin plugin="magmotor.forces"><instance name="magnets">
      <config key="act" value="{act}"/></instance></plugin>{extension}
  </extension>
  <option timestep="{timestep}" integrator="{integrator}"><flag contact="disable"/></option>
  <size memory="100M"/>
  <custom>{custom}</custom>
"""
FEW = """
  <worldbody>
    <site name="fixed" pos="0 0 0.4" user="2"/>
    <site name="probe" pos="0.1 0.1 0.2"/>
    <geom name="table" type="plane" size="1 1 1" pos="0 0 -0.5"/>
    {more}
    <body name="needle" user="{wrenches}">
      <joint name="turn" axis="0 1 0" damping="1e-4" user="{potential}"/>
      <geom name="core" type="capsule" fromto="-0.05 0 0 0.05 0 0" size="0.01" mass="0.05"/>
      <site name="tip" pos="0.05 0 0" zaxis="1 0 0.3" user="1"/>
    </body>
    <body name="ball" pos="0.2 0.1 0.3">
      <freejoint/><geom name="ball" size="0.02" mass="0.1"/>{sites}
    </body>
    <body name="sled" pos="-0.2 0.05 0.1">
      <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 1" stiffness="5"/>
      <geom name="sled" type="box" size="0.02 0.03 0.01" mass="0.1"/>
      <site name="coil" zaxis="0 1 1" user="0.7"/><site name="aside" pos="0.06 0 0"/>
    </body>
  </worldbody>
  <actuator>
    <general name="current" site="coil" gainprm="0"/>
    <general name="slow" site="tip" gainprm="0" dyntype="filterexact" dynprm="0.02"/>
  </actuator>
  <sensor>{sensor}</sensor>
  <keyframe><key ctrl="0.6 1" time="0.5"/></keyframe>
</mujoco>
"""
FLEX = """<flexcomp name="cloth" type="grid" count="3 3 1" spacing="0.1 0.1 0.1" pos="0 1 0"
 dim="2" radius="0.01" mass="0.1"><edge equality="true"/></flexcomp>"""
SHAPES = "".join(
    f'<body pos="{place}"><freejoint/><geom type="{kind}" size="{size}" user="{user}" mass=".1"/>'
    "</body>"
    for place, kind, size, user in (
        ("0.3 0.1 0.3", "box", ".02 .03 .01", ".2 0 1"),
        ("0.3 0.1 0.34", "cylinder", ".02 .01", "0 .3 1"),
        ("0.3 0.15 0.3", "ellipsoid", ".01 .015 .02", "0 0 1"),
        ("0.3 0.1 -0.46", "sphere", ".02", "0 1 1"),
        ("0.33 0.1 -0.48", "box", ".01 .01 .02", "0 0 1"),
        ("0.34 0.1 0.3", "capsule", ".01 .02", "0 .5 1"),
    )
) + (
    '</worldbody><asset><mesh name="pyramid" vertex="-.01 -.02 0 .01 -.02 0 .01 .02 0 -.01 .02 0'
    ' 0 .01 .02"/></asset><worldbody><body pos="0.26 0.1 0.3"><freejoint/>'
    '<geom type="mesh" mesh="pyramid" user="0 .3 1" mass=".1"/></body>'
)
SITE = '<site name="ball" pos="0 0 0.01" zaxis="0.2 0 1" user="1.5"/>'
EMPTY = dict.fromkeys(("extension", "custom", "more", "wrenches", "potential", "sensor"), "")
PLAIN = {"act": "all", "timestep": "1e-3", "integrator": "Euler", "sites": SITE}


def few(*custom: str, **changed: str) -> str:
    """A needle, a ball and a sled, which carry magnets, below a fixed one."""
    given = EMPTY | PLAIN | {"custom": "".join(custom)} | changed
    return (HEAD + FEW).format(**given)


def many(tolerance: float, count: int = 1000) -> str:
    """A sheet of free magnets: tiles, or clusters where a tolerance is worth them."""
    draw = random.Random(2).uniform
    bodies = "".join(
        f'<body pos="{draw(-1, 1)} {draw(-1, 1)} {draw(-0.01, 0.01)}"'
        f' euler="{draw(-90, 90)} {draw(-90, 90)} 0"><freejoint/>'
        f'<geom size="0.01"/><site user="1"/></body>'
        for _ in range(count)
    )
    custom = numeric("magnetic_tolerance", tolerance)
    head = HEAD.format(**EMPTY | PLAIN | {"timestep": "1e-5", "custom": custom})
    return f"{head}<worldbody>{bodies}</worldbody></mujoco>"


def magnetometer(name: str, site: str, more: str = "") -> str:
    return METER.format(f' name="{name}" objtype="site" objname="{site}"{more}')


GRID = mm.tabulated_field(lambda p: 0.01 * p * p[:, [1, 2, 0]], (-5, -5, -5), (5, 5, 5), (4, 4, 4))
ROW = "".join(f'<site pos="{k / 100} 0 0" user="0.1"/>' for k in range(20))
MODELS = {
    "dipoles": few(),
    "in other units": few(numeric("magnetic_constant", 1e-6)),
    "coupled": few(group("coupling", "body world 2", "body ball 2")),
    "large": few(sites=ROW, more=f'<body name="row" pos="0 0 0.5">{ROW}</body>'),
    "uniform field": few(numeric("field", "0 0.01 0.02")),
    "gradient": few(numeric("field", "0 0.01 0.02 0.1 0 0 0.2 0")),
    "table": few(GRID),
    "field of a body": few(field("0 0 0.05", "body sled")),
    "driven field": few(field("0 0 0.05", "actuator slow")),
    "coil": few(group("coil", "actuator current", "site coil")),
    "saturated coil": few(group("coil", "actuator slow 0.5", "site tip", "body ball")),
    "iron": few(iron("geom core")),
    "saturated iron": few(iron("geom core", "geom ball", material="5000 1e4"), sites=""),
    "hysteresis": few(
        numeric("loop", "500 0.3"), group("hysteresis", "numeric loop", "site tip", "site ball"),
        integrator="RK4",
    ),
    "plane of iron": few(iron("geom table", "geom ball")),
    "magnets by geom": few(more=SHAPES, timestep="1e-5"),
    "magnets by geom on iron": few(iron("geom table", "geom ball"), more=SHAPES, timestep="1e-5"),
    "magnetometer": few(extension=METER.format(""), sensor=magnetometer("still", "probe")),
    "two magnetometers": few(
        iron("geom core"), GRID, extension=METER.format(""),
        sensor=magnetometer("a", "probe") + magnetometer("b", "aside", ' cutoff="1e-3"'),
    ),
    "potential": few(potential="0.1 0.2 0 0.05"),
    "noise": few(wrenches="0 1e-4 0 0 1e-4 0"),
    "noise by RK4": few(wrenches="0 1e-4 0 0 1e-4 0", integrator="RK4"),
    "implicit": few(integrator="implicitfast"),
    "flex": few(more=FLEX),
}  # fmt: skip
"""Models of few magnets, by what they have."""

FILES = [*sorted(ROOT.glob("models/*_magnetic.xml")), ROOT / "models" / "levitation.xml"]
MANY = {"tiles": many(0.0), "clusters": many(0.01)}


def started(model: mujoco.MjModel) -> mujoco.MjData:
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    return data


def state(data: mujoco.MjData) -> list[float]:
    """Positions, velocities and data of sensors."""
    return [*data.qpos, *data.qvel, *data.sensordata]


def state_after(model: mujoco.MjModel, steps: int) -> list[float]:
    data = started(model)
    mujoco.mj_step(model, data, nstep=steps)
    return state(data)


def states() -> list[list[float]]:
    """The states of all models, in their order."""
    load, read = mujoco.MjModel.from_xml_string, mujoco.MjModel.from_xml_path
    found = [state_after(load(text), STEPS) for text in MODELS.values()]
    found += [state_after(read(str(path)), STEPS) for path in FILES]
    return found + [state_after(load(text), OF_MANY) for text in MANY.values()]
