"""Ensembles: statistics compared with stored trajectories, threads, checkpoints, crashes."""

import errno
import signal
from typing import Any

import numpy as np
import pytest
from refusals import refused

import magmotor as mm
from magmotor import theory
from magmotor.common import files as whole_files
from magmotor.device import ENERGY_GREW
from magmotor.device import checkpoint as checkpoints
from magmotor.devices.disk.ensemble import accumulators
from magmotor.devices.disk.ensemble import run as ensembles
from magmotor.devices.disk.ensemble.result import _jackknife

WARM = mm.Disk(sigma=0.5, friction=0.5, noise=1.0)
ARGUMENTS: dict[str, Any] = {
    "method": "variational/baoab", "timestep": 0.05, "duration": 60.0, "replicas": 150,
    "seed": 2, "sample_interval": 10,
}  # fmt: skip


@pytest.fixture(scope="module")
def trajectories():
    """Return the same replicas with all 121 samples stored, 0.5 apart."""
    return mm.simulate(
        WARM, method="variational/baoab", timestep=0.05, duration=60, replicas=150, seed=2,
        record_interval=10,
    )  # fmt: skip


@pytest.fixture(scope="module")
def whole():
    return mm.ensemble(WARM, **ARGUMENTS, trajectories=7)


def test_replicas_equal_those_of_simulate(trajectories, whole):
    for name in ("x", "v", "theta", "omega"):
        np.testing.assert_array_equal(whole[name], trajectories[name][:, -1])
    np.testing.assert_array_equal(whole.path, trajectories.x[:7].sel(time=whole.time))


def test_moments_equal_those_of_the_trajectories(trajectories, whole):
    at = trajectories.sel(time=whole.time)
    moved = at.x - at.x[:, 0], at.theta - at.theta[:, 0]
    for name, values in {
        "x": moved[0],
        "y": moved[0] + moved[1],
        "v": at.v,
        "omega": at.omega,
        "energy": at.energy,
        "slip": at.v + at.omega,
        "d": WARM.sigma * at.omega - at.v,
    }.items():
        found = whole.sel(quantity=name)
        close: dict[str, Any] = {"rtol": 1e-15, "atol": 0}  # 0, the same sums
        np.testing.assert_allclose(found["mean"], values.mean("replica"), **close)
        np.testing.assert_allclose(found.mean_square, (values**2).mean("replica"), **close)
        root = np.sqrt(150)
        np.testing.assert_allclose(
            found.mean_error, values.std("replica") / root, rtol=0, atol=2e-14
        )  # 6e-16
        square_error = (values**2).std("replica") / root
        np.testing.assert_allclose(
            found.mean_square_error, square_error, rtol=0, atol=3e-13
        )  # 1.4e-14


@pytest.mark.parametrize(("burn_in", "lags"), [(0.0, 5), (7.5, 5), (45.0, 3)])
def test_increment_correlations_equal_those_of_the_trajectories(trajectories, burn_in, lags):
    run = mm.ensemble(WARM, **ARGUMENTS, burn_in=burn_in)
    x = trajectories.x.values[:, round(burn_in / 0.5) :]
    assert run.lag[0] == 0.5
    assert run.sizes["lag"] == lags
    for level, (found, square) in enumerate(
        zip(run.increment_correlation, run.mean_square_increment, strict=True)
    ):
        increments = np.diff(x[:, :: 2**level], axis=1)
        a, b = increments[:, :-1].ravel(), increments[:, 1:].ravel()
        assert float(found) == pytest.approx(np.corrcoef(a, b)[0, 1], rel=0, abs=2e-14)  # 9e-16
        assert float(square) == pytest.approx(np.mean(b**2), rel=1e-14, abs=0)  # 5e-16
    assert (run.increment_correlation_error > 0).all()


