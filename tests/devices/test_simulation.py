"""`simulate`: datasets, invalid input, divergence and interruption."""

import json
import pickle
from contextlib import nullcontext
from typing import Any

import mujoco
import numpy as np
import pytest
import xarray as xr
from refusals import refused

import magmotor as mm
from magmotor.device import ENERGY_GREW
from magmotor.mjcf.hooks import without_stopwatch
from magmotor.run import in_mujoco as mujoco_run
from magmotor.run import simulate as running

SHORT: dict[str, Any] = {"method": "mujoco/rk4", "timestep": 0.025, "duration": 1.0}


def test_dataset_has_names_units_and_attributes():
    run = mm.simulate(mm.Top(), **SHORT)
    assert run.sizes == {"time": 41, "space": 3, "component": 4}
    names = {"position", "velocity", "axis", "angular_velocity", "slip_velocity",
             "momentum_map", "energy", "orientation"}  # fmt: skip
    assert set(run.data_vars) == names
    assert all(run[name].attrs.keys() >= {"units", "long_name"} for name in [*names, "time"])
    assert run.momentum_map.dims == ("time",)
    assert run.attrs["method"] == "mujoco/rk4"
    assert run.attrs["timestep"] == 0.025
    assert json.loads(run.attrs["versions"]).keys() >= {"magmotor", "mujoco"}
    np.testing.assert_array_equal(run.time, 0.025 * np.arange(41))


def test_a_file_holds_the_run_and_its_scene(tmp_path):
    scene = mm.Top.experiment(friction=0.2)
    run = mm.simulate(scene, **SHORT)
    run.to_netcdf(tmp_path / "run.nc")
    read = xr.load_dataset(tmp_path / "run.nc")
    assert read.identical(run)
    assert mm.scene_of(read) == scene
    attributes = {name: read.attrs[name] for name in SHORT}
    assert mm.simulate(mm.scene_of(read), **attributes).identical(run)


@pytest.mark.parametrize("method", mm.methods(mm.Top()))
def test_a_record_interval_selects_records_of_the_same_run(method):
    every = mm.simulate(mm.Top(), method=method, timestep=0.025, duration=2)
    third = mm.simulate(mm.Top(), method=method, timestep=0.025, duration=2, record_interval=3)
    assert third.sizes["time"] == 27
    for name in third.data_vars:
        np.testing.assert_allclose(third[name], every[name][::3], rtol=1e-9, atol=1e-15)  # 7e-10


@pytest.mark.parametrize("record_interval", [7, 25_000])
def test_records_cross_chunks(record_interval):
    """Chunks have 20 000 steps, which need not be a multiple of the interval."""
    steps = 52_000
    every, thinned = (
        mm.simulate(mm.Top(), method="mujoco/euler", timestep=0.01, duration=520, record_interval=n)
        for n in (1, record_interval)
    )
    assert every.sizes["time"] == steps + 1
    chosen = every.isel(time=slice(None, None, record_interval))
    for name in ("time", "position", "velocity", "orientation"):
        np.testing.assert_array_equal(thinned[name], chosen[name])


def test_the_stopwatch_runs_again_after_a_run():
    model = mm.build(mm.Top())
    data = mujoco.MjData(model)
    mm.simulate(mm.Top(), **SHORT)
    mujoco.mj_step(model, data)
    assert data.timer[mujoco.mjtTimer.mjTIMER_STEP].duration > 0


@pytest.mark.parametrize("method", mm.methods(mm.Top()))
def test_a_run_continues_another(method):
    whole = mm.simulate(mm.Top(), method=method, timestep=0.0125, duration=4)
    first = mm.simulate(mm.Top(), method=method, timestep=0.0125, duration=2)
    second = mm.simulate(mm.Top(), method=method, timestep=0.0125, duration=2, initial=first)
    for name in second.data_vars:
        scale = float(abs(whole[name]).max())
        gap = abs(second[name][-1] - whole[name][-1]).max()
        assert gap <= 1e-13 * scale  # 9e-15


def test_initial_parts_replace_those_of_the_scene():
    initial = {"position": (0.1, 0.2), "velocity": (0.3, 0.4), "axis": (0, 3, 4.0)}
    for method in mm.methods(mm.Top()):
        run = mm.simulate(mm.Top(spin=1.0), method=method, timestep=0.01, duration=0.01,
                          initial=initial)  # fmt: skip
        np.testing.assert_allclose(run.position[0], [0.1, 0.2, 0.018], rtol=1e-15)  # 0
        np.testing.assert_allclose(run.velocity[0], [0.3, 0.4, 0], rtol=1e-15)  # 0
        np.testing.assert_allclose(run.axis[0], [0, 0.6, 0.8], rtol=1e-15)  # 0
        np.testing.assert_allclose(run.angular_velocity[0], [0, 0, 1], rtol=1e-15)  # 0
        assert np.abs(run.position[1] - run.position[0]).max() < 0.01


def test_the_spin_of_the_scene_is_about_its_axis():
    run = mm.simulate(mm.Top(axis=(1, 1, 0), spin=3.0), **SHORT)
    np.testing.assert_allclose(
        run.angular_velocity[0], 3 * np.array([1, 1, 0]) / np.sqrt(2), rtol=1e-15
    )  # 0
    assert float(run.momentum_map[0]) == pytest.approx(3 * 2.592e-5, rel=1e-15, abs=0)  # 0


@pytest.mark.parametrize(
    ("method", "limit"), [("mujoco/euler", 0.0414), ("mujoco/implicitfast", 0.0414),
                          ("mujoco/rk4", 0.139)],
)  # fmt: skip
def test_the_plane_bears_the_ball_up_to_a_linear_limit(method, limit):
    scene = mm.Top(surface="plane")
    run = mm.simulate(scene, method=method, timestep=0.99 * limit, duration=60)
    assert abs(run.position[:, 2] - scene.ball_radius).max() < 2e-7  # 1.1e-7
    with refused("timestep"):
        mm.simulate(scene, method=method, timestep=1.01 * limit, duration=60)


