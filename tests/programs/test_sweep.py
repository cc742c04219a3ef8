"""Sweeps: their cases, their results, and the input that they reject."""

import json
import tracemalloc
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
import xarray as xr
from refusals import refused
from scipy.stats import qmc
from sweep_driver import contents

import magmotor as mm
from magmotor.common import environment as threads
from magmotor.common.integrity import canonical
from magmotor.device import provenance
from magmotor.sweep import Samples, Sweep
from magmotor.sweep.axes import full_name, numeric_fields
from magmotor.sweep.case import case_of
from magmotor.sweep.definition import sweep_from

DISK: dict[str, Any] = {
    "scene": mm.Disk(),
    "method": "variational/baoab",
    "timestep": 0.05,
    "duration": 5.0,
    "measure": ["displacement", "temperature"],
}
NOISES = (1.0, 2.0, 4.0)


@pytest.fixture
def here():
    """Return an executor within this process, which computes the same as worker processes."""
    with ThreadPoolExecutor(1) as executor:
        yield executor


def test_the_cases_are_all_combinations_with_seeds_of_their_own():
    sweep = Sweep(**DISK, vary={"noise": NOISES, ("x", "v"): (0.0, 0.5)}, seeds=range(5, 9))
    assert (len(sweep), sweep.shape) == (24, (3, 2, 4))
    specs = [case.spec for case in sweep]
    fields = [spec["scene_fields"] for spec in specs]
    assert [(f["noise"], f["x"], f["v"]) for f in fields] == [
        (n, x, x) for n in NOISES for x in (0.0, 0.5) for _ in range(4)
    ]
    for k, root in enumerate(range(5, 9)):
        children = np.random.SeedSequence(root).spawn(6)
        expected = [int(child.generate_state(1, np.uint64)[0]) >> 11 for child in children]
        assert [spec["seed"] for spec in specs[k::4]] == expected
    assert len({spec["seed"] for spec in specs}) == 24
    assert sweep.label(4) == "noise = 1, x = 0.5, v = 0.5, seed = 5"


def test_a_top_has_no_noise_and_so_no_seeds():
    top = Sweep(scene=mm.Top(), vary={"tilt": (0, 0.1)}, seeds=8, measure=["max_spin"], duration=1)
    assert top.shape == (2, 1)


def test_numpy_numbers_are_accepted(tmp_path, here):
    numbers = {"duration": np.float32(5), "timestep": np.float64(0.05), "replicas": np.int64(2)}
    more = {
        "seeds": np.arange(2),
        "record_interval": np.int8(2),
        "vary": {"noise": np.arange(1, 3)},
    }
    own = Sweep(**{**DISK, **numbers, **more})
    plain = Sweep(**DISK, seeds=2, replicas=2, record_interval=2, vary={"noise": (1.0, 2.0)})
    assert [*own] == [*plain]
    assert mm.sweep.run(own, tmp_path / "s", executor=here).done == 4


def test_every_number_of_every_scene_can_be_varied():
    for scene in (mm.Top(), mm.Motor(position=(0.8, 0.0), axis=(0, 0, 1)), mm.Disk()):
        for name, field in numeric_fields(scene).items():
            value = getattr(scene, field.declared.name)
            value = value if field.component is None else value[field.component]
            value = (5e-5 if name.startswith("ball") else 3.0) if value is None else value
            sweep = Sweep(
                scene=scene,
                vary={name: [value]},
                measure=["trajectory"],
                duration=1,
                timestep=0.01,
                method=mm.methods(scene)[0],
            )
            changed = provenance.scene_from(
                type(scene).__name__, sweep.case(0).spec["scene_fields"]
            )
            changed_value = getattr(changed, field.declared.name)
            assert (
                changed_value if field.component is None else changed_value[field.component]
            ) == value
    assert {"position_y", "axis_z", "ring_dipoles"} <= numeric_fields(mm.Top()).keys()
    assert not {"surface", "ring_script", "potential"} & numeric_fields(mm.Top()).keys()
    assert full_name(mm.Top(), "height") == "ring_height"


