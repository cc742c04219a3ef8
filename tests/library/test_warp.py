"""Magnets in MuJoCo Warp: the same forces, fields, noise and motion as in C, world by world."""

import warnings
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from refusals import refused

import magmotor as mm

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # of the compiler in Warp
    wp: Any = pytest.importorskip("warp")
    mujoco_warp: Any = pytest.importorskip("mujoco_warp")
    wp.config.quiet = True
    wp.config.verbose = False

from magmotor.warp import put_model

ROOT = Path(__file__).parents[2]
POSES = 20
MODELS = (
    "levitation", "top_magnetic", "top_plane_magnetic", "motor_magnetic", "motor_plane_magnetic",
    "disk_magnetic",
)  # fmt: skip

TABLE = mm.tabulated_field(
    lambda points: 0.01 * np.sin(3 * points[:, [1, 2, 0]] + 1), [-2, -2, -2], [2, 2, 2], (9, 8, 7),
    name="field_table",
)  # fmt: skip

EVERYTHING = f"""
<mujoco>
  <extension>
    <plugin plugin="magmotor.forces"><instance name="magnets"><config key="act"
      value="dipoles couplings noise potentials fields coils iron"/></instance></plugin>
    <plugin plugin="magmotor.magnetometer"/>
  </extension>
  <option timestep="0.004" integrator="RK4"><flag contact="disable"/></option>
  <size nuserdata="5"/>
  <custom>
    <numeric name="magnetic_constant" data="2e-4"/>
    <numeric name="field_even" data="0.01 -0.02 0.03"/>
    <numeric name="field_steep" data="0.01 0.02 -0.01 0.05 0.02 -0.03 0.04 0.01"/>
    {TABLE}
    <numeric name="steel" data="40"/>
    <tuple name="iron"><element objtype="numeric" objname="steel"/>
      <element objtype="geom" objname="floor"/></tuple>
    <tuple name="coupling"><element objtype="body" objname="ball" prm="1.7"/>
      <element objtype="body" objname="needle" prm="1.7"/></tuple>
    <tuple name="coupling of the world"><element objtype="body" objname="world" prm="0"/>
      <element objtype="body" objname="needle" prm="0"/></tuple>
    <tuple name="coil"><element objtype="actuator" objname="current" prm="0.8"/>
      <element objtype="site" objname="coil"/></tuple>
    <tuple name="coil of a body"><element objtype="actuator" objname="slow"/>
      <element objtype="body" objname="arm"/></tuple>
    <tuple name="field of the sled"><element objtype="numeric" objname="field_steep"/>
      <element objtype="body" objname="sled"/></tuple>
    <tuple name="field at a site"><element objtype="numeric" objname="field_table"/>
      <element objtype="site" objname="aside"/>
      <element objtype="actuator" objname="current" prm="0.5"/></tuple>
  </custom>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1" pos="0 0 -0.6" euler="5 10 0"/>
    <site name="fixed" pos="0 0 0.4" user="2"/>
    <site name="probe" pos="0.1 0.1 0.2" euler="20 30 40"/>
    <body name="frame" pos="0.5 0 0.2" mocap="true"><site pos="0 0.1 0" zaxis="1 1 0" user="1"/>
    </body>
    <body name="needle" user="0 0 0 0.01 0 0.02 0 0 0 0 0.03 0">
      <joint name="turn" axis="0 1 0" user="0.1 -0.2 0.05 0.3"/>
      <geom type="capsule" fromto="-0.05 0 0 0.05 0 0" size="0.01" mass="0.05"/>
      <site name="tip" pos="0.05 0 0" zaxis="1 0 0.3" user="1"/>
    </body>
    <body name="ball" pos="0.2 0.1 0.3" user="0 0 0 0 0 0 0.05 0.02 0 0 0.01 0">
      <freejoint/><geom size="0.02" mass="0.1"/>
      <site zaxis="0 1 1" user="1.5"/><site pos="0.01 0 0.02" zaxis="1 0 1" user="-0.8"/>
      <body name="arm" pos="0.1 0 0"><joint axis="1 0 1" pos="0 0.02 0"/>
        <geom size="0.01" pos="0.05 0 0" mass="0.03"/>
        <site pos="0.05 0 0" user="0.6"/><site pos="0.05 0.03 0" zaxis="1 1 1" user="0.4"/>
        <body pos="0.05 0 0.02"><geom size="0.01" mass="0.01"/><site user="0.3" zaxis="0 1 0"/>
        </body>
      </body>
    </body>
    <body name="sled" pos="-0.2 0.05 0.1">
      <joint type="slide" axis="1 0 0" user="0.2 0.1"/><joint type="slide" axis="0 1 1"/>
      <joint type="ball"/><geom type="box" size="0.02 0.03 0.01" mass="0.1"/>
      <site name="coil" zaxis="0 1 1" user="0.7"/><site name="aside" pos="0.06 0 0"/>
    </body>
  </worldbody>
  <actuator>
    <general name="current" site="coil" gainprm="0" ctrlrange="-1 1"/>
    <general name="slow" joint="turn" gainprm="0" dyntype="filterexact" dynprm="0.02"/>
  </actuator>
  <sensor>
    <clock/>
    <plugin plugin="magmotor.magnetometer" objtype="site" objname="probe"/>
    <plugin plugin="magmotor.magnetometer" objtype="site" objname="aside" cutoff="0.03"/>
  </sensor>
</mujoco>
"""

