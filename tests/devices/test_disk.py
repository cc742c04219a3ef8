"""The sliding disk: the reference schemes against theory, and the paper's claims measured.

Statistical tests have fixed seeds; their bounds are those of the claim, or 4 standard errors (false
alarm rate 6e-5), and the standard error stands beside the measured value.
"""

import numpy as np
import pytest
from refusals import refused
from scipy import stats

import magmotor as mm
from magmotor import theory
from magmotor.device import ENERGY_GREW
from magmotor.noise import BrownianPath
from magmotor.numerics.splittings import DISK

PAPER = mm.Disk()
WARM = mm.Disk(sigma=0.5, friction=0.5, noise=1.0)
"""Temperature kT = 1, the amplitude of the potential."""

ODD = ((0.1, 0.2), (0.3, -0.5), (0.0, 0.3))
VARIATIONAL = (
    "variational/euler",
    "variational/verlet",
    "variational/baoab",
    "variational/middle",
)
FIRST_ORDER = ("variational/euler", "variational/middle")
SEVERAL_POTENTIALS = ("symmetric", "asymmetric", "flat", "cosine", ODD)


def test_schemes_are_lists_and_splittings_are_palindromes():
    assert DISK["euler"].parts == "OBA"
    assert DISK["middle"].parts == "BAOA"
    first = [name.removeprefix("variational/") for name in FIRST_ORDER]
    symmetric = [scheme for name, scheme in DISK.items() if name not in first]
    assert len(symmetric) == 4
    assert all(s.parts == s.parts[::-1] for s in symmetric)
    assert all(s.fractions == s.fractions[::-1] for s in symmetric)


@pytest.mark.parametrize("potential", SEVERAL_POTENTIALS, ids=str)
def test_the_euler_scheme_is_the_papers(potential):
    """Equation (svi), written out in NumPy with a matrix root of C."""
    scene = mm.Disk(potential=potential)
    h, sigma = 0.01, scene.sigma
    run = mm.simulate(scene, method="variational/euler", timestep=h, duration=5, seed=7)
    increments = BrownianPath(7, h).increments(500)
    C = np.array([[1, 1 / sigma], [1 / sigma, 1 / sigma**2]])
    # C has rank one: n dW is a root of C times any two Brownian motions whose image this is.
    n = np.array([1, 1 / sigma])
    assert np.allclose(np.outer(n, n), C, rtol=1e-15)
    x, theta, u = 0.0, 0.0, np.zeros(2)
    path = []
    for dW in increments:
        slope = sum(
            k * (a * np.cos(k * x) - b * np.sin(k * x))
            for k, (a, b) in enumerate(scene.coefficients, start=1)
        )
        momentum = u * [1, sigma]
        u = u - [h * slope, 0] - h * scene.friction * C @ momentum + scene.noise * n * dW
        x, theta = x + h * u[0], theta + h * u[1]
        path.append([x, theta, *u])
    found = np.array([run.x[1:], run.theta[1:], run.v[1:], run.omega[1:]]).T
    assert np.abs(found - path).max() < 3e-14 * np.abs(path).max()  # 1.2e-15


@pytest.mark.parametrize("potential", SEVERAL_POTENTIALS, ids=str)
def test_momentum_identity_along_each_path(potential):
    """y_N - y_0 = (alpha/c) W_N - (sigma/c)(omega_N - omega_0) + h (s_N - s_0), for any U."""
    scene, h, replicas, steps = mm.Disk(potential=potential), 0.01, 20, 5000
    run = mm.simulate(
        scene, method="variational/euler", timestep=h, duration=50, seed=3, replicas=replicas
    )
    W = [BrownianPath(3, h).increments(steps, replica=r).sum() for r in range(replicas)]
    y, s = run.x + run.theta, run.v + run.omega
    gain = [(q[:, -1] - q[:, 0]).values for q in (y, s, run.omega)]
    c, sigma = scene.friction, scene.sigma
    expected = scene.noise / c * np.array(W) - sigma / c * gain[2] + h * gain[1]
    assert np.abs(gain[0] - expected).max() < 5e-11  # 3e-12 of values up to 820


