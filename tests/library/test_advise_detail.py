"""What of a model can be switched off: known changes, savings, interactions, text, time budget."""

import itertools
import math
import time

import mujoco
import numpy as np
import pytest
from advised_models import Clock

import magmotor as mm
from magmotor.advice import detail, features
from magmotor.advice.detail import Detail, measure_detail
from magmotor.advice.features import Feature, Seen
from magmotor.advice.measure import Measurement
from magmotor.advice.measured_quantities import read_quantity
from magmotor.advice.paths import Runs
from magmotor.advice.report import details_table
from magmotor.mjcf.lookup import disabled
from trials.corpus.models import digest

PENDULUM = f"""
<mujoco>
  <option timestep="0.002"><flag energy="enable"/></option>
  <worldbody>
    <body>
      <joint name="hinge" axis="0 1 0" damping="0.01"/>
      <geom type="capsule" fromto="0 0 0 0 0 -.5" size=".02" contype="0" conaffinity="0"/>
      <site name="tip" pos="0 0 -.5"/>
    </body>
  </worldbody>
  <sensor>
    <jointpos name="angle" joint="hinge"/>{'<accelerometer site="tip"/>' * 60}
  </sensor>
</mujoco>
"""

BOX = """
<mujoco>
  <option cone="elliptic" density="1.2"/>
  <default><geom condim="6"/></default>
  <worldbody>
    <light mode="trackcom"/>
    <geom name="floor" type="plane" size="1 1 1"/>
    <body name="box" pos="0 0 0.1"><freejoint/><geom name="box" type="box" size=".2 .2 .1"/></body>
  </worldbody>
</mujoco>
"""

RODS = f"""
<mujoco>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1"/>
    <body pos="0 0 0.1"><freejoint/><geom name="ball" size="0.1"/></body>
    {
    "".join(
        f'<body pos="{0.1 * k} 5 10"><joint type="slide" axis="0 0 1" stiffness="1"/>'
        f'<geom name="rod{k}" type="capsule" size=".01 2" euler="30 0 0"/></body>'
        for k in range(24)
    )
}
  </worldbody>
</mujoco>
"""

TWINS = """
<mujoco>
  <option><flag contact="disable"/></option>
  <worldbody>
    <body>
      <joint name="one" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 -.5" size=".02"/>
    </body>
    <body pos="0 1 0">
      <joint name="two" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 -.5" size=".02"/>
    </body>
  </worldbody>
  <equality><joint joint1="one" joint2="two"/></equality>
</mujoco>
"""

RING = 0.1 * np.exp(2j * np.pi * np.arange(95) / 95)

DIPOLES = f"""
<mujoco>
  <custom>
    <text name="magmotor" data="dipoles"/><numeric name="magnetic_tolerance" data="1e-5"/>
  </custom>
  <worldbody>
    {
    "".join(
        f'<site name="s{k}" pos="{z.real:.6f} {z.imag:.6f} 0" zaxis="0 1 0"'
        f' user="{1 if k % 19 == 0 else 1e-9}"/>'
        for k, z in enumerate(RING)
    )
}
    <body name="needle">
      <joint name="needle" axis="0 0 1"/>
      <geom type="capsule" fromto="-0.03 0 0 0.03 0 0" size="0.003" contype="0" conaffinity="0"/>
      {"".join(f'<site pos="{0.01 * k} 0 0" zaxis="1 0 0" user="0.2"/>' for k in range(-2, 3))}
    </body>
  </worldbody>
</mujoco>
"""

WEAKEST = 'site user="0" at the weakest dipoles (90)'

PLUGIN = (
    '<extension><plugin plugin="magmotor.forces"><instance name="magnets"/></plugin></extension>'
)


@pytest.fixture(autouse=True)
def steady(monkeypatch):
    """Count work instead of time, since nothing must depend on the load of the machine."""
    Clock(monkeypatch, step=1e-4)

    def timed(runs, integrator, timestep, steps):
        runs.prepare(integrator, timestep)
        model = runs.model
        constraint = not disabled(model, "constraint")
        work = 10.0 + 0.1 * np.count_nonzero(model.site_user)
        work += 10.0 if model.nsensor and not disabled(model, "sensor") else 0.0
        work += 1.0 if model.opt.enableflags else 0.0
        if constraint and not disabled(model, "contact"):
            work += 0.5 * np.count_nonzero(model.geom_contype)
        if constraint and not disabled(model, "equality"):
            work += 3.0 * model.neq
        return 1e-6 * work

    monkeypatch.setattr(Runs, "timed", timed)


