"""`mm.advise` where paths have no error: chaos, noise, and temperature."""

import math
import os

import mujoco
import numpy as np
import pytest
from advised_models import OSCILLATOR, PENDULUM, TRAP, Clock, started

import magmotor as mm
from magmotor.advice.advice import Advice
from magmotor.advice.paths import Runs
from magmotor.advice.points import Point, reaching
from magmotor.advice.statistics_errors import (
    Ensemble,
    Statistic,
    certain,
    errors,
    unproven,
)
from magmotor.advice.thermal import Thermal

BATH = OSCILLATOR.replace('stiffness="100"', 'stiffness="20" damping="1"')
BATH = BATH.replace('"0.004"', '"0.05"')


def test_chaos_limits_the_horizon_and_gives_statistics(capsys, monkeypatch):
    Clock(monkeypatch, step=2e-5)
    coarse = PENDULUM.replace('"0.005"', '"0.02"')
    advice = mm.advise(*started(coarse, [2.5, 1.0]), duration=20.0, budget=15)
    print(advice)
    assert advice.growth is not None
    assert advice.growth > 1e3
    assert 2.0 < advice.horizon < 20.0  # 5.5 s
    rk4 = {s.name: s for s in advice.statistics if (s.method, s.timestep) == ("RK4", 0.01)}
    euler = {s.name: s for s in advice.statistics if (s.method, s.timestep) == ("Euler", 0.01)}
    assert {*rk4} == {"mean", "spread", "kinetic energy", "spectrum"}
    for name, statistic in rk4.items():
        assert statistic.error < 4 * statistic.doubt, name
    assert euler["kinetic energy"].error > 10 * euler["kinetic energy"].doubt  # it loses energy
    assert "chaotic" in capsys.readouterr().out


def test_runs_of_a_model_with_noise_follow_one_brownian_path(monkeypatch):
    Clock(monkeypatch, step=5e-5)
    with mm.magnetism():
        advice = mm.advise(*started(TRAP), quantity="joint slide", duration=5.0, budget=15)
        assert advice.method
        own, truth = (noisy_loop(advice.method, advice.timestep, k) for k in (0, 3))
    own = own[: len(truth)]
    found = np.abs(own - truth[: len(own)]).max() / np.ptp(truth)
    assert 0.3 * advice.promised < found < advice.promised
    for name in ("Euler", "implicitfast", "discrete"):
        assert advice.orders[name].value == pytest.approx(1, abs=0.3)  # 0.1
    by_key = {(s.method, s.timestep, s.name): s for s in advice.statistics}
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
    model, data = started(BATH)
    advice = mm.advise(model, data, quantity="joint slide", kT=1.0, duration=400.0, error=0.02)
    kinetic = {(s.method, s.timestep): s for s in advice.statistics if s.name == "kinetic energy"}
    for timestep in (0.2, 0.1):
        # Leimkuhler and Matthews, 2013: BAOAB has kT (1 - (omega h)^2/4), "middle" is exact.
        baoab, middle = (kinetic[name, timestep] for name in ("baoab", "middle"))
        expected = 20 * (timestep**2 - 0.0125**2) / 4
        assert abs(baoab.error - expected) < 4 * baoab.doubt
        assert expected > 8 * baoab.doubt
        assert middle.error < 4 * middle.doubt
    assert advice.promised <= 0.02
    assert advice.timestep < 0.2
    best = advice.for_statistics
    assert best == Point(advice.method, advice.timestep, advice.seconds, advice.promised)
    assert f"{advice.method} at a timestep of {advice.timestep:g} s is the" in str(advice)
    # The reference errs by 20 (h/4)^2/4, and its halving changes it by three times as much.
    doubt = kinetic["middle", 0.05].unproven
    assert 3 * 20 * 0.0125**2 / 4 < doubt < 0.02  # 0.0023, 0.0067
    assert "the reference of the statistics is uncertain by 0." in str(advice)


