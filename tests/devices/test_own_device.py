"""A user-defined device outside the package has all features of the paper's devices."""

import itertools
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

import magmotor as mm
from magmotor.device import ENERGY_GREW, Device, Scene, register
from magmotor.device import device as protocol
from magmotor.device import job as jobs
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


METHODS = ("variational/baoab", "mujoco/euler", "mujoco/implicitfast", "mujoco/baoab")


@pytest.mark.parametrize("method", METHODS)
def test_an_interrupted_run_continues_to_the_bit(method, rotor, tmp_path, monkeypatch):
    """The whole run is one chunk, the interrupted one has 22."""
    scene, path = rotor.Rotor(), tmp_path / "rotor.checkpoint"
    arguments = {**REFERENCE, "method": method, "replicas": 2, "record_interval": 3}
    whole = mm.simulate(scene, **arguments)
    monkeypatch.setattr(jobs, "CHUNK", 20)
    real, chunks = rotor.RotorGuard.faults, itertools.count(1)

    def faults(guard, states):
        if next(chunks) == 3:
            raise KeyboardInterrupt
        return real(guard, states)

    with monkeypatch.context() as patch:
        patch.setattr(rotor.RotorGuard, "faults", faults)
        with pytest.raises(mm.SimulationInterrupted) as stop:
            mm.simulate(scene, **arguments, checkpoint=path)
    assert stop.value.dataset.sizes["time"] == 7  # the start, and two chunks of three records
    assert mm.simulate(scene, **arguments, checkpoint=path).identical(whole)
    assert mm.rerun(whole).identical(whole)


@pytest.mark.parametrize("method", METHODS)
def test_a_run_continues_another_on_its_brownian_path(method, rotor):
    arguments = {**REFERENCE, "method": method, "replicas": 2}
    long = mm.simulate(rotor.Rotor(), **{**arguments, "duration": 4.0})
    first = mm.simulate(rotor.Rotor(), **arguments)
    later = mm.simulate(rotor.Rotor(), **arguments, initial=first)
    for name in ("theta", "omega", "energy"):
        np.testing.assert_array_equal(first[name], long[name][:, :201])
        np.testing.assert_array_equal(later[name], long[name][:, 200:])


SWEEP = """
import magmotor as mm
from own_device import Rotor

if __name__ == "__main__":
    sweep = mm.sweep.Sweep(
        scene=Rotor(), vary={"kT": [1e-5, 4e-5]}, measure=["turns", "temperature"], seeds=2,
        replicas=2, method="variational/baoab", timestep=0.01, duration=2.0,
    )
    mm.sweep.run(sweep, "sweep", workers=1)
"""


def test_a_process_of_a_sweep_computes_its_measures(rotor, tmp_path):
    (tmp_path / "rotors.py").write_text(SWEEP)
    folders = os.pathsep.join([str(EXAMPLES), os.environ.get("PYTHONPATH", "")])
    environment = {**os.environ, "PYTHONPATH": folders}
    subprocess.run([sys.executable, "rotors.py"], cwd=tmp_path, env=environment, check=True)
    found = mm.sweep.combine(tmp_path / "sweep")
    cases = [*mm.sweep.sweep_of(tmp_path / "sweep")]
    assert found.turns.shape == found.temperature.shape == (2, 2, 2)
    points = itertools.product((1e-5, 4e-5), (0, 1))
    for case, (kT, seed) in zip(cases, points, strict=True):
        scene = rotor.Rotor(kT=kT)
        run = mm.simulate(scene, **REFERENCE, replicas=2, seed=case.spec["seed"])
        own = found.sel(kT=kT, seed=seed)
        turns = np.max(np.abs(run.theta.values - 1.0), axis=1) / 6.283185307179586
        np.testing.assert_array_equal(own.turns, turns)
        temperature = 2e-6 * np.mean(run.omega.values**2, axis=1)
        np.testing.assert_allclose(own.temperature, temperature, rtol=2e-15, atol=0)  # 0
    assert [*mm.sweep.measures(rotor.Rotor())] == ["turns", "temperature"]


def red_half(picture):
    """Return the angle from north of the needle's red half in the view from above, in degrees.

    The camera is 0.5 m above the needle, whose axle is 0.05 m south of the view's center. The trail
    is out of the circle that counts.
    """
    view = picture[:360, 800:]
    rows, columns = np.nonzero((view[..., 0] > 2 * view[..., 1]) & (view[..., 0] > 80))
    pixel = 2 * 0.5 * np.tan(np.radians(45 / 2)) / 360
    east, north = pixel * (columns + 0.5 - 240), pixel * (180 - rows - 0.5) + 0.05
    inside = np.hypot(east, north) < 0.035
    assert inside.sum() > 200  # 274
    return np.degrees(np.arctan2(-east[inside].mean(), north[inside].mean()))


def test_its_pictures_show_the_needle_and_its_angle(rotor, tmp_path, written):
    run = mm.simulate(rotor.Rotor(), **REFERENCE)
    shown = []
    for record in (0, 50, 100):
        try:
            mm.render.still(run, None, tmp_path / "rotor.png", record / 100)
        except mm.render.NoOpenGL as reason:
            pytest.skip(str(reason))
        with Image.open(tmp_path / "rotor.png") as picture:
            shown.append(red_half(np.asarray(picture).astype(int)))
    angles = np.degrees(run.theta.values[[0, 50, 100]])
    assert np.ptp(angles) > 60  # 70
    np.testing.assert_allclose(shown, angles, rtol=0, atol=2)  # 0.46
    for words in ("t = 0.0 s", "θ +57°", "t = 0.5 s", "θ +0°", "t = 1.0 s", "θ −12°"):
        assert words in written
    assert rotor.RotorMovieContent.title in written


