"""A user-defined device outside the package has all features of the paper's devices."""

import importlib
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import magmotor as mm
from magmotor.device import Device, Scene, register
from magmotor.device.provenance import attributes_of

EXAMPLES = Path(__file__).parents[2] / "examples"
REFERENCE = {"method": "variational/baoab", "timestep": 0.01, "duration": 2.0}

KINDS = {
    "variational": "variational/baoab",
    "mujoco": "mujoco/baoab",
    "ode": "scipy/dop853",
}
"""The method that each part of a device makes possible."""


def test_its_integrator_and_mujoco_follow_one_brownian_path(rotor):
    runs = [
        mm.simulate(rotor.Rotor(), **{**REFERENCE, "method": method}, replicas=3)
        for method in ("variational/baoab", "mujoco/baoab")
    ]
    assert abs(runs[0].theta - runs[1].theta).max() < 1e-14  # 3.9e-16
    other = mm.simulate(rotor.Rotor(), **REFERENCE, replicas=3, seed=1)
    assert abs(runs[0].theta - other.theta).max() > 0.1  # 0.74


def test_it_has_the_temperature_of_its_oil(rotor):
    """I omega^2 of 2000 rotors at 10 times is kT to 1 %; false alarms: 1e-5."""
    scene = rotor.Rotor(magnet=0.0)
    found = mm.ensemble(
        scene, method="variational/baoab", timestep=0.05, duration=10.0, replicas=2000,
        sample_interval=20,
    ).sel(quantity="omega")  # fmt: skip
    warm = scene.inertia / scene.kT * found.mean_square.isel(time=slice(1, None))
    assert float(warm.mean()) == pytest.approx(1.0, abs=0.044)  # 0.003; 0.01 is one deviation
    assert float(found.mean_square_error[-1] * scene.inertia / scene.kT) < 0.05  # 0.031


def test_its_ensemble_is_the_mean_of_its_runs(rotor):
    scene = rotor.Rotor()
    found = mm.ensemble(scene, **REFERENCE, replicas=5, sample_interval=10)
    run = mm.simulate(scene, **REFERENCE, replicas=5, record_interval=10)
    np.testing.assert_array_equal(found.time, run.time)
    for name in ("theta", "omega", "energy"):
        one = found.sel(quantity=name)
        np.testing.assert_array_equal(one["mean"], run[name].mean("replica"))
        deviation = run[name].std("replica", ddof=1) / np.sqrt(5)
        np.testing.assert_allclose(one.mean_error, deviation, rtol=1e-14, atol=0)  # 0 here
    with pytest.raises(ValueError, match=r"burn_in = 1\.0: must be left out: ensembles of a Rotor"):
        mm.ensemble(scene, **REFERENCE, replicas=5, burn_in=1.0)


def test_an_ensemble_counts_heat_from_the_start_and_is_reproduced(rotor):
    numerics = {**REFERENCE, "timestep": 0.1, "duration": 30.0, "replicas": 2}
    found = mm.ensemble(mm.Motor(), **numerics, sample_interval=1)
    run = mm.simulate(mm.Motor(), **numerics)
    np.testing.assert_array_equal(found["mean"].sel(quantity="heat"), run.heat.mean("replica"))
    assert mm.rerun(found).identical(found)
    own = mm.ensemble(rotor.Rotor(), **REFERENCE, replicas=2, initial={"theta": 0.5})
    with pytest.raises(ValueError, match="initial"):
        mm.rerun(own)


def test_it_continues_from_a_checkpoint_and_is_reproduced(rotor, tmp_path):
    scene, path = rotor.Rotor(), tmp_path / "rotor.checkpoint"
    mm.simulate(scene, **{**REFERENCE, "duration": 2.0}, replicas=2, checkpoint=path)
    again = mm.simulate(scene, **REFERENCE, replicas=2, checkpoint=path)
    whole = mm.simulate(scene, **REFERENCE, replicas=2)
    assert again.equals(whole)
    assert mm.rerun(whole).identical(whole)
    later = mm.simulate(scene, **REFERENCE, replicas=2, initial=whole)
    long = mm.simulate(scene, **{**REFERENCE, "duration": 4.0}, replicas=2)
    np.testing.assert_array_equal(later.theta[:, -1], long.theta[:, -1])


