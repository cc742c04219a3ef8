"""`check` of magnets and iron by their geom: pull at touch, overlaps, and how they are described.

Closed forms that share no code with the package judge the pull. Measured deviations stand beside
the bounds.
"""

import re

import mujoco
import numpy as np
import pytest

import magmotor as mm
from benchmarks.accuracy.pull_exact import pull_of_twin
from magmotor.mjcf.checking.frequencies import frequencies
from magmotor.numerics.iron.response import of_geoms

DISK = '<geom name="{}" type="cylinder" size=".00635 .0015875" density="7500" user="0 0 1.32"/>'
BLOCK = '<geom name="block" type="box" size=".02 .02 .01"/>'
TURNED = 'euler="20 30 40"'
AXES = np.array([[2, -1, 2], [2, 2, -1], [-1, 2, 2]]) / 3
"""Axes of a brick that is a mesh, as columns."""
SIZES = (0.008, 0.006, 0.005)
CORNERS = AXES @ np.array([[x, y, z] for x in (0, 0.008) for y in (0, 0.006) for z in (0, 0.005)]).T
HULL = f'<mesh name="hull" vertex="{" ".join(map(str, CORNERS.T.ravel()))}"/>'


MARK = '<text name="magmotor" data="dipoles magnets iron"/>'