@pytest.mark.parametrize(
    ("scene", "timestep", "event"),
    [
        (mm.Top.paper(4), 0.25, ""),
        (mm.Top.si(gravity=1e3), 0.025, ""),
        (mm.Top.si(), 0.001, "ball lifted"),
    ],
    ids=["step", "coupling", "lift"],
)
@pytest.mark.parametrize("method", ["mujoco/euler", "mujoco/rk4"])
def test_a_stopped_run_raises_with_its_records(scene, timestep, event, method):
    numerics = {"method": method, "timestep": timestep, "duration": 60}
    with pytest.raises(mm.SimulationStopped) as caught:
        mm.simulate(scene, **numerics, allow_unstable=True)
    error = caught.value
    assert type(error) is (mm.PhysicalEvent if event else mm.SimulationDiverged)
    assert getattr(error, "event", "") == event
    assert bool(event) == (error.reason != ENERGY_GREW)
    assert str(pickle.loads(pickle.dumps(error))) == str(error)
    assert (error.method, error.timestep) == (method, timestep)
    kept = error.dataset
    assert error.time == pytest.approx(
        float(kept.time[-1]) + timestep, rel=1e-15, abs=0
    )  # 0, or rounding
    assert all(np.isfinite(kept[name]).all() for name in kept.data_vars)
    assert mujoco.get_mjcb_control() is None
    same = pickle.loads(pickle.dumps(error))
    assert same.dataset.identical(kept)


def test_a_value_that_is_not_finite_is_never_returned():
    """With automatic resets, MuJoCo would silently restart from the initial state."""
    scene = mm.Top.si(gravity=1e3, ring_height=0.0365, ring_radius=0.05, position=(0.05, 0.0))
    with pytest.raises(mm.SimulationDiverged) as caught:
        mm.simulate(
            scene,
            method="mujoco/rk4",
            timestep=5.0,
            duration=5000,
            record_interval=100,
            allow_unstable=True,
        )
    kept = caught.value.dataset
    assert caught.value.reason != ENERGY_GREW
    assert all(np.isfinite(kept[name]).all() for name in kept.data_vars)
    assert kept.sizes["time"] < 11


def test_the_step_in_which_mujoco_warns_is_recorded():
    """It is not reset, and not lost: friction has slowed the ball and made it roll."""
    scene, h = mm.Top(velocity=(3e9, 0.0)), 1e-3
    with pytest.raises(mm.SimulationDiverged) as caught:
        mm.simulate(scene, method="mujoco/euler", timestep=h, duration=3 * h)
    kept = caught.value.dataset
    assert caught.value.reason != ENERGY_GREW
    assert kept.time.values.tolist() == [0, h]
    drag = h * scene.friction * 3e9
    slowed = 3e9 - drag / scene.ball_mass
    turned = drag * scene.ball_radius / scene.inertia[1]
    assert kept.velocity.values[1, 0] == pytest.approx(slowed, rel=1e-13)  # 6e-15
    spin = np.linalg.norm(kept.angular_velocity.values[1])
    assert spin == pytest.approx(turned, rel=3e-10)  # 2e-11: the magnets' torque


def test_ctrl_c_keeps_the_records(monkeypatch):
    chunks = mujoco_run.run

    def interrupted(*arguments):
        yield next(chunks(*arguments))
        raise KeyboardInterrupt

    changes: dict[str, Any] = {"duration": 1000.0}
    monkeypatch.setattr(mujoco_run, "run", interrupted)
    with pytest.raises(mm.SimulationInterrupted) as caught:
        mm.simulate(mm.Top(), **(SHORT | changes))
    assert caught.value.dataset.sizes["time"] == 20_001
    assert isinstance(caught.value, KeyboardInterrupt)


def test_a_run_ends_with_the_last_record_that_fits():
    run = mm.simulate(mm.Top(), method="variational/verlet", timestep=0.007, duration=0.01)
    assert run.time.values.tolist() == [0, 0.007]


@pytest.mark.parametrize("timestep", [1e-12, 1e-30])
def test_records_beyond_the_memory_are_refused(timestep, monkeypatch):
    pages = {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": 2**22}
    monkeypatch.setattr("os.sysconf", pages.__getitem__)
    with refused("record_interval"):
        mm.simulate(mm.Top(), method="variational/verlet", timestep=timestep, duration=60.0)


def test_records_up_to_the_memory_are_not_refused(monkeypatch):
    row = 8 * (1 + 3 + 3 + 3 + 3 + 4)
    for pages, fits in ((1000, True), (999, False)):
        monkeypatch.setattr(running, "physical_memory", lambda size=row * pages: size)
        arguments = {"method": "variational/verlet", "timestep": 0.01, "duration": 10.0}
        with nullcontext() if fits else refused("record_interval") as told:
            mm.simulate(mm.Top(), **arguments)
        assert told is None or told.value.allowed.startswith("must be at least 2 ")


def test_the_stopwatch_runs_again_after_runs_that_overlap():
    model = mm.build(mm.Top())
    data = mujoco.MjData(model)
    first, second = without_stopwatch(), without_stopwatch()
    first.__enter__()
    second.__enter__()
    first.__exit__(None, None, None)
    mujoco.mj_step(model, data)
    assert data.timer[mujoco.mjtTimer.mjTIMER_STEP].duration == 0
    second.__exit__(None, None, None)
    mujoco.mj_step(model, data)
    assert data.timer[mujoco.mjtTimer.mjTIMER_STEP].duration > 0