def test_errors_of_the_correlations_match_repeated_runs():
    """The jackknife error agrees with the scatter of 100 seeds, which is known to 1/sqrt(198)."""
    runs = [
        mm.ensemble(WARM, **(ARGUMENTS | {"seed": s, "replicas": 640, "burn_in": 5.0}))
        for s in range(100)
    ]
    found = np.array([r.increment_correlation for r in runs])
    told = np.array([r.increment_correlation_error for r in runs])
    ratio = found.std(axis=0, ddof=1) / np.sqrt(np.mean(told**2, axis=0))
    assert (np.abs(ratio - 1) < 4 / np.sqrt(198)).all()  # 0.95 to 1.05; 1.35 to 1.49 of errors / √2


@pytest.mark.parametrize(
    "sizes", [(128, 1), (128, 22), (128, 128, 4), (128, 128, 128, 128, 128), (5, 9, 2, 40)]
)
def test_the_jackknife_of_unequal_groups_is_unbiased(sizes):
    """For means of n normal numbers, with variance 1/n; within 4 standard errors of 1e5 draws."""
    sizes = np.array(sizes)[:, np.newaxis]
    sums = np.random.default_rng(1).normal(size=(len(sizes), 100_000)) * np.sqrt(sizes)
    total, number = sums.sum(axis=0), sizes.sum()
    told = _jackknife(total / number, (total - sums) / (number - sizes), sizes + 0 * sums)
    ratio = number * np.mean(told**2)
    assert abs(ratio - 1) < 4 * np.sqrt(2 / 1e5)  # 0.996 to 1.002


def test_errors_of_the_correlations_with_a_small_last_group():
    """As above; the errors of two groups also scatter by 1/sqrt(2 * 100)."""
    runs = [
        mm.ensemble(WARM, **(ARGUMENTS | {"seed": s, "replicas": 130, "burn_in": 5.0}))
        for s in range(100)
    ]
    found = np.array([r.increment_correlation for r in runs])
    told = np.array([r.increment_correlation_error for r in runs])
    ratio = found.std(axis=0, ddof=1) / np.sqrt(np.mean(told**2, axis=0))
    assert (np.abs(ratio - 1) < 4 / np.sqrt(100)).all()  # 1.09 to 1.18


def test_densities_are_histograms(trajectories, whole):
    x, v = trajectories.x.values % (2 * np.pi), trajectories.v.values
    bins = np.linspace(0, 2 * np.pi, accumulators.BINS + 1)
    expected = np.histogram(x, bins, density=True)[0]
    assert np.abs(whole.density_x - expected).max() < 1e-15  # 6e-17
    bins = np.linspace(-6, 6, accumulators.BINS + 1) * np.sqrt(theory.temperature(WARM))
    expected = np.histogram(v, bins, density=True)[0]
    np.testing.assert_allclose(whole.density_v, expected, rtol=0, atol=1e-15)  # 6e-17
    for name in ("x", "v", "omega"):
        width = float(whole[f"{name}_bin"].diff(f"{name}_bin")[0])
        assert float(whole[f"density_{name}"].sum()) * width == pytest.approx(
            1, rel=1e-13, abs=0
        )  # 5e-15


@pytest.mark.parametrize("burn_in", [0.0, 30.0])
def test_flights_equal_those_of_the_trajectories(trajectories, burn_in):
    """Flights by their definition, in Python loops."""
    whole = mm.ensemble(WARM, **ARGUMENTS, burn_in=burn_in)
    d = (WARM.sigma * trajectories.omega - trajectories.v).values[:, round(burn_in / 0.5) :]
    threshold = 0.1 * np.sqrt(theory.gibbs_mean_squares(WARM)["d"])
    finished, unfinished = [], []
    for row in d:
        sign, since = 0, None
        for sample, value in enumerate(row):
            now = int(value > threshold) - int(value < -threshold)
            if now and now != sign:
                if since is not None:
                    finished.append(sample - since)
                since = sample if sign else None
                sign = now
        if since is not None and since < len(row) - 1:
            unfinished.append(len(row) - 1 - since)
    edges = np.append(accumulators.flight_bin_edges(), np.inf)[: whole.sizes["flight_duration"] + 1]
    assert len(finished) > 500
    for durations, found in ((finished, whole.flights), (unfinished, whole.unfinished_flights)):
        # Durations are integers; one at an edge, a power of 2, belongs to the bin above.
        expected = np.histogram(np.array(durations) * (1 + 1e-12), edges)[0]
        np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_the_number_of_threads_does_not_change_a_bit(threads, whole):
    assert mm.ensemble(WARM, **ARGUMENTS, trajectories=7, threads=threads).identical(whole)