@pytest.mark.parametrize("method", VARIATIONAL)
def test_a_shift_of_d_by_the_alias_period_changes_nothing(method):
    h, steps = 0.05, 200
    period = theory.alias_period(PAPER, h)
    assert period == pytest.approx(2 * np.pi * 1.5 / h, rel=1e-15, abs=0)  # 0
    # d shifts at constant slip: v by -period/(1 + sigma), omega by the opposite.
    shift = period / (1 + PAPER.sigma)
    # Verlet's scheme uses the forces half a step later.
    ahead = h / 2 * shift if method == "variational/verlet" else 0.0
    both = [
        mm.simulate(PAPER, method=method, timestep=h, duration=h * steps, seed=1, initial=initial)
        for initial in ({}, {"v": -shift, "omega": shift, "x": ahead})
    ]
    n = np.arange(steps + 1)
    assert np.abs(both[1].v + shift - both[0].v).max() < 2e-11  # 5e-13, 1.3e-12
    assert np.abs(both[1].omega - shift - both[0].omega).max() < 4e-12  # 2.3e-13
    apart = both[1].x + 2 * np.pi * n - both[0].x - ahead
    assert np.abs(apart).max() < 5e-11  # 1.9e-12


def test_a_step_beyond_the_alias_limit_gives_a_warning_with_the_limit():
    largest = theory.largest_timestep(PAPER)
    assert largest == pytest.approx(np.pi / 6 * np.sqrt(1.5 * 0.008), rel=1e-15, abs=0)  # 0
    arguments = {"method": "variational/euler", "duration": 1.0}
    mm.simulate(PAPER, timestep=0.999 * largest, **arguments)
    with pytest.warns(UserWarning, match=r"above 0\.0574 ") as warned:
        mm.simulate(PAPER, timestep=0.06, **arguments)
    assert warned[0].filename == __file__


def moment(run, quantity, power="mean_square"):
    """Return the last recorded mean square and its standard error."""
    chosen = run.sel(quantity=quantity).isel(time=-1)
    return float(chosen[power]), float(chosen[f"{power}_error"])


def test_flat_variance_from_rest():
    run = mm.ensemble(
        mm.Disk(potential="flat"), method="variational/euler", timestep=0.05, duration=2000,
        replicas=2500, seed=1, sample_interval=400,
    )  # fmt: skip
    square, error = moment(run, "x")
    expected = 277.8 * (2000 - 5.0)
    assert error / expected < 0.03  # 0.028
    assert square == pytest.approx(expected, rel=0.11)  # 0.996; one deviation: 0.028
    assert abs(square / 2000 - 444.4) > 100  # the paper's limit of var(x)/t


def test_symmetric_from_rest_rejects_the_papers_diffusion():
    """Sample size 2500; 4 standard errors from the expected values, and more from the paper's."""
    run = mm.ensemble(
        PAPER, method="variational/euler", timestep=0.01, duration=1000, replicas=2500, seed=1,
        sample_interval=1000,
    )  # fmt: skip
    assert moment(run, "d")[0] == pytest.approx(76.3, abs=7.4)  # 79.3 +- 1.8
    assert moment(run, "x")[0] == pytest.approx(1.35e7, abs=1.4e6)  # 1.313e7 +- 3.4e5
    square, error = moment(run, "y")
    assert square / 1000 == pytest.approx(theory.y_diffusion(PAPER), rel=0.11)  # 2471 +- 69
    assert theory.y_diffusion(PAPER) == pytest.approx(2500, rel=1e-15, abs=0)  # 0
    assert (square / 1000 - 1000) / (error / 1000) > 15  # 21; the paper has 1000
    diffusion, deviation = (value / 1000 for value in moment(run, "x"))
    assert (diffusion - 444.4) / deviation > 25  # 37


