"""Models in other units than those of SI: a numeric says what mu0 is in them."""

import re
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
import pytest
from test_magnetic_tolerance import HEAD as CLUSTERED
from test_many_magnets import gas, wrenches

import magmotor as mm
from magmotor.mjcf.arrows import dipole_sites

ROOT = Path(__file__).parents[2]
PLUGIN = '<plugin plugin="magmotor.forces"><instance name="m"/></plugin>'


class Units(NamedTuple):
    """Units of length, mass, time and current, in those of SI; others follow."""

    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0
    current: float = 1.0

    @property
    def force(self):
        return self.mass * self.length / self.time**2

    @property
    def energy(self):
        return self.force * self.length

    @property
    def moment(self):
        return self.current * self.length**2

    @property
    def flux(self):
        return self.energy / self.moment

    @property
    def constant(self):
        return 4e-7 * np.pi * self.current**2 / self.force


SI = Units()
MICRO = Units(1e-6, 1e-15, 1e-3, 1e-6)
MILLI = Units(1e-3, 1e-3, 1.0, 1.0)
ODD = Units(0.3, 7.0, 0.02, 0.3)
OTHERS = {"micro": MICRO, "milli": MILLI, "odd": ODD}


def scene(u, extension=PLUGIN, forces="dipoles couplings fields coils iron"):
    """Everything magnetic around a millimeter, in some units."""
    m, q, b = 1e-3 / u.length, 1e-3 / u.moment, 1e-3 / u.flux
    kg_m2 = u.mass * u.length**2
    table = mm.tabulated_field(
        lambda at: b * (np.sin(at / m) @ np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0.0]])),
        [-20 * m] * 3, [20 * m] * 3, (5, 5, 4), name="field_table",
    )  # fmt: skip
    return mujoco.MjModel.from_xml_string(f"""
<mujoco>
  <extension>{extension}<plugin plugin="magmotor.magnetometer"/></extension>
  <option gravity="0 0 0" timestep="{1e-5 / u.time!r}"><flag contact="disable"/></option>
  <custom>
    <text name="magmotor" data="{forces}"/>
    <numeric name="magnetic_constant" data="{u.constant!r}"/>
    <numeric name="field_uniform" data="{3 * b} {b} {-2 * b}"/>
    <numeric name="field_bent" data="0 {b} 0 {b / m} 0 {b / m} 0 {-b / m}"/>
    {table}
    <numeric name="soft" data="100 {2e5 * u.length / u.current!r}"/>
    <numeric name="hard" data="1000"/>
    <tuple name="field_driven"><element objtype="numeric" objname="field_bent"/>
      <element objtype="actuator" objname="current"/>
      <element objtype="site" objname="carrier"/></tuple>
    <tuple name="iron"><element objtype="numeric" objname="soft"/>
      <element objtype="geom" objname="ball"/><element objtype="geom" objname="rod"/></tuple>
    <tuple name="iron_plane"><element objtype="numeric" objname="hard"/>
      <element objtype="geom" objname="plane"/></tuple>
    <tuple name="coil"><element objtype="actuator" objname="current"/>
      <element objtype="site" objname="coil"/></tuple>
    <tuple name="coupling"><element objtype="body" objname="one" prm="0.5"/>
      <element objtype="body" objname="needle" prm="0.5"/></tuple>
  </custom>
  <default><geom density="{7500 * u.length**3 / u.mass!r}"/></default>
  <worldbody>
    <geom name="plane" type="plane" size="1 1 1" pos="0 0 {-8 * m}"/>
    <site name="coil" pos="{2 * m} {5 * m} 0" user="{2 * q}" zaxis="1 0 1"/>
    <site name="place" pos="{-2 * m} {3 * m} {m}" euler="10 20 30"/>
    <body name="one" pos="0 0 0"><freejoint/><geom size="{m}"/>
      <site name="a" user="{q}" zaxis="1 2 3"/>
      <site name="b" user="{-q / 2}" pos="{m / 2} 0 0" zaxis="0 1 0"/></body>
    <body name="two" pos="{4 * m} 0 {m}"><freejoint/><geom size="{m}"/>
      <site name="c" user="{2 * q}" zaxis="-1 0 2"/></body>
    <body name="needle" pos="0 {-4 * m} 0">
      <joint type="hinge" axis="0 0 1" damping="{1e-10 / (kg_m2 / u.time)!r}"/>
      <geom type="capsule" size="{m / 2}" fromto="{-m} 0 0 {m} 0 0"/>
      <site name="d" user="{q / 2}" zaxis="1 0 0"/><site name="carrier" pos="0 0 {m}"/></body>
    <body name="soft" pos="{-4 * m} 0 0"><freejoint/><geom name="ball" size="{m}"/></body>
    <body name="long" pos="0 {m} {5 * m}"><freejoint/>
      <geom name="rod" type="capsule" size="{m / 2} {m}"/></body>
  </worldbody>
  <actuator><general name="current" site="coil" gainprm="0"/></actuator>
  <sensor>
    <plugin name="fixed" plugin="magmotor.magnetometer" objtype="site" objname="place"/>
  </sensor>
</mujoco>""")


