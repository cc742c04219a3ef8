"""Closed forms and reduced equation of the disk, compared with exponentials and quadrature."""

import math

import numpy as np
import pytest
from scipy.integrate import quad, simpson
from scipy.linalg import eigh, expm
from scipy.special import i0, roots_hermitenorm

from magmotor import theory
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.numerics.splittings import friction_and_noise
from magmotor.theory import DiskTheory

PAPER = Disk()
OTHER = Disk(sigma=1.7, friction=0.3, noise=1.2, friction_ratio=0.2, v=0.4, omega=-1.1)
TIMES = np.array([1e-3, 0.05, 1.0, 30.0, 1000.0])
FLAT = [PAPER, OTHER, LangevinParticle()]


def velocities_matrix(scene):
    """Return -c C M and alpha C^(1/2) of the velocities; for the disk, C as in the paper."""
    if isinstance(scene, LangevinParticle):
        C = np.eye(1)
    else:
        n, m = np.array([1, 1 / scene.sigma]), np.array([1 / scene.sigma, -1])
        C = np.outer(n, n) + scene.friction_ratio * np.outer(m, m)
    values, vectors = np.linalg.eigh(C)
    root = (vectors * np.sqrt(np.maximum(values, 0))) @ vectors.T
    return -scene.friction * C @ np.diag(scene.masses), scene.noise * root


def van_loan(scene, t):
    """Return transition matrix and covariance of (positions, velocities) on flat U after time t."""
    drift, noise = velocities_matrix(scene)
    dof = len(drift)
    A = np.block([[np.zeros((dof, dof)), np.eye(dof)], [np.zeros((dof, dof)), drift]])
    Q = np.zeros_like(A)
    Q[dof:, dof:] = noise @ noise.T
    # Backward only for a part of t, then doubled: e^(-A t) alone would overflow.
    parts = max(0, math.ceil(math.log2(t)))
    block = expm(np.block([[-A, Q], [np.zeros_like(A), A.T]]) * (t / 2**parts))
    transition = block[2 * dof :, 2 * dof :].T
    covariance = transition @ block[: 2 * dof, 2 * dof :]
    for _ in range(parts):
        covariance = covariance + transition @ covariance @ transition.T
        transition = transition @ transition
    return transition, covariance


@pytest.mark.parametrize("scene", FLAT)
def test_flat_displacement_against_matrix_exponential(scene):
    dof = len(scene.masses)
    direction = np.array([1.0, 0.6])[:dof]
    mean = theory.flat_mean_displacement(scene, TIMES, direction)
    rest = theory.flat_variance_from_rest(scene, TIMES, direction)
    gibbs = theory.flat_msd_from_gibbs(scene, TIMES, direction)
    start = np.diag(theory.gibbs_deviations(scene) ** 2)
    velocities = np.array([scene.v, getattr(scene, "omega", 0.0)])[:dof]
    for i, t in enumerate(TIMES):
        transition, covariance = van_loan(scene, float(t))
        flow = direction @ transition[:dof, dof:]
        assert mean[i] == pytest.approx(flow @ velocities, rel=3e-14, abs=0)  # 1e-15
        exact = direction @ covariance[:dof, :dof] @ direction
        assert rest[i] == pytest.approx(exact, rel=5e-13, abs=0)  # 3.2e-14
        assert gibbs[i] == pytest.approx(flow @ start @ flow + exact, rel=5e-13, abs=0)  # 3.3e-14


@pytest.mark.parametrize("t", [0.01, 1.0, 5.0])
@pytest.mark.parametrize("scene", [PAPER, OTHER])
def test_friction_and_noise_of_a_step_against_matrix_exponential(scene, t):
    """Also if friction in two directions couples velocities of unequal inertia."""
    wrenches = scene.slip_directions.T
    friction, noise = scene.friction * wrenches @ wrenches.T, scene.noise * wrenches
    decrement, driven = friction_and_noise(scene.masses, friction, noise, t, exact=True)
    transition, covariance = van_loan(scene, t)
    np.testing.assert_allclose(np.eye(2) + decrement, transition[2:, 2:], rtol=4e-13)  # 2e-14
    error = np.abs(driven @ driven.T - covariance[2:, 2:]).max()
    assert error < 2e-14 * np.abs(covariance[2:, 2:]).max()  # 1.3e-15