def press_ctrl_c():
    signal.raise_signal(signal.SIGINT)


class Crash(Exception):
    """An error that no code expects."""


def crash():
    raise Crash


def interrupt_after(monkeypatch, calls, event):
    """Call `event` in a segment of an ensemble, before all groups are done."""
    advance = ensembles.EnsembleRun._advance_group
    done = []

    def broken(self, group, *arguments):
        if group == 0:
            done.append(1)
            if len(done) == calls:
                event()
        advance(self, group, *arguments)

    monkeypatch.setattr(ensembles.EnsembleRun, "_advance_group", broken)


@pytest.mark.parametrize("calls", [1, 20, 60])
def test_an_interrupted_ensemble_continues_to_the_bit(tmp_path, monkeypatch, whole, calls):
    path = tmp_path / "run.ckpt"
    with monkeypatch.context() as patch:
        interrupt_after(patch, calls, press_ctrl_c)
        with pytest.raises(mm.SimulationInterrupted) as caught:
            mm.ensemble(WARM, **ARGUMENTS, trajectories=7, checkpoint=path)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    partial = caught.value.dataset
    assert 0 < partial.attrs["time_reached"] < 60
    np.testing.assert_array_equal(partial["mean"], whole["mean"].sel(time=partial.time))
    resumed = mm.ensemble(WARM, **ARGUMENTS, trajectories=7, checkpoint=path, threads=1)
    assert resumed.identical(whole)
    again = mm.ensemble(WARM, **ARGUMENTS, trajectories=7, checkpoint=path)
    assert again.identical(whole)


def test_a_crash_loses_only_the_samples_after_the_last_checkpoint(tmp_path, monkeypatch, whole):
    path = tmp_path / "run.ckpt"
    with monkeypatch.context() as patch:
        patch.setattr(checkpoints, "SECONDS_BETWEEN", 0.0)
        interrupt_after(patch, 30, crash)
        with pytest.raises(Crash):
            mm.ensemble(WARM, **ARGUMENTS, trajectories=7, checkpoint=path)
    assert b'"done": 0,' not in path.read_bytes()[:5000]
    assert mm.ensemble(WARM, **ARGUMENTS, trajectories=7, checkpoint=path).identical(whole)


def test_a_full_disk_keeps_the_previous_checkpoint(tmp_path, monkeypatch, whole):
    path = tmp_path / "run.ckpt"
    with monkeypatch.context() as patch:
        interrupt_after(patch, 20, press_ctrl_c)
        with pytest.raises(mm.SimulationInterrupted):
            mm.ensemble(WARM, **ARGUMENTS, trajectories=7, checkpoint=path)
    before = path.read_bytes()

    def full(number):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(whole_files.os, "fsync", full)
        with pytest.warns(UserWarning, match="checkpoint is kept"):
            run = mm.ensemble(WARM, **ARGUMENTS, trajectories=7, checkpoint=path)
    assert run.identical(whole)
    assert path.read_bytes() == before
    assert [*tmp_path.iterdir()] == [path]


