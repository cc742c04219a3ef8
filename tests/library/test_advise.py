"""`mm.advise`: errors against closed forms and plain loops, limits, chaos, floors, bad input."""

import copy
import itertools
import math
import re
import time
import warnings

import mujoco
import numpy as np
import pytest

import magmotor as mm
from magmotor.advice import survey
from magmotor.advice.errors import Samples, reference
from magmotor.advice.measure import Measurement
from magmotor.advice.paths import OutOfTime, Runs, quiet
from magmotor.advice.statistics import Statistic, certain

OMEGA, AMPLITUDE = 10.0, 0.1

OSCILLATOR = """
<mujoco>
  <option gravity="0 0 0" timestep="0.004"/>
  <worldbody>
    <body><joint name="slide" type="slide" stiffness="100"/><geom size="0.1" mass="1"/></body>
  </worldbody>
</mujoco>
"""

PENDULUM = """
<mujoco>
  <option timestep="0.005"/>
  <worldbody>
    <body>
      <joint name="one" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 -.5" size=".02"/>
      <body pos="0 0 -.5">
        <joint name="two" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 -.5" size=".02"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""

BALL = """
<mujoco>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body pos="0 0 0.3"><freejoint name="ball"/><geom size="0.1"/></body>
  </worldbody>
</mujoco>
"""

TRAP = """
<mujoco>
  <size nuserdata="5"/>
  <option gravity="0 0 0" timestep="0.01"/>
  <custom><text name="magmotor" data="noise"/></custom>
  <worldbody>
    <body user="1 0 0 0 0 0">
      <joint name="slide" type="slide" axis="1 0 0" stiffness="20" damping="0.5"/>
      <geom size="0.1" mass="1"/>
    </body>
  </worldbody>
</mujoco>
"""

NEEDLE = """
<mujoco>
  <extension><plugin plugin="magmotor.forces"><instance name="magnets"/></plugin></extension>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>
    <site pos="0 0.1 0" zaxis="0 1 0" user="5"/>
    <body>
      <joint name="needle" axis="0 0 1"/>
      <geom type="capsule" fromto="-0.03 0 0 0.03 0 0" size="0.003"/>
      <site zaxis="1 0 0" user="0.2"/>
    </body>
  </worldbody>