def test_a_sweep_takes_it(rotor):
    cold, warm = 1e-5, 4e-5
    sweep = mm.sweep.Sweep(
        scene=rotor.Rotor(), vary={"kT": [cold, warm]}, measure=["turns", "temperature"],
        replicas=2, **REFERENCE,
    )  # fmt: skip
    compute = importlib.import_module("magmotor.sweep.compute").compute
    outcomes = [compute(case, sweep.measure) for case in sweep]
    assert [outcome.error for outcome in outcomes] == [None, None]
    assert [*mm.sweep.measures(rotor.Rotor())] == ["turns", "temperature"]


def test_it_is_filmed(rotor, tmp_path):
    run = mm.simulate(rotor.Rotor(), **REFERENCE)
    try:
        mm.render.still(run, None, tmp_path / "rotor.png", 1.0)
    except mm.render.NoOpenGL as reason:
        pytest.skip(str(reason))
    assert (tmp_path / "rotor.png").stat().st_size > 20_000
    mm.plots.overview(run, None, tmp_path / "overview.png")


def test_missing_features_are_named(rotor):
    scene = rotor.Rotor()
    with pytest.raises(ValueError, match=r"timestep = 0\.3: must be less than"):
        mm.simulate(scene, method="mujoco/euler", timestep=0.3, duration=3.0)
    with pytest.raises(ValueError, match="the charts have no "):
        mm.recommend(scene)
    with pytest.raises(ValueError, match="a Rotor has no energy balance"):
        mm.observables.energy_balance(mm.simulate(scene, **REFERENCE))


def test_an_ensemble_of_its_own_is_reproduced_at_its_times(rotor, monkeypatch):
    """Records at samples 0, 1, 2, 4, ..., and a dimension that only this ensemble has."""

    def own(scene, *, method, timestep, duration, replicas, seed, sample_interval, **rest):
        numerics = {"method": method, "timestep": timestep, "duration": duration, "seed": seed}
        run = mm.simulate(scene, **numerics, replicas=replicas, record_interval=sample_interval)
        final = run.isel(time=times(None, scene, 1, len(run.time), 1, 0.0).astype(int))
        mean = final[["theta"]].mean("replica").assign(bins=("angle_bin", [0.0, 1.0]))
        options = {"replicas": replicas, "sample_interval": sample_interval, "burn_in": 0.0}
        attributes = attributes_of(scene, **numerics, **options, trajectories=0)
        return mean.assign_coords(replica=run.replica).assign_attrs(attributes)

    def times(self, scene, timestep, duration, sample_interval, burn_in):
        last = int(np.log2(duration / (timestep * sample_interval)))
        return timestep * sample_interval * 2.0 ** np.arange(last + 1)

    device = rotor.RotorDevice
    monkeypatch.setattr(device, "ensemble", lambda self, scene: own)
    found = mm.ensemble(rotor.Rotor(), **REFERENCE, replicas=3, sample_interval=10)
    np.testing.assert_allclose(found.time, [0.1, 0.2, 0.4, 0.8, 1.6], rtol=1e-14, atol=0)  # 0
    with pytest.raises(ValueError, match=r"dimensions = .*angle_bin.*: must be those of one run"):
        mm.rerun(found)
    monkeypatch.setattr(device, "ensemble_dimensions", frozenset({"angle_bin"}))
    with pytest.raises(ValueError, match=r"time = .*: must be the times of a run's records"):
        mm.rerun(found)
    monkeypatch.setattr(device, "ensemble_times", times)
    assert mm.rerun(found).identical(found)
    with pytest.raises(ValueError, match=r"time = .*: must be the times of a run's records"):
        mm.rerun(found.isel(time=slice(1, None)))