@pytest.mark.parametrize(
    ("method", "expected"), [("variational/euler", 1.081), ("variational/baoab", 1.0)]
)
def test_slip_temperature_of_each_scheme(method, expected):
    """<s^2>/(gamma kT): 96 times 4.0 apart, six times 1/lambda, 4000 replicas; 4 errors.

    The power against Euler's 8 % is above 0.999.
    """
    run = mm.ensemble(
        WARM, method=method, timestep=0.1, duration=400, replicas=4000, seed=1,
        sample_interval=40,
    )  # fmt: skip
    slip = run.sel(quantity="slip").sel(time=slice(20, None))
    unit = theory.gibbs_mean_squares(WARM)["slip"]
    error = float(slip.mean_square_error.mean()) / unit / np.sqrt(slip.sizes["time"])
    assert error < 2.5e-3  # 2.4e-3, 2.3e-3
    assert float(slip.mean_square.mean()) / unit == pytest.approx(expected, abs=0.01)  # 0.0065
    # 1.0749, 0.9935, on the same paths; 40 000 replicas of seed 2 have 1.0807(8), 0.9991(7)
    if method == "variational/euler":
        assert theory.euler_slip_variance(WARM, 0.1) / unit == pytest.approx(
            1.081, abs=2e-4
        )  # 8e-5


def test_lower_ballistic_bound_fails():
    """E[A^2] vanishes, E[B^2] tends to mu[d^2]: the theorem's step E[A^2] = E[B^2] is wrong.

    60 initial states from the Gibbs measure, 100 Brownian paths from each, whose means stand for
    the conditional expectations; t = 1000.
    """
    starts, paths, t = 60, 100, 1000.0
    initial = {k: np.repeat(v, paths) for k, v in mm.theory.gibbs(WARM, starts, seed=5).items()}
    run = mm.simulate(
        WARM, method="variational/baoab", timestep=0.05, duration=t, replicas=starts * paths,
        seed=1, record_interval=20_000, initial=initial,
    )  # fmt: skip
    z = (WARM.sigma * run.theta - run.x).values
    d = (WARM.sigma * run.omega - run.v).values[:, 1].reshape(starts, paths)
    moved = (z[:, 1] - z[:, 0]).reshape(starts, paths)
    A = (moved - moved.mean(axis=1, keepdims=True)) / t
    B = d - d.mean(axis=1, keepdims=True) - A
    unit = theory.gibbs_mean_squares(WARM)["d"] * (paths - 1) / paths
    assert np.mean(A**2) / unit < 0.05  # 0.0178 +- 0.0007
    assert np.mean(B**2) / unit == pytest.approx(1, abs=0.1)  # 1.020 +- 0.019
    # In the paper's own terms: MSD/t^2 is below its lower bound (1 + sigma)/(4 beta).
    assert np.mean(moved**2) / t**2 < 0.25 * theory.gibbs_mean_squares(WARM)["d"]  # 0.018 of it


def test_y_diffuses_at_the_corrected_rate():
    """2500 replicas, 4 standard errors; a noise larger by a tenth is seen with a power of 0.99."""
    run = mm.ensemble(
        WARM, method="variational/baoab", timestep=0.1, duration=3000, replicas=2500, seed=1,
        sample_interval=1000,
    )  # fmt: skip
    square, error = moment(run, "y")
    assert error / 3000 < 0.12  # 0.114
    assert square / 3000 == pytest.approx(4.0, abs=0.45)  # 4.036


