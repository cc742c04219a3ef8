"""Background drag on the sliding disk: against DOP853, matrix exponentials and exact laws."""

import numpy as np
import pytest
from refusals import refused
from scipy.integrate import quad
from scipy.linalg import expm, solve_continuous_lyapunov

import magmotor as mm
from magmotor import theory
from magmotor.devices.disk.variational import step_coefficients
from magmotor.numerics.splittings import exchange, friction_and_noise

DRAG = mm.Disk(drag=0.02, rotational_drag=0.005, drag_temperature=60.0)
WARM = mm.Disk(friction=0.5, noise=1.0, drag=0.2, rotational_drag=0.05)
"""At kT = 1, in a potential as deep."""

QUIET = mm.Disk(noise=0.0, v=3.0, drag=0.02, rotational_drag=0.005)


def linear_motion(scene):
    """Return A and G G^T of du = -A u dt + G dW by the equation of motion, term by term."""
    sigma, c, g, turning = scene.sigma, scene.friction, scene.drag, scene.rotational_drag
    kT = scene.noise**2 / (2 * c)
    hot = kT if scene.drag_temperature is None else scene.drag_temperature
    A = np.array([[c + g, c], [c / sigma, (c + turning) / sigma]])
    force = scene.noise * np.array([1.0, 1 / sigma])
    alone = np.diag([2 * hot * g, 2 * hot * turning / sigma**2])
    return A, np.outer(force, force) + alone


def covariance(A, noise, t):
    """Return the covariance of u after a time t from rest, by Van Loan's matrix exponential.

    It is exact for a 64th part of t, which is then doubled six times.
    """
    n, h = len(A), t / 64
    block = expm(h * np.block([[A, noise], [np.zeros((n, n)), -A.T]]))
    flow = expm(-A * h)
    found = flow @ block[:n, n:]
    for _ in range(6):
        found, flow = found + flow @ found @ flow.T, flow @ flow
    return found


@pytest.mark.parametrize("scene", [DRAG, WARM, DRAG.replace(rotational_drag=0.0)], ids=str)
@pytest.mark.parametrize("t", [0.01, 1.0, 30.0])
def test_friction_and_noise_with_more_channels_than_velocities(scene, t):
    A, noise = linear_motion(scene)
    decrement, increment = friction_and_noise(
        scene.masses, scene.friction_matrix, scene.noise_matrix, t, exact=True
    )
    np.testing.assert_allclose(np.eye(2) + decrement, expm(-A * t), rtol=0, atol=8e-15)  # 3e-16
    found, expected = increment @ increment.T, covariance(A, noise, t)
    assert np.abs(found - expected).max() < 1e-13 * np.abs(expected).max()  # 8e-15


@pytest.mark.parametrize("scene", [DRAG, WARM], ids=str)
@pytest.mark.parametrize("t", [0.01, 3.0])
def test_the_mean_heat_of_an_exact_part(scene, t):
    """Against the integral of the mean power, by the matrix exponential of the moments."""
    A, noise = linear_motion(scene)
    found = exchange(scene.masses, scene.friction_matrix, scene.noise_matrix, t)
    u = np.array([1.5, -0.4])

    def squares(s):
        then = expm(-A * s) @ u
        return np.outer(then, then) + covariance(A, noise, s)

    power = lambda s: float(np.trace(scene.friction_matrix @ squares(s)))  # noqa: E731
    expected = quad(power, 0, t, epsabs=0, epsrel=1e-11, limit=200)[0]
    heat = u @ found.heat @ u + np.trace(found.heat @ squares(t)) + found.unresolved
    assert heat == pytest.approx(expected, rel=3e-11, abs=0)  # 1e-12


@pytest.mark.parametrize("t", [-0.3, 1e-5, 0.7, 30.0])
def test_how_far_an_exact_part_moves(t):
    """Without noise, under a constant force, by the matrix exponential of (x, u, force)."""
    A, force = linear_motion(DRAG)[0], np.array([0.7, -0.2])
    found = exchange(DRAG.masses, DRAG.friction_matrix, 0 * DRAG.noise_matrix, t)
    block = np.zeros((5, 5))
    block[:2, 2:4], block[2:4, 2:4] = np.eye(2), -A
    block[2:4, 4] = force / DRAG.masses
    u = np.array([1.5, -0.4])
    after = expm(t * block) @ [0, 0, *u, 1]
    moved = found.mean @ (u + after[2:4]) / 2 + found.force @ force
    np.testing.assert_allclose(moved, after[:2], rtol=3e-13, atol=0)  # 1e-14


