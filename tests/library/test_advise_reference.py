"""The reference of `mm.advise`, costs in turns, and the budget."""

import math
from itertools import product

import mujoco
import numpy as np
import pytest
from advised_models import AMPLITUDE, OSCILLATOR, PENDULUM, Clock, started

import magmotor as mm
from magmotor.advice import survey
from magmotor.advice.measure import Measurement
from magmotor.advice.measured_quantities import Quantity, read_quantity
from magmotor.advice.path_errors import Samples, reference
from magmotor.advice.paths import INTEGRATORS, Runs
from magmotor.advice.points import Point, time_in_turns


@pytest.fixture(autouse=True)
def clock(monkeypatch):
    """Budgets count steps instead of time, so that no load of the machine changes an answer."""
    return Clock(monkeypatch, step=2e-5)


WHOLE = Quantity("a number", lambda _model, _data: 0.0).distances


def samples(*values):
    return Samples(1, np.array(values, float)[:, np.newaxis])


def test_paths_that_agree_by_accident_are_not_trusted():
    coarse, middle, fine = samples(0, 3.0), samples(0, 1.0), samples(0, 1.001)
    found = reference({"RK4": [(0.04, coarse), (0.02, middle), (0.01, fine)]}, WHOLE)
    assert found.doubt[-1] >= 1.0


def test_two_paths_alone_are_trusted_half_as_much():
    found = reference({"RK4": [(0.02, samples(0, 1.0)), (0.01, samples(0, 1.1))]}, WHOLE)
    assert found.doubt[-1] == pytest.approx(0.2)


def test_integrators_must_agree():
    def chain(end):
        return [(h, samples(0, 1.0, end + 1e-4 * h)) for h in (0.04, 0.02, 0.01)]

    alone = reference({"RK4": chain(2.0)}, WHOLE)
    both = reference({"RK4": chain(2.0), "implicitfast": chain(2.5)}, WHOLE)
    assert alone.doubt[-1] < 1e-5
    assert both.doubt[-1] == pytest.approx(0.5, rel=1e-3)
    assert both.doubt[1] < 1e-5


@pytest.mark.parametrize("order", [1, 2, 4])
def test_extrapolation_gains_an_order(order):
    times = np.linspace(0.0, 1.0, 50)
    exact = np.sin(3 * times)

    def found(finest):
        steps = finest * np.array([8.0, 4.0, 2.0, 1.0])
        chain = [
            (h, samples(*(exact + h**order * times + h ** (order + 1) * np.cos(times) * times)))
            for h in steps
        ]
        return reference({"RK4": chain}, WHOLE)

    coarse, fine = found(0.01), found(0.005)
    errors = [np.abs(each.path.values[:, 0] - exact).max() for each in (coarse, fine)]
    assert coarse.name == f"RK4 extrapolated from 0.01 s at order {order}"
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order + 1, abs=1e-3)  # 8e-5
    assert errors[0] < coarse.doubt[-1]


def test_short_errors_count():
    """Only the finest two paths have records where they differ; the coarsest one has none there."""
    fine, middle = np.zeros((17, 1)), np.zeros((9, 1))
    fine[2], middle[1] = 1.0, 0.5
    chain = [(4.0, Samples(4, fine[::4])), (2.0, Samples(2, middle)), (1.0, Samples(1, fine))]
    found = reference({"RK4": chain}, WHOLE)
    assert (found.path.values == fine).all()
    assert found.doubt[:, 0].tolist() == [0.0, *16 * [0.5]]


STIFF = PENDULUM.replace(
    "</worldbody>",
    '<body pos="1 0 0"><joint axis="0 1 0" damping="1e7"/><geom size=".1"/></body></worldbody>',
)


def test_implicitfast_is_the_reference_where_rk4_fails():
    model, data = started(STIFF, [1.0, 0.5], [0.0, 0.0, 1.0])
    advice = mm.advise(model, data, quantity="joint two", budget=4)
    assert advice.reference.startswith("implicitfast ")
    assert {p.diverged is None for p in advice.points if p.method == "RK4"} == {False}
    undamped = mm.advise(*started(PENDULUM, [1.0, 0.5]), quantity="joint two", budget=4)
    assert undamped.reference.startswith("RK4 ")
    errors = [{(p.method, p.timestep): p.error for p in each.points} for each in (advice, undamped)]
    key = "Euler", 0.005  # the third joint hardly moves, and the others are the same
    assert errors[0][key] == pytest.approx(errors[1][key], abs=2 * advice.doubt)
    assert advice.doubt < 0.01  # 0.0004


def test_euler_is_the_reference_where_all_else_fails(monkeypatch):
    measured = Measurement.samples

    def samples(self, integrator, factor):
        found = measured(self, integrator, factor)
        return found if integrator == "Euler" else None

    monkeypatch.setattr(Measurement, "samples", samples)
    advice = mm.advise(*started(OSCILLATOR, [AMPLITUDE]), quantity="joint slide", budget=4)
    assert advice.reference.startswith("Euler ")
    monkeypatch.undo()
    better = mm.advise(*started(OSCILLATOR, [AMPLITUDE]), quantity="joint slide", budget=4)
    errors = [
        {p.timestep: p.error for p in each.points if p.method == "Euler"}
        for each in (advice, better)
    ]
    assert errors[0][0.004] == pytest.approx(errors[1][0.004], abs=2 * advice.doubt)
    assert advice.doubt < 3e-4  # 1e-5


