"""`mm.advise` finds in the scenes what their charts found.

The charts ran other code. Here the paths are those that `advise` measures; errors are defined as in
the charts, and the top's reference is MuJoCo's, not DOP853 with the paper's equations.
"""

import re
from concurrent.futures import ThreadPoolExecutor
from functools import cache

import mujoco
import numpy as np
import pytest
from advised_models import Clock

import magmotor as mm
from benchmarks.accuracy import paths, top
from benchmarks.advice import topic
from magmotor.advice.measure import Measurement
from magmotor.advice.measured_quantities import read_quantity
from magmotor.advice.paths import STATE, Runs
from magmotor.run import chart_data
from magmotor.sweep import Sweep, run

METHODS = {
    "Euler": "mujoco/euler",
    "implicitfast": "mujoco/implicitfast",
    "RK4": "mujoco/rk4",
}
REPLICAS = 64
"""As many as those of MuJoCo's methods in the charts."""


def charted(scene, quantity, integrator, timestep):
    """Return the error that was charted, as measured."""
    key = type(scene).__name__, "planar", quantity, METHODS[integrator]
    (error,) = (
        point["error"]
        for point in chart_data.load()["points"]
        if tuple(point[name] for name in ("scene", "surface", "quantity", "method")) == key
        and point["timestep"] == pytest.approx(timestep, rel=1e-9)
    )
    return error


def started(scene, timestep):
    """Return the model of a scene and its initial state."""
    model = mm.build(scene)
    model.opt.timestep = timestep
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    return model, data


def along_the_top(of):
    """Return a function of integrator and steps per second that gives a quantity at each second."""
    scene = mm.Top.paper(4)
    runs = Runs(*started(scene, 1 / 64))
    quantity = read_quantity(runs.model, runs.workspace(), of)
    measured = Measurement(runs, quantity, top.DURATIONS["top"])

    def path(integrator, number):
        with mm.magnetism():
            samples = measured.samples(integrator, 64 / number)
        assert samples is not None
        return samples.values[:: round(1 / measured.tick / samples.ticks)]

    return path


def momentum_map(model, data):
    """Return J = I_3 omega . xi_3."""
    ball = model.body("ball").id
    velocity = np.empty(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, ball, velocity, 1)
    return mm.Top.paper(4).inertia[2] * velocity[2]


CASES = [("Euler", 64), ("Euler", 16), ("implicitfast", 32), ("RK4", 64), ("RK4", 16), ("RK4", 8)]


def test_positions_of_the_top_err_as_charted():
    scene, path = mm.Top.paper(4), along_the_top("body ball")
    truth = path("RK4", 512)[:, :2]
    reach = np.linalg.norm(truth, axis=1).max()
    for integrator, number in CASES:
        wrong = path(integrator, number)[top.COMPARED_AT, :2] - truth[top.COMPARED_AT]
        error = np.linalg.norm(wrong) / reach
        expected = charted(scene, "position", integrator, 1 / number)
        assert error == pytest.approx(expected, rel=0, abs=1e-10)  # 1e-11


def test_the_momentum_map_of_the_top_errs_as_charted():
    scene, path = mm.Top.paper(4), along_the_top(momentum_map)
    truth = path("RK4", 512)
    for integrator, number in CASES:
        error = np.abs(path(integrator, number) - truth).max() / np.abs(truth).max()
        expected = charted(scene, "momentum_map", integrator, 1 / number)
        assert error == pytest.approx(expected, rel=0, abs=1e-10)  # 1e-11


NOISY = {
    "motor": (mm.Motor(), "body ball", "position", (64, 256)),
    "disk": (mm.Disk(), "body disk", "x", (32, 128)),
}
"""A scene, its quantity, the variable that is charted, and timesteps over the reference's."""


@pytest.mark.slow
@pytest.mark.parametrize("name", NOISY)
def test_paths_of_noisy_scenes_err_as_charted(name):
    """On the same noise, from the same states, replica by replica."""
    scene, of, variable, factors = NOISY[name]
    unit = paths.DURATIONS[name] / (paths.INTERVAL * paths.RECORDS)
    model, data = started(scene, unit)
    runs = Runs(model, data)
    quantity = read_quantity(runs.model, runs.workspace(), of)
    starts = [start_of(scene, model, data, replica) for replica in range(REPLICAS)]
    truth = (
        mm.simulate(
            scene,
            method="variational/baoab",
            timestep=unit,
            seed=1,
            replicas=REPLICAS,
            duration=paths.STRONG * paths.INTERVAL * unit,
            record_interval=paths.INTERVAL,
            initial=gibbs(scene) if isinstance(scene, mm.Disk) else None,
        )[variable]
        .transpose("replica", "time", ...)
        .values.reshape(REPLICAS, paths.STRONG + 1, -1)
    )
    truth = truth[..., :2]

    def positions(integrator, factor):
        every, timestep, found = paths.INTERVAL // factor, factor * unit, []
        for start in starts:
            _, states = runs.path(integrator, timestep, every, paths.STRONG, start=start)
            found.append(quantity.along(runs.model, runs.workspace(), states))
        return np.array(found)[..., : truth.shape[-1]]

    with mm.magnetism():
        for integrator in METHODS:
            for factor in factors:
                error = paths.strong_error(positions(integrator, factor), truth)
                expected = charted(scene, "path", integrator, factor * unit)
                assert error == pytest.approx(expected, rel=2e-5)  # 2e-6


