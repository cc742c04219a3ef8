"""`check` of magnets by their geom that something keeps off iron, or off each other.

Closed forms and magpylib, which share no code with the package, judge the pull. Measured deviations
stand beside the bounds; three digits of a pull are shown.
"""

import re
from pathlib import Path
from typing import Any

import magpylib
import mujoco
import numpy as np
import pytest
from test_check_shapes import DISK, free, load

import magmotor as mm
from benchmarks.accuracy.pull_exact import pull_of_twin, pull_on_steel
from magmotor.mjcf.checking.closest_approach import meetings
from magmotor.mjcf.checking.true_approach import TrueApproach
from magmotor.mjcf.checking.true_pull import force_in_pose as forces

SIZES, REMANENCE, STEEL = (0.0127, 0.003175), 1.32, 1000.0
MAGNET = DISK.format("disk")
SLAB = '<geom name="block" type="box" size=".05 .05 .02" pos="0 0 -.02"/>'
OFF = 'contype="0" conaffinity="0"'


def on_steel(gap):
    """The pull of a disk on a half-space of steel, in N."""
    return pull_on_steel("cylinder", SIZES, REMANENCE, gap, STEEL)


def finding(model):
    """The pull that the only finding quotes, in N, and its text."""
    (found,) = [each for each in mm.check(model).findings if "attract" in each]
    (pull,) = re.findall(r"with (?:at most|up to about) ([\d.]+) N", found)
    return float(pull), found


def pull_in_a_run(model, data):
    """The force that pulls all bodies down, in N."""
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    return -data.xfrc_applied[:, 2].sum()


# Geoms in the way ---------------------------------------------------------------------------------

HAND = """
<body pos="0 0 .1"><freejoint/>
  <geom name="housing" type="cylinder" size=".012 .01" pos="0 0 .01"/>
  <body pos="0 0 .003"><joint name="retract" type="slide" axis="0 0 1" armature=".1" {}/>
    <geom name="disk" type="cylinder" size=".00635 .0015875" pos="0 0 .0015875" user="0 0 1.32"/>
  </body>
</body>"""
STOPS = 'range="-.001 .01" solreflimit="{} 1"'


@pytest.mark.parametrize("iron", [SLAB, '<geom name="block" type="plane" size="1 1 1"/>'])
def test_a_housing_on_another_body_covers_a_magnet(iron):
    """It is 3 mm thick, and the slide can bring the magnet 1 mm nearer, but not further."""
    pull, text = finding(load(iron + HAND.format(STOPS.format("2e-5"))))
    assert pull == pytest.approx(on_steel(0.002), rel=2e-3)  # 2e-4
    assert "limit" not in text


@pytest.mark.parametrize("joint", [STOPS.format(".02"), ""])
def test_a_magnet_can_come_out_of_its_housing(joint):
    """Its slide has no limit, or one that is so soft that the magnet is pulled through it."""
    pull, text = finding(load(SLAB + HAND.format(joint)))
    assert pull == pytest.approx(on_steel(0.0), rel=2e-3)  # 3e-4
    assert ("(the limit of joint 'retract' is too soft" in text) == bool(joint)


def test_the_gripper_of_the_examples_holds_a_plate_through_its_wall():
    """Its magnet can come 0.1 mm nearer than the wall of 1 mm; the plate is thick for it."""
    path = Path(__file__).parents[2] / "examples" / "magnetic_gripper.xml"
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    (found,) = meetings(model, data)
    assert found.approach is not None
    expected = pull_on_steel("cylinder", (0.008, 0.005), 1.3, 0.9e-3, 1000.0)
    assert found.approach.pull == pytest.approx(expected, rel=5e-3)  # 1.6e-3
    assert not mm.check(model).findings


def test_what_pulls_is_computed_once(monkeypatch):
    """Whatever settings are tried, for each of four wheels, whose forces are alike."""
    path = Path(__file__).parents[2] / "examples" / "climbing_robot.xml"
    calls, pull = [], TrueApproach.pull

    def counted(self, *args):
        calls.append(args)
        return pull(self, *args)

    monkeypatch.setattr(TrueApproach, "pull", counted)
    forces.cache_clear()
    assert mm.check(mujoco.MjModel.from_xml_path(str(path))).solref
    assert len(calls) == 4
    found = forces.cache_info()
    assert found.hits > found.misses