@pytest.mark.parametrize(("method", "bound"), [("variational/euler", 1), ("variational/baoab", 2)])
def test_energy_balance_pathwise(method, bound):
    """E(t) - E(0) = -heat + injected + martingale on each of 50 paths, to the scheme's order."""
    residuals = []
    steps = (0.04, 0.02, 0.01)
    for h in steps:
        run = mm.simulate(PAPER, method=method, timestep=h, duration=50, replicas=50, seed=1)
        balance = mm.observables.energy_balance(run, PAPER)
        injected = float(balance.injected[0, -1])
        assert injected == pytest.approx(theory.injection_rate(PAPER) * 50, rel=1e-15, abs=0)  # 0
        residuals.append(float(np.abs(balance.residual).max("time").mean()) / injected)
        gain = run.energy.values - run.energy.values[:, :1]
        rest = gain + (balance.heat - balance.injected - balance.martingale).values
        np.testing.assert_allclose(balance.residual, rest, rtol=0, atol=2e-11)  # 9e-13
    order = np.polyfit(np.log(steps), np.log(residuals), 1)[0]
    assert residuals[-1] < {1: 1e-3, 2: 5e-6}[bound]  # 4.2e-4, 2.3e-6
    assert order == pytest.approx(bound, abs=0.2)  # 0.91, 2.01


@pytest.mark.parametrize("method", ["verlet", "baoab", "middle", "blanes-moan4", "blanes-moan6"])
def test_the_energy_balance_closes_at_a_large_step(method):
    """Also without noise, when heat is as accurate as the method; lambda h = 0.3."""
    cold = mm.Disk(friction=0.5, noise=0.0, v=2.0, omega=1.0, drag=0.05)
    run = mm.simulate(cold, method=f"variational/{method}", timestep=0.2, duration=20)
    balance = mm.observables.energy_balance(run)
    bound = {"middle": 0.5, "blanes-moan4": 1e-5, "blanes-moan6": 5e-8}.get(method, 0.05)
    # 4.6e-3, 3.6e-3, 0.11, 5.3e-7, 1.8e-9
    assert float(abs(balance.residual).max()) < bound * float(balance.heat[-1])
    if method.startswith("blanes"):
        return
    warm = mm.Disk(friction=0.5, noise=1.0, friction_ratio=0.3)
    many = mm.simulate(warm, method=f"variational/{method}", timestep=0.2, duration=400, replicas=8)
    balance = mm.observables.energy_balance(many)
    # 1.7e-4, 1.0e-4, 3.9e-4
    assert float(abs(balance.residual).max()) < 2e-3 * float(balance.injected[0, -1])


def test_energy_balance_follows_the_path_of_the_run():
    """Also for a coarsened path of another run, and for a run that continues another."""
    path = BrownianPath(1, 0.005).coarsened(2)
    arguments = {"method": "variational/baoab", "timestep": 0.01, "path": path}
    first = mm.simulate(PAPER, duration=20, **arguments)
    second = mm.simulate(PAPER, duration=20, initial=first, **arguments)
    for run in (first, second):
        balance = mm.observables.energy_balance(run, PAPER)
        assert np.abs(balance.residual).max() < 1e-5 * float(balance.injected[-1])  # 6e-6


@pytest.mark.parametrize(
    ("method", "steps", "order", "replicas"),
    [
        ("variational/euler", (0.1, 0.05, 0.025), 1, 20_000),
        ("variational/middle", (0.1, 0.05, 0.025), 1, 20_000),
        ("variational/verlet", (1.6 / 3, 1.6 / 6, 1.6 / 12), 2, 400_000),
        ("variational/baoab", (0.4, 0.2, 0.1), 2, 400_000),
    ],
)
def test_weak_order(method, steps, order, replicas):
    """E f(x_t) at t = 1.6: differences between a step and half of it, on the same paths.

    The bound is the next order's share and 4 standard errors.
    """
    scene = mm.Disk(sigma=0.5, friction=0.5, noise=1.0, x=0.5, v=1.0, omega=-1.0)
    means, errors = [], []
    for h in steps:
        fine = BrownianPath(2, h / 2)
        ends = [
            mm.simulate(
                scene, method=method, timestep=path.timestep, duration=1.6, path=path,
                replicas=replicas, record_interval=round(1.6 / path.timestep),
            ).x[:, -1].values
            for path in (fine, fine.coarsened(2))
        ]  # fmt: skip
        gaps = np.array([of(ends[1]) - of(ends[0]) for of in (np.square, np.cos)])
        means.append(gaps.mean(axis=1))
        errors.append(gaps.std(axis=1) / np.sqrt(gaps.shape[1]))
    for mean, error in zip(np.abs(means).T, np.transpose(errors), strict=True):
        fit, covariance = np.polyfit(np.log(steps), np.log(mean), 1, w=mean / error, cov="unscaled")
        assert np.sqrt(covariance[0, 0]) < 0.02  # 0.001 (first order) to 0.019 (verlet)
        assert fit[0] == pytest.approx(order, abs=0.1)  # 0.048
    # square and cosine: 0.97, 0.98; 1.00, 1.01; 1.95, 1.99; 2.00, 2.02


