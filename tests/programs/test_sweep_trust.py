"""Untrusted or damaged files of a sweep: no code in them runs, and no damage is silent."""

import json
import os
import sys
from concurrent.futures import Executor, Future
from typing import Any

import numpy as np
import pytest
import refusals
import xarray as xr
from sweep_driver import contents

import magmotor as mm
from magmotor.common.integrity import bytes_with_checksum, verified, with_checksum
from magmotor.sweep import Range, Samples, Sweep, Values
from magmotor.sweep.directory import Directory

DISK: dict[str, Any] = {
    "scene": mm.Disk(),
    "method": "variational/baoab",
    "timestep": 0.05,
    "duration": 1.0,
}
EVIL = "from pathlib import Path\nPath({marker!r}).touch()\ndef go(run, scene): return 7.0\n"


class Here(Executor):
    """Computes each case when it is submitted."""

    def submit(self, fn, /, *args, **kwargs):
        future = Future()
        future.set_result(fn(*args, **kwargs))
        return future


def swept(folder, **changes):
    """Run a sweep of four cases, the last of which fails unless it is a trajectory."""
    own = {"measure": ["sweep_measures:broken", "temperature"], **DISK, **changes}
    sweep = Sweep(**own, vary={"noise": (1.0, 2.0, 4.0, 3.0)})
    mm.sweep.run(sweep, folder, executor=Here())
    return sweep


def rewrite(folder, **changes):
    """Change sweep.json, with a matching checksum."""
    spec = verified((folder / "sweep.json").read_bytes()) | changes
    (folder / "sweep.json").write_bytes(with_checksum(spec))


@pytest.fixture
def evil(tmp_path, monkeypatch):
    """Write a module that leaves a marker when it is imported; return the marker."""
    marker = tmp_path / "marker"
    (tmp_path / "evil.py").write_text(EVIL.format(marker=str(marker)))
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    yield marker
    sys.modules.pop("evil", None)