def test_a_short_step_takes_each_channel_as_it_is():
    noise = DRAG.noise_matrix
    assert noise.shape == (2, 3)
    _, increment = friction_and_noise(DRAG.masses, DRAG.friction_matrix, noise, 1e-8, exact=True)
    apart = increment * np.array(DRAG.masses)[:, np.newaxis] / 1e-4 - noise
    assert np.abs(apart).max() < 1e-7  # 8e-9


def test_without_drag_a_step_is_the_papers():
    plain = step_coefficients(mm.Disk(), "baoab", 0.05)
    assert step_coefficients(mm.Disk(drag_temperature=7.0), "baoab", 0.05) == plain
    assert step_coefficients(mm.Disk(drag=0.1), "baoab", 0.05) != plain


def test_slip_and_rotation_may_be_one_velocity_to_rounding():
    scene = mm.Disk(sigma=1e-30, friction=1e-30, noise=1e-30, rotational_drag=1e-30)
    (part,) = (p for p in step_coefficients(scene, "baoab", 0.05).parts if any(map(any, p.noise)))
    found = np.array(part.noise).T @ np.array(part.noise)
    expected = covariance(*linear_motion(scene), 0.05)
    np.testing.assert_allclose(found[1], expected[1], rtol=1.8e-14)  # 6e-16


@pytest.mark.parametrize(("method", "timestep", "bound"), [
    ("variational/blanes-moan4", 0.05, 2e-7),  # 8e-9
    ("variational/baoab", 0.05, 6e-3),  # 3e-4
    ("variational/euler", 0.0125, 1.0),  # 0.056
    ("mujoco/rk4", 0.05, 3e-5),  # 1.1e-6
    ("mujoco/implicitfast", 0.0125, 1.0),  # 0.05
])  # fmt: skip
def test_a_disk_slows_down_as_by_dop853(method, timestep, bound):
    """The positions at t = 50, where x = 35.7; without drag, it would be 95.4."""
    runs = [
        mm.simulate(QUIET, method=name, timestep=h, duration=50.0)
        for name, h in (("scipy/dop853", 0.05), (method, timestep))
    ]
    assert abs(float(runs[0].x[-1] - runs[1].x[-1])) < bound
    assert abs(float(mm.observables.energy_balance(runs[0]).residual[-1])) < 0.03  # 1.3e-3


@pytest.mark.parametrize("scheme", ["baoab", "euler"])
@pytest.mark.parametrize("scene", [DRAG, DRAG.replace(friction_ratio=0.2)], ids=str)
def test_mujoco_and_the_reference_follow_one_path(scheme, scene):
    """Slip, and each drag, have noise of their own."""
    runs = [
        mm.simulate(scene, method=f"{engine}/{scheme}", timestep=0.05, duration=50.0, seed=3)
        for engine in ("mujoco", "variational")
    ]
    assert float(abs(runs[0].x - runs[1].x).max()) < 6e-10  # 2.7e-11
    assert float(abs(runs[1].x).max()) > 50  # 105


def test_the_energy_balance_closes_along_a_path():
    residuals = []
    for timestep in (0.05, 0.0125):
        run = mm.simulate(
            DRAG, method="variational/baoab", timestep=timestep, duration=50.0, seed=3
        )
        balance = mm.observables.energy_balance(run)
        residuals.append(float(abs(balance.residual).max()))
    assert residuals[0] < 1.0  # 0.11, of 1965 injected, 90 of which by the drag
    assert residuals[1] < 0.4  # 0.044
    A, noise = linear_motion(DRAG)
    power = np.trace(np.diag(DRAG.masses) @ noise) / 2
    assert theory.injection_rate(DRAG) == pytest.approx(power, rel=1e-14, abs=0)  # 0
    u = np.array([0.3, -1.1])
    lost = u @ np.diag(DRAG.masses) @ A @ u
    assert float(theory.heat_rate(DRAG, u)) == pytest.approx(lost, rel=1e-14, abs=0)  # 0


def late_mean_squares(scene):
    """Return means of v^2 and omega^2 of 2^13 replicas from rest, over the last half of t = 60."""
    run = mm.ensemble(
        scene, method="variational/baoab", timestep=0.05, duration=60.0, replicas=2**13,
        sample_interval=100, seed=4,
    )  # fmt: skip
    late = run.mean_square.sel(time=slice(30, None)).mean("time")
    return np.array([float(late.sel(quantity=name)) for name in ("v", "omega")])


def test_equipartition_with_drag():
    """7 samples of 2^13 replicas: a standard error of 0.8 % or less; 3 % by chance in one of 10^3.

    From rest, d equilibrates only by the potential and the drag, at rates above 0.1.
    """
    kinetic = late_mean_squares(WARM) * np.array(WARM.masses)
    np.testing.assert_allclose(kinetic, 1.0, rtol=0.03)  # 0.0073