def test_statistics_count_with_two_standard_errors():
    rows = [
        Statistic("Euler", 0.1, "mean", 0.01, 0.02, 1.0),
        Statistic("Euler", 0.1, "spread", 0.03, 0.0, 1.0),
        Statistic("RK4", 0.1, "mean", 0.0, 0.001, 0.5),
        Statistic("RK4", 0.2, "mean", math.inf, math.nan, math.nan),
    ]
    euler, rk4 = Point("Euler", 0.1, 1.0, 0.05), Point("RK4", 0.1, 0.5, 0.002)
    assert certain(rows) == [euler, rk4]
    assert reaching(certain(rows), 0.05) == [rk4, euler]  # the cheapest first
    assert reaching(certain(rows), 0.04) == [rk4]


def ensemble(kinetic):
    """Return eight replicas with a mean kinetic energy, all with the same noise."""
    noise = np.array([1.0, -1.0] * 4)[:, np.newaxis]
    energies = kinetic + 1e-3 * noise
    path = np.sin(np.arange(64.0))[:, np.newaxis]
    return Ensemble([path] * 8, [np.repeat(energy, 64) for energy in energies], 1.0)


def test_errors_of_statistics_are_printed_to_the_digits_that_they_have():
    errors = [(0.0123, 0.004), (0.5, 0.123), (5.4e4, 5.3e4), (math.inf, math.nan)]
    rows = (Statistic("Euler", 0.1, f"{k}", *pair, 1.0) for k, pair in enumerate(errors))
    advice = Advice(quantity="positions", error=0.01, duration=1.0, statistics=(*rows,))
    for printed in ("1.2 ± 0.4 %", "50 ± 12 %", "5.4e+06 ± 5e+06 %", "diverged"):
        assert printed in str(advice)


@pytest.mark.parametrize(("order", "factor"), [(0.5, 0.414), (1, 1.0), (2, 6.0)])
def test_a_reference_of_statistics_proves_itself_by_halving(order, factor):
    truth, half, whole = (ensemble(1 + 0.1 * (h / 4) ** order) for h in (1, 2, 4))
    doubt = unproven(truth, half, whole)["kinetic energy"]
    error = 0.1 / 4**order
    assert doubt == pytest.approx(factor * error, rel=0.06)  # 0.03, since the scale is 1.025


def test_a_reference_of_statistics_that_is_right_by_accident_is_not_trusted():
    same = ensemble(1.0)
    assert unproven(same, same, ensemble(1.2))["kinetic energy"] == pytest.approx(0.1, rel=1e-9)
    assert unproven(same, ensemble(1.1), None)["kinetic energy"] == pytest.approx(0.2, rel=0.01)
    assert unproven(same, None, None)["kinetic energy"] == math.inf


def test_the_doubt_of_the_reference_counts():
    known = {("RK4", 0.25): 1.0, ("RK4", 0.5): 1.1, ("RK4", 1.0): 1.4, ("Euler", 1.0): 1.001}
    asked = []

    def run(*key):
        asked.append(key)
        return ensemble(known[key]) if key in known else None

    rows = [*errors(run, 0.1, ["implicitfast", "RK4"], [("RK4", 1.0), ("Euler", 1.0)])]
    assert asked == [("implicitfast", 0.25), *known]  # nothing twice
    found = {(row.method, row.timestep): row for row in rows if row.name == "kinetic energy"}
    assert [*found] == [("RK4", 0.05), ("RK4", 0.1), ("Euler", 0.1)]
    euler = found["Euler", 0.1]
    assert euler.error == pytest.approx(0.001, rel=1e-9)
    assert euler.unproven == pytest.approx(0.3 / 2 / 1.1, rel=0.01)
    assert reaching(certain(rows), 0.13) == []
    assert reaching(certain(rows), 0.15)[0].error == pytest.approx(euler.bound)
    assert [*errors(lambda *_: None, 0.1, ["RK4"], [])] == []