WORDS = {
    "dipoles": "dipoles",
    "couplings": "dipoles couplings",
    "fields": "dipoles fields",
    "coils": "dipoles coils",
    "iron": "dipoles iron",
    "all": "dipoles couplings fields coils iron",
}


def state(u, words, extension=PLUGIN):
    """What a scene has become after 2 ms, in units of SI, by quantities."""
    model = scene(u, extension, words)
    data = mujoco.MjData(model)
    data.ctrl[0] = 0.7
    with mm.magnetism():
        mujoco.mj_step(model, data, nstep=200)
        mujoco.mj_forward(model, data)
    free = data.qpos[: 7 * 2].reshape(2, 7)
    points = np.array([[1, 2, 3], [3, -2, 1.0]]) * 1e-3 / u.length
    return {
        "positions": u.length * free[:, :3],
        "turns": np.concatenate([free[:, 3:].ravel(), data.qpos[14:15]]),
        "forces": u.force * (data.qfrc_passive[:3] + data.xfrc_applied[1, :3]),
        "energy": u.energy * np.array(mm.magnetic_energy(model, data)),
        "field": u.flux * mm.field(model, data, points),
        "measured": u.flux * data.sensordata,
        "moments": u.moment * dipole_sites(model, data)[1],
    }


@pytest.fixture(scope="module")
def in_si():
    return {words: state(SI, words) for words in WORDS.values()}


def error(found, expected):
    """The largest difference, over the largest number."""
    assert np.abs(expected).max() > 0
    return np.abs(found - expected).max() / np.abs(expected).max()


@pytest.mark.parametrize("words", WORDS.values(), ids=WORDS)
@pytest.mark.parametrize("u", OTHERS.values(), ids=OTHERS)
def test_a_system_moves_alike_in_all_units(u, words, in_si):
    found = state(u, words)
    for name, expected in in_si[words].items():
        assert error(found[name], expected) < 1e-12, name  # 1.2e-13


def test_the_block_has_the_constant_of_the_plugin(in_si):
    words = WORDS["all"]
    found = state(MICRO, words, extension="")
    for name, expected in in_si[words].items():
        assert error(found[name], expected) < 1e-12, name  # 1.2e-13


BEADS = """
<mujoco>
  <option gravity="0 0 0" timestep="0.01"/>
  <custom>
    <text name="magmotor" data="dipoles"/>
    <numeric name="magnetic_constant" {size}data="1.2566370614359173e-3"/>
  </custom>
  <worldbody>
    <site zaxis="1 0 0" user="1e4"/>
    <body name="bead" pos="5 0 0">
      <freejoint/><geom size="1.4" density="1.6"/><site zaxis="1 0 0" user="1e4"/>
    </body>
  </worldbody>
</mujoco>
"""
"""Two beads of 1e-14 A m^2, 5 um apart, in um, ms and pg: forces are in fN and fields in mT."""


