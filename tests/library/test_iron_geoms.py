"""Magnets by their geom near iron by its geom, in MuJoCo: a bar, a block, edges, and contact.

The pull at the end of the bar is that of converged surface charges; see `test_iron_shapes.py`.
"""

import math

import mujoco
import numpy as np
import pytest
from energy_slopes import forces_by_energy

import magmotor as mm

MODEL = """
<mujoco>
  <option gravity="0 0 0"/>
  <custom>
    <text name="magmotor" data="magnets iron"/><numeric name="steel" data="{material}"/>
    <tuple name="iron"><element objtype="numeric" objname="steel"/>
      <element objtype="geom" objname="piece"/></tuple>
  </custom>
  <asset><mesh name="cube" scale="0.003 0.003 0.003"
    vertex="-1 -1 -1  -1 -1 1  -1 1 -1  -1 1 1  1 -1 -1  1 -1 1  1 1 -1  1 1 1"/></asset>
  <worldbody>
    <body><freejoint/><geom name="piece" {piece}/></body>
    <body><freejoint/><geom {magnet}/></body>
  </worldbody>
</mujoco>"""
ROD = 'type="cylinder" size="0.005 0.005" user="0 0 1.3"'
DISK = 'type="cylinder" size="0.00635 0.0015875" user="0 0 1.32"'
BAR = 'type="box" size="0.005 0.005 0.03"'
BLOCK = 'type="box" size="0.03 0.03 0.01"'
END = {0.002: 9.23, 0.005: 2.150, 0.010: 0.3572, 0.020: 0.0307}


def placed(piece, magnet, place, turn=(0.0, 0.0, 0.0), material="1000"):
    """A model and its data, with the magnet at a place and turned by a vector in rad."""
    model = mujoco.MjModel.from_xml_string(
        MODEL.format(piece=piece, magnet=magnet, material=material)
    )
    data = mujoco.MjData(model)
    data.qpos[7:10] = place
    mujoco.mju_axisAngle2Quat(
        data.qpos[10:14], np.array(turn) / (np.linalg.norm(turn) or 1.0), np.linalg.norm(turn)
    )
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    return model, data


@pytest.mark.parametrize(("material", "bound"), [("1000", 0.05), ("1000 0 0.0025", 0.01)])
@pytest.mark.parametrize("gap", END)
def test_a_bar_end_on(gap, material, bound):
    """Automatic nodes are within 0.5 %, finer ones within 0.4 %."""
    _, data = placed(BAR, ROD, [0, 0, 0.035 + gap], material=material)
    assert -data.xfrc_applied[2, 2] == pytest.approx(END[gap], rel=bound)


def test_a_disk_sticks_to_a_thick_block_as_to_a_plane():
    _, data = placed(BLOCK, DISK, [0.004, -0.003, 0.0115875])
    assert -data.xfrc_applied[2, 2] == pytest.approx(34.1, rel=0.03)  # 0.0026


@pytest.mark.parametrize(
    ("magnet", "height", "turn"),
    [
        ('type="box" size="0.01 0.005 0.0025" user="0 0 1.3"', 0.0025, 0.0),
        (DISK, 0.0015875, 0.0),
        ('type="capsule" size="0.004 0.008" user="0 0 1.3"', 0.004, math.pi / 2),
        ('type="mesh" mesh="cube" user="0 0 1.3"', 0.003, 0.0),
    ],
)
def test_a_magnet_that_lies_flat_on_the_middle_of_a_block_is_not_tilted(magnet, height, turn):
    """By symmetry; where one of its corners was the lowest, the torque was 4e-3 of the scale."""
    _, data = placed(BLOCK, magnet, [0, 0, 0.01 + height], [turn, 0, 0])
    force, torque = np.abs(data.xfrc_applied[2]).reshape(2, 3)
    assert force[2] > 1.0
    assert torque.max() < 1e-4 * 0.01 * force[2]  # 6e-6
    assert force[:2].max() < 1e-7 * force[2]  # 8e-9


ROUND, BALL = 'type="cylinder" size="0.008 0.02"', 'size="0.008"'
CAPSULE = 'type="capsule" size="0.008 0.01"'
BOX = 'type="box" size="0.004 0.005 0.006" user="0.3 0.5 1"'
FLAT = 'type="box" size="0.006 0.005 0.002" user="0 0 1"'
PILL = 'type="capsule" size="0.003 0.004" user="0 0 1"'
CUBE = 'type="mesh" mesh="cube" user="0 0 1"'
SCENES = {
    "contact": (BLOCK, DISK, [0.003, 0.001, 0.0116875], [0.0, 0.01, 0.0]),
    "above an edge": (BLOCK, DISK, [0.027, 0.001, 0.0128], [0.03, -0.02, 0.1]),
    "beyond an edge": (BLOCK, DISK, [0.034, 0.001, 0.0128], [0.03, -0.02, 0.1]),
    "a corner": (BLOCK, DISK, [0.031, 0.029, 0.0128], [0.03, -0.02, 0.1]),
    "end of a rod": (ROUND, DISK, [0.003, 0.002, 0.0225], [0.1, 0, 0]),
    "side of a rod": (ROUND, ROD, [0.0145, 0.002, 0.003], [0.1, 1, 0]),
    "capsule": (CAPSULE, ROD, [0.003, 0.002, 0.0245], [0.1, 0.2, 0]),
    "ball": (BALL, DISK, [0.003, 0.002, 0.0105], [0.1, 0.2, 0]),
    "box": (BLOCK, BOX, [0.01, 0.0, 0.0168], [0.03, 0.05, 1]),
    "a flat box": (BLOCK, FLAT, [0.01, 0.0, 0.0122], [0.01, -0.02, 1]),
    "a capsule that lies": (BLOCK, PILL, [0.01, 0.0, 0.0132], [1.55, 0.1, 0]),
    "mesh": (BLOCK, CUBE, [0.01, 0.0, 0.0132], [0.01, -0.02, 1]),
}


@pytest.mark.parametrize("material", ["1000", "1000 3e5"])
@pytest.mark.parametrize("name", SCENES)
def test_wrenches_are_derivatives_of_the_energy(name, material):
    """By differences of 1 um; the forces on the two bodies are opposite, and so are the torques."""
    model, data = placed(*SCENES[name], material=material)
    forces, torques, places = data.xfrc_applied[:, :3], data.xfrc_applied[:, 3:], data.xipos
    size = np.linalg.norm(forces[2])
    assert np.abs(forces.sum(axis=0)).max() < 1e-14 * size  # 0
    about = torques + np.cross(places, forces)
    assert np.abs(about.sum(axis=0)).max() < 1e-14 * size  # 1e-17
    found = np.zeros(model.nv)
    for body in (1, 2):
        mujoco.mj_applyFT(model, data, forces[body], torques[body], places[body], body, found)
    errors = abs(found - forces_by_energy(model, data, 3 * [1e-6] + 3 * [1e-4]))
    assert (errors.reshape(-1, 2, 3) / [[[1], [0.01]]]).max() < 3e-5 * size  # 3e-6