def prepared(xml, quantity, qpos=(), qvel=(), duration=1.0):
    """Return runs, a quantity, and its range along the model's own path."""
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    data.qpos[: len(qpos)] = qpos
    data.qvel[: len(qvel)] = qvel
    runs = Runs(model, data)
    read = read_quantity(runs.model, mujoco.MjData(runs.model), quantity)
    path = Measurement(runs, read, duration).samples(runs.integrator, 1.0)
    assert path is not None
    return runs, read, float(read.ranges(path.values)[0])


def measured(xml, quantity, qpos=(), qvel=(), *, error=0.01, duration=1.0, seconds=4.0):
    """Return the details by what they switch off, and that of all together."""
    runs, read, scale = prepared(xml, quantity, qpos, qvel, duration)
    until = time.perf_counter() + seconds
    found = measure_detail(
        runs, read, runs.integrator, runs.timestep, duration, error, scale, until
    )
    single = {each.what: each for each in found if not each.together}
    joint = [each for each in found if each.together]
    assert len(single) + len(joint) == len(found)
    return single, joint[0] if joint else Detail("", 0.0, 0.0, False)


def test_gravity_stays_and_sensors_that_nothing_reads_go():
    single, joint = measured(PENDULUM, "joint hinge", [1.0])
    assert {*single} == {
        'flag damper="disable"', 'flag eulerdamp="disable"', 'flag gravity="disable"',
        'flag sensor="disable"', 'flag energy="disable"',
    }  # fmt: skip
    for what in ('flag sensor="disable"', 'flag energy="disable"'):
        assert single[what].change == 0.0
    gravity, sensor = single['flag gravity="disable"'], single['flag sensor="disable"']
    assert gravity.change == pytest.approx(1, abs=1e-4)  # it stays at its largest angle
    assert not gravity.can_go
    assert sensor.can_go
    assert sensor.saved == pytest.approx(10 / 21)
    assert 'flag sensor="disable"' in joint.together
    assert joint.change <= 0.01
    assert joint.saved == pytest.approx(11 / 21)


def test_the_change_is_that_of_plain_loops():
    single, _ = measured(PENDULUM, "joint hinge", [1.0])
    paths = []
    for flag in (0, mujoco.mjtDisableBit.mjDSBL_DAMPER):
        model = mujoco.MjModel.from_xml_string(PENDULUM)
        model.opt.disableflags |= flag
        data = mujoco.MjData(model)
        data.qpos[0] = 1.0
        angles = [1.0]
        for _ in range(500):
            mujoco.mj_step(model, data)
            angles.append(float(data.qpos[0]))
        paths.append(np.array(angles))
    change = np.abs(paths[1] - paths[0]).max() / np.ptp(paths[0])
    assert single['flag damper="disable"'].change == pytest.approx(change, rel=1e-9)


def test_sensors_stay_if_the_quantity_is_one():
    single, _ = measured(PENDULUM, "sensor angle", [1.0])
    sensor = single['flag sensor="disable"']
    scale = prepared(PENDULUM, "sensor angle", [1.0])[2]
    assert sensor.change == pytest.approx(1 / scale, rel=1e-9)  # of 1 rad, it shows 0
    assert not sensor.can_go


def test_controls_and_applied_forces_act():
    motor = '<actuator><motor name="motor" joint="hinge"/></actuator>'
    sensor = '<actuatorfrc name="torque" actuator="motor"/>'
    text = PENDULUM.replace("<sensor>", f"{motor}<sensor>{sensor}")
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.ctrl[0] = 0.5
    runs = Runs(model, data)
    read = read_quantity(runs.model, mujoco.MjData(runs.model), "sensor torque")
    until = time.perf_counter() + 4
    found = measure_detail(runs, read, "Euler", 0.002, 0.2, 0.01, 1.0, until)
    changes = {each.what: each.change for each in found}
    assert changes['flag actuation="disable"'] == 0.5
    assert changes['flag gravity="disable"'] == 0.0


