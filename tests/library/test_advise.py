"""`mm.advise`: errors against closed forms and plain loops, orders, limits, floors, the choice."""

import itertools
import math
import re
from contextlib import nullcontext
from pathlib import Path

import dm_control
import mujoco
import numpy as np
import pytest
from advised_models import (
    AMPLITUDE,
    BALL,
    LEVITRON,
    NEEDLE,
    OMEGA,
    OSCILLATOR,
    PENDULUM,
    WHIP,
    Clock,
    started,
)
from refusals import refused

import magmotor as mm
from magmotor.advice import advise, survey
from magmotor.advice.measure import Measurement
from magmotor.advice.paths import OutOfTime, Runs
from magmotor.advice.stability import find_rest, stability_limit


@pytest.fixture(autouse=True, scope="module")
def clock():
    """Costs and budgets count steps instead of time, whatever the load of the machine."""
    with pytest.MonkeyPatch.context() as patch:
        yield Clock(patch, step=1.5e-4)


def loop(model, data, integrator, timestep, duration):
    """Return the positions after all steps of a plain loop."""
    model.opt.timestep = timestep
    model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    run = mujoco.MjData(model)
    run.qpos[:], run.qvel[:] = data.qpos, data.qvel
    path = [run.qpos.copy()]
    for _ in range(int(duration / timestep + 1e-6)):
        mujoco.mj_step(model, run)
        path.append(run.qpos.copy())
    return np.array(path)


@pytest.fixture(scope="module")
def oscillator(clock):
    model, data = started(OSCILLATOR, [AMPLITUDE])
    return mm.advise(model, data, quantity="joint slide", duration=2.0)


def test_errors_of_an_oscillator_are_those_of_the_closed_form(oscillator):
    compared = []
    for integrator in {point.method for point in oscillator.points}:
        worst = 0.0
        own = [point for point in oscillator.points if point.method == integrator]
        for point in sorted(own, key=lambda point: point.timestep):
            path = loop(*started(OSCILLATOR, [AMPLITUDE]), integrator, point.timestep, 2.0)[:, 0]
            times = np.arange(len(path)) * point.timestep
            error = np.abs(path - AMPLITUDE * np.cos(OMEGA * times)).max() / (2 * AMPLITUDE)
            worst = max(worst, float(error))
            if point.timestep > 2e-4:  # shorter ones are recorded at ticks only
                compared.append(point.error / worst)
    assert len(compared) > 25  # 32
    assert np.abs(np.array(compared) - 1).max() < 0.01  # 0.002


def test_orders_and_limits_of_an_oscillator_are_those_of_theory(oscillator):
    for integrator, order, limit in [
        ("Euler", 1, 2.0), ("implicitfast", 1, 2.0), ("RK4", 4, 2.0 * math.sqrt(2.0)),
    ]:  # fmt: skip
        assert oscillator.orders[integrator].value == pytest.approx(order, abs=0.15)  # 0.1
        found = oscillator.limits[integrator]
        assert found.theory == pytest.approx(limit / OMEGA, rel=0.01)
        assert found.found == pytest.approx(limit / OMEGA, rel=0.01)
        assert found.joints == (("slide", 1.0),)


COUPLED = """
<mujoco>
  <option gravity="0 0 0" timestep="0.004"/>
  <worldbody>
    <body><joint name="light" type="slide" stiffness="10"/><geom size="0.1" mass="1"/></body>
    <body><joint name="heavy" type="slide" stiffness="20"/><geom size="0.1" mass="4"/></body>
  </worldbody>
  <tendon>
    <fixed stiffness="100"><joint joint="light" coef="1"/><joint joint="heavy" coef="-1"/></fixed>
  </tendon>
</mujoco>
"""


def test_the_mode_of_two_joints_is_that_of_theory():
    apart = COUPLED.replace("<option", '<option integrator="RK4"').replace(
        "<geom", '<geom contype="0"'
    )
    advice = mm.advise(*started(apart, [0.1]), budget=10)
    mass = np.array([1.0, 4.0])
    stiffness = np.array([[110.0, -100.0], [-100.0, 120.0]])
    squares, modes = np.linalg.eigh(stiffness / np.sqrt(np.outer(mass, mass)))
    (first, share), (second, rest) = advice.limits["Euler"].joints
    assert (first, second) == ("light", "heavy")
    assert [share, rest] == pytest.approx(modes[:, -1] ** 2, abs=0.03)  # 0.001
    limit = 2 / math.sqrt(squares[-1])
    assert advice.limits["Euler"].theory == pytest.approx(limit, rel=0.01)  # 0.005