def test_a_drag_of_another_temperature_makes_the_law_of_two_baths():
    """Exact for flat U: Lyapunov's equation. The same sample size as above."""
    scene = WARM.replace(potential="flat", drag_temperature=5.0)
    expected = np.diag(solve_continuous_lyapunov(*linear_motion(scene)))
    np.testing.assert_allclose(late_mean_squares(scene), expected, rtol=0.03)  # 0.0178
    assert (np.abs(expected * WARM.masses - 1.0) > 0.5).all()


@pytest.mark.parametrize("origin", ["rest", "gibbs"])
def test_flat_displacements_with_drag(origin):
    """Against the covariance of (x, u), by matrix exponentials."""
    scene = WARM.replace(potential="flat")
    A, noise = linear_motion(scene)
    drift = np.zeros((3, 3))
    drift[1:, 1:], drift[0, 1] = A, -1.0
    kicks = np.zeros((3, 3))
    kicks[1:, 1:] = noise
    start = np.diag([0.0, 1.0, 1 / scene.sigma]) if origin == "gibbs" else np.zeros((3, 3))
    exact = theory.flat_msd_from_gibbs if origin == "gibbs" else theory.flat_variance_from_rest
    for t in (0.3, 5.0, 40.0):
        flow = expm(-drift * t)
        expected = (covariance(drift, kicks, t) + flow @ start @ flow.T)[0, 0]
        assert float(exact(scene, t)) == pytest.approx(expected, rel=5e-13, abs=0)  # 2e-14


@pytest.mark.parametrize(("drag", "turning", "bound"), [
    (0.1, 0.05, 1e-5),  # 6e-7: rotational_drag = sigma drag, where it is exact
    (1e-4, 0.0, 0.01),  # 4e-4: to first order in the drag
])  # fmt: skip
def test_the_reduced_equation_knows_the_drag(drag, turning, bound):
    """On flat U, where the exact displacement is known."""
    scene = mm.Disk(potential="flat", drag=drag, rotational_drag=turning)
    model, t = theory.ReducedDisk(scene), np.array([50.0, 1e3, 1e5])
    for found, expected in (
        (model.msd_from_gibbs(t), theory.flat_msd_from_gibbs(scene, t)),
        (model.msd_from_rest(t), theory.flat_variance_from_rest(scene, t)),
    ):
        np.testing.assert_allclose(found, expected, rtol=bound)
    slow = theory.flat_msd_from_gibbs(scene, 1e9) / 2e9
    assert model.x_diffusion == pytest.approx(float(slow), rel=bound, abs=0)


def test_the_mean_from_rest_with_drag():
    """In a vanishing potential, the first impulse is forgotten exactly as on flat U."""
    scene = mm.Disk(potential=((1e-6, 0.0),), drag=0.01, rotational_drag=0.005)
    curves, t = theory.DiskTheory(scene), np.array([1.0, 30.0, 1e3])
    expected = theory.flat_mean_displacement(scene.replace(v=1.0), t)
    np.testing.assert_allclose(curves.mean(t) / curves.first_impulse, expected, rtol=1e-4)  # 5e-6


def test_the_reduced_equation_in_a_potential_with_drag():
    """4000 replicas from the Gibbs measure at t = 1000; more by chance in one of 16 000 samples.

    Without the drag, theory has 1.34 times as much.
    """
    scene = mm.Disk(drag=1e-3, rotational_drag=5e-4)
    run = mm.ensemble(
        scene, method="variational/baoab", timestep=0.05, duration=1000.0, replicas=4000, seed=5,
        initial=mm.theory.gibbs(scene, 4000, seed=6),
    ).isel(time=-1)  # fmt: skip
    found = run.mean_square.sel(quantity="x")
    expected = theory.ReducedDisk(scene).msd_from_gibbs(1000.0)
    error = run.mean_square_error.sel(quantity="x")
    assert abs(found - expected) < 4 * error  # 0.2


def test_steps_and_guards_know_the_drag():
    fast = mm.Disk(drag=50.0)
    with refused("timestep"):
        mm.simulate(fast, method="variational/euler", timestep=0.05, duration=1.0)
    mm.simulate(fast, method="variational/baoab", timestep=0.05, duration=1.0)
    hot = mm.Disk(drag=0.1, drag_temperature=500.0)
    ratio = theory.largest_timestep(mm.Disk()) / theory.largest_timestep(hot)
    assert ratio == pytest.approx(2.0, rel=1e-14, abs=0)  # 0: d is twice as fast
    mm.simulate(hot, method="variational/baoab", timestep=0.02, duration=200.0, replicas=64)


def test_a_dataset_with_drag_is_made_again():
    run = mm.simulate(DRAG, method="variational/baoab", timestep=0.05, duration=5.0, seed=3)
    assert mm.rerun(run).equals(run)