def test_only_what_touches_must_be_stiff():
    model = load(SLAB + HAND.format(STOPS.format("2e-5")))
    assert {*mm.check(model).solref} == {"geom 'block'", "geom 'housing'"}


def wall(place, euler):
    return f'<geom type="box" size=".5 .5 .01" pos="{place}" euler="{euler}"/>'


def test_walls_of_a_room_keep_no_magnet_off_iron_in_it():
    """They and the iron belong to one rigid body, the world."""
    sides = [wall(f"{sign}.5 0 0", "0 90 0") for sign in ("", "-")]
    sides += [wall(f"0 {sign}.5 0", "90 0 0") for sign in ("", "-")]
    room = "".join(sides) + wall("0 0 -.05", "0 0 0") + wall("0 0 .5", "0 0 0")
    pull, _ = finding(load(SLAB + room + free(MAGNET, "0 0 .1")))
    assert pull == pytest.approx(on_steel(0.0), rel=2e-3)  # 3e-4


def test_spacers_in_the_middle_of_iron_do_not_cover_all_of_it():
    """There is one on each face of the slab."""
    places = ("0 0 .005", "0 0 -.045", ".055 0 -.02", "-.055 0 -.02", "0 .055 -.02", "0 -.055 -.02")
    spacers = "".join(f'<geom type="box" size=".005 .005 .005" pos="{p}"/>' for p in places)
    pull, _ = finding(load(SLAB + spacers + free(MAGNET, "0 0 .1")))
    assert pull == pytest.approx(on_steel(0.0), rel=6e-3)  # 3e-4


CUP = '<geom type="box" size=".012 .012 .001" pos="0 0 .006"/>' + "".join(
    f'<geom type="box" size=".003 .012 .005" euler="0 0 {angle}" pos="{x} {y} .002"/>'
    for angle, x, y in ((0, 0.0105, 0), (0, -0.0105, 0), (90, 0, 0.0105), (90, 0, -0.0105))
)
"""Its rim is 3 mm beyond the center of a disk in it."""


def test_a_cup_keeps_a_magnet_off_a_slab_but_not_off_a_rod():
    pull, _ = finding(load(SLAB + free(MAGNET + CUP, "0 0 .1")))
    assert pull == pytest.approx(on_steel(0.003 - SIZES[1] / 2), rel=2e-3)  # 5e-5
    rod = '<geom name="block" type="box" size=".004 .004 .02"/>'
    pull, _ = finding(load(rod + free(MAGNET + CUP, "0 0 .1")))
    model = load(rod + free(MAGNET, f"0 0 {0.02 + SIZES[1] / 2}"))
    assert pull == pytest.approx(pull_in_a_run(model, mujoco.MjData(model)), rel=6e-3)  # 1.5e-3


DIPOLE = '<geom type="cylinder" size=".00635 .0015875" density="7500"/><site user=".42"/>'


def test_a_cup_keeps_a_dipole_site_off_a_slab():
    """As on a half-space of iron of susceptibility 1000, by the image of the dipole."""
    pull, _ = finding(load(SLAB + free(DIPOLE + CUP, "0 0 .1")))
    exact = 3e-7 * 0.42**2 / (8 * 0.003**4) * STEEL / (STEEL + 2)
    assert pull == pytest.approx(exact, rel=1e-3)  # 5e-5


# Poses that joints allow --------------------------------------------------------------------------

INERTIA = '<inertial pos="0 0 0" mass=".1" diaginertia="1e-4 1e-4 1e-4"/>'
WHEEL = f"""<body euler="90 0 0"><joint axis="0 0 1"/>
  <geom name="disk" type="cylinder" size=".00635 .0015875" user="0 0 1.32" {OFF}/>
  <geom type="cylinder" size=".01 .001"/></body>"""
SLIDES = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>'
YAW = '<joint axis="0 0 1"/>'


def on_rim(gap):
    """The pull of a disk that stands on its rim, at a gap from a half-space of steel, in N."""
    width, height = SIZES
    disk = magpylib.magnet.Cylinder(polarization=(0, 0, REMANENCE), dimension=(width, height))
    image = magpylib.magnet.Cylinder(
        polarization=(0, 0, -REMANENCE), dimension=(width, height), position=(width + 2 * gap, 0, 0)
    )
    force: Any = magpylib.getFT(image, disk, meshing=2000)
    return force[0][0] * STEEL / (STEEL + 2)