def errors_of_elements(model, data, advice, elements):
    """Return the error of each of some positions over its own range, and that of all of them."""
    own = loop(model, data, advice.method, advice.timestep, 1.0)[:, :elements]
    truth = loop(model, data, "RK4", advice.timestep / 20, 1.0)[::20, :elements][: len(own)]
    return np.abs(own - truth).max(axis=0) / np.ptp(truth, axis=0)


@pytest.mark.parametrize(("xml", "start", "speed", "name"), [
    (WHIP, [1.0, 0.1], [], "joint 'two'"),
    (LEVITRON, [0.0, 0.0, 0.0885], [0.0, 0.0, 0.0, 2.0, 0.0, 150.0], "x of joint 'top'"),
])  # fmt: skip
def test_the_worst_element_keeps_the_promise(xml, start, speed, name):
    """The small joint of a whip, and the place of a top that floats: 1 % was 45 and 28 % there."""
    count = len(start)
    with mm.magnetism() if xml == LEVITRON else nullcontext():
        whole, each = (
            mm.advise(*started(xml, start, speed), every_element=every, budget=5)
            for every in (False, True)
        )
        errors = [
            errors_of_elements(*started(xml, start, speed), advice, count)
            for advice in (whole, each)
        ]
    assert whole.promised <= 0.01
    assert errors[0].max() > 0.2  # 0.45, 0.28
    assert f"over its own range {100 * errors[0].max():.2g} % ({name})" in str(whole)
    assert 0.2 * each.promised < errors[1].max() < each.promised <= 0.01
    advised = each.method, each.timestep
    (chosen,) = (p for p in each.points if (p.method, p.timestep) == advised)
    assert (chosen.element, chosen.worst) == (name, chosen.error)
    assert chosen.norm < 0.1 * chosen.error


def test_ranges_are_those_of_a_plain_loop_and_what_was_not_seen_is_named():
    """The second body creeps, and the third hardly moves beside the others."""
    xml = OSCILLATOR.replace(
        "</worldbody>",
        """
        <body pos="0 1 0"><joint name="slow" type="slide"/><geom size="0.1"/></body>
        <body pos="0 2 0"><joint name="still" type="slide"/><geom size="0.1"/></body>
        </worldbody>""",
    )
    model, data = started(xml, [AMPLITUDE], [0.0, 0.01, 1e-5])
    advice = mm.advise(model, data, budget=10)
    ranges = advice.ranges
    assert ranges["joint 'slide'"] == pytest.approx(2 * AMPLITUDE, rel=1e-4)
    assert ranges["joint 'slow'"] == pytest.approx(0.01, rel=1e-4)
    assert math.isinf(ranges["joint 'still'"])
    assert "thousandth of what moves most is not judged: joint 'still'" in str(advice)
    assert "joint 'slow' moved one way only: over a longer duration" in str(advice)


@pytest.mark.parametrize("error", [0.1, 0.01, 1e-4])
def test_promises_hold_for_a_double_pendulum(error):
    model, data = started(PENDULUM, [1.0, 0.5])
    advice = mm.advise(model, data, quantity="joint two", duration=2.0, error=error, budget=10)
    assert advice.promised <= error
    own = loop(model, data, advice.method, advice.timestep, 2.0)[:, 1]
    truth = loop(model, data, "RK4", advice.timestep / 10, 2.0)[::10, 1][: len(own)]
    found = np.abs(own - truth).max() / np.ptp(truth)
    assert 0.3 * advice.promised < found < advice.promised


def test_the_model_and_the_data_are_left_as_they_are():
    model, data = started(PENDULUM, [1.0, 0.5])
    mm.advise(model, data, duration=0.3, budget=2)
    assert (model.opt.timestep, model.opt.integrator) == (0.005, 0)
    assert data.time == 0.0
    np.testing.assert_array_equal(data.qpos, [1.0, 0.5])


def test_sensors_are_read_with_the_controls_of_the_state():
    driven = OSCILLATOR.replace(
        "</mujoco>",
        """
      <actuator><motor name="motor" joint="slide" gear="3"/></actuator>
      <sensor>
        <actuatorfrc name="force" actuator="motor"/><jointpos name="x" joint="slide"/>
      </sensor>
    </mujoco>""",
    )
    model, data = started(driven)
    data.ctrl[:] = 5.0
    read = []

    def forces(_, run):
        read.append(run.sensordata[0])
        return run.sensordata[1]

    advice = mm.advise(model, data, quantity=forces, budget=10)
    assert advice.method == "RK4"
    assert {*read[1:]} == {5.0}  # the first call only asks how many numbers there are