def test_flat_variance_is_the_papers_reference_form():
    t, rate = np.array([0.1, 3.0, 500.0]), theory.slip_rate(PAPER)
    decay = np.exp(-rate * t)
    expected = 2500 / 9 * (t - 2 * (1 - decay) / rate + (1 - decay**2) / (2 * rate))
    assert theory.flat_variance_from_rest(PAPER, t) == pytest.approx(
        expected, rel=1e-10, abs=0
    )  # 6e-12
    assert theory.flat_variance_from_rest(PAPER, t, (1, 1)) == pytest.approx(
        9 * expected, rel=1e-10, abs=0
    )  # 6e-12
    assert theory.flat_variance_from_rest(PAPER, 1e9) == pytest.approx(
        277.77777777e9, rel=1e-8, abs=0
    )  # 5e-9
    decay = np.exp(-0.1 * t)
    control = 2500 * (t - 20 * (1 - decay) + 5 * (1 - decay**2))
    particle = LangevinParticle()
    assert theory.flat_variance_from_rest(particle, t) == pytest.approx(
        control, rel=1e-9, abs=0
    )  # 1.1e-10


@pytest.mark.parametrize("sigma", [0.5, 1.0, 3.0])
def test_noise_of_the_paper_by_matrix_square_root(sigma):
    scene = Disk(sigma=sigma)
    drift, noise = velocities_matrix(scene)
    slip = np.array([1.0, 1.0])
    rate = theory.slip_rate(scene)
    assert slip @ drift == pytest.approx(-rate * slip, rel=2e-15, abs=0)  # 0, or rounding
    kick = np.linalg.norm(slip @ noise)
    assert kick == pytest.approx(
        scene.noise * theory.slip_factor(scene), rel=2e-15, abs=0
    )  # 1.2e-16
    assert (kick / rate) ** 2 == pytest.approx(
        theory.y_diffusion(scene), rel=5e-15, abs=0
    )  # 3.6e-16
    # The coefficient of e^(-lambda (t - s)) is the projection on the eigenvector of the drift.
    velocity_kick = np.linalg.norm((drift / -rate @ noise)[0])
    assert velocity_kick == pytest.approx(
        theory.velocity_noise_coefficient(scene), rel=2e-15, abs=0
    )  # 0, or rounding


def test_the_numbers_of_the_paper():
    assert theory.y_diffusion(PAPER) == pytest.approx(2500, rel=1e-15, abs=0)  # 0
    assert theory.flat_x_diffusion(PAPER) == pytest.approx(277.78, abs=0.01)  # 277.778
    assert theory.ballistic_coefficient(PAPER) == pytest.approx(83.33, abs=0.01)  # 83.333
    assert theory.temperature(PAPER) == pytest.approx(125, rel=1e-15, abs=0)  # 0
    assert theory.friction_step_limit(PAPER) == pytest.approx(2 / 0.3, rel=1e-15, abs=0)  # 0
    assert theory.potential_step_limit(PAPER) == pytest.approx(2, rel=1e-15, abs=0)  # 0
    assert theory.largest_timestep(PAPER) == pytest.approx(
        math.pi / 6 * math.sqrt(1.5 * 0.008), rel=1e-15, abs=0
    )  # 0


def test_mean_squares_are_quadratic_forms_of_the_covariance():
    covariance = np.diag([125, 250.0])
    forms = {"v": (1, 0), "omega": (0, 1), "slip": (1, 1), "d": (-1, 0.5)}
    for name, value in theory.gibbs_mean_squares(PAPER).items():
        form = np.array(forms[name])
        assert value == pytest.approx(form @ covariance @ form, rel=2e-15, abs=0)  # 0, or rounding
    assert theory.gibbs_deviations(PAPER) ** 2 == pytest.approx(
        [125, 250], rel=1e-15, abs=0
    )  # 1.1e-16


def test_friction_rates_are_eigenvalues_of_the_friction_matrix():
    for scene in FLAT:
        expected = np.sort(-np.linalg.eigvals(velocities_matrix(scene)[0]).real)
        assert theory.friction_rates(scene) == pytest.approx(expected, abs=1e-15)  # 6e-17, of 0.3
    assert theory.friction_rates(PAPER)[0] == 0


def test_slip_variance_of_euler_against_iterated_covariance():
    h = 0.8
    drift, noise = velocities_matrix(PAPER)
    step, covariance = np.eye(2) + h * drift, np.zeros((2, 2))
    for _ in range(200):
        covariance = step @ covariance @ step.T + h * noise @ noise.T
    expected = covariance.sum()
    found = theory.euler_slip_variance(PAPER, h)
    assert found == pytest.approx(expected, rel=5e-15, abs=0)  # 3e-16