def test_a_checkpoint_of_another_task_is_refused(tmp_path):
    path = tmp_path / "run.ckpt"
    mm.ensemble(WARM, **ARGUMENTS, checkpoint=path)
    with refused("checkpoint"):
        mm.ensemble(WARM, **{**ARGUMENTS, "seed": 3}, checkpoint=path)
    for content in (b"", b"not a checkpoint", path.read_bytes()[:200]):
        path.write_bytes(content)
        with refused("checkpoint"):
            mm.ensemble(WARM, **ARGUMENTS, checkpoint=path)


def test_mujocos_ensemble_has_the_same_statistics_on_the_same_noise():
    """The groups of the jackknife are smaller, so that a few replicas have errors."""
    reference, found = (
        mm.ensemble(
            WARM, **ARGUMENTS | {"method": method, "duration": 30.0, "replicas": 20},
            burn_in=5.0, trajectories=4,
        )
        for method in ("variational/baoab", "mujoco/baoab")
    )  # fmt: skip
    assert found.attrs["method"] == "mujoco/baoab"
    assert mm.rerun(found).identical(found)
    jackknifed = ["increment_correlation_error", "mean_square_increment_error"]
    assert np.isfinite(found[jackknifed]).all().to_array().all()
    same = reference.drop_vars(jackknifed)
    for name, values in same.items():
        size = float(np.abs(values).max())
        np.testing.assert_allclose(
            found[name], values, rtol=0, atol=3e-12 * size, err_msg=str(name)
        )  # 6e-13


def test_gibbs_states_are_stationary():
    """Compare moments at the start and later, 20 000 replicas, within 4 standard errors."""
    scene = WARM.replace(potential="asymmetric")
    initial = mm.theory.gibbs(scene, 20_000, seed=1)
    run = mm.ensemble(
        scene, method="variational/baoab", timestep=0.05, duration=10.0, replicas=20_000, seed=1,
        initial=initial,
    )  # fmt: skip
    energy = run.sel(quantity="energy")
    gap = np.abs(energy["mean"] - energy["mean"][0])
    assert (gap[1:] < 4 * np.sqrt(2) * energy.mean_error[1:]).all()
    for name, expected in theory.gibbs_mean_squares(scene).items():
        chosen = run.sel(quantity=name)
        assert (np.abs(chosen.mean_square - expected) < 4 * chosen.mean_square_error).all()


def test_a_diverging_ensemble_raises_with_its_records():
    with (
        pytest.warns(UserWarning, match="aliased"),
        pytest.raises(mm.SimulationDiverged) as caught,
    ):
        mm.ensemble(
            mm.Disk(), method="variational/euler", timestep=1.5, duration=1e6, replicas=100,
            sample_interval=100,
        )  # fmt: skip
    assert caught.value.reason == ENERGY_GREW
    assert caught.value.dataset.sizes["time"] > 3
    assert 0 < caught.value.time < 1e6


def test_conditioning_on_d_does_not_change_the_slip():
    scene = mm.Disk(sigma=0.7)
    state = mm.theory.gibbs(scene, 40_000, seed=1, d=30.0)
    d, slip = scene.sigma * state["omega"] - state["v"], state["v"] + state["omega"]
    np.testing.assert_allclose(d, 30.0, rtol=2e-14)  # 7e-16
    expected = theory.gibbs_mean_squares(scene)["slip"]
    assert (slip**2).mean() == pytest.approx(expected, rel=0.03)  # 0.008, one deviation: 0.007
    assert abs(slip.mean()) < 0.02 * expected**0.5  # 0.003, one deviation: 0.005


@pytest.mark.parametrize("noise", [0.3, 0.05])
def test_a_cold_state_is_drawn_from_an_asymmetric_well(noise):
    """The sum of coefficients overestimates its depth; with it, few samples are accepted."""
    scene = mm.Disk(potential="asymmetric", noise=noise)
    x = np.sort(mm.theory.gibbs(scene, 2000, seed=1)["x"])
    reached = np.abs(theory.position_cdf(scene, x) - np.arange(2000) / 2000).max()
    assert reached < 0.044  # 0.019, 0.013; one in a thousand draws is beyond