def beads(size=""):
    model = mujoco.MjModel.from_xml_string(BEADS.format(size=size))
    return model, mujoco.MjData(model)


def pull(model, data):
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    return data.xfrc_applied[1, 0]


def test_beads_have_the_force_energy_and_field_of_closed_forms():
    """3 mu0 m^2/(2 pi d^4), -mu0 m^2/(2 pi d^3), and mu0 m/(2 pi r^3), with mu0 in these units."""
    model, data = beads()
    mu0 = 4e-4 * np.pi
    force = -3 * mu0 * 1e8 / (2 * np.pi * 5**4)
    assert force == pytest.approx(-96, rel=1e-12)
    assert pull(model, data) == pytest.approx(force, rel=1e-14, abs=0)  # 5e-16
    energy = -mu0 * 1e8 / (2 * np.pi * 5**3)
    assert mm.magnetic_energy(model, data) == pytest.approx(energy, rel=1e-14, abs=0)  # 5e-16
    both = mu0 * 1e4 / (2 * np.pi) * (2**-3 + 7**-3)
    assert mm.field(model, data, [-2, 0, 0])[0] == pytest.approx(both, rel=1e-14, abs=0)  # 5e-16


def test_the_constant_may_change_while_the_model_runs():
    model, data = beads()
    numeric = model.numeric("magnetic_constant").data
    before, numeric[0] = pull(model, data), 3 * numeric[0]
    assert pull(model, data) == pytest.approx(3 * before, rel=5e-15, abs=0)  # 2e-16


def test_tiles_and_clusters_have_the_constant():
    """In another unit of current, all moments are 1000 times as large, and mu0 is 1e-6 of its."""
    units = f'<numeric name="magnetic_constant" data="{4e-13 * np.pi!r}"/></custom>'
    model = gas(1600, head=CLUSTERED)
    other = gas(1600, head=CLUSTERED.replace("</custom>", units))
    other.site_user[:] = 1000 * model.site_user
    both = []
    for tolerance in (0, 1e-2):
        for each in (model, other):
            each.numeric("magnetic_tolerance").data[:] = tolerance
            both.append(wrenches(each, mujoco.MjData(each)))
    for expected, found in (both[:2], both[2:]):
        for part in (slice(0, 3), slice(3, 6)):
            assert error(found[:, part], expected[:, part]) < 3e-15  # 2e-16
    assert error(both[0], both[2]) > 1e-6  # 1e-4: the clusters act


MAGNETS = """
<mujoco>
  <option gravity="0 0 0" timestep="{step}"/>
  <default><geom density="{density}" solref="{solref} 1" solimp="0.9 0.95 {width}"/></default>
  <custom>
    <text name="magmotor" data="dipoles iron fields"/>
    {constant}
    <numeric name="field" data="{field} 0 0"/>
    <numeric name="soft" data="1000 {saturation}"/>
    <tuple name="iron"><element objtype="numeric" objname="soft"/>
      <element objtype="geom" objname="ball"/></tuple>
  </custom>
  <worldbody>
    <body name="one"><freejoint/><geom size="{radius}"/><site user="{moment}"/></body>
    <body name="other" pos="0 0 {apart}"><freejoint/><geom size="{radius}"/>
      <site user="{moment}"/></body>
    <body name="disk" pos="0 {apart} 0"><freejoint/>
      <geom type="cylinder" size="{radius} {half}"/><site user="{moment}"/></body>
    <body name="soft" pos="{apart} 0 0"><freejoint/><geom name="ball" size="{radius}"/></body>
    <body name="needle" pos="0 {minus} 0"><joint axis="1 0 0" type="hinge"/>
      <geom type="capsule" size="{half} {radius}" mass="{mass}"/><site user="{moment}"/></body>
  </worldbody>
  <keyframe>
    <key name="spin" qvel="0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 {spin} 0 0 0 0 0 0 0"/>
  </keyframe>
</mujoco>
"""