def start_of(scene, model, data, replica):
    """Return the state, with the Brownian path, from which a replica starts in the charts."""
    data.userdata[:2] = 1, replica
    if isinstance(scene, mm.Disk):
        first = {name: values[replica] for name, values in gibbs(scene).items()}
        data.qpos[:], data.qvel[:] = (first["x"], first["theta"]), (first["v"], first["omega"])
    start = np.empty(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, start, STATE)
    return start


@cache
def gibbs(scene):
    return mm.theory.gibbs(scene, REPLICAS, seed=1)


RECOMMENDED = {
    "top": (mm.Top.paper(4), "position", 0.05, 1.2),  # 0.08, 0.78
    "motor": (mm.Motor(), "path", 0.05, 0.15),  # 0.077, 0.10
    "disk": (mm.Disk(), "path", 0.2, 0.5),  # 0.31
}
"""A scene, its charted quantity, and bounds of the timesteps, measured over charted."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "method", "step"),
    [("top", "mujoco/rk4", 2e-4), ("motor", "mujoco/euler", 3e-4), ("disk", "mujoco/rk4", 2e-4)],
)
def test_recommended_timesteps_are_near_those_of_the_charts(name, method, step, monkeypatch):
    """For 1 %. What is measured is stricter: it is the largest of all elements on a path.

    The charts have the rms error of one position at the end; what they call the same error is
    reached at a longer timestep.
    """
    scene, quantity, shortest, longest = RECOMMENDED[name]
    Clock(monkeypatch, step)  # so that the budget is the same work on any machine
    own = mm.recommend(scene, method=method, error=0.01, measure=True)
    chart = mm.recommend(scene, method=method, error=0.01, quantity=quantity)
    assert shortest < own.timestep / chart.timestep < longest


def test_what_a_choice_rests_on_is_printed(capsys, monkeypatch, tmp_path):
    """By `simulate` and by a sweep that runs: the charts, or a measurement if that was asked."""
    data = chart_data.load()
    charts = f"(charts measured on {data['machine']} by MuJoCo {data['versions']['mujoco']})\n"
    mm.simulate(mm.Disk(), duration=1.0)
    assert charts in capsys.readouterr().err
    mm.simulate(mm.Disk(), method="mujoco/euler", duration=1.0)
    assert charts in capsys.readouterr().err
    sweep = Sweep(scene=mm.Disk(), vary={"x": (0, 1)}, measure=["displacement"], duration=1.0)
    run(sweep, tmp_path, executor=ThreadPoolExecutor(1))
    assert charts in capsys.readouterr().err
    Clock(monkeypatch, step=3e-4)  # so that the budget is the same work on any machine
    own = mm.recommend(mm.Disk(noise=0.0, v=1.0), measure=True)
    assert re.search(r"\(measured on this machine; worst .*: joint '(x|theta)'\)$", str(own))


def test_the_table_of_public_models_shows_what_is_partial_and_where_runs_fail():
    record = {
        "dof": 2, "horizon": 0.25, "duration": 1.0, "reason": "",
        "own": {"integrator": "Euler", "timestep": 0.002, "error": None}, "gain": 0.5,
        "advice": {"integrator": "RK4", "timestep": 0.001, "promised": 0.005, "settings": {},
                   "fails_from": 0.016, "limit": None},
    }  # fmt: skip
    whole = record | {"horizon": 1.0, "advice": None, "reason": "too little time"}
    rows = topic.tables({"advice/acrobot": record, "advice/ant": whole})["advice"].splitlines()
    part, none = ([cell.strip() for cell in row.strip("|").split("|")] for row in rows[-2:])
    assert part == ["acrobot", "2", "Euler, 2 ms", "diverges", "RK4, 1 ms", "0.5 %", "0.25 s",
                    "2 times slower", "16 ms", ""]  # fmt: skip
    assert none == ["ant", "2", "Euler, 2 ms", "diverges", "too little time", *[""] * 5]
