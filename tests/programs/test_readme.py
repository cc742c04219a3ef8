"""The blocks of Python in the README, and on the pages about devices and sweeps, run as shown."""

import re
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest
import xarray as xr

from magmotor.live import LiveSimulation

ROOT = Path(__file__).parents[2]


def blocks(page, language="python"):
    text = (ROOT / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)


def test_the_readme_prints_what_it_shows(tmp_path, monkeypatch, capsys):
    examples, outputs = blocks("README.md"), blocks("README.md", "text")
    (model,) = blocks("README.md", "xml")
    monkeypatch.chdir(tmp_path)
    Path("needle.xml").write_text(model)
    namespace: dict = {}
    for example, output in zip(examples, outputs, strict=True):
        exec(example, namespace)
        assert capsys.readouterr().out == output
    assert namespace["data"].qpos[0] == pytest.approx(np.pi / 2, rel=5e-8, abs=0)  # 2e-9
    assert isinstance(namespace["run"], xr.Dataset)
    assert Path("top.png").stat().st_size > 10_000


def test_the_readmes_needle_is_live_as_in_mujoco():
    """The plugin acts on it once, and the view can switch it off."""
    (text,) = blocks("README.md", "xml")
    model, perturb = mujoco.MjModel.from_xml_string(text), mujoco.MjvPerturb()
    data, live = mujoco.MjData(model), LiveSimulation(mujoco.MjModel.from_xml_string(text))
    mujoco.mj_step(model, data, nstep=200)
    live.advance(200, perturb)
    assert data.qpos[0] > 0.7
    np.testing.assert_array_equal(live.data.qpos, data.qpos)
    live.switch("magnetism")
    live.reset()
    live.advance(200, perturb)
    assert live.data.qpos[0] == 0


def test_the_readme_is_short():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 120
    (picture,) = re.findall(r"!\[.*?\]\((.*?)\)", text)
    assert (ROOT / picture).stat().st_size < 1e6


def test_the_overview_lists_every_page():
    overview = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    pages = {page.name for page in (ROOT / "docs").glob("*.md")} - {"index.md"}
    assert pages <= set(re.findall(r"\]\(([\w]+\.md)", overview))


def test_devices():
    top, surroundings, ensemble, drag, motor, load = blocks("docs/paper_devices.md")
    namespace: dict = {}
    exec(top, namespace)
    assert np.abs(namespace["run"].momentum_map).max() == pytest.approx(
        1.858e-4, rel=1e-3
    )  # 1.4e-4
    namespace = {}
    exec(surroundings, namespace)
    spins = {
        name: float(abs(run.momentum_map).max()) / namespace["level"].inertia[2]
        for name, run in (
            ("tilted_floor", namespace["run"]),
            *((name, namespace["mm"].simulate(
                namespace[name], method="mujoco/rk4", timestep=0.0125, duration=60.0
            )) for name in ("in_a_field", "on_aluminum")),
        )
    }  # fmt: skip
    table = {"tilted_floor": 4.95, "in_a_field": 1.44, "on_aluminum": 0.26}
    assert spins == pytest.approx(table, abs=0.0051)
    assert namespace["in_air"].drag > 6e-6
    namespace = {}
    exec(ensemble, namespace)
    fine, same, coarse = (namespace[name] for name in ("fine", "same", "coarse"))
    reach = float(np.abs(fine.x).max())
    assert np.abs(same.x - fine.x).max() < 1e-10 * reach  # 4e-12
    early = np.abs(coarse.x - fine.x).sel(time=slice(0, 10))
    assert early.sizes["time"] > 200
    assert early.max() < 0.5  # 0.12, of 112
    square = namespace["many"].sel(quantity="x").isel(time=-1)
    theory = namespace["mm"].theory.ReducedDisk(namespace["disk"]).msd_from_rest(1000.0)
    assert abs(square.mean_square - theory) < 4 * square.mean_square_error
    exec(drag, namespace)
    limit = namespace["mm"].theory.ReducedDisk(namespace["disk"]).x_diffusion
    assert limit == pytest.approx(2.9e5, abs=5e3)
    namespace = {}
    exec(motor, namespace)
    mm, run, scene = (namespace[name] for name in ("mm", "run", "motor"))
    balance = mm.observables.energy_balance(run, scene)
    assert abs(balance.residual[-1]) < 0.002 * balance.injected[-1]  # 5e-4
    modes = mm.observables.mode_temperatures(run, scene, burn_in=2000)
    assert modes.temperature.sel(mode="slip") == pytest.approx(scene.kT, rel=0.05)  # 5 errors
    exec(load, namespace)
    run = namespace["run"]
    balance = mm.observables.energy_balance(run)
    angle = mm.observables.azimuth(run).values
    np.testing.assert_allclose(balance.load_work, 1e-7 * (angle - angle[:, :1]), atol=1e-18)
    assert balance.load_work.isel(time=-1).mean() > 0  # by 6.9 standard errors


def test_the_sweep_runs_as_a_script(tmp_path):
    (sweep,) = blocks("docs/sweeps.md")
    (tmp_path / "noise.py").write_text(sweep + "    data.to_netcdf('noise.nc')\n")
    subprocess.run(
        [sys.executable, "-W", "error", "noise.py"], cwd=tmp_path, check=True, timeout=120
    )
    data = xr.load_dataset(tmp_path / "noise.nc")
    assert dict(data.sizes) == {"noise": 5, "seed": 4}
    kT = data.noise**2 / (2 * 0.1)
    # 1000 rate/2 = 150 independent squares in each run: standard error 0.06.
    np.testing.assert_allclose((data.slip_temperature / kT).mean("seed"), 1, atol=0.3)  # 0.03


def test_errata_name_tests_that_exist():
    errata = (ROOT / "docs" / "errata.md").read_text(encoding="utf-8")
    named = re.findall(r"`(?:(tests/\w+/\w+\.py))?::(test_\w+)`", errata)
    assert len(named) > 15
    file = ""
    for path, name in named:
        file = path or file
        assert f"def {name}(" in (ROOT / file).read_text(encoding="utf-8"), (file, name)