class Machine(Runs):
    """Stands for `Runs` on a machine that is ten times slower from one call to another."""

    def __init__(self, *, slow):
        self.calls, self._slow = [], slow

    def places(self, integrator, timestep, duration, count):
        return [np.array([k]) for k in range(count)]

    def timed(self, integrator, timestep, steps, start=None):
        self.calls.append((integrator, timestep, start))
        cost = {"Euler": 1e-5, "RK4": 4e-5}[integrator]
        return cost * (10 if len(self.calls) in self._slow else 1)


def test_points_take_turns_so_that_disturbances_spare_costs():
    points = [Point(name, h, 1.0, 0.01) for name, h in product(("Euler", "RK4"), (0.01, 0.02))]
    machine = Machine(slow=range(40, 81))  # the last turns
    assert time_in_turns(machine, points, 1.0, math.inf)
    turn = [(p.method, p.timestep, k) for p in points for k in range(4)]
    assert machine.calls == 5 * turn
    assert [p.seconds for p in points] == pytest.approx([1e-3, 5e-4, 4e-3, 2e-3], rel=1e-12)


def test_costs_that_are_not_measured_in_turns_are_noted(monkeypatch):
    alone = [Point("Euler", 0.01, 1.0, 0.01)]
    assert not time_in_turns(Machine(slow=()), alone, 1.0, until=0.0)
    assert alone[0].seconds == 1.0
    monkeypatch.setattr(survey, "time_in_turns", lambda *_: False)
    advice = mm.advise(*started(PENDULUM, [1.0]), budget=4)
    assert "the budget was too small to measure the costs in turns" in str(advice)


@pytest.mark.parametrize("step", [4e-4, 5e-3])
def test_ten_degrees_of_freedom_are_advised_within_the_budget(step, monkeypatch):
    links = '<body pos="0 0 -.1"><joint axis="0 1 0"/><geom size=".03" pos="0 0 -.1"/>' * 10
    xml = (
        f'<mujoco><option timestep="0.01"/><worldbody>{links}{"</body>" * 10}</worldbody></mujoco>'
    )
    model, data = started(xml, [0.1] * 10)
    clock = Clock(monkeypatch, step)  # far slower than such a model
    advice = mm.advise(model, data, error=0.05, budget=60)
    assert advice.method
    assert clock.now < 66  # 48, 60
    assert ({*advice.limits} == {*INTEGRATORS}) == (step < 1e-3)
    assert ("too small for all limits" in str(advice)) == (step > 1e-3)


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


def test_a_slow_quantity_keeps_to_the_budget(monkeypatch):
    clock = Clock(monkeypatch, step=1e-6)

    def slow(_, run):
        clock.now += 0.01
        return run.qpos[0]

    model, data = started(PENDULUM, [1.0, 0.5])
    advice = mm.advise(model, data, quantity=slow, duration=5.0, budget=1.5)
    assert clock.now < 1.5  # 0.61
    assert "budget is too small" in advice.reason


def test_the_scale_of_energy_is_the_largest_kinetic_energy_of_the_finest_path():
    model, data = started(OSCILLATOR)
    model.opt.timestep, data.qvel[0] = 0.15, 1.0  # omega h = 1.5
    runs = Runs(model, data)
    measured = Measurement(runs, read_quantity(runs.model, runs.workspace(), "energy"), 10.0)
    scales = []
    for integrator, factor in (("Euler", 1.0), ("RK4", 1 / 64), ("RK4", 1 / 2)):
        assert measured.samples(integrator, factor) is not None
        scales.append(measured.quantity.scale)
    assert scales == pytest.approx([scales[0], 0.5, 0.5], rel=1e-5)
    assert scales[0] > 0.6  # 1.1 J of 0.5 J


def test_before_a_horizon_the_scale_of_energy_is_that_of_the_path_until_then():
    """The oscillator starts at rest, and has the kinetic energy k A^2 sin^2(omega t)/2."""
    model, data = started(OSCILLATOR, [AMPLITUDE])
    runs = Runs(model, data)
    measured = Measurement(runs, read_quantity(runs.model, runs.workspace(), "energy"), 2.0)
    assert measured.samples("RK4", 1 / 2) is not None
    for end in (0.01, 0.05, 2.0):
        expected = 0.5 * 100 * AMPLITUDE**2 * math.sin(min(10 * end, math.pi / 2)) ** 2
        found = measured.within(round(end / measured.tick)).scale
        assert found == pytest.approx(expected, rel=0.002)  # 4e-4


def test_the_error_of_energy_is_relative_to_a_kinetic_energy_that_is_constant():
    """A free body turns about an axis of its inertia: total and kinetic energy do not change."""
    model, data = started("""
    <mujoco>
      <option timestep="0.01" gravity="0 0 0"/>
      <worldbody><body><freejoint/><geom type="box" size=".1 .2 .3"/></body></worldbody>
    </mujoco>""")
    data.qvel[5] = 1.0
    advice = mm.advise(model, data, quantity="energy", budget=3)
    assert advice.method
    assert advice.promised < 1e-9