@pytest.mark.parametrize("design", ["sobol", "latin", "random"])
def test_designs_are_those_of_scipy_and_numpy(design):
    samples = Samples({"noise": (1, 3), "friction": (0.01, 1, True)}, 8, design, seed=4)
    sweep = Sweep(**DISK, samples=samples, vary={"x": (0.0, 1.0)})
    assert sweep.shape == (8, 2, 1)
    if design == "random":
        unit = np.random.default_rng(4).random((8, 2))
    else:
        kind = {"sobol": qmc.Sobol, "latin": qmc.LatinHypercube}[design]
        unit = kind(2, rng=4).random(8)
    expected = np.stack([1 + 2 * unit[:, 0], 0.01 * 100 ** unit[:, 1]], axis=1)
    found = [(sweep.changes(2 * i)["noise"], sweep.changes(2 * i)["friction"]) for i in range(8)]
    np.testing.assert_allclose(found, expected, rtol=1e-15)  # 1.5e-16


def test_a_sweep_is_restored_from_its_specification():
    samples = Samples({"v": (0, 1), "friction": (0.01, 1, True)}, 4, "latin", 3)
    numerics = {"seeds": [4, 2], "replicas": 3, "record_interval": 5}
    sweep = Sweep(**DISK, samples=samples, vary={("noise", "x"): NOISES}, **numerics)
    again = sweep_from(json.loads(canonical(sweep.as_json())))
    assert [*again] == [*sweep]
    assert again.as_json() == sweep.as_json()
    other = {**sweep.as_json(), "versions": {"magmotor": "0"}}
    assert sweep_from(other).case(0).spec["versions"] == {"magmotor": "0"}


def test_the_cases_do_not_change_the_scene_that_they_vary():
    sweep = Sweep(
        scene=mm.Top(), vary={"position_x": (0.0, 0.01)}, measure=["max_spin"], duration=1.0
    )
    before = json.dumps(sweep.as_json())
    assert [case.spec["scene_fields"]["position"] for case in sweep] == [[0.0, 0.02], [0.01, 0.02]]
    assert json.dumps(sweep.as_json()) == before


def test_a_million_cases_are_planned_without_being_stored():
    line = np.linspace(0.1, 4, 1000)
    tracemalloc.start()
    try:
        sweep = Sweep(**DISK, vary={"noise": line, "friction": line})
        for index in range(0, len(sweep), 200):
            sweep.case(index)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len(sweep) == 10**6
    assert peak < 1e6  # 3.4e5 bytes; 1e6 cases of 1 kB would be 1e9


def test_the_key_depends_on_everything_that_determines_a_run():
    spec = Sweep(**DISK, vary={"noise": NOISES}).case(0).spec
    keys = {case_of(spec).key}
    other = {
        "scene": "LangevinParticle",
        "scene_fields": {**spec["scene_fields"], "sigma": 0.6},
        "method": "variational/euler",
        "timestep": 0.025,
        "duration": 6.0,
        "record_interval": 2,
        "replicas": 3,
        "seed": spec["seed"] + 1,
        "versions": {**spec["versions"], "numpy": "1.0"},
    }
    assert other.keys() == spec.keys()
    keys |= {case_of({**spec, name: value}).key for name, value in other.items()}
    assert len(keys) == 1 + len(other)


def test_versions_are_those_that_matter():
    engines = {"variational/baoab": set(), "mujoco/euler": {"mujoco"}}
    for method, more in engines.items():
        spec = Sweep(**{**DISK, "method": method}, vary={"noise": NOISES}).case(0).spec
        assert spec["versions"].keys() == {"magmotor", "numba", "numpy", "libc", "machine"} | more


def test_results_are_those_of_simulate(tmp_path, here):
    sweep = Sweep(**DISK, vary={"noise": NOISES, "v": (0.0, 1.0)}, seeds=2, replicas=3)
    tally = mm.sweep.run(sweep, tmp_path / "s", executor=here, workers=1)
    assert (tally.cases, tally.done, tally.failed, tally.computed) == (12, 12, 0, 12)
    data = mm.sweep.combine(tmp_path / "s")
    assert data.displacement.dims == ("noise", "v", "seed", "replica")
    assert json.loads(data.attrs["axes"]) == ["noise", "v"]
    assert data.noise.attrs["long_name"].startswith("noise alpha")
    own = np.random.SeedSequence(1).spawn(6)[5].generate_state(1, np.uint64)[0] >> 11
    run = mm.simulate(
        mm.Disk(noise=4.0, v=1.0),
        method="variational/baoab",
        timestep=0.05,
        duration=5.0,
        seed=int(own),
        replicas=3,
    )
    found = data.sel(noise=4.0, v=1.0, seed=1)
    np.testing.assert_array_equal(found.displacement, run.x.isel(time=-1) - run.x.isel(time=0))
    np.testing.assert_array_equal(found.temperature, (run.v**2).mean("time"))
    data.to_netcdf(tmp_path / "s.nc")
    xr.testing.assert_identical(xr.load_dataset(tmp_path / "s.nc"), data)