def test_contacts_leave_a_floor():
    advice = mm.advise(*started(BALL), error=1e-7, budget=5)
    assert not advice.method
    assert 1e-7 < advice.doubt < 0.1
    assert "uncertain" in advice.reason


def test_magnetism_acts_with_the_plugin_and_inside_a_block():
    marked = NEEDLE.replace('<extension><plugin plugin="magmotor.forces">', "<extension>")
    plain = re.sub("<extension>.*</extension>", "", NEEDLE)
    assert marked != plain
    with_plugin = mm.advise(*started(NEEDLE), quantity="joint needle", budget=10)
    with mm.magnetism():
        in_block = mm.advise(*started(plain), quantity="joint needle", budget=10)
    assert with_plugin.timestep == in_block.timestep
    assert with_plugin.promised == pytest.approx(in_block.promised, rel=1e-6)
    with refused("quantity"):
        mm.advise(*started(plain), quantity="joint needle", budget=10)


def test_the_energy_includes_that_of_magnets():
    advice = mm.advise(*started(NEEDLE), quantity="energy", error=0.001, budget=5)
    assert advice.method
    assert advice.orders["RK4"].value > 3


SHARED = ("quantity", "error", "method", "timestep", "promised", "seconds", "horizon", "basis")


def test_the_cheapest_that_keeps_the_promise_is_advised(oscillator):
    good = [p for p in oscillator.points if 1.2 * (p.error + oscillator.doubt) <= 0.01]
    assert len({p.method for p in good}) > 1  # 2 to 4, by their costs
    (chosen,) = (
        p for p in good
        if (p.method, p.timestep) == (oscillator.method, oscillator.timestep)
    )  # fmt: skip
    assert oscillator.seconds == chosen.seconds == min(p.seconds for p in good)
    sentence = str(mm.Recommendation(**{name: getattr(oscillator, name) for name in SHARED}))
    assert sentence.endswith(" s per simulated second (measured on this machine)")
    assert f"\nadvice: {sentence.partition(' (')[0]}" in str(oscillator)
    assert oscillator.promised == pytest.approx(1.2 * (chosen.error + oscillator.doubt), rel=1e-6)


def test_a_longer_timestep_is_no_more_accurate():
    model, data = started(PENDULUM, [1.0, 0.5])
    # Where the elbow is at 0.7 s, errors of both signs cross zero.
    advice = mm.advise(
        model, data, quantity=lambda _, run: math.cos(20 * run.qpos[1]), duration=0.7, budget=6
    )
    for name in {point.method for point in advice.points}:
        own = sorted((p.timestep, p.error) for p in advice.points if p.method == name)
        assert all(b >= a for (_, a), (_, b) in itertools.pairwise(own)), name


LINKAGE = """
<mujoco>
  <option solver="PGS" iterations="50" tolerance="0"/>
  <worldbody>
    <body>
      <joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0.3 0 0" size=".02"/>
      <body pos="0.3 0 0">
        <joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0.2 0 0.4" size=".02"/>
        <body name="end" pos="0.2 0 0.4">
          <joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0.2 0 -0.4" size=".02"/>
        </body>
      </body>
    </body>
  </worldbody>
  <equality><connect body1="end" anchor="0.2 0 -0.4"/></equality>
</mujoco>
"""


@pytest.mark.parametrize(("iterations", "advised"), [(50, None), (4, 16), (1, "does not converge")])
def test_the_solver_gets_the_iterations_that_it_needs(iterations, advised):
    model, data = started(LINKAGE.replace('"50"', f'"{iterations}"'), qvel=[0.5])
    advice = mm.advise(model, data, duration=0.5, error=0.02, budget=10)
    if advised == "does not converge":
        assert not advice.method
        assert advised in advice.reason
    else:
        assert advice.settings.get("iterations") == advised
        assert (f'iterations="{advised}"' in str(advice)) == bool(advised)