def cart(joints):
    return f'<body pos="0 0 .06">{joints}{INERTIA}{WHEEL}</body>'


PLATE = '<geom name="block" type="plane" size="1 1 1"/>'


@pytest.mark.parametrize(
    ("iron", "joints"), [(SLAB, SLIDES), (PLATE, SLIDES), (PLATE, SLIDES + YAW)]
)
def test_the_wheel_of_a_cart_stays_on_its_rim(iron, joints):
    pull, _ = finding(load(iron + cart(joints)))
    assert pull == pytest.approx(on_rim(0.01 - SIZES[0] / 2), rel=6e-3)  # 1.4e-3


def test_a_cart_that_turns_touches_the_side_of_iron_with_its_wheel():
    pull, _ = finding(load(SLAB + cart(SLIDES + YAW)))
    assert pull == pytest.approx(on_steel(0.0), rel=1e-2)  # 3.2e-3


def test_the_wheel_of_a_cart_stays_on_its_rim_with_a_dipole_site_in_it():
    """The moment lies along the iron, which pulls it half as strongly as one across."""
    wheel = re.sub('<geom name="disk".*', '<site user=".42"/>', cart(SLIDES))
    exact = 1.5e-7 * 0.42**2 / (8 * 0.01**4) * STEEL / (STEEL + 2)
    for iron in (SLAB, PLATE):
        pull, _ = finding(load(iron + wheel))
        assert pull == pytest.approx(exact, rel=5e-3)  # 3e-4


def test_a_free_wheel_lies_flat():
    pull, _ = finding(load(SLAB + f'<body pos="0 0 .06"><freejoint/>{INERTIA}{WHEEL}</body>'))
    assert pull == pytest.approx(on_steel(0.0), rel=2e-3)  # 3e-4


def test_an_axle_that_sticks_out_keeps_a_free_wheel_from_lying_flat():
    """In 500 random poses on the slab, no pull is more than what is said."""
    axle = '<geom name="axle" type="box" size=".002 .02 .002"/>'
    model = load(SLAB + f'<body pos="0 0 .06"><freejoint/>{INERTIA}{axle}{WHEEL}</body>')
    said, _ = finding(model)
    data, generator, pulls = mujoco.MjData(model), np.random.default_rng(1), []
    for quaternion in generator.normal(size=(500, 4)):
        data.qpos[:7] = 0, 0, 0.06, *quaternion
        mujoco.mj_kinematics(model, data)
        data.qpos[2] -= min(
            mujoco.mj_geomDistance(model, data, 0, geom, 1.0, None) for geom in (1, 3)
        )
        pulls.append(pull_in_a_run(model, data))
    assert max(pulls) < said < 1.1 * max(pulls)  # 1.006


# Joints that keep magnets apart -------------------------------------------------------------------


def on_slide(constant):
    """Two disks whose centers a limit keeps 10 mm from each other."""
    disk = MAGNET.replace("/>", f" {OFF}/>")
    limit = f'type="slide" axis="0 0 1" range="-.01 .1" solreflimit="{constant} 1"'
    return load(f'{disk.replace("disk", "other")}<body pos="0 0 .02"><joint {limit}/>{disk}</body>')


def test_magnets_that_limits_keep_apart_pull_with_their_shapes():
    model = on_slide(1e-4)
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    (found,) = meetings(model, data)
    assert found.linked is not None
    expected = pull_of_twin("cylinder", SIZES, REMANENCE, 0.01 - SIZES[1])
    assert found.linked.force == pytest.approx(expected, rel=6e-3)  # 3.3e-4


def test_a_magnet_that_limits_keep_above_a_plane_pulls_with_its_shape():
    disk = MAGNET.replace("/>", f" {OFF}/>")
    limit = 'type="slide" axis="0 0 1" range="-.01 .1" solreflimit="1e-4 1"'
    model = load(PLATE + f'<body pos="0 0 .014"><joint {limit}/>{disk}</body>')
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    (found,) = meetings(model, data)
    assert found.linked is not None
    assert found.linked.force == pytest.approx(on_steel(0.004 - SIZES[1] / 2), rel=6e-3)  # 3.3e-4


@pytest.mark.parametrize(("constant", "count"), [(1.2e-3, 0), (1.4e-3, 1)])
def test_a_limit_must_hold_the_shapes(constant, count):
    """As dipoles, they would attract each other three times as strongly."""
    assert len(mm.check(on_slide(constant)).findings) == count