def test_an_interruption_at_a_temperature_leaves_one_verdict(monkeypatch):
    run, calls = Thermal._ensemble, []

    def interrupted(*key):
        calls.append(key)
        if len(calls) > 20:
            raise KeyboardInterrupt
        return run(*key)

    monkeypatch.setattr(Thermal, "_ensemble", interrupted)
    model, data = started(BATH)
    advice = mm.advise(model, data, quantity="joint slide", kT=1.0, duration=200.0, error=0.1)
    assert all(row.seconds > 0 for row in advice.statistics)
    best = advice.for_statistics
    assert best == Point(advice.method, advice.timestep, advice.seconds, advice.promised)
    text = str(advice)
    assert "interrupted: this is what is known so far" in text
    assert f"advice: {advice.method} at" in text
    assert "no recommendation" not in text
    calls += [()] * 20
    nothing = mm.advise(model, data, quantity="joint slide", kT=1.0, duration=200.0)
    assert (nothing.method, nothing.statistics) == ("", ())
    assert "no recommendation: no reference was found in this time" in str(nothing)


@pytest.mark.parametrize(("budget", "sentence"), [
    (1.0, "the budget is too small: the reference takes about"),
    (10.0, "the budget is too small: the reference takes about"),
    (40.0, "the budget was too small for more ensembles"), (300.0, "qualifies"),
])  # fmt: skip
def test_a_temperature_keeps_to_the_budget(budget, sentence, monkeypatch):
    clock, sample = Clock(monkeypatch, step=0.0), mm.Langevin.sample
    steps, step = Thermal._steps, 2e-4

    def stepped(self, splitting, factor, count):
        steps(self, splitting, factor, 1)
        clock.now += step * count
        return step * count

    def sampled(self, duration, **options):
        # slower than a single replica lets expect
        clock.now += 3 * 4 * step * duration / self.timestep
        return sample(self, duration, **options)

    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    monkeypatch.setattr(Thermal, "_steps", stepped)
    monkeypatch.setattr(mm.Langevin, "sample", sampled)
    model, data = started(BATH)
    advice = mm.advise(
        model, data, quantity="joint slide", kT=1.0, duration=100.0, error=0.1, budget=budget
    )
    assert clock.now < budget  # 0.11, 0.95, 39.4, 128
    assert sentence in str(advice)
    assert (len(advice.statistics) == 4 * 24) == (budget == 300.0)


def test_a_slow_quantity_at_a_temperature_keeps_to_the_budget(monkeypatch):
    clock = Clock(monkeypatch, step=0.0)

    def slow(_, run):
        clock.now += 0.01
        return run.qpos[0]

    advice = mm.advise(*started(BATH), quantity=slow, kT=1.0, duration=100.0, budget=5)
    assert clock.now < 5
    assert "the budget is too small: the reference takes about" in advice.reason


def test_a_splitting_that_diverges_is_no_reference():
    unstable = BATH.replace('stiffness="20"', 'stiffness="1e5"')
    advice = mm.advise(*started(unstable), quantity="joint slide", kT=1.0, duration=50.0)
    assert not advice.method
    assert "baoab diverges even at a quarter of the model's timestep" in advice.reason


def test_costs_of_ensembles_are_measured_in_turns(monkeypatch):
    def timed(_, integrator, timestep, steps, start):
        return 1e-6 * (1 + len(integrator))

    monkeypatch.setattr(Runs, "timed", timed)
    with mm.magnetism():
        advice = mm.advise(*started(TRAP), quantity="joint slide", duration=5.0, budget=10)
    rows = [row for row in advice.statistics if math.isfinite(row.error)]
    assert len(rows) > 40  # 80
    points = {(p.method, p.timestep) for p in advice.points}
    assert any((row.method, row.timestep) not in points for row in rows)
    for row in rows:
        expected = 1e-6 * (1 + len(row.method)) / row.timestep
        assert row.seconds == pytest.approx(expected, rel=1e-9)