def test_no_file_has_a_module_imported(evil, tmp_path, run_script):
    folder = tmp_path / "shared"
    swept(folder, measure=["temperature"])
    rewrite(folder, measure=["evil:go"])
    for file in (folder / "done").glob("*/*.json"):  # results as of that measure
        spec = verified(file.read_bytes())
        file.write_bytes(with_checksum({**spec, "values": {"evil:go": 2.0}}))
    plan = mm.sweep.sweep_of(folder)
    assert mm.sweep.status(folder).done == 4
    data = mm.sweep.combine(folder)
    assert data["evil:go"].attrs == {"units": "1", "long_name": "go"}
    mm.plots.sweep(data, tmp_path / "picture.png")
    data.to_netcdf(tmp_path / "shared.nc")
    again = Sweep(**DISK, vary={"noise": (1.0,)}, measure=plan.measure)
    for call in (
        lambda: mm.rerun(xr.load_dataset(tmp_path / "shared.nc")),
        lambda: mm.sweep.run(plan, tmp_path / "new", executor=Here()),
        lambda: mm.sweep.run(again, tmp_path / "new", executor=Here()),
    ):
        with refusals.refused("measure"):
            call()
    assert not (tmp_path / "new").exists()
    errors = ""
    for arguments, code in {
        ("sweep", "status", folder): 0,
        ("sweep", "combine", folder): 0,
        ("sweep", "movie", folder): 2,
        ("rerun", tmp_path / "shared.nc"): 2,
    }.items():
        found, _, errors = run_script(*arguments)
        assert (found, errors.count("\n")) == (code, code // 2)
    assert "evil:go" in errors
    assert not evil.exists()
    with refusals.refused("measures"):
        mm.sweep.sweep_of(folder, measures=["evil:no"])
    assert not evil.exists()
    allowed = mm.sweep.sweep_of(folder, measures=["evil:go"])
    mm.sweep.run(allowed, tmp_path / "new", executor=Here())
    assert evil.exists()
    np.testing.assert_array_equal(mm.sweep.combine(tmp_path / "new")["evil:go"], np.full((4, 1), 7))


def test_a_measure_that_the_caller_allows_is_run(tmp_path, run_script, monkeypatch):
    swept(tmp_path / "s")
    execute = mm.sweep.run
    monkeypatch.setattr(mm.sweep, "run", lambda *given: execute(*given, executor=Here()))
    mm.sweep.combine(tmp_path / "s").to_netcdf(tmp_path / "s.nc")
    allow = ("--allow-measure", "sweep_measures:broken")
    assert run_script("rerun", tmp_path / "s.nc", *allow)[0] == 0
    code, _, errors = run_script("rerun", tmp_path / "s.nc")
    assert (code, errors.count("\n")) == (2, 1)
    run = mm.simulate(**{k: v for k, v in DISK.items() if k != "measure"})
    with refusals.refused("measures"):
        mm.rerun(run, measures=["sweep_measures:broken"])


@pytest.fixture(scope="module", params=["numbers", "trajectories"])
def intact(request, tmp_path_factory):
    """Return a folder of a sweep and its contents."""
    folder = tmp_path_factory.mktemp(request.param) / "s"
    own = {"measure": ["trajectory"]} if request.param == "trajectories" else {}
    sweep = swept(folder, **own)
    return sweep, folder, contents(folder), mm.sweep.combine(folder)


def test_any_damaged_byte_is_detected_named_and_repaired(intact):
    """200 times one damaged byte: in results, numbers or whole runs, in errors, in the sweep."""
    sweep, folder, whole, truth = intact
    random = np.random.default_rng(5)
    for turn in range(150 if sweep.measure != ("trajectory",) else 50):
        name = sorted(whole)[turn % len(whole)]
        content = bytearray(whole[name])
        content[random.integers(len(content))] ^= random.integers(1, 256)
        (folder / name).write_bytes(content)
        if name == "sweep.json":
            for read in (mm.sweep.status, mm.sweep.combine, mm.sweep.sweep_of):
                with refusals.refused("directory"):
                    read(folder)
        else:
            (damage,) = mm.sweep.status(folder).damaged
            assert damage == f"{name} is damaged: its checksum differs"
            found = mm.sweep.combine(folder, skip_damaged=True)
            for variable in truth:
                both = found[variable].notnull()
                assert both.sum() <= truth[variable].notnull().sum()
                assert (found[variable] == truth[variable]).where(both, True).all()
        if name.startswith("done"):
            assert not mm.sweep.combine(folder, skip_damaged=True).identical(truth)
            with pytest.raises(mm.InputError, match=f"^{name} is damaged"):
                mm.sweep.combine(folder)
        if turn < len(whole):
            with pytest.warns(
                UserWarning,
                match=f"{name} is damaged.*(recomputed|again)",
            ):
                mm.sweep.run(sweep, folder, executor=Here())
            assert contents(folder) == whole
        (folder / name).write_bytes(whole[name])


def test_a_result_of_another_case_is_damage(intact):
    _, folder, whole, _ = intact
    one, other, *_ = (name for name in whole if name.startswith("done"))
    (folder / one).write_bytes(whole[other])
    (damage,) = mm.sweep.status(folder).damaged
    assert damage.startswith(f"{one} is damaged: ")
    (folder / one).write_bytes(whole[one])


@pytest.mark.parametrize("values", [{}, {"temperature": 1.0}, 3, None, "text"])
def test_nonsense_with_a_checksum_is_damage(tmp_path, values):
    swept(tmp_path / "s", measure=["temperature", "displacement"])
    file = next((tmp_path / "s" / "done").glob("*/*.json"))
    file.write_bytes(with_checksum({**verified(file.read_bytes()), "values": values}))
    with pytest.raises(mm.InputError, match=f"{file.name} is damaged: its measures differ"):
        mm.sweep.combine(tmp_path / "s")
    odd = {"temperature": [[1.0]], "displacement": {"a": 1}}
    file.write_bytes(with_checksum({**verified(file.read_bytes()), "values": odd}))
    with pytest.raises(mm.InputError, match=f"{file.name} is damaged: "):
        mm.sweep.combine(tmp_path / "s")


@pytest.mark.parametrize("inside", ["done", "parts", "claims", "failed", "done/{}"])
@pytest.mark.parametrize("retry", [False, True])
def test_nothing_is_written_read_or_removed_through_a_link(tmp_path, inside, retry):
    elsewhere, folder = tmp_path / "elsewhere", tmp_path / "s"
    elsewhere.mkdir()
    (elsewhere / f"x@{os.uname().nodename}.999999999").touch()
    sweep = Sweep(**DISK, vary={"noise": (1.0, -0.0)}, measure=["sweep_measures:three"])
    store = Directory(folder, sweep)
    for case in sweep:
        for name in (case.key, f"{case.key}.json", f"{case.key}.nc"):
            (elsewhere / name).touch()
    link = folder / inside.format(store.done(sweep.case(0)).parent.name)
    link.parent.mkdir(exist_ok=True)
    if link.exists():
        link.rmdir()
    link.symlink_to(elsewhere)
    with refusals.refused("directory") as told:
        mm.sweep.run(sweep, folder, executor=Here(), retry=retry)
    assert told.value.value == str(link)
    assert len([*elsewhere.iterdir()]) == 1 + 3 * len(sweep)


def test_results_are_combined_if_the_size_of_memory_is_unknown(tmp_path, monkeypatch):
    swept(tmp_path / "s", measure=["temperature"])
    monkeypatch.delattr(os, "sysconf")  # as on Windows
    assert mm.sweep.combine(tmp_path / "s").temperature.notnull().all()


def test_a_file_that_is_a_link_or_a_pipe_is_damage(tmp_path):
    sweep = swept(tmp_path / "s", measure=["temperature"])
    whole = contents(tmp_path / "s")
    first, second, *_ = (tmp_path / "s" / "done").glob("*/*")
    first.replace(tmp_path / "mine.json")
    first.symlink_to(tmp_path / "mine.json")
    second.unlink()
    os.mkfifo(second)
    assert len(mm.sweep.status(tmp_path / "s").damaged) == 2
    with pytest.warns(UserWarning, match="is not a regular file; the case is recomputed"):
        mm.sweep.run(sweep, tmp_path / "s", executor=Here())
    assert contents(tmp_path / "s") == whole
    assert not first.is_symlink()


def test_a_folder_in_the_place_of_a_file_must_be_removed(tmp_path):
    sweep = swept(tmp_path / "s", measure=["temperature"])
    whole = contents(tmp_path / "s")
    first = next((tmp_path / "s" / "done").glob("*/*"))
    first.unlink()
    first.mkdir()
    for use in (mm.sweep.status, lambda path: mm.sweep.run(sweep, path, executor=Here())):
        with refusals.refused("directory") as told:
            use(tmp_path / "s")
        assert told.value.value == str(first)
    first.rmdir()
    mm.sweep.run(sweep, tmp_path / "s", executor=Here())
    assert contents(tmp_path / "s") == whole


ODD: tuple[Any, ...] = (
    None, True, 3, -1, 10**12, 1e300, float("nan"), "", "x", "\0", b"x", [], [3], [[]], ["x", "x"],
    [["x", [1]]], [[["x"], 3]], {}, {"x": 3}, [{"size": 4}], [[None, None]], [None],
)  # fmt: skip
"""Odd values for a field of sweep.json, an attribute or an argument."""

WRONG: tuple[Any, ...] = (*ODD, object(), np.zeros((2, 2)), range(3), len)

SWEEP_FIELDS = (
    "duration", "measure", "method", "record_interval", "replicas", "samples", "scene",
    "scene_fields", "seeds", "timestep", "vary", "versions",
)  # fmt: skip


@pytest.fixture(scope="module")
def spec():
    """Return the specification of a sweep."""
    samples = Samples({"v": (0.0, 1.0)}, 4)
    sweep = Sweep(**DISK, measure=["temperature"], vary={"noise": (1.0, 2.0)}, samples=samples)
    return json.loads(json.dumps(sweep.as_json()))


def refused(function, *arguments, **named):
    """Whether a call raises a ValueError with a message; other errors propagate."""
    try:
        function(*arguments, **named)
    except ValueError as error:
        return 10 < len(str(error)) < 2000
    return False


def entered(context, *arguments):
    with context(*arguments):
        pass


@pytest.mark.parametrize("field", SWEEP_FIELDS)
def test_odd_fields_of_a_sweep_are_refused_by_name(spec, field):
    odd = [value for value in ODD if value != spec[field]]
    accepted = [v for v in odd if not refused(mm.sweep.sweep_from, {**spec, field: v})]
    fine = {"replicas": [3], "record_interval": [3, 10**12], "seeds": [[3]], "samples": [[]]}
    fine |= {"vary": [[]], "timestep": [], "duration": [3, 10**12]}
    fine |= {"versions": [None, {}]}
    assert accepted == fine.get(field, [])
    assert refused(mm.sweep.sweep_from, {k: v for k, v in spec.items() if k != field})


def test_odd_recipes_of_a_design_and_axes_are_refused(spec):
    recipe = spec["samples"][0]
    for name in recipe:
        for value in ODD:
            samples = [{**recipe, name: value}]
            taken = not refused(mm.sweep.sweep_from, {**spec, "samples": samples})
            assert not taken or (name, value) == ("seed", 3) or (name, value) == ("seed", 10**12)
    for value in ODD:
        for entry in (value, [value, [1.0]], [["x"], value], [[value], [1.0]], [["x"], [value]]):
            taken = not refused(mm.sweep.sweep_from, {**spec, "vary": [entry]})
            numbers = (1.0, 3, -1, 10**12)
            fine = entry in [[["x"], [n]] for n in numbers] and value is not True
            assert taken == fine, entry


def test_arguments_of_wrong_types_raise_only_named_errors():
    own = {**DISK, "measure": ["temperature"], "vary": {"noise": (1.0,)}}
    for value in WRONG:
        for name in (*SWEEP_FIELDS, "vary"):
            if name != "scene_fields":
                refused(Sweep, **{**own, name: value})
        if not isinstance(value, list | dict | np.ndarray):
            refused(Sweep, **{**own, "vary": {value: (1.0,)}})
            refused(Samples, {value: (0, 1)}, 4)
        refused(Sweep, **{**own, "vary": {"noise": value}})
        refused(Samples, value, 4)
        refused(Samples, {"v": value}, 4)
        refused(Samples, {"v": (0, 1)}, value)
        refused(Samples, {"v": (0, 1)}, 4, value)
        refused(Samples, {"v": (0, 1)}, 4, "sobol", value)
        bad: Any = value
        refused(Samples, {"v": Range(bad, bad, bad)}, 4)
        refused(Values, value, (1.0,))
        refused(Values, ("v",), value)


def test_arguments_of_wrong_types_of_functions_are_refused(tmp_path):
    plan = Sweep(**DISK, measure=["temperature"], vary={"noise": (1.0,)})
    sweep = mm.sweep
    for value in WRONG:
        assert refused(sweep.measures, value)
        assert refused(sweep.sweep_from, value)
        assert refused(sweep.run, value, tmp_path / "s")
        if not isinstance(value, str) or value == "\0":
            for call in (sweep.status, sweep.combine, sweep.sweep_of):
                assert refused(call, value)
            assert refused(sweep.run, plan, value)
            assert refused(entered, sweep.dask_workers, value)
            assert refused(entered, sweep.local_cluster, 1, value)
        if value is not None:
            assert refused(sweep.run, plan, tmp_path / "s", executor=value)
            if not isinstance(value, int) or value is True or value < 1:
                assert refused(sweep.run, plan, tmp_path / "s", workers=value)
                assert refused(entered, sweep.local_cluster, value)
    assert refused(entered, sweep.local_cluster, 1, "")  # Dask takes all interfaces
    assert not (tmp_path / "s").exists()


@pytest.mark.filterwarnings("ignore:.*:RuntimeWarning")
def test_odd_attributes_of_a_run_make_rerun_fail_in_one_line(tmp_path, run_script):
    run = mm.simulate(**DISK)
    for name in ("method", "timestep", "duration", "seed", "path", "versions", "time_reached"):
        for odd in ("", "[]", "[" * 10**4, 2.5, np.arange(3), b"x", 10**15):
            run.assign_attrs({name: odd}).to_netcdf(tmp_path / "odd.nc")
            code, said, errors = run_script("rerun", tmp_path / "odd.nc")
            assert (code == 2, errors.count("\n")) in ((True, 1), (False, 0)), (name, odd)
            assert code in (0, 1, 2)
            assert bool(said) == (code != 2)


def test_odd_attributes_of_a_sweep_make_rerun_fail_in_one_line(
    spec, tmp_path, run_script, monkeypatch
):
    """The attribute may be any text, an array, or anything that JSON can hold."""
    monkeypatch.setattr(mm.sweep, "run", lambda *_: pytest.fail("it runs"))
    texts = ["", "x", "{}", "[]", "3", "null", "NaN", "[" * 10**5, '{"measure": 3}']
    texts += [json.dumps({**spec, name: 3}) for name in ("measure", "vary", "seeds", "scene")]
    for odd in (*texts, 3, 2.5, np.arange(3), b"x"):
        data = xr.Dataset({"temperature": ("noise", [1.0, 2.0])}, attrs={"sweep": odd})
        data.to_netcdf(tmp_path / "odd.nc")
        code, said, errors = run_script("rerun", tmp_path / "odd.nc")
        assert (code, said, errors.count("\n")) == (2, "", 1)
        assert errors.startswith(f"magmotor rerun: {tmp_path / 'odd.nc'}: ")


def test_a_run_cannot_refer_to_other_files(tmp_path):
    """NetCDF-4, which is HDF5, may refer to data in any file; the classic format cannot."""
    sweep = swept(tmp_path / "s", measure=["trajectory"])
    path = next((tmp_path / "s" / "done").glob("*/*.nc"))
    assert path.read_bytes().startswith(b"CDF\x05")
    run = mm.simulate(mm.Disk(), method="variational/euler", timestep=0.05, duration=1.0)
    run.to_netcdf(tmp_path / "run.nc", engine="netcdf4")
    path.write_bytes(bytes_with_checksum((tmp_path / "run.nc").read_bytes(), path.stem))
    with pytest.raises(mm.InputError, match="is damaged: it is not a run in netCDF's classic"):
        mm.sweep.combine(tmp_path / "s")
    assert len(sweep) == 4


def test_an_axis_does_not_hide_a_recorded_quantity(tmp_path):
    own = {**DISK, "measure": ["trajectory"]}
    mm.sweep.run(Sweep(**own, vary={"x": (0.0, 0.5)}), tmp_path / "s", executor=Here())
    data = mm.sweep.combine(tmp_path / "s")
    assert data.x.dims == ("initial_x", "seed", "time")
    np.testing.assert_array_equal(data.x.isel(time=0, seed=0), data.initial_x)


class Mute(ValueError):
    def __str__(self):
        raise RuntimeError("no words")


def mute(run, scene):
    raise Mute


def test_an_error_without_text_is_stored_with_its_case(tmp_path):
    plan = Sweep(**DISK, vary={"noise": (1.0, 2.0)}, measure=["test_sweep_trust:mute"])
    with pytest.raises(mm.sweep.SweepFailed):
        mm.sweep.run(plan, tmp_path / "s", executor=Here())
    assert [*mm.sweep.status(tmp_path / "s").errors] == ["Mute"]