def checked(u, capsys, field=2.0, constant=True, step=2e-3):
    declared = f'<numeric name="magnetic_constant" data="{u.constant!r}"/>' if constant else ""
    found = mm.check(mujoco.MjModel.from_xml_string(MAGNETS.format(
        step=step / u.time, density=7500 * u.length**3 / u.mass, solref=0.02 / u.time,
        width=1e-3 / u.length, constant=declared, field=field / u.flux,
        saturation=1.7e6 * u.length / u.current, radius=5e-3 / u.length, apart=0.05 / u.length,
        minus=-0.05 / u.length, half=2e-3 / u.length, moment=0.3 / u.moment, mass=1e-6 / u.mass,
        spin=100 * u.time,
    )))  # fmt: skip
    print(found)
    assert capsys.readouterr().out == f"{found}\n"
    return found


def without_numbers(findings):
    return [re.sub(r"[0-9.]+(e[+-]?[0-9]+)?", "#", finding) for finding in findings]


def test_a_single_dipole_is_judged_only_where_a_tesla_is_known(capsys):
    words = "attract each other too strongly"
    found = [checked(SI, capsys, constant=constant).findings for constant in (False, True)]
    assert [any(words in finding for finding in each) for each in found] == [True, False]


@pytest.mark.parametrize("u", [MICRO, MILLI, Units(1e-2, 1e-1, 1e4, 1e-3)], ids=str)
def test_check_finds_the_same_in_all_units(u, capsys):
    """Units of time are powers of ten, so that rounded settings differ by the unit only."""
    expected, found = checked(SI, capsys), checked(u, capsys)
    assert len(expected.findings) >= 5
    assert any("spins at 100 rad/s" in finding for finding in expected.findings)
    assert without_numbers(found.findings) == without_numbers(expected.findings)
    assert found.timestep * u.time == pytest.approx(expected.timestep, rel=3e-15)  # 1e-16
    for name, (constant, _) in expected.solref.items():
        assert found.solref[name][0] * u.time == pytest.approx(constant, rel=3e-15)  # 1e-16
    assert found.solref.keys() == expected.solref.keys()
    assert "stand for" in found.units[0]
    assert found.units[0] in str(found).splitlines()


def test_what_is_said_of_other_units_is_not_said_of_those_of_si(capsys):
    model, _ = beads()
    undeclared = BEADS.format(size="").replace("magnetic_constant", "other")
    found = mm.describe(model)
    print(found)
    assert found.huge == {}
    (sentence,) = found.units
    assert "mu0 = 0.00125664" in sentence
    assert sentence in capsys.readouterr().out
    model.numeric("magnetic_constant").data[:] = 1.2566e-6  # that of um, ng, ms and uA, too
    assert mm.describe(model).huge == {}
    assert "mu0 = 1.2566e-06" in mm.describe(model).units[0]
    assert not any("neodymium" in finding for finding in mm.check(model).findings)
    model = mujoco.MjModel.from_xml_string(undeclared)
    capsys.readouterr()
    found = mm.describe(model)
    print(found)
    assert found.units == ()
    assert len(found.huge) == str(found).count("magnetic_constant") == 2
    model.site_user[:] = 1e5
    (sentence,) = mm.describe(model).units
    assert re.search(
        "body 'bead' has the moment of 7.1e.02 kg.*of 18 kg.*magnetic_constant", sentence
    )
    nameless = mujoco.MjModel.from_xml_string(undeclared.replace('name="bead"', ""))
    nameless.site_user[:] = 1e5
    (sentence,) = mm.describe(nameless).units
    assert sentence.startswith("body 1 has the moment")