def test_a_variant_that_diverges_stays():
    stiff = PENDULUM.replace('damping="0.01"', 'damping="100"')
    single, _ = measured(stiff, "joint hinge", [1.0], [10.0])
    explicit = single['flag eulerdamp="disable"']
    assert explicit.change == math.inf
    assert math.isnan(explicit.saved)
    assert not explicit.can_go
    assert any("diverged" in line for line in details_table([explicit]))


def test_friction_of_a_sliding_box_stays_and_its_torsion_goes():
    single, _ = measured(BOX, "positions", qvel=[1.0], duration=0.5)
    assert single['geom condim="3"'].change < 2e-5  # 8e-7
    assert single['geom condim="1"'].change > 2  # 9
    assert single['flag contact="disable"'].change > 5  # 26
    assert not single['geom condim="1"'].can_go
    assert {'option cone="pyramidal"', 'option solver="CG"', 'light mode="fixed"'} < {*single}
    assert single['light mode="fixed"'].change == 0.0
    assert not any("nothing touches" in what for what in single)
    assert not any("equality" in what for what in single)


def test_geoms_that_never_touch_go():
    single, joint = measured(RODS, "positions", qvel=[1.0], duration=0.5)
    what = 'geom contype="0" conaffinity="0" where nothing touches (24)'
    rods = single[what]
    assert rods.names == tuple(f"rod{k}" for k in range(24))
    assert rods.change == 0.0
    assert rods.can_go
    assert rods.saved == pytest.approx(12 / 23)
    assert what in joint.together


def test_an_equality_that_holds_by_itself_goes():
    single, joint = measured(TWINS, "joint one", [1.0, 1.0])
    constraint, equality = single['flag constraint="disable"'], single['flag equality="disable"']
    assert equality.change == 0.0
    assert equality.can_go
    assert joint.together[0] == constraint.what  # which includes that for equalities
    assert equality.what not in joint.together
    single, _ = measured(TWINS, "joint one", [1.0, 0.5])
    assert not single['flag equality="disable"'].can_go


@pytest.mark.parametrize("plugin", [True, False])
def test_weak_dipoles_go(plugin):
    xml = DIPOLES.replace("<mujoco>", f"<mujoco>{PLUGIN}") if plugin else DIPOLES
    with mm.magnetism():
        single, joint = measured(xml, "joint needle", error=1e-4, duration=0.3)
    assert {*single} == {
        'flag gravity="disable"', 'numeric name="magnetic_tolerance" data="0.0001"', WEAKEST,
    }  # fmt: skip
    dipoles = single[WEAKEST]
    assert {*dipoles.names} == {f"s{k}" for k in range(95) if k % 19}
    assert 0.0 < dipoles.change < 3e-7  # 2e-8
    assert dipoles.can_go
    assert dipoles.saved == pytest.approx(9 / 20)
    assert joint.together == (WEAKEST,)


def test_dipoles_are_left_alone_where_no_magnetism_acts():
    single, _ = measured(DIPOLES, "joint needle", qvel=[1.0], duration=0.3)
    assert {*single} == {'flag gravity="disable"'}


@pytest.mark.parametrize("quantity", ["energy", "joint needle"])
def test_what_magnetism_left_behind_does_not_act(quantity):
    model = mujoco.MjModel.from_xml_string(DIPOLES)
    data = mujoco.MjData(model)
    data.qvel[0] = 1.0
    changes = []
    with mm.magnetism():
        for _ in range(2):
            runs = Runs(model, data)
            read = read_quantity(runs.model, mujoco.MjData(runs.model), quantity)
            until = time.perf_counter() + 4
            found = measure_detail(runs, read, "Euler", 0.002, 0.3, 1e9, 1.0, until)
            changes.append({each.what: each.change for each in found})
            mujoco.mj_forward(model, data)  # leaves forces in `xfrc_applied`
    assert data.xfrc_applied.any()
    assert changes[0]['site user="0" at the weakest dipoles (100)'] > 1e-6  # 5e-6, 3
    assert changes[0] == changes[1]


def test_the_model_is_not_changed():
    for xml, quantity in ((RODS, "positions"), (BOX, "energy")):
        runs, read, scale = prepared(xml, quantity, qvel=[1.0], duration=0.2)
        before, start = digest(runs.model), runs.start.copy()
        until = time.perf_counter() + 3
        assert measure_detail(runs, read, "RK4", 0.001, 0.2, 0.01, scale, until)
        assert digest(runs.model) == before
        np.testing.assert_array_equal(runs.start, start)