def test_energy_balance_rates():
    for scene in FLAT:
        drift, noise = velocities_matrix(scene)
        masses = np.diag(scene.masses)
        injected = np.trace(masses @ noise @ noise.T) / 2
        assert theory.injection_rate(scene) == pytest.approx(injected, rel=5e-15, abs=0)  # 6e-16
        velocities = np.array([[0.3, -2.0], [1.0, 0.5]])[:, : len(masses)]
        power = -np.einsum("...i,ij,...j", velocities, masses @ drift, velocities)
        assert theory.heat_rate(scene, velocities) == pytest.approx(
            power, rel=5e-15, abs=0
        )  # 2.7e-16
        modes = np.eye(len(masses)) * theory.gibbs_deviations(scene)
        assert theory.heat_rate(scene, modes).sum() == pytest.approx(
            injected, rel=5e-15, abs=0
        )  # 6e-16
    assert theory.injection_rate(PAPER) == pytest.approx(12.5 * 3, rel=1e-15, abs=0)  # 0


@pytest.mark.parametrize(
    ("potential", "waves"),
    [("asymmetric", 1), ("cosine", 1), (((0, 0), (1.0, 0.3)), 2), (((0, 0), (0, 0.5)), 2)],
)
def test_alias_is_an_exact_symmetry_of_the_papers_scheme(potential, waves):
    scene, h, sigma = Disk(potential=potential), 0.5, 0.5

    def path(d):
        # v and omega such that the slip is 0.2 in both runs.
        x, v, omega = 0.1, (sigma * 0.2 - d) / (1 + sigma), (0.2 + d) / (1 + sigma)
        xs = []
        for kick in np.random.default_rng(1).normal(size=20):
            k = np.arange(1, len(scene.coefficients) + 1)
            a, b = np.array(scene.coefficients).T
            force = -scene.friction * h * (v + omega) + 0.1 * kick
            v += force - h * float(k @ (a * np.cos(k * x) - b * np.sin(k * x)))
            omega += force / sigma
            x += h * v
            xs.append(x)
        return np.array(xs)

    shift = theory.alias_period(scene, h)
    assert shift == pytest.approx(2 * np.pi * 1.5 / h / waves, rel=1e-15, abs=0)  # 0
    moved = path(1.0 + shift) - path(1.0)
    expected = -2 * np.pi / waves * np.arange(1, 21)
    assert np.abs(moved - expected).max() < 2e-12  # 1e-13
    assert theory.alias_period(Disk(potential="flat"), h) == math.inf


def test_the_steepest_curvature_may_be_that_of_a_maximum():
    """For -U'' = cos x + 2 cos 2x, which is 3 at x = 0 and has the minimum -2.06."""
    scene = Disk(potential=((0.0, 1.0), (0.0, 0.5)))
    assert theory.potential_step_limit(scene) == pytest.approx(
        2 / math.sqrt(3), rel=1e-15, abs=0
    )  # 0


def test_position_law_against_bessel_and_quadrature():
    x = np.array([0.0, 0.7, 3.0, 6.2])
    cold = Disk(potential="cosine", friction=1.0, noise=0.5)  # beta = 8
    density = np.exp(-8 * np.cos(x)) / (2 * np.pi * i0(8))
    assert theory.position_density(cold, x + 2 * np.pi) == pytest.approx(
        density, rel=2e-14, abs=0
    )  # 1.7e-15
    nodes, weights = np.polynomial.legendre.leggauss(100)
    for scene in (cold, Disk(potential="asymmetric", friction=1.0)):
        for end in x:
            part = end / 2 * weights @ theory.position_density(scene, end / 2 * (1 + nodes))
            assert theory.position_cdf(scene, end) == pytest.approx(part, abs=5e-14)  # 2.1e-15
    half = theory.position_cdf(cold, np.pi)
    assert half == pytest.approx(0.5, abs=1e-15)  # 1.1e-16