@pytest.mark.parametrize("method", VARIATIONAL)
@pytest.mark.parametrize(
    "scene", [WARM, WARM.replace(potential=ODD), WARM.replace(friction_ratio=0.3)], ids=str
)
def test_stationary_law_is_gibbs(method, scene):
    """Kolmogorov-Smirnov of x mod 2 pi, v, omega with the effective sample size.

    50 replicas, 2000 samples each, 1 apart, of which autocorrelation leaves some 5e4; false alarm
    rate 1e-4 a variable. At h = 0.01 Euler's bias, 0.25 % of the variance of v, is not seen.
    """
    timestep = 0.01 if method == "variational/euler" else 0.05
    run = mm.simulate(
        scene, method=method, timestep=timestep, duration=2000, replicas=50, seed=4,
        record_interval=round(1 / timestep), initial=mm.theory.gibbs(scene, 50, seed=4),
    )  # fmt: skip
    kT = theory.temperature(scene)
    laws = {
        "x": (run.x.values % (2 * np.pi), lambda x: theory.position_cdf(scene, x)),
        "v": (run.v.values, stats.norm(scale=np.sqrt(kT)).cdf),
        "omega": (run.omega.values, stats.norm(scale=np.sqrt(kT / scene.sigma)).cdf),
    }
    for name, (samples, cdf) in laws.items():
        waves = (np.sin(samples), np.cos(samples)) if name == "x" else (samples,)
        size = min(effective_size(wave) for wave in waves)
        assert size > 2.5e3  # 5.3e3 to 6.5e4
        distance = empirical_distance(samples, cdf)
        assert stats.kstwobign.sf(np.sqrt(size) * distance) > 1e-4, name  # 0.2 to 1


def empirical_distance(samples, cdf):
    """Return the Kolmogorov-Smirnov statistic."""
    expected = cdf(np.sort(samples, axis=None))
    steps = np.arange(samples.size + 1) / samples.size
    return max((steps[1:] - expected).max(), (expected - steps[:-1]).max())


def effective_size(samples):
    """Return the number of independent samples, by the initial positive sequence."""
    deviations = samples - samples.mean()
    n = samples.shape[1]
    spectrum = np.abs(np.fft.rfft(deviations, 2 * n, axis=1)) ** 2
    covariance = np.fft.irfft(spectrum, axis=1)[:, :n].mean(axis=0) / np.arange(n, 0, -1)
    rho = covariance / covariance[0]
    until = int(np.argmax(rho < 0.02))
    return samples.size / max(1.0, 1 + 2 * rho[1:until].sum())


@pytest.mark.parametrize("method", VARIATIONAL)
def test_the_friction_ratio_keeps_the_temperature(method):
    """With friction in both directions, d relaxes too, at the same kT. 5000 replicas.

    A standard error is 2 %; a noise larger by a tenth heats by 21 %.
    """
    scene = WARM.replace(friction_ratio=0.3)
    run = mm.ensemble(scene, method=method, timestep=0.01, duration=40, replicas=5000, seed=2)
    kT = theory.temperature(scene)
    assert kT == pytest.approx(1, rel=1e-15, abs=0)  # 0
    for name, mean in theory.gibbs_mean_squares(scene).items():
        square, error = moment(run, name)
        assert abs(square - mean) < 4 * error, name  # up to 1.4 errors