def test_whole_runs_are_recorded(tmp_path, here):
    arguments = {**DISK, "measure": ["trajectory"], "record_interval": 5}
    sweep = Sweep(**arguments, vary={"noise": NOISES}, seeds=2)
    mm.sweep.run(sweep, tmp_path / "s", executor=here)
    data = mm.sweep.combine(tmp_path / "s")
    assert data.x.dims == ("noise", "seed", "time")
    case = sweep.case(3).spec
    names = ("method", "timestep", "duration", "record_interval", "seed")
    run = mm.simulate(mm.Disk(noise=2.0), **{name: case[name] for name in names})
    np.testing.assert_array_equal(data.omega.sel(noise=2.0, seed=1), run.omega)
    assert data.x.attrs == run.x.attrs
    files = sorted((tmp_path / "s" / "done").rglob("*.nc"))
    assert len(files) == 6
    kept = next(k for k in map(xr.load_dataset, files) if k.attrs["seed"] == case["seed"])
    xr.testing.assert_identical(kept, run)


def test_a_case_beyond_its_stability_limit_fails_without_stopping_others(tmp_path, here):
    arguments = {"duration": 1.0, "method": "variational/verlet", "timestep": 0.03}
    vary = {"height": (0.3, 0.05), "tilt": (0.0, 0.1, 0.5)}
    sweep = Sweep(scene=mm.Top(), vary=vary, measure=["max_spin"], **arguments)
    tally = mm.sweep.run(sweep, tmp_path / "s", executor=here)
    assert (tally.done, tally.failed) == (3, 3)
    status = mm.sweep.status(tmp_path / "s")
    assert (status.done, status.failed, status.missing) == (3, 3, 0)
    errors = {case: error for error, cases in status.errors.items() for case in cases}
    assert errors.keys() == {f"ring_height = 0.05, tilt = {t}" for t in ("0", "0.1", "0.5")}
    assert errors["ring_height = 0.05, tilt = 0"].startswith(
        "timestep = 0.03: must be less than 0.01"
    )
    assert errors["ring_height = 0.05, tilt = 0.5"].startswith(
        "tilt = 0.5: must be less than 0.147"
    )
    data = mm.sweep.combine(tmp_path / "s")
    np.testing.assert_array_equal(np.isnan(data.max_spin.values[..., 0]), [[0] * 3, [1] * 3])


def test_a_run_that_diverges_keeps_its_records(tmp_path, here):
    sweep = Sweep(
        scene=mm.Top.si(),
        vary={"tilt": (0.0, 0.1)},
        measure=["trajectory"],
        duration=60.0,
        method="variational/verlet",
        timestep=0.005,
    )
    with pytest.raises(mm.sweep.SweepFailed):
        mm.sweep.run(sweep, tmp_path / "s", executor=here)
    kept = [xr.load_dataset(path) for path in (tmp_path / "s" / "failed").glob("*.nc")]
    assert {json.loads(run.attrs["scene_fields"])["tilt"] for run in kept} == {0, 0.1}
    (error,) = {e.split(" stopped at")[0] for e in mm.sweep.status(tmp_path / "s").errors}
    assert error == "variational/verlet with timestep 0.005 s"


def test_a_user_defined_measure_and_its_errors(tmp_path, here):
    vary = {"noise": (2.0, 3.0)}
    sweep = Sweep(**{**DISK, "measure": ["sweep_measures:broken"]}, vary=vary)
    mm.sweep.run(sweep, tmp_path / "s", executor=here)
    data = mm.sweep.combine(tmp_path / "s")
    np.testing.assert_array_equal(data["sweep_measures:broken"], [[-1.0], [np.nan]])
    assert mm.sweep.status(tmp_path / "s").errors == {
        "ZeroDivisionError: float division by zero": ["noise = 3"]
    }
    shape = "shape of a measure = (3,): must be ()"
    for replicas, bound in (
        (None, ": a run without replicas has one value"),
        (2, " or (replicas,)"),
    ):
        own = {**DISK, "measure": ["sweep_measures:three"], "replicas": replicas}
        sweep = Sweep(**own, vary=vary)
        with pytest.raises(mm.sweep.SweepFailed):
            mm.sweep.run(sweep, tmp_path / f"{replicas}", executor=here)
        assert [*mm.sweep.status(tmp_path / f"{replicas}").errors] == [shape + bound]