def test_its_movies_have_curve_marker_and_trail(rotor):
    run = mm.simulate(rotor.Rotor(), **REFERENCE)
    content = rotor.RotorMovieContent(run, rotor.Rotor(), np.array([0.0, 0.505]))
    theta = run.theta.values
    between = np.degrees((theta[50] + theta[51]) / 2)
    np.testing.assert_allclose(content.value, [np.degrees(1.0), between], rtol=4e-15)  # 4e-16
    np.testing.assert_allclose(np.linalg.norm(content.path, axis=1), 0.05, rtol=2e-15)  # 2e-16
    around = np.arctan2(-content.path[:, 0], content.path[:, 1])
    np.testing.assert_allclose(around, theta, rtol=0, atol=1e-15)  # 1e-16
    (line,) = content.plot(Figure().add_subplot())
    np.testing.assert_array_equal(line.get_xydata().T, [run.time, np.degrees(theta)])


def test_its_overview_is_written(rotor, tmp_path):
    run = mm.simulate(rotor.Rotor(), **REFERENCE)
    mm.plots.overview(run, None, tmp_path / "overview.png")
    with Image.open(tmp_path / "overview.png") as picture:
        assert np.std(np.asarray(picture)) > 5  # 21


@pytest.mark.parametrize(("warmth", "most"), [(0.0, 0.5), (0.01, 2.0)])
def test_its_guard_finds_states_with_too_much_energy(warmth, most, rotor):
    """A needle at rest may gain the error of a method, or 200 kT; energies over the torque."""
    torque = rotor.Rotor().torque
    scene = rotor.Rotor(angle=0.0, kT=warmth * torque)
    device = scene.device
    guard = device.guard(scene, device.initial_state(scene, None, 2))

    def states(kinetic):
        omega = np.sqrt(2 * np.array([[0.0, 0.0], [0.0, kinetic], [kinetic, 0.0]]) * torque / 2e-6)
        return rotor.RotorStates(np.arange(3.0), 0 * omega, omega)

    assert guard.first_wrong(states(0.99 * most)) == (3, None)
    assert guard.first_wrong(states(1.01 * most)) == (1, (ENERGY_GREW, ""))


def test_an_unstable_run_of_it_ends(rotor):
    scene = rotor.Rotor(kT=0.0)
    arguments = {**REFERENCE, "timestep": 0.5, "duration": 50.0}
    with pytest.raises(mm.SimulationDiverged, match=ENERGY_GREW):
        mm.simulate(scene, **arguments, allow_unstable=True)


def test_missing_features_are_named(rotor):
    scene = rotor.Rotor()
    with pytest.raises(ValueError, match=r"timestep = 0\.3: must be less than"):
        mm.simulate(scene, method="mujoco/euler", timestep=0.3, duration=3.0)
    with pytest.raises(ValueError, match="the charts have no "):
        mm.recommend(scene)
    with pytest.raises(ValueError, match="a Rotor has no energy balance"):
        mm.observables.energy_balance(mm.simulate(scene, **REFERENCE))


def test_its_module_registers_it(rotor):
    assert protocol.SCENES["Rotor"] is rotor.Rotor
    assert isinstance(rotor.Rotor().device, rotor.RotorDevice)


def test_the_last_registration_counts(rotor, monkeypatch):
    """A notebook may run the cell that defines a device again."""
    monkeypatch.setattr(protocol, "SCENES", dict(protocol.SCENES))
    scenes = [type("Again", (Scene,), {"__module__": "notebook"}) for _ in range(2)]
    devices = [rotor.RotorDevice() for _ in range(3)]
    for device, scene in zip(devices, [scenes[0], scenes[0], scenes[1]], strict=True):
        register(device, scene)
        assert protocol.SCENES["Again"] is scene
        assert scene.device is device
    assert scenes[0].device is devices[1]


def test_an_ensemble_of_its_own_is_reproduced_at_its_times(rotor, monkeypatch):
    """Records at samples 0, 1, 2, 4, ..., and a dimension that only this ensemble has."""

    def own(scene, options, simulate):
        told = options._asdict()
        numerics = {name: told[name] for name in ("method", "timestep", "duration", "seed")}
        replicas, sample_interval = options.replicas, options.sample_interval
        run = simulate(scene, **numerics, replicas=replicas, record_interval=sample_interval)
        final = run.isel(time=times(None, scene, 1, len(run.time), 1, 0.0).astype(int))
        mean = final[["theta"]].mean("replica").assign(bins=("angle_bin", [0.0, 1.0]))
        more = {"replicas": replicas, "sample_interval": sample_interval, "burn_in": 0.0}
        attributes = attributes_of(scene, **numerics, **more, trajectories=0)
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
    assert protocol.SCENES["Rotor"] is rotor.Rotor
    assert isinstance(rotor.Rotor().device, Device)