def d_diffusion_by_quadrature(scene, d):
    """Integrate the original integrand with cosine quadrature (QAWO) where it does not vanish."""
    S, rate = math.sqrt(scene.sigma / ((1 + scene.sigma) * scene.beta)), theory.slip_rate(scene)
    total = 0.0
    for k, (a, b) in enumerate(scene.coefficients, start=1):
        width = k * S

        def envelope(t, width=width):
            return math.exp(-((width / rate) ** 2) * (rate * t + math.expm1(-rate * t)))

        end = 40 * rate / width**2 + 9 / width
        wave = k * d / (1 + scene.sigma)
        integral = quad(
            envelope, 0, end, weight="cos", wvar=wave, epsabs=1e-13, epsrel=0, limit=1000
        )[0]
        total += k**2 * (a**2 + b**2) / 2 * integral
    return total


@pytest.mark.parametrize(
    "scene",
    [
        PAPER,
        Disk(potential="asymmetric"),
        Disk(sigma=2.0, friction=3.0, potential=((0.3, 0.4), (0.0, 0.0), (0.1, -0.2))),
        Disk(friction=0.01, noise=1.0),
    ],
)
def test_d_diffusion_against_quadrature(scene):
    rms = math.sqrt(theory.gibbs_mean_squares(scene)["d"])
    for deviations in (0.0, 0.5, 1.5, 3.0):
        value = float(theory.d_diffusion(scene, deviations * rms))
        exact = d_diffusion_by_quadrature(scene, deviations * rms)
        assert value == pytest.approx(exact, abs=5e-15, rel=1e-10)  # 1.5e-16, 6e-12


def test_finite_volumes_keep_probability_and_detailed_balance():
    model = theory.ReducedDisk(PAPER)
    p = model.probability
    assert p.sum() == pytest.approx(1, abs=2e-15)  # 2.2e-16
    flux = p[:-1] * model.up[:-1], p[1:] * model.down[1:]
    assert flux[0] == pytest.approx(flux[1], rel=1e-14, abs=0)  # 6e-16
    assert model.up[-1] == model.down[0] == 0
    assert p @ model.d**2 == pytest.approx(1.5 * 125, rel=3e-15, abs=0)  # 1.5e-16


def test_constant_diffusion_is_ornstein_uhlenbeck():
    scene = Disk(potential="flat", friction_ratio=1e-4)
    model = theory.ReducedDisk(scene, cells=2000)
    rate = 1 / model.bulk_time
    assert rate == pytest.approx(theory.friction_rates(scene)[0], rel=1e-4, abs=0)  # 1.1e-5
    assert model.correlation_time == pytest.approx(model.bulk_time, rel=2e-15, abs=0)  # 1.5e-16
    t = np.array([0.1, 1, 10]) / rate
    correlation = model.mean_square * np.exp(-rate * t)
    assert model.d_correlation(t) == pytest.approx(correlation, rel=1e-6)  # 8e-8
    square = -model.mean_square * np.expm1(-2 * rate * t)
    assert model.d_mean_square_from_rest(t) == pytest.approx(square, rel=1e-5)  # 3e-6
    gibbs = theory.flat_msd_from_gibbs(scene, t)
    assert model.msd_from_gibbs(t) == pytest.approx(gibbs, rel=1e-3)  # 6e-5
    rest = theory.flat_variance_from_rest(scene, t)
    assert model.msd_from_rest(t) == pytest.approx(rest, rel=1e-3)  # 7e-5
    assert model.msd_from_rest(1e10) == pytest.approx(
        2e10 * model.x_diffusion, rel=5e-5, abs=0
    )  # 3.2e-6


def test_weak_friction_of_d_makes_long_superdiffusion_without_potential():
    """Exact on flat U: largest slope after t = 10, and decades with a slope above 1.5."""
    t = np.geomspace(10, 1e8, 2000)
    width = np.log10(t[1] / t[0])
    found = []
    for ratio in (1, 0.1, 0.01, 1e-3, 1e-4, 1e-5):
        square = theory.flat_variance_from_rest(Disk(potential="flat", friction_ratio=ratio), t)
        slope = np.diff(np.log10(square)) / width
        assert slope[-1] == pytest.approx(1, abs=0.02)  # 1.004 or closer
        found.append((slope.max(), width * np.count_nonzero(slope > 1.5)))
    expected = [(1.40, 0), (2.19, 0.96), (2.49, 1.99), (2.75, 2.43), (2.89, 2.88), (2.96, 3.34)]
    np.testing.assert_allclose(found, expected, rtol=0, atol=0.05)  # 0.023