@pytest.mark.parametrize(("density", "words"), [
    (7.5e-3, "lighter than air"), (7.5e6, "osmium"),
    (2.7e6, "osmium"),  # aluminum in m and g
])  # fmt: skip
def test_densities_of_no_matter_are_doubted(density, words):
    """Magnets in mm and g, and in m and g; one with the density of neodymium is not doubted."""
    text = BEADS.replace("magnetic_constant", "other").replace("1e4", "1").format(size="")
    for given, doubted in ((density, True), (7500, False)):
        text = re.sub(r'density="[^"]*"', f'density="{given}"', text)
        units = mm.describe(mujoco.MjModel.from_xml_string(text)).units
        assert [words in sentence for sentence in units] == [True] * doubted
    mixed = text.replace("<worldbody>", "<worldbody><body><freejoint/><geom size='1'/></body>")
    mixed = re.sub(r'density="[^"]*"', f'density="{density}"', mixed)
    units = mm.describe(mujoco.MjModel.from_xml_string(mixed)).units
    assert not any(words in sentence for sentence in units)


IN_MILLIMETERS = """
<mujoco>
  <worldbody>
    <body name="magnet"><freejoint/><geom size="5" density="7500"/><site user="0.5"/></body>
    <body name="robot" pos="99 0 0"><freejoint/><geom size="0.1" mass="{mass}"/>
      <site user="{moment}"/></body>
  </worldbody>
</mujoco>"""


@pytest.mark.parametrize(
    ("mass", "moment", "doubted"), [(30, 1e-5, True), (30, 1e-4, False), (1e7, 0.5, True)]
)
def test_moments_that_are_far_too_weak_are_doubted(mass, moment, doubted):
    """Sizes in mm make masses 1e9 times too large; all magnets must be as weak as that."""
    model = mujoco.MjModel.from_xml_string(IN_MILLIMETERS.format(mass=mass, moment=moment))
    said = "the moment of .* kg of neodymium magnets, and a mass of .* and lengths in m[?]"
    assert [bool(re.search(said, each)) for each in mm.describe(model).units] == [True] * doubted


SHIPPED = sorted([*ROOT.glob("models/*.xml"), *ROOT.glob("examples/*.xml")])


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_the_units_of_shipped_models_are_not_doubted(path):
    if path.stem == "pick_and_place":
        pytest.skip("its program adds a part")
    model = mujoco.MjModel.from_xml_path(str(path))
    assert len(mm.describe(model).units) == (path.stem == "micro_swimmer")


def test_temperatures_in_other_units_are_not_taken_for_kelvin(recwarn):
    text = BEADS.replace("<freejoint/>", '<joint type="slide" damping="1"/>').format(size="")
    mm.Langevin(mujoco.MjModel.from_xml_string(text), kT=300.0)
    assert not recwarn
    model = mujoco.MjModel.from_xml_string(text.replace("magnetic_constant", "other"))
    with pytest.warns(UserWarning, match="300 K"):
        mm.Langevin(model, kT=300.0)


def test_advice_says_what_its_units_are():
    text = BEADS.replace("<freejoint/>", '<joint type="slide" axis="0 1 0" stiffness="1e4"/>')
    model = mujoco.MjModel.from_xml_string(text.format(size=""))
    state = mujoco.MjData(model)
    state.qpos[0] = 1.0
    with mm.magnetism():
        advice = mm.advise(model, state, duration=0.48, budget=1.0)
    assert "mu0 = 0.00125664" in advice.notes[0]
    assert advice.notes[0] in str(advice)