def load(bodies, custom="", assets="", steel="1000", mark=MARK):
    """A model in which a geom named `block`, if there is one, is iron."""
    if 'name="block"' in bodies:
        custom += f"""
          <numeric name="steel" data="{steel}"/>
          <tuple name="iron"><element objtype="numeric" objname="steel"/>
          <element objtype="geom" objname="block"/></tuple>"""
    return mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <option gravity="0 0 0" timestep="1e-5"/>
      <custom>{mark}{custom}</custom>
      <asset>{assets}</asset>
      <worldbody>{bodies}</worldbody>
    </mujoco>""")


def free(geom, place="0 0 0", more=""):
    return f'<body pos="{place}" {more}><freejoint/>{geom}</body>'


def pull_of(model):
    """The pull that a finding quotes, in N."""
    (found,) = [each for each in mm.check(model).findings if "attract" in each]
    (pull,) = re.findall(r"with (?:at most|up to about) ([\d.]+) N", found)
    return float(pull)


LONG = '<geom type="cylinder" size=".003 .015" user="0 0 1.2"/>'
BRICK = '<geom type="box" size=".004 .003 .0025" user="0 0 1.3"/>'
MESH = '<geom type="mesh" mesh="hull" user="{} {} {}"/>'.format(*1.3 * AXES[:, 2])


@pytest.mark.parametrize(
    ("geom", "shape", "sizes", "polarization"),
    [
        (DISK.format("disk"), "cylinder", (0.0127, 0.003175), 1.32),  # 6e-4
        (LONG, "cylinder", (0.006, 0.03), 1.2),  # 2.5e-3
        (BRICK, "cuboid", SIZES, 1.3),  # 1.1e-3
        (MESH, "cuboid", SIZES, 1.3),  # 1.1e-3
    ],
)
def test_the_pull_at_touch_is_that_of_the_shapes(geom, shape, sizes, polarization):
    model = load(free(geom) + free(geom.replace("disk", "other"), "0 .1 0", TURNED), assets=HULL)
    expected = pull_of_twin(shape, sizes, polarization, 0.0)
    assert pull_of(model) == pytest.approx(expected, rel=7.5e-3)  # three digits are shown


@pytest.mark.parametrize("place", ["0 0 .1", "0 .02 .1"])
def test_the_pull_of_a_plane_is_that_of_the_image(place):
    plane = '<geom name="block" type="plane" size="1 1 1" euler="0 20 0"/>'
    model = load(plane + free(DISK.format("disk"), place, TURNED), steel="1e6")
    expected = pull_of_twin("cylinder", (0.0127, 0.003175), 1.32, 0.0)
    assert pull_of(model) == pytest.approx(expected, rel=7.5e-3)  # 6e-4


def test_two_magnets_of_one_body_pull_together():
    """A disk in two halves, one on the other, pulls like the whole one."""
    whole = DISK.format("whole")
    half = DISK.replace(".0015875", ".00079375")
    upper = half.format("upper").replace("<geom", '<geom pos="0 0 .00079375"')
    lower = half.format("lower").replace("<geom", '<geom pos="0 0 -.00079375"')
    found = [pull_of(load(free(each) + free(whole.replace("whole", "other"), "0 .1 0", TURNED)))
             for each in (whole, upper + lower)]  # fmt: skip
    assert found[1] == pytest.approx(found[0], rel=0.03)  # 2e-3


def test_units_of_the_model():
    """Lengths in mm, masses in g, times in ms, currents in mA: forces are in N."""
    constant = (
        'type="cylinder" size="6.35 1.5875" density="7.5e-3" user="0 0 1.32e-6" solref="20 1"'
    )
    geom = DISK.format("disk")
    other = f'<geom name="disk" {constant}/>'
    found = []
    for each, custom, away in (
        (geom, "", "0 .1 0"),
        (other, '<numeric name="magnetic_constant" data="1.25663706127e-12"/>', "0 100 0"),
    ):
        found.append(pull_of(load(free(each) + free(each.replace("disk", "b"), away), custom)))
    assert found[1] / found[0] == pytest.approx(1.0, rel=1e-3)


@pytest.mark.parametrize("gap", [1e-5, 1e-3])
def test_swings_of_disks_that_nearly_touch(gap):
    """The frequency is a bound of that of swings along the axis, and not many times as large."""
    pulls = []
    for away in (gap, gap + 1e-5):
        disks = free(DISK.format("a")) + free(DISK.format("b"), f"0 0 {0.003175 + away}")
        model = load(disks)
        data = mujoco.MjData(model)
        with mm.magnetism():
            mujoco.mj_forward(model, data)
        pulls.append(data.xfrc_applied[1, 2])
    true = np.sqrt(2 * (pulls[0] - pulls[1]) / 1e-5 / model.body_mass[1])
    ratio = frequencies(model, data)[1] / true
    assert 1 < ratio < 4  # 1.2 and 2.7


def overlaps_of(model):
    return [each for each in mm.check(model).findings if "overlap" in each]


def test_a_magnet_inside_a_piece_of_iron():
    (found,) = overlaps_of(load(BLOCK + free(DISK.format("disk"), "0 0 .004")))
    assert found == (
        "geom 'disk' and geom 'block' (a magnet and iron) overlap by 0.0076 m at the start, where"
        " forces mean nothing; at most 0.00032 m is allowed, 0.1 of the smaller width; move them"
        " apart"
    )


@pytest.mark.parametrize("fixed", ["one body", "the world"])
def test_an_overlap_that_no_motion_undoes(fixed):
    both = DISK.format("disk") + BLOCK
    other = free(DISK.format("other"), "0 0 1")
    (found,) = overlaps_of(load((free(both) if fixed == "one body" else both) + other))
    assert "'disk' and geom 'block'" in found
    assert "no motion separates them" in found


@pytest.mark.parametrize(("depth", "count"), [(0.09, 0), (0.11, 1)])
@pytest.mark.parametrize("collide", [0, 1])
def test_magnets_that_sink_into_each_other(depth, count, collide):
    geom = DISK.replace("<geom", f'<geom contype="{collide}" conaffinity="{collide}"')
    height = (1 - depth) * 0.003175
    model = load(free(geom.format("a")) + free(geom.format("b"), f".001 0 {height}"))
    found = overlaps_of(model)
    assert len(found) == count
    assert all("geom 'a' and geom 'b' (magnets) overlap by 0.00035 m" in each for each in found)


def test_an_overlap_in_a_keyframe():
    model = load(BLOCK + free(DISK.format("disk"), "0 0 .03"))
    key = '</worldbody><keyframe><key name="near" qpos="0 0 .01 1 0 0 0"/></keyframe><worldbody>'
    model = load(BLOCK + free(DISK.format("disk"), "0 0 .03") + key)
    (found,) = overlaps_of(model)
    assert "overlap by 0.0016 m in keyframe 'near'" in found


def test_magnets_of_one_body_may_overlap():
    """A ring is a cylinder, and in its hole one with the opposite polarization."""
    hole = '<geom type="cylinder" size=".003 .0015875" user="0 0 -1.32"/>'
    ring = free(DISK.format("disk") + hole)
    assert not overlaps_of(load(ring + free(DISK.format("other"), "0 0 .05")))


@pytest.mark.parametrize(("height", "count"), [(0.0, 1), (0.0085, 0)])
def test_a_dipole_in_iron(height, count):
    """As of a coil that is meant to have a core; one just below the surface may have sunk in."""
    coil = f'<site name="coil" pos="0 0 {height}" user="1"/>'
    other = free('<geom size=".002"/><site user="1"/>', "0 0 .1")
    found = [each for each in mm.check(load(BLOCK + coil + other)).findings if "shields" in each]
    assert len(found) == count
    for each in found:
        assert each == (
            "site 'coil' is in the iron of geom 'block' at the start: iron shields a dipole in it;"
            " for a coil with a core, let the coil list a geom, and give that the user numbers 0 0"
            " mu0 N I/L, in T"
        )


def notes_of(model):
    return [each for each in mm.check(model).notes if each.startswith("geom")]


def test_how_magnets_and_iron_are_described():
    disks = (free(DISK.format(k), f"0 0 {0.0116 + 0.0033 * k}") for k in range(3))
    ball = free('<geom name="ball" size=".004" user="0 0 1"/>', "0 0 .3")
    assert notes_of(load(BLOCK + "".join(disks) + ball)) == [
        (
            "geom '0' (and 2 more like it) is a magnet, a cylinder: 4 to 64 charges on a face where"
            " it is near, else a dipole; in contact, forces are right to 2.5 %, for about 3 us per"
            " pair and step"
        ),
        "geom 'ball' is a magnet, a sphere: a dipole, which is exact for other spheres",
        (
            "geom 'block' is iron: 144 nodes about 0.0082 m apart, for about 4 us per step; in"
            " contact with magnets, forces are right to 1 % on a face, but to 10 % near its edges,"
            " for about 20 us each"
        ),
    ]


def test_iron_that_saturates_is_less_right_as_a_sheet():
    sheet = BLOCK.replace(".01", ".0005")
    model = load(sheet + free(DISK.format(0), "0 0 .004"), steel="1000 1.7e6")
    assert "right to 1 % on a face, to 20 % on a sheet that they saturate" in notes_of(model)[-1]


def test_what_cannot_touch_is_described_briefly():
    slide = '<body pos="0 0 {}"><joint type="slide" axis="1 0 0"/>{}</body>'
    iron = slide.format(0, '<geom name="block" size=".01"/>')
    magnet = slide.format(0.1, MESH.replace("<geom", '<geom name="brick"'))
    nodes = response_of_ball(0.01)
    assert notes_of(load(iron + magnet, assets=HULL)) == [
        (
            "geom 'brick' is a magnet, a mesh: 12 faces with up to 1000 charges where it is near,"
            " else a dipole"
        ),
        (
            f"geom 'block' is iron: {nodes} nodes about 0.0036 m apart, for about 3 us per step;"
            " forces on magnets are right to 0.5 % from that distance on"
        ),
    ]


def test_iron_close_to_iron_is_described():
    ball = free('<geom name="{}" size=".01"/>')
    tuples = """<numeric name="field" data="0 0 .1"/><text name="magmotor" data="fields iron"/>
      <tuple name="iron_b"><element objtype="numeric" objname="steel"/>
      <element objtype="geom" objname="b"/></tuple>"""
    text = ball.format("block") + ball.format("b").replace("0 0 0", "0 0 .05")
    (note,) = notes_of(load(text, tuples, mark=""))
    assert "(and 1 more like it) is iron: 118 nodes" in note
    assert note.endswith("; close to other iron, forces are rough, for about 200 us each")


def response_of_ball(radius):
    """The number of nodes of a ball of iron."""
    sizes, places = np.array([[radius, 0, 0]]), np.zeros((1, 3))
    return len(of_geoms(np.array([2.0]), sizes, places, 1000.0, 0.0).points)


@pytest.mark.parametrize(
    ("bodies", "sentence"),
    [
        (DISK.format("strong").replace("1.32", "2.6"), "geom 0 'strong': .* 2.6 .* at most 2.5 T"),
        ('<geom name="dent" type="mesh" mesh="dent" user="0 0 1"/>', "geom 0 'dent' .* be convex"),
        ('<geom name="flat" type="mesh" mesh="flat" user="0 0 1"/>', "geom 0 'flat' .* be closed"),
        (BLOCK, "numeric 0 'steel' = -1.5: .* susceptibility, at least -1"),
    ],
)
def test_what_makes_no_sense_is_an_error(bodies, sentence):
    tip = "0 0 0 1 0 0 0 1 0 0 0 1"
    assets = f'''
      <mesh name="dent" vertex="{tip} .2 .2 .2" face="0 2 1 0 1 3 0 3 2 1 2 4 2 3 4 3 1 4"/>
      <mesh name="flat" vertex="{tip}" face="0 2 1 0 1 3 0 3 2" inertia="shell"/>'''
    with pytest.raises(ValueError, match=sentence):
        mm.check(load(bodies, assets=assets, steel="-1.5"))


def test_a_magnet_without_volume_is_an_error():
    model = load(DISK.format("thin"))
    model.geom("thin").size[1] = 0
    with pytest.raises(ValueError, match="geom 0 'thin': the size of iron and of magnets must be"):
        mm.check(model)
