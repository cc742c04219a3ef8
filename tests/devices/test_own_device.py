"""A user-defined device outside the package has all features of the paper's devices."""

import importlib
from pathlib import Path

import numpy as np
import pytest

import magmotor as mm
from magmotor.device import Device, Scene, register
from magmotor.device import device as protocol

EXAMPLES = Path(__file__).parents[2] / "examples"
REFERENCE = {"method": "variational/baoab", "timestep": 0.01, "duration": 2.0}


@pytest.fixture
def rotor(monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLES)
    module = importlib.import_module("own_device")
    monkeypatch.setitem(protocol.SCENES, "Rotor", module.Rotor)
    return module


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


def test_two_scene_classes_of_one_name_are_rejected(rotor):
    other = type("Rotor", (Scene,), {"__module__": "elsewhere"})
    with pytest.raises(ValueError, match=r"name of the scene class = 'Rotor': .* has registered"):
        register(rotor.Rotor().device, other)
    assert isinstance(rotor.Rotor().device, Device)