def test_failed_cases_are_run_again_only_on_demand(tmp_path, here, monkeypatch):
    import sweep_measures

    sweep = Sweep(**{**DISK, "measure": ["sweep_measures:broken"]}, vary={"noise": (*NOISES, 3.0)})
    assert mm.sweep.run(sweep, tmp_path / "s", executor=here).failed == 1
    again = mm.sweep.run(sweep, tmp_path / "s", executor=here)
    assert (again.failed, again.computed) == (1, 0)
    (failed,) = (tmp_path / "s" / "failed").iterdir()
    failed.with_suffix(".nc").touch()  # as of a run that diverged
    monkeypatch.setattr(sweep_measures, "broken", lambda run, scene: 7.0)
    again = mm.sweep.run(sweep, tmp_path / "s", executor=here, retry=True)
    assert (again.done, again.failed, again.computed) == (4, 0, 1)
    assert mm.sweep.status(tmp_path / "s").errors == {}
    assert not [*(tmp_path / "s" / "failed").iterdir()]


def test_warnings_of_a_run_are_kept_with_it(tmp_path, here):
    arguments = {**DISK, "timestep": 1.0, "scene": mm.Disk(noise=20.0)}
    with pytest.warns(UserWarning, match="flights") as said:
        mm.simulate(mm.Disk(noise=20.0), method="variational/baoab", timestep=1.0, duration=5.0)
    mm.sweep.run(Sweep(**arguments, vary={"x": (0.0,)}), tmp_path / "s", executor=here)
    (path,) = (tmp_path / "s" / "done").rglob("*.json")
    assert json.loads(path.read_bytes())["warnings"] == [str(said[0].message)]


def test_a_measure_that_changes_its_run_changes_no_other(tmp_path, here):
    own = {**DISK, "measure": ["sweep_measures:changing", "square_displacement"]}
    mm.sweep.run(Sweep(**own, vary={"x": (0.0,)}), tmp_path / "s", executor=here)
    assert float(mm.sweep.combine(tmp_path / "s").square_displacement.squeeze()) > 0


def test_nan_is_null_in_a_file_and_nan_when_combined():
    from magmotor.sweep.compute import decoded, encoded

    values = [1.5, np.nan, np.inf, -np.inf]
    assert json.loads(json.dumps(encoded(values, (4,)), allow_nan=False)) == [
        1.5,
        None,
        "inf",
        "-inf",
    ]
    np.testing.assert_array_equal(decoded(encoded(values, (4,)), (4,)), values)
    assert np.isnan(decoded(encoded(np.nan, ()), ()))
    assert np.isnan(decoded(encoded(np.ma.masked, ()), ()))


def test_integers_vary_only_on_grids():
    top = {"scene": mm.Top(), "measure": ["max_spin"], "duration": 1.0, "timestep": 0.01}
    sweep = Sweep(**top, vary={"ring_dipoles": np.linspace(5, 20, 4)})
    assert [case.spec["scene_fields"]["ring_dipoles"] for case in sweep] == [5, 10, 15, 20]
    with refused("ring_dipoles"):
        Sweep(**top, vary={"ring_dipoles": (5.5,)})
    with refused("field"):
        Sweep(**top, samples=Samples({"ring_dipoles": (5, 20)}, 4))


def test_the_timestep_is_the_shortest_that_is_recommended_at_the_corners(capsys):
    vary = {"tilt": (0.0, 0.1), "ring_height": (0.12, 0.4, 0.2)}
    sweep = Sweep(scene=mm.Top(), vary=vary, measure=["max_spin"], duration=1.0)
    assert sweep.method == mm.recommend(mm.Top()).method
    corners = [mm.Top(tilt=tilt, ring_height=h) for tilt in (0.0, 0.1) for h in (0.12, 0.4)]
    steps = [mm.recommend(corner, method=sweep.method).timestep for corner in corners]
    assert sweep.timestep == min(steps)
    assert len(set(steps)) > 1
    assert sweep.choice is not None
    assert (sweep.choice.method, sweep.choice.timestep) == (sweep.method, sweep.timestep)
    assert not capsys.readouterr().err
    box = Samples({"coupling": (1e-6, 4e-5), "ring_height": (0.12, 0.4)}, 4)
    drawn = Sweep(scene=mm.Top(), samples=box, measure=["max_spin"], duration=1.0)
    corners = [mm.Top(coupling=c, ring_height=h) for c in (1e-6, 4e-5) for h in (0.12, 0.4)]
    steps = [mm.recommend(corner, method=drawn.method).timestep for corner in corners]
    assert drawn.timestep == min(steps) < min(steps[:2] + steps[3:])