def test_the_langevin_particle_is_at_the_same_temperature():
    particle = mm.LangevinParticle(friction=0.5, noise=1.0)
    run = mm.ensemble(
        particle, method="variational/baoab", timestep=0.05, duration=50, replicas=5000, seed=2
    )
    square, error = moment(run, "v")
    assert abs(square - 1.0) < 4 * error  # 0.969 +- 0.019
    assert "omega" not in run


@pytest.mark.parametrize(
    "method", [*VARIATIONAL, "variational/blanes-moan4", "variational/blanes-moan6"]
)
def test_conservative_limit_keeps_its_energy(method):
    """Symplectic: over 2e5 steps the energy error stays what it was after a hundred.

    In short steps the schemes of higher order show rounding, no error of theirs.
    """
    scene, h = mm.Disk(noise=0.0, friction=0.0, v=1.0, omega=0.5), 0.05
    if method not in VARIATIONAL:
        h = 0.4
    run = mm.simulate(scene, method=method, timestep=h, duration=2e5 * h, record_interval=97)
    error = np.abs(run.energy - run.energy[0])
    early, late = float(error[:100].max()), float(error[-1000:].max())
    assert late < 1.1 * early  # 1.00
    assert early < (0.06 if method in FIRST_ORDER else 1e-3)  # 0.055; 7e-4 to 2e-7
    assert np.abs(run.omega - 0.5).max() == 0


def test_a_continued_run_follows_the_same_path():
    arguments = {"method": "variational/baoab", "timestep": 0.01, "seed": 3, "replicas": 3}
    whole = mm.simulate(PAPER, duration=5.01, **arguments)
    first = mm.simulate(PAPER, duration=2.01, **arguments)
    second = mm.simulate(PAPER, duration=3.0, initial=first, **arguments)
    assert second.attrs["first_step"] == 201
    third = mm.simulate(PAPER, duration=1.0, initial=second.isel(time=slice(101)), **arguments)
    assert third.attrs["first_step"] == 301
    # The kernel keeps x in turns, so that a dataset's x has one rounding more.
    np.testing.assert_allclose(
        second.x, whole.x[:, 201:], rtol=0, atol=2e-14
    )  # 0; the rounding of 35 is 7e-15
    np.testing.assert_allclose(third.x, whole.x[:, 301:402], rtol=0, atol=2e-14)  # 1.8e-15


def test_a_path_drives_runs_and_is_saved_with_them(tmp_path):
    path = BrownianPath(9, 0.005).coarsened(4)
    run = mm.simulate(PAPER, method="variational/euler", timestep=0.02, duration=1, path=path)
    own = mm.simulate(PAPER, method="variational/euler", timestep=0.02, duration=1, seed=9)
    assert not np.array_equal(run.x, own.x)
    assert run.attrs["seed"] == 9
    assert '"factor": 4' in run.attrs["path"]
    run.to_netcdf(tmp_path / "run.nc")
    with refused("path.timestep"):
        mm.simulate(PAPER, method="variational/euler", timestep=0.01, duration=1, path=path)


@pytest.mark.parametrize("method", VARIATIONAL)
def test_aliased_flights_end_in_a_divergence(method):
    """Beyond the alias limit, d diffuses freely: the scheme has no invariant probability."""
    with (
        pytest.warns(UserWarning, match="aliased"),
        pytest.raises(mm.SimulationDiverged) as caught,
    ):
        mm.simulate(
            PAPER, method=method, timestep=1.5, duration=6e6, record_interval=1000, replicas=32
        )  # fmt: skip
    error = caught.value
    assert error.reason == ENERGY_GREW
    assert error.dataset.sizes["time"] > 5  # 8 or more
    assert error.time == float(error.dataset.time[-1]) + 1500
    limit = 200 * theory.temperature(PAPER)
    assert float(error.dataset.energy.max()) < 1.01 * limit + 4