@pytest.mark.parametrize(
    ("missing", "line"),
    [
        ("variational", r"method = 'variational/\.\.\.': a Rotor needs RotorDevice\.variational, "),
        ("mujoco", r"method = 'mujoco/baoab': a Rotor needs RotorDevice\.mujoco, which is missing"),
        ("ode", r"method = 'scipy/dop853': a Rotor needs RotorDevice\.ode, which is missing"),
        ("joints", r"scene = Rotor\(.*\): a Rotor needs RotorDevice\.joints, which is missing"),
    ],
)
def test_what_a_device_does_not_define_is_named(rotor, monkeypatch, tmp_path, missing, line):
    scene, device = rotor.Rotor(), rotor.RotorDevice
    run = mm.simulate(scene, **REFERENCE)
    monkeypatch.setattr(device, missing, getattr(Device, missing))
    monkeypatch.setattr(device, "methods", lambda self, scene: tuple(KINDS.values()))
    monkeypatch.setattr(device, "check_run", lambda *_: None)

    def use():
        if missing == "joints":
            mm.render.movie(run, scene, tmp_path / "rotor.mp4")
        else:
            mm.simulate(scene, **{**REFERENCE, "method": KINDS[missing]})

    with pytest.raises(ValueError, match=line):
        use()
    assert not any(tmp_path.iterdir())


def test_replicas_without_noise_are_rejected(rotor):
    cold = rotor.Rotor(kT=0.0)
    with pytest.raises(ValueError, match=r"replicas = 3: must be None: without noise \(kT = 0\)"):
        mm.simulate(cold, **REFERENCE, replicas=3)
    with pytest.raises(ValueError, match=r"replicas = 2: must be None: without noise"):
        mm.ensemble(cold, **REFERENCE, replicas=2)
    with pytest.raises(ValueError, match=r"replicas = 0: must be at least 1"):
        mm.simulate(rotor.Rotor(), **REFERENCE, replicas=0)
    assert float(mm.simulate(cold, **REFERENCE).theta[0]) == cold.angle


@pytest.mark.parametrize(
    ("part", "line"),
    [
        (
            {"theta": np.nan},
            r"initial\['theta'\] contains nan: every value must be finite and at",
        ),
        ({"omega": [0, 1e31]}, r"initial\['omega'\] contains 1e\+31: .* at most 1e\+30"),
        ({"theta": "north"}, r"initial\['theta'\] = 'north': must be an array of numbers"),
        (
            {"omega": [1, 2, 3]},
            r"initial\['omega'\] = \[1, 2, 3\]: must be a finite number or 2",
        ),
        (
            {"theta": [[1, 2]]},
            r"initial\['theta'\] = \[\[1, 2\]\]: must be a finite number or 2",
        ),
        ({"phi": 1}, r"initial = 'phi': must be one of theta, omega"),
    ],
)
def test_a_wrong_initial_state_is_named(rotor, part, line):
    with pytest.raises(ValueError, match=f"^{line}"):
        mm.simulate(rotor.Rotor(), **REFERENCE, replicas=2, initial=part)


def test_it_is_one_file_that_imports_only_what_is_public(tmp_path):
    """A copy of the file alone works, and all it takes from the package is in the API pages."""
    source = (EXAMPLES / "own_device.py").read_text(encoding="utf-8")
    copy = tmp_path / "mine.py"
    copy.write_text(source, encoding="utf-8")
    taken = re.findall(r"^(?:from|import) (\S+)", source, re.MULTILINE)
    known = {*sys.stdlib_module_names, "mujoco", "numpy", "xarray", "tyro"}
    ours = {name for name in taken if name.partition(".")[0] not in known}
    assert ours - {"numpy.typing", "collections.abc"} == {"magmotor", "magmotor.device"}
    done = subprocess.run(
        [sys.executable, "-W", "error", copy, "--help"],
        cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert "--replicas" in done.stdout


def test_two_scene_classes_of_one_name_are_rejected(rotor):
    other = type("Rotor", (Scene,), {"__module__": "elsewhere"})
    with pytest.raises(ValueError, match=r"name of the scene class = 'Rotor': .* has registered"):
        register(rotor.Rotor().device, other)
    assert isinstance(rotor.Rotor().device, Device)