</mujoco>
"""


def started(xml, qpos=(), qvel=()):
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    data.qpos[: len(qpos)] = qpos
    data.qvel[: len(qvel)] = qvel
    return model, data


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
def oscillator():
    model, data = started(OSCILLATOR, [AMPLITUDE])
    return mm.advise(model, data, quantity="joint slide", duration=2.0)


def test_errors_of_an_oscillator_are_those_of_the_closed_form(oscillator):
    compared = []
    for integrator in {point.integrator for point in oscillator.points}:
        worst = 0.0
        own = [point for point in oscillator.points if point.integrator == integrator]
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


@pytest.mark.parametrize("error", [0.1, 0.01, 1e-4])
def test_promises_hold_for_a_double_pendulum(error):
    model, data = started(PENDULUM, [1.0, 0.5])
    advice = mm.advise(model, data, quantity="joint two", duration=2.0, error=error, budget=30)
    assert advice.promised <= error
    own = loop(model, data, advice.integrator, advice.timestep, 2.0)[:, 1]
    truth = loop(model, data, "RK4", advice.timestep / 10, 2.0)[::10, 1][: len(own)]
    found = np.abs(own - truth).max() / np.ptp(truth)
    assert 0.3 * advice.promised < found < advice.promised


def test_the_model_and_the_data_are_left_as_they_are():
    model, data = started(PENDULUM, [1.0, 0.5])
    mm.advise(model, data, duration=0.3, budget=2)
    assert (model.opt.timestep, model.opt.integrator) == (0.005, 0)
    assert data.time == 0.0
    np.testing.assert_array_equal(data.qpos, [1.0, 0.5])


def test_chaos_limits_the_horizon_and_gives_statistics(capsys):
    coarse = PENDULUM.replace('"0.005"', '"0.02"')
    advice = mm.advise(*started(coarse, [2.5, 1.0]), duration=20.0, budget=15)
    assert advice.growth is not None
    assert advice.growth > 1e3
    assert 2.0 < advice.horizon < 20.0  # 5.5 s
    rk4 = {s.name: s for s in advice.statistics if (s.integrator, s.timestep) == ("RK4", 0.01)}
    euler = {s.name: s for s in advice.statistics if (s.integrator, s.timestep) == ("Euler", 0.01)}
    assert {*rk4} == {"mean", "spread", "kinetic energy", "spectrum"}
    for name, statistic in rk4.items():
        assert statistic.error < 4 * statistic.doubt, name
    assert euler["kinetic energy"].error > 10 * euler["kinetic energy"].doubt  # it loses energy
    assert "chaotic" in capsys.readouterr().out


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
    assert advice.integrator == "RK4"
    assert {*read[1:]} == {5.0}  # the first call only asks how many numbers there are


def test_runs_of_a_model_with_noise_follow_one_brownian_path():
    with mm.magnetism():
        advice = mm.advise(*started(TRAP), quantity="joint slide", duration=5.0, budget=15)
        assert advice.integrator is not None
        own, truth = (noisy_loop(advice.integrator, advice.timestep, k) for k in (0, 3))
    own = own[: len(truth)]
    found = np.abs(own - truth[: len(own)]).max() / np.ptp(truth)
    assert 0.3 * advice.promised < found < advice.promised
    for name in ("Euler", "implicitfast", "discrete"):
        assert advice.orders[name].value == pytest.approx(1, abs=0.3)  # 0.1
    by_key = {(s.integrator, s.timestep, s.name): s for s in advice.statistics}
    closest = by_key["implicitfast", 0.005, "kinetic energy"]
    # On the same noise, the difference is far smaller than the spread of a kinetic energy.
    assert closest.doubt < 0.05  # 0.002
    assert advice.limits["Euler"].theory == pytest.approx(advice.limits["Euler"].found, rel=0.02)


def noisy_loop(integrator, timestep, halvings):
    """Return the positions at multiples of a timestep, by steps that are halved so many times."""
    model, data = started(TRAP)
    parts = timestep / 2**halvings / 0.01
    model.opt.timestep = parts * 0.01
    model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    data.userdata[2:4] = max(1, parts), max(0, -math.log2(parts))
    path = [data.qpos[0]]
    for _ in range(int(5.0 / timestep)):
        mujoco.mj_step(model, data, nstep=2**halvings)
        path.append(data.qpos[0])
    return np.array(path)


def test_splittings_at_a_temperature_have_the_kinetic_energy_of_theory():
    bath = OSCILLATOR.replace('stiffness="100"', 'stiffness="20" damping="1"')
    model, data = started(bath.replace('"0.004"', '"0.05"'))
    advice = mm.advise(model, data, quantity="joint slide", kT=1.0, duration=400.0, error=0.02)
    kinetic = {
        (s.integrator, s.timestep): s for s in advice.statistics if s.name == "kinetic energy"
    }
    for timestep in (0.2, 0.1):
        # Leimkuhler and Matthews, 2013: BAOAB has kT (1 - (omega h)^2/4), "middle" is exact.
        baoab, middle = (kinetic[name, timestep] for name in ("baoab", "middle"))
        expected = 20 * (timestep**2 - 0.0125**2) / 4
        assert abs(baoab.error - expected) < 4 * baoab.doubt
        assert expected > 8 * baoab.doubt
        assert middle.error < 4 * middle.doubt
    assert advice.promised <= 0.02
    assert advice.timestep < 0.2


def test_a_temperature_and_noise_exclude_each_other():
    with pytest.raises(ValueError, match=r"kT = 1\.0: must be omitted, since the model has noise"):
        mm.advise(*started(TRAP), kT=1.0, duration=5.0)


def test_noise_needs_room_to_choose_its_path():
    silent = TRAP.replace('<size nuserdata="5"/>', "")
    with pytest.raises(ValueError, match="nuserdata of the model = 0: must be at least 5, to"):
        mm.advise(*started(silent))


def test_contacts_leave_a_floor():
    advice = mm.advise(*started(BALL), error=1e-7, budget=5)
    assert advice.integrator is None
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
    with pytest.raises(ValueError, match="quantity = 'joint needle': does not change"):
        mm.advise(*started(plain), quantity="joint needle", budget=10)


def test_the_energy_includes_that_of_magnets():
    advice = mm.advise(*started(NEEDLE), quantity="energy", error=0.001, budget=5)
    assert advice.integrator is not None
    assert advice.orders["RK4"].value > 3


@pytest.mark.parametrize(("quantity", "sentence"), [
    ("speed", "quantity = 'speed': must be 'positions', 'energy', 'body NAME'"),
    ("joint tow", r"joint of the quantity = 'tow': must be one of one, two \(did you mean 'two'"),
    ("sensor x", "quantity = 'sensor x': the model has no sensor with a name"),
    (lambda model, data: "fast", "quantity .*: must be finite numbers"),
    (lambda model, data: math.nan, "quantity .*: must be finite numbers"),
    (lambda model, data: 1 / 0, "quantity = '<lambda>': fails: division by zero"),
    (lambda model, data: data.qpos[: 1 + (data.time > 0.1)], "always be the same number"),
    ("joint", "quantity = 'joint': must be 'positions', 'energy', 'body NAME'"),
    (lambda model, data: 1.0, "quantity .*: does not change along the path"),
])  # fmt: skip
def test_a_quantity_that_is_not_there_is_named(quantity, sentence):
    with pytest.raises(ValueError, match=sentence):
        mm.advise(*started(PENDULUM, [1.0]), quantity=quantity, budget=2)


@pytest.mark.parametrize(("arguments", "sentence"), [
    ({"error": 1e-9}, "error = 1e-09: must be"),
    ({"error": 1.0}, "error = 1.0: must be"),
    ({"duration": 0.2}, "duration = 0.2: must be at least 0.24 s, 48 timesteps"),
    ({"budget": 0.1}, "budget = 0.1: must be"),
])  # fmt: skip
def test_numbers_out_of_bounds_are_named(arguments, sentence):
    with pytest.raises(ValueError, match=sentence):
        mm.advise(*started(PENDULUM, [1.0]), **arguments)


def samples(*values):
    return Samples(1, np.array(values, float)[:, np.newaxis])


def test_paths_that_agree_by_accident_are_not_trusted():
    coarse, middle, fine = samples(0, 3.0), samples(0, 1.0), samples(0, 1.001)
    found = reference({"RK4": [(0.04, coarse), (0.02, middle), (0.01, fine)]})
    assert found.doubt[-1] >= 1.0


def test_two_paths_alone_are_trusted_half_as_much():
    found = reference({"RK4": [(0.02, samples(0, 1.0)), (0.01, samples(0, 1.1))]})
    assert found.doubt[-1] == pytest.approx(0.2)


def test_integrators_must_agree():
    def chain(end):
        return [(h, samples(0, 1.0, end + 1e-4 * h)) for h in (0.04, 0.02, 0.01)]

    alone = reference({"RK4": chain(2.0)})
    both = reference({"RK4": chain(2.0), "implicitfast": chain(2.5)})
    assert alone.doubt[-1] < 1e-5
    assert both.doubt[-1] == pytest.approx(0.5, rel=1e-3)
    assert both.doubt[1] < 1e-5


def test_the_cheapest_that_keeps_the_promise_is_advised(oscillator):
    good = [p for p in oscillator.points if 1.2 * (p.error + oscillator.doubt) <= 0.01]
    assert len({p.integrator for p in good}) > 2
    (chosen,) = (
        p for p in good
        if (p.integrator, p.timestep) == (oscillator.integrator, oscillator.timestep)
    )  # fmt: skip
    assert chosen.seconds == min(p.seconds for p in good)
    assert oscillator.promised == pytest.approx(1.2 * (chosen.error + oscillator.doubt), rel=1e-6)


def test_a_longer_timestep_is_no_more_accurate():
    model, data = started(PENDULUM, [1.0, 0.5])
    # Where the elbow is at 0.7 s, errors of both signs cross zero.
    advice = mm.advise(
        model, data, quantity=lambda _, run: math.cos(20 * run.qpos[1]), duration=0.7, budget=6
    )
    for name in {point.integrator for point in advice.points}:
        own = sorted((p.timestep, p.error) for p in advice.points if p.integrator == name)
        assert all(b >= a for (_, a), (_, b) in itertools.pairwise(own)), name


def test_statistics_count_with_two_standard_errors():
    rows = [
        Statistic("Euler", 0.1, "mean", 0.01, 0.02, 1.0),
        Statistic("Euler", 0.1, "spread", 0.03, 0.0, 1.0),
        Statistic("RK4", 0.1, "mean", 0.0, 0.001, 0.5),
        Statistic("RK4", 0.2, "mean", math.inf, math.nan, math.nan),
    ]
    assert certain(rows) == {("RK4", 0.1): 0.002, ("Euler", 0.1): 0.05}
    assert [*certain(rows)] == [("RK4", 0.1), ("Euler", 0.1)]  # the cheapest first


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
        assert advice.integrator is None
        assert advised in advice.reason
    else:
        assert advice.settings.get("iterations") == advised
        assert (f'iterations="{advised}"' in str(advice)) == bool(advised)


def test_what_is_not_finite_along_the_path_is_no_accuracy():
    def at_first(_, run):
        return run.qpos[0] if run.time < 1.0 else math.nan

    model, data = started(PENDULUM, [1.0, 0.5])
    with pytest.raises(ValueError, match=r"quantity = 'at_first': is not finite along"):
        mm.advise(model, data, quantity=at_first, duration=2.0, budget=5)


def test_limits_by_theory_exist_only_without_constraints():
    advice = mm.advise(*started(BALL), duration=1.0, error=0.1, budget=15)
    assert advice.constraints > 0
    for limit in advice.limits.values():
        assert math.isnan(limit.theory)


def test_data_of_another_model_are_named():
    with pytest.raises(ValueError, match="data = 'MjData': must belong to the model"):
        mm.advise(started(PENDULUM)[0], started(OSCILLATOR)[1])


def test_copied_data_are_accepted():
    model, data = started(PENDULUM, [1.0, 0.5])
    assert mm.advise(model, copy.deepcopy(data), duration=0.3, budget=3).points


def test_warnings_are_heard_again_after_overlapping_blocks():
    before = mujoco.get_mju_user_warning()  # dm_control, if imported, has one of its own
    first, second = quiet(), quiet()
    first.__enter__()
    second.__enter__()
    first.__exit__(None, None, None)
    second.__exit__(None, None, None)
    with pytest.warns(UserWarning, match="heard"):
        warnings.warn("heard", stacklevel=1)
    assert mujoco.get_mju_user_warning() is before


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
    if advice.integrator == "Euler" and advice.timestep > 0.001:
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
    assert (advice.integrator, advice.timestep) == (tried[-1].integrator, tried[-1].timestep)


def test_costs_are_measured_along_the_path():
    boxes = "".join(
        f'<body pos="{0.21 * (k % 3)} {0.21 * (k // 3)} 0.4"><freejoint/>'
        '<geom type="box" size=".1 .1 .1"/></body>'
        for k in range(9)
    )
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><worldbody><geom type="plane" size="5 5 1"/>{boxes}</worldbody></mujoco>'
    )
    runs, counts = Runs(model), []
    for state in runs.places("Euler", 0.002, 1.0, 4):
        runs.prepare("Euler", 0.002, state)
        mujoco.mj_forward(runs.model, runs.data)
        counts.append(int(runs.data.ncon))
    assert counts[0] == 0
    assert min(counts[2:]) >= 36  # they have landed


def test_a_slow_quantity_keeps_to_the_budget():
    def slow(_, run):
        time.sleep(0.01)
        return run.qpos[0]

    model, data = started(PENDULUM, [1.0, 0.5])
    began = time.perf_counter()
    advice = mm.advise(model, data, quantity=slow, duration=5.0, budget=1.5)
    assert time.perf_counter() - began < 6.0  # 0.8
    assert "budget is too small" in advice.reason


def test_a_picture_needs_something_measured(tmp_path):
    with pytest.raises(ValueError, match=r"points = \(\): must be measured"):
        mm.Advice("positions", 0.01, 1.0).draw(tmp_path / "advice.png")
    with pytest.raises(ValueError, match="must be in an existing directory"):
        mm.advise(*started(PENDULUM, [1.0]), picture=tmp_path / "missing" / "advice.png")


def test_a_model_at_rest_is_named():
    with pytest.raises(ValueError, match="quantity = 'positions': does not change along the path"):
        mm.advise(*started(PENDULUM))


def test_a_model_that_diverges_at_every_timestep_is_no_recommendation(capsys):
    unstable = OSCILLATOR.replace('stiffness="100"', 'stiffness="-1e9"')
    advice = mm.advise(*started(unstable, [AMPLITUDE]), budget=5)
    assert advice.integrator is None
    assert (
        "no recommendation: the model diverges at every timestep tried" in capsys.readouterr().out
    )


@pytest.mark.parametrize("phase", ["time_in_turns", "find_rest"])
def test_an_interruption_gives_what_is_known(phase, monkeypatch, capsys):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(survey, phase, interrupt)
    advice = mm.advise(*started(PENDULUM, [1.0, 0.5]), budget=10)
    assert len(advice.points) > 20
    assert advice.integrator == "RK4"
    assert "interrupted: this is what is known so far" in capsys.readouterr().out


def test_an_interrupted_reference_is_no_recommendation(monkeypatch, capsys):
    calls = []

    def quantity(model, data):
        calls.append(data.time)
        if len(calls) > 500:
            raise KeyboardInterrupt
        return data.qpos[0]

    advice = mm.advise(*started(PENDULUM, [1.0, 0.5]), quantity=quantity, budget=10)
    assert (advice.points, advice.integrator) == ((), None)
    assert "interrupted before a reference was found" in capsys.readouterr().out


def test_a_picture_is_drawn(tmp_path, oscillator):
    oscillator.draw(tmp_path / "advice.png")
    assert 10_000 < (tmp_path / "advice.png").stat().st_size < 200_000