@pytest.mark.parametrize("u", OTHERS.values(), ids=OTHERS)
def test_magnets_by_grade_attract_alike_in_all_units(u):
    """Two disks of N42; also their masses and inertias."""
    disk, found = mm.magnet("cylinder", (0.01, 0.005), grade="N42"), []
    for units in (SI, u):
        text = disk.mjcf(0.1, 0.005, units=(units.length, units.mass, units.moment))
        model = mujoco.MjModel.from_xml_string(f"""
            <mujoco><custom><text name="magmotor" data="dipoles"/>
            <numeric name="magnetic_constant" data="{units.constant!r}"/></custom><worldbody>
            <body>{text}</body>
            <body pos="0 0 {0.012 / units.length!r}"><freejoint/>{text}</body>
            </worldbody></mujoco>""")
        data = mujoco.MjData(model)
        with mm.magnetism():
            mujoco.mj_forward(model, data)
        inertia = model.body_inertia[2] * units.mass * units.length**2
        found.append([data.xfrc_applied[2, 2] * units.force, model.body_mass[2] * units.mass,
                      *inertia])  # fmt: skip
    assert found[1] == pytest.approx(found[0], rel=1e-10, abs=0)  # 1e-11, of 12 digits
    assert found[0][0] < -1


def test_attached_constants_are_reported():
    text = BEADS.format(size="").replace('"magnetic_constant"', '"part/magnetic_constant"')
    reasons = mm.describe(mujoco.MjModel.from_xml_string(text)).idle
    assert ["part/magnetic_constant" in reason for reason in reasons] == [True]


NAMES = {"m": 1, "mm": 1e-3, "cm": 1e-2, "µm": 1e-6, "kg": 1, "g": 1e-3, "mg": 1e-6, "ng": 1e-12,
         "pg": 1e-15, "s": 1, "ms": 1e-3, "A": 1, "10 A": 10, "µA": 1e-6}  # fmt: skip


def rows():
    """The rows of the table in the documentation: units, and numbers."""
    for line in (ROOT / "docs/units.md").read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.split("|")[1:-1]]
        if len(cells) > 2 and " (" in cells[0] + " (" and ", " in cells[0] and "length" not in line:
            names = cells[0].partition(" (")[0].split(", ")
            units = [Fraction(str(NAMES[name])) for name in names]
            yield units, [Fraction(cell.split()[0]) for cell in cells[1:]]


def test_the_table_of_units_follows_from_dimensions():
    """In exact arithmetic, but for pi and digits that the table leaves out."""
    found = [*rows()]
    assert len(found) == 7
    for (length, mass, time, current), numbers in found:
        force = mass * length / time**2
        energy, moment = force * length, current * length**2
        boltzmann = Fraction("1.380649e-23")
        ball = float(Fraction(15, 8) * Fraction("1e-15") * mass * length**2 / 1000)
        expected = [
            Fraction("4e-7") * Fraction(np.pi) * current**2 / force, force, energy,
            300 * boltzmann / energy, energy / moment, moment, current / length,
            1000 * length**3 / mass, Fraction("1e-3") * length * time / mass,
            Fraction((ball / np.pi) ** 0.2),
        ]  # fmt: skip
        assert [float(n) for n in numbers[1:3] + numbers[4:9]] == pytest.approx(
            [float(n) for n in expected[1:3] + expected[4:9]], rel=1e-15, abs=0
        )
        for k, digits in ((0, 1e-10), (3, 1e-4), (9, 0.03)):
            assert float(numbers[k] / expected[k]) == pytest.approx(1, rel=digits)


def test_mujoco_compiles_spheres_down_to_the_size_in_the_table():
    for (length, _, _, _), (*_, density, _, smallest) in rows():
        for factor, compiles in ((1.05, True), (0.95, False)):
            text = (
                "<mujoco><worldbody><body><freejoint/>"
                f'<geom size="{float(factor * smallest / length)!r}" density="{float(density)!r}"/>'
                "</body></worldbody></mujoco>"
            )
            if compiles:
                mujoco.MjModel.from_xml_string(text)
            else:
                with pytest.raises(ValueError, match="mjMINVAL"):
                    mujoco.MjModel.from_xml_string(text)