def test_details_fit_beside_the_promise_with_the_settings_advised(monkeypatch):
    asked = []

    def measure_detail(runs, *rest):
        asked.append((runs.model.opt.iterations, rest[1], rest[2], rest[4]))
        return ()

    monkeypatch.setattr(survey, "measure_detail", measure_detail)
    model, data = started(LINKAGE.replace('"50"', '"4"'), qvel=[0.5])
    advice = mm.advise(model, data, duration=0.5, error=0.02, budget=15, detail=True)
    assert advice.settings["iterations"] == 16
    left = (0.02 - advice.promised) / 1.2
    assert asked == [(16, advice.method, advice.timestep, pytest.approx(left))]
    assert left > 0
    asked.clear()
    unanswered = mm.advise(model, data, duration=0.5, error=1e-7, budget=5, detail=True)
    assert not unanswered.method
    assert asked == [(4, "Euler", 0.002, 0.0)]


def test_only_some_integrators_may_be_recommended_and_only_the_solver_as_it_is():
    model, data = started(PENDULUM, [1.0, 0.5])
    asked = {"quantity": "joint two", "budget": 5, "error": 0.01}
    advice = advise.survey(model, data, **asked, among=["Euler", "implicit"])
    assert advice.method in ("Euler", "implicit")
    assert {p.method for p in advice.points} > {"RK4"}
    model, data = started(LINKAGE.replace('"50"', '"4"'), qvel=[0.5])
    asked = {"quantity": "positions", "duration": 0.5, "error": 0.02, "budget": 10}
    assert advise.survey(model, data, **asked).settings["iterations"] == 16
    advice = advise.survey(model, data, **asked, tune=False)
    assert (advice.method != "", advice.settings) == (True, {})


def test_limits_by_theory_exist_only_without_constraints():
    advice = mm.advise(*started(BALL), duration=1.0, error=0.1, budget=15)
    assert advice.constraints > 0
    for limit in advice.limits.values():
        assert math.isnan(limit.theory)


def test_where_nothing_grows_no_mode_does():
    """The limit found by a push may be one of contacts, which the linear map does not know."""
    rest = find_rest(Runs(*started(OSCILLATOR)), math.inf)
    assert rest is not None
    assert rest.mode("Euler", 1e-3) == ()
    assert rest.mode("Euler", 1e3) != ()


def test_growth_that_drag_soon_ends_is_found():
    """The fish swims in a fluid whose drag grows with the square of the speed."""
    folder = Path(next(iter(dm_control.__path__)))
    model = mujoco.MjModel.from_xml_path(str(folder / "suite" / "fish.xml"))
    rest = find_rest(Runs(model), math.inf)
    assert rest is not None
    limit = stability_limit(rest, "implicitfast")
    assert limit is not None
    assert limit.found == pytest.approx(limit.theory, rel=0.03)  # 0.013


SPINNING = """
<mujoco>
  <option timestep="0.01"/>
  <worldbody>
    <geom type="plane" size="5 5 1"/>
    <body pos="0 0 1"><joint name="spin" axis="0 0 1"/><geom size="0.05" mass="1"/></body>
    <body pos="2 0 0.1"><freejoint/><geom size="0.1"/></body>
  </worldbody>
  <actuator><velocity joint="spin" kv="2"/></actuator>
</mujoco>
"""


def test_a_limit_below_the_timestep_is_found_also_with_contacts():
    model, data = started(SPINNING.replace("<option", '<option integrator="implicitfast"'))
    data.qvel[0] = 1.0
    advice = mm.advise(model, data, duration=1.0, budget=20)
    assert advice.constraints > 0
    # The inertia is 2 m r^2/5 = 0.001: Euler fails from h = 2 I/kv = 0.001 on.
    assert advice.limits["Euler"].found == pytest.approx(0.001, rel=0.02)
    if advice.method == "Euler" and advice.timestep > 0.001:
        assert "exceeds the stability limit at rest" in str(advice)


def test_a_point_that_the_solver_rejects_is_not_advised_later(monkeypatch):
    tried = []

    def settled(own, point, settings):
        tried.append(point)
        if point is not tried[0]:
            raise OutOfTime
        tightest = settings.get("iterations", 0) == 6400
        return own.samples("RK4", 0.5) if tightest else own.samples("Euler", 8.0)

    monkeypatch.setattr(Measurement, "settled", settled)
    advice = mm.advise(*started(PENDULUM, [1.0, 0.5]), duration=0.5, budget=5)
    assert "too small to check" in str(advice)
    assert tried[-1] is not tried[0]
    assert (advice.method, advice.timestep) == (tried[-1].method, tried[-1].timestep)


def test_a_picture_is_drawn(tmp_path, oscillator):
    oscillator.draw(tmp_path / "advice.png")
    assert 10_000 < (tmp_path / "advice.png").stat().st_size < 200_000