@pytest.mark.parametrize("xml", [PENDULUM, BOX, RODS, TWINS])
def test_features_are_what_mjcf_makes_of_their_names(xml):
    model, own = (mujoco.MjModel.from_xml_string(xml) for _ in range(2))
    seen = Seen(np.ones(model.ngeom, bool), True)
    found = [*features.features(model, seen)]
    assert len({feature.what for feature in found}) == len(found)
    options = [each for each in found if each.what.startswith(("flag", "option"))]
    assert len(options) > 4
    for feature in options:
        element = f"<{feature.what}/>"
        if feature.what.startswith("flag"):
            element = f"<option>{element}</option>"
        text = xml.replace("<worldbody>", f"{element}<worldbody>")
        written = mujoco.MjModel.from_xml_string(text)
        features.switch_off((), model, own)
        assert digest(model) != digest(written)
        features.switch_off((feature,), model, own)
        assert digest(model) == digest(written), feature.what


class Sums:
    """Stands for variants whose changes and savings add up."""

    def __init__(self, **features):
        self.changes = {name: change for name, (change, _) in features.items()}
        self.saved = {name: saved for name, (_, saved) in features.items()}

    def change(self, off, until):
        return sum(self.changes[feature.what] for feature in off)

    def savings(self, variants, until):
        return np.array([sum(self.saved[f.what] for f in off) for off in variants]), 0.01


def together(sums, within=()):
    """Return what can go together at an error of 0.01."""
    ratios = {
        Feature(name, lambda _: None, frozenset(within if name == "part" else ())): change
        / sums.saved[name]
        for name, change in sums.changes.items()
    }
    return detail._together(sums, ratios, 0.01, math.inf)


def test_what_changes_too_much_together_stays_by_its_ratio():
    sums = Sums(cheap=(0.006, 0.1), dear=(0.007, 0.3), free=(0.0, 0.02))
    (joint,) = together(sums)
    assert joint.together == ("dear", "free")
    assert (joint.change, joint.saved) == pytest.approx((0.007, 0.32))


def test_a_part_goes_only_if_the_whole_stays():
    (joint,) = together(Sums(whole=(0.002, 0.3), part=(0.001, 0.2)), ["whole"])
    assert joint.together == ("whole",)
    (joint,) = together(Sums(whole=(0.009, 0.1), part=(0.001, 0.2), other=(0.004, 0.2)), ["whole"])
    assert joint.together == ("part", "other")
    assert together(Sums()) == ()


def test_what_is_known_when_time_runs_out_is_returned(monkeypatch):
    runs, read, scale = prepared(BOX, "positions", qvel=[1.0])
    ticks = itertools.count()
    monkeypatch.setattr(time, "perf_counter", lambda: next(ticks) * 1e-3)
    counts = []
    for seconds in (0.0, 5.0, 20.0, 100.0):
        began = time.perf_counter()
        found = measure_detail(runs, read, "Euler", 0.002, 1.0, 0.01, scale, began + seconds)
        assert time.perf_counter() - began < seconds + 0.01  # 0.005
        counts.append((len(found), sum(not math.isnan(each.saved) for each in found)))
    assert counts[0] == (0, 0)
    assert counts[0] < counts[1] < counts[2] < counts[3]  # (1, 1), (10, 10), (20, 20)


def test_the_table_lists_what_can_go():
    names = tuple(f"geom {k}" for k in range(10))
    lines = details_table([
        Detail("one", 0.5, 0.2, False), Detail("two", 0.0, 0.25, True, names),
        Detail("three", 0.001, 0.1, True), Detail("four", math.inf, math.nan, False),
        Detail("all of these", 0.002, 0.3, True, together=("two",)),
    ])  # fmt: skip
    assert [line.split() for line in lines[:5]] == [
        ["without", "change", "saves", "can", "go"],
        ["one", "50", "%", "20", "%"],
        ["two", "0", "%", "25", "%", "yes"],
        ["three", "0.1", "%", "10", "%", "alone"],
        ["four", "diverged"],
    ]
    assert lines[5] == f"two: {', '.join(names[:8])}, and 2 more"
    assert lines[6].endswith("by 0.2 % and saves 30 % of the time: two")
    assert details_table([]) == []
