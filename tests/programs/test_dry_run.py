"""The cost of a sweep is estimated from short runs, before anything is written."""

import importlib
import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

import magmotor as mm
from magmotor.commands.sweep_run import duration, size

estimates = importlib.import_module("magmotor.sweep.estimate")
NUMBERS = {"scene": mm.Disk(), "method": "variational/baoab", "timestep": 0.05}


def plan(measure="slip_temperature", duration=2000.0, values=3, **more):
    noises = np.linspace(1, 2, values)
    return mm.sweep.Sweep(
        **NUMBERS, vary={"noise": noises}, measure=[measure], duration=duration, **more
    )


@pytest.mark.parametrize("length", [0.1, 0.8, 50.0, 2e6])
def test_the_time_is_extrapolated_from_set_up_and_steps(monkeypatch, length):
    """By a clock that advances by 0.1 s for each run and 0.2 ms for each step."""
    now = [0.0]

    def simulate(scene, *, duration, timestep, **_):
        now[0] += 0.1 + 2e-4 * round(duration / timestep)
        return xr.Dataset()

    monkeypatch.setattr(estimates, "simulate", simulate)
    monkeypatch.setattr(estimates, "time", SimpleNamespace(perf_counter=lambda: now[0]))
    found = mm.sweep.estimate(plan(duration=length, values=100), workers=4)
    assert found.seconds_per_case == pytest.approx(0.1 + 2e-4 * length / 0.05, rel=6e-11)  # 2e-12
    assert found.seconds == pytest.approx(25 * found.seconds_per_case)
    assert now[0] < 3 * 4 * 1.3  # 3.9 for the longest


def test_the_size_is_that_of_the_files(tmp_path):
    for name, sweep in {
        "measures": plan(duration=20.0, values=40, replicas=5),
        "trajectory": plan("trajectory", duration=400.0),
    }.items():
        found = mm.sweep.estimate(sweep, workers=1)
        assert found.probed == 3
        with ThreadPoolExecutor(1) as here:
            mm.sweep.run(sweep, tmp_path / name, executor=here)
        files = filter(Path.is_file, (tmp_path / name).rglob("*"))
        combined = mm.sweep.combine(tmp_path / name).nbytes
        written = sum(file.stat().st_size for file in files) + combined
        assert 0.8 * written < found.size < 1.25 * written, name  # 0.93 and 1.10


def test_a_sweep_of_which_no_case_can_run_says_why():
    sweep = mm.sweep.Sweep(
        scene=mm.Top(), method="variational/euler", timestep=0.01, duration=1.0,
        vary={"coupling": [1.0, 2.0]}, measure=["max_spin"],
    )  # fmt: skip
    with pytest.raises(ValueError, match="none of the probed cases can run: "):
        mm.sweep.estimate(sweep)


def test_a_sweep_too_large_for_memory_is_refused():
    with pytest.raises(ValueError, match=r"record_interval = \d+: must be at least .* of memory"):
        mm.sweep.estimate(plan(duration=1e15))


def test_a_dry_run_prints_the_plan_and_writes_nothing(run_script, tmp_path):
    flags = ["--vary", "noise=1:2:7", "--method", "variational/baoab", "--timestep", "0.05"]
    code, said, _ = run_script(
        "sweep", "disk", *flags, "--duration", "10", "--out", tmp_path / "all", "--dry-run"
    )
    assert code == 0
    first, *cases, times, sizes = said.splitlines()
    assert first == "7 cases by variational/baoab, h = 0.05, T = 10"
    assert cases == [f"  noise = {x:.6g}" for x in np.linspace(1, 2, 7)[:5]] + ["  ... and 2 more"]
    assert re.match(
        r"about [\d.e-]+ s on \d+ cores?, [\d.e-]+ s per case \(measured on this", times
    )
    assert re.match(r"about [\d.]+ kB in .*all and .*all.nc; nothing is written yet$", sizes)
    assert not [*tmp_path.iterdir()]


def test_times_and_sizes_in_words():
    words = [duration(x) for x in (0.01234, 12.3, 130, 8000, 200_000)]
    assert words == ["0.012 s", "12 s", "2 minutes", "2 hours", "2 days"]
    assert [size(x) for x in (1234, 557_000, 2.5e6, 3e9)] == ["1.2 kB", "557 kB", "2.5 MB", "3 GB"]