NEEDLES = """
<mujoco>
  <extension><plugin plugin="magmotor.forces"><instance name="magnets">
    <config key="act" value="{act}"/></instance></plugin></extension>
  <option timestep="0.005"/>
  {more}
  <worldbody>
    <site name="magnet" pos="0 0.1 0" zaxis="0 1 0" user="5"/>
    {world}
    <body name="needle" {body}>
      <joint axis="0 0 1" damping="1e-4"/>
      <geom type="capsule" fromto="-0.03 0 0 0.03 0 0" size="0.003"/>
      <site name="needle" zaxis="1 0 0" user="0.2"/>
    </body>
  </worldbody>
</mujoco>
"""


def needles(act="dipoles", more="", world="", body=""):
    return compiled(NEEDLES.format(act=act, more=more, world=world, body=body))


def compiled(text):
    return mujoco.MjModel.from_xml_string(text)


def states(model, seed=1):
    """The data of random poses, with other controls, and other steps of other paths of noise."""
    rng = np.random.default_rng(seed)
    found = []
    for k in range(POSES):
        data = mujoco.MjData(model)
        mujoco.mj_integratePos(model, data.qpos, rng.normal(0, 0.05, model.nv), 1.0)
        data.ctrl[:], data.act[:] = rng.uniform(-2, 2, model.nu), rng.uniform(-2, 2, model.na)
        data.time = 3 * k * model.opt.timestep
        if model.nuserdata:
            data.userdata[:] = 7, k, 1, 0, 1000
        found.append(data)
    return found


def worlds(m, model, data):
    """One world for each mjData."""
    d = mujoco_warp.make_data(model, nworld=len(data))
    for name in ("qpos", "qvel", "ctrl", "act", "time"):
        getattr(d, name).assign(np.array([getattr(each, name) for each in data]))
    if m.magmotor.noise:
        m.magmotor.noise.paths = np.array([each.userdata for each in data])
    return d


def largest_error(found, expected):
    """Of numbers of any worlds: each over the largest of its column, or a hundredth of any."""
    largest = np.abs(expected).max(axis=0)
    return (np.abs(found - expected) / np.maximum(largest, 0.01 * largest.max())).max()


def compared(model):
    """The largest errors of forces and sensor data, and the worlds."""
    data = states(model)
    for each in data:
        mujoco.mj_forward(model, each)
    m = put_model(model)
    d = worlds(m, model, data)
    mujoco_warp.forward(m, d)
    names = ("qfrc_passive", "sensordata") if model.nsensordata else ("qfrc_passive",)
    return {
        name: largest_error(getattr(d, name).numpy(), np.array([getattr(e, name) for e in data]))
        for name in names
    }, d


@pytest.mark.parametrize("name", MODELS)
def test_forces_are_those_of_the_plugin(name):
    model = mujoco.MjModel.from_xml_path(str(ROOT / "models" / f"{name}.xml"))
    errors, _ = compared(model)
    print(name, errors)
    assert errors["qfrc_passive"] < 3e-6
    assert errors.get("sensordata", 0.0) < 3e-6


def test_forces_and_sensors_of_one_model_with_everything():
    errors, d = compared(compiled(EVERYTHING))
    print(errors)
    assert errors["qfrc_passive"] < 3e-6
    assert errors["sensordata"] < 3e-6
    measured = np.abs(d.sensordata.numpy()[:, 4:])
    assert measured.max() == np.float32(0.03)  # the cutoff
    assert measured.min() < 0.03