def test_flat_potential_conserves_d():
    scene = Disk(potential="flat")
    model = theory.ReducedDisk(scene, cells=100)
    t = np.array([0.01, 1.0, 1e4])
    gibbs, rest = theory.flat_msd_from_gibbs(scene, t), theory.flat_variance_from_rest(scene, t)
    assert model.msd_from_gibbs(t) == pytest.approx(gibbs, rel=2e-9, abs=0)  # 1.1e-10
    assert model.msd_from_rest(t) == pytest.approx(rest, rel=5e-8, abs=0)  # 3.2e-9
    assert model.bulk_time == model.correlation_time == model.x_diffusion == math.inf


def test_moments_from_rest_against_matrix_exponential_on_the_whole_line():
    cells, t = 60, 1000.0
    model = theory.ReducedDisk(PAPER, cells=cells)
    d = np.concatenate([-model.d[:0:-1], model.d])
    step, n = d[1] - d[0], len(d)
    faces = (d[1:] + d[:-1]) / 2
    weight = np.exp(-(d**2) / 375)
    flux = theory.d_diffusion(PAPER, faces) * np.exp(-(faces**2) / 375) / step**2
    L = np.diag(flux / weight[:-1], 1) + np.diag(flux / weight[1:], -1)
    L -= np.diag(L.sum(axis=1))
    # Rows: E[z^2], E[z] and 1 at given d_0; d/dt E[z^2] = L E[z^2] + 2 d E[z], and so on.
    zero, times_d = np.zeros((n, n)), np.diag(d)
    chain = expm(t * np.block([[L, 2 * times_d, zero], [zero, L, times_d], [zero, zero, L]]))
    z_square = chain[n // 2, 2 * n :].sum()
    d_square = chain[n // 2, :n] @ d**2
    assert float(model.d_mean_square_from_rest(t)) == pytest.approx(
        d_square, rel=1e-8, abs=0
    )  # 6e-10
    y = theory.flat_variance_from_rest(PAPER, t)
    expected = float(y) + z_square / 1.5**2
    assert float(model.msd_from_rest(t)) == pytest.approx(expected, rel=1e-9, abs=0)  # 4e-11


def test_correlation_against_hermite_galerkin():
    modes = 160
    node, weight = roots_hermitenorm(400)
    rms = math.sqrt(187.5)
    basis = np.zeros((modes, len(node)))
    basis[0], basis[1] = 1.0, node
    for n in range(1, modes - 1):
        basis[n + 1] = (node * basis[n] - math.sqrt(n) * basis[n - 1]) / math.sqrt(n + 1)
    slopes = np.sqrt(np.arange(1, modes))[:, None] * basis[:-1] / rms
    diffusion = theory.d_diffusion(PAPER, rms * node) * weight / math.sqrt(2 * math.pi)
    rates, vectors = eigh((slopes * diffusion) @ slopes.T)
    t = np.array([100.0, 1000.0, 1e4])
    expected = 187.5 * np.exp(-np.outer(t, rates)) @ vectors[0] ** 2
    assert theory.ReducedDisk(PAPER).d_correlation(t) == pytest.approx(expected, rel=5e-4)  # 3e-5


def test_grid_converges_at_second_order():
    t = np.array([30.0, 1e3, 1e6])
    coarse, middle, fine = (
        theory.ReducedDisk(PAPER, cells).msd_from_rest(t) for cells in (200, 400, 800)
    )
    ratio = (coarse - middle) / (middle - fine)
    assert ratio == pytest.approx(4, abs=0.1)  # 3.97
    default = theory.ReducedDisk(PAPER).msd_from_rest(t)
    assert default == pytest.approx(fine + (fine - middle) / 3, rel=1e-4)  # 3e-5


def test_reference_numbers_of_the_symmetric_potential():
    model = theory.ReducedDisk(PAPER)
    rms = math.sqrt(model.mean_square)
    assert float(theory.d_diffusion(PAPER, 3 * rms)) == pytest.approx(3.778e-5, rel=1e-3)  # 1.1e-4
    assert model.bulk_time == pytest.approx(1907.4, abs=0.1)  # 0.046
    assert float(model.d_correlation(6684)) == pytest.approx(187.5 / math.e, rel=1e-4)  # 3e-5
    assert float(model.d_mean_square_from_rest(1000)) == pytest.approx(76.57, abs=0.01)  # 4.1e-4
    assert float(model.msd_from_rest(1000)) == pytest.approx(1.3589e7, rel=1e-4)  # 3.9e-6
    times = [30, 300, 1e3, 1e4, 5e4, 1e8, 1e9]
    slopes = [1.372, 2.523, 2.459, 1.865, 1.598, 1.045, 1.004]
    assert model.slope_from_rest(times) == pytest.approx(slopes, abs=1e-3)  # 4.5e-4
    assert float(model.slope_from_gibbs(1267)) == pytest.approx(1.9, abs=2e-4)  # 1.90002
    assert (model.slope_from_gibbs(np.geomspace(30, 1200, 20)) > 1.9).all()  # 1.904
    lags = [100, 1e3, 1e4, 1e5]
    correlations = [0.951, 0.854, 0.547, 0.383]
    assert model.increment_correlation(lags) == pytest.approx(correlations, abs=1e-3)  # 5e-4
    assert model.correlation_time == pytest.approx(6.675e4, rel=1e-3)  # 5.3e-5
    assert float(model.msd_from_gibbs(1e11)) == pytest.approx(
        2e11 * model.x_diffusion, rel=1e-3
    )  # 1e-4


def test_asymptotic_diffusion_when_slip_and_d_contribute_equally():
    """At sigma = 1, friction on d does not affect the slip; the flat formula has the same limit."""
    scene = Disk(potential="flat", sigma=1.0, friction_ratio=1.0)
    once, twice = theory.flat_msd_from_gibbs(scene, [1e7, 2e7])
    found = theory.ReducedDisk(scene).x_diffusion
    assert found == pytest.approx((twice - once) / 2e7, rel=1e-14, abs=0)  # 4e-16


def test_first_impulse_of_weak_noise_is_that_of_diffusion():
    scene = LangevinParticle(noise=1e-9)
    (a, _), *_ = scene.coefficients
    diffusion = (scene.noise / scene.friction) ** 2
    found = DiskTheory(scene).first_impulse
    assert found == pytest.approx(-2 * a / diffusion, rel=2e-14, abs=0)  # 1e-15


def test_first_impulse_against_quadrature_over_a_normal_law():
    """For x from rest, whose variance on flat U comes from the matrix exponential."""
    node, weight = roots_hermitenorm(200)
    weight = weight / weight.sum()
    t, step = np.linspace(0.0, 1.6, 81, retstep=True)
    scene = Disk(potential=((0.8, -0.3), (0.5, 0.7), (0.2, 0.1)))
    spread = [0.0, *(math.sqrt(van_loan(scene, float(s))[1][0, 0]) for s in t[1:])]
    x = np.multiply.outer(spread, node)
    slope = 0.8 * np.cos(x) + 0.3 * np.sin(x) + np.cos(2 * x) - 1.4 * np.sin(2 * x)
    slope += 0.6 * np.cos(3 * x) - 0.3 * np.sin(3 * x)
    expected = -simpson(slope @ weight, dx=step)
    assert DiskTheory(scene).first_impulse == pytest.approx(expected, rel=2e-7, abs=0)  # 1e-8


def test_without_noise_nothing_moves_from_rest():
    scene = Disk(friction=0.0, noise=0.0)
    assert theory.temperature(scene) == theory.injection_rate(scene) == 0
    assert theory.friction_step_limit(scene) == theory.largest_timestep(scene) == math.inf
    assert theory.flat_variance_from_rest(scene, [0.0, 10.0]) == pytest.approx(
        [0, 0], rel=0, abs=0
    )  # 0
    drifting = Disk(friction=0.0, noise=0.0, v=2.0)
    assert theory.flat_mean_displacement(drifting, [0.0, 10.0]) == pytest.approx(
        [0, 20], rel=1e-15, abs=0
    )  # 0


def test_a_mode_without_friction_has_the_rate_zero_and_a_slow_one_its_own():
    """The product of the rates is c^2 r (sigma + 1/sigma)^2/sigma; one is nearly c gamma."""
    for sigma in (0.5, 0.3, 1 / 7):
        scene = PAPER.replace(sigma=sigma)
        assert theory.friction_rates(scene)[0] == 0.0
        slow, fast = theory.friction_rates(scene.replace(friction_ratio=1e-12))
        expected = scene.friction * 1e-12 * (sigma + 1 / sigma) ** 2 / (1 + sigma)
        assert fast == pytest.approx(theory.slip_rate(scene), rel=1e-11, abs=0)  # 6e-13
        assert slow == pytest.approx(expected, rel=5e-4, abs=0)  # 3.3e-5, of rounding