def test_the_engine_decides_unless_a_method_is_given():
    short = {"scene": mm.Top(), "vary": {"tilt": (0.0, 0.1)}, "measure": ["max_spin"]}
    engines: tuple[Any, ...] = ("mujoco", "any")
    chosen = [Sweep(**short, duration=1.0, engine=engine) for engine in engines]
    wanted = [mm.recommend(mm.Top(), engine=engine).method for engine in engines]
    assert [sweep.method for sweep in chosen] == wanted
    assert len(set(wanted)) == 2
    named = Sweep(**short, duration=1.0, method="variational/verlet")
    assert named.method == "variational/verlet"
    assert all("engine" not in sweep.as_json() for sweep in chosen)


def test_a_corner_for_which_nothing_is_charted_needs_a_timestep():
    """With the timestep of the other corner, its cases would fail one by one."""
    slippery = {"scene": mm.Top(surface="plane"), "vary": {"coulomb_friction": (0.0, 0.1)}}
    with refused("coulomb_friction"):
        Sweep(**slippery, measure=["max_spin"], duration=1.0)
    given = {"method": "mujoco/euler", "timestep": 0.004}
    assert len(Sweep(**slippery, **given, measure=["max_spin"], duration=1.0)) == 2


def test_a_directory_of_something_else_is_refused_and_unchanged(tmp_path, here):
    sweep = Sweep(**DISK, vary={"noise": NOISES})
    mm.sweep.run(sweep, tmp_path / "s", executor=here)
    before = contents(tmp_path / "s")
    other = Sweep(**{**DISK, "duration": 6.0}, vary={"v": NOISES})
    with refused("directory"):
        mm.sweep.run(other, tmp_path / "s", executor=here)
    assert contents(tmp_path / "s") == before
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "mine.txt").write_text("mine")
    for path in ("notes", "notes/mine.txt"):
        with refused("directory"):
            mm.sweep.run(sweep, tmp_path / path, executor=here)
    for look in (mm.sweep.status, mm.sweep.combine):
        with refused("directory"):
            look(tmp_path / "nowhere")


def test_an_executor_that_drops_its_cases_ends_the_sweep(tmp_path):
    class Gone(Executor):
        def submit(self, fn, /, *args, **kwargs):
            future = Future()
            future.cancel()
            return future

    with pytest.raises(mm.sweep.NoWorkers):
        mm.sweep.run(Sweep(**DISK, vary={"noise": NOISES}), tmp_path / "s", executor=Gone())
    assert mm.sweep.status(tmp_path / "s").missing == 3


def test_other_versions_do_not_mix(tmp_path, here):
    sweep = Sweep(**DISK, vary={"noise": NOISES})
    assert sweep.versions is not None
    old = Sweep(**DISK, vary={"noise": NOISES}, versions={**sweep.versions, "numpy": "1.0"})
    with pytest.raises(mm.sweep.OtherVersions):
        mm.sweep.run(old, tmp_path / "s", executor=here)
    with refused("directory"):
        mm.sweep.run(sweep, tmp_path / "s", executor=here)
    assert mm.sweep.status(tmp_path / "s").missing == 3  # can be read as before


def test_files_are_data(tmp_path, here):
    """JSON or netCDF, readable without this package."""
    mm.sweep.run(Sweep(**DISK, vary={"noise": NOISES}), tmp_path / "s", executor=here)
    for name, content in contents(tmp_path / "s").items():
        assert name.endswith(".json")
        assert len(json.loads(content)["checksum"]) == 64


@pytest.mark.parametrize(
    ("setting", "expected"), [("1", 1), ("3", 3), ("", 5), ("4,2", 5), ("0", 5)]
)
def test_a_worker_uses_the_number_of_threads_in_its_environment(monkeypatch, setting, expected):
    monkeypatch.setattr(threads.os, "cpu_count", lambda: 5)
    monkeypatch.setenv("OMP_NUM_THREADS", setting)
    assert threads.thread_count() == expected
