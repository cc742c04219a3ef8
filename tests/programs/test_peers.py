"""The comparison with other software: what is common to both sides, and judges that are missing."""

import shutil
import sys
from math import cos, pi, sqrt, tau

import numpy as np
import pytest
from scipy.special import iv

from benchmarks.peers import langevin, langevin_estimates, langevin_orders, other_environment
from benchmarks.peers.langevin import exact_diffusion

SIGMAS = 4.5
"""A false alarm in 1.5e5 of normal estimates."""


@pytest.fixture
def judge(tmp_path, monkeypatch):
    """Make this environment the other one, with a judge that repeats its question."""
    shutil.copy(other_environment.FOLDER / "server.py", tmp_path)
    (tmp_path / "echo.py").write_text("def answer(**question):\n    return question\n")
    (tmp_path / "lost.py").write_text("import no_such_library\n")
    monkeypatch.setattr(other_environment, "FOLDER", tmp_path)
    monkeypatch.setattr(other_environment, "PYTHON", other_environment.Path(sys.executable))


def test_a_judge_answers_a_question(judge):
    assert other_environment.answer_of("echo", kT=1.5, lags=[1, 2]) == {"kT": 1.5, "lags": [1, 2]}


def test_a_judge_without_its_library_says_so(judge):
    why = "not measured: ModuleNotFoundError: No module named 'no_such_library'"
    assert other_environment.answer_of("lost") == {"failed": why}


def test_without_the_environment_the_tables_say_so(tmp_path, monkeypatch):
    monkeypatch.setattr(other_environment, "PYTHON", tmp_path / "bin" / "python")
    records = {case.key: {} for case in langevin.cases(quick=True)}
    records |= {
        f"peers/langevin/{judge}": other_environment.answer_of(judge) for judge in langevin.JUDGES
    }
    records["peers/langevin/dipoles"] = other_environment.answer_of("langevin_lammps")
    rows = langevin.tabulate(records).splitlines()[2:]
    assert len(rows) == 4
    records = {
        case.key: other_environment.answer_of("x") for case in langevin_orders.cases(quick=False)
    }
    rows += langevin_orders.tabulate(records).splitlines()[2:]
    assert all(f"(not measured: no {tmp_path.name})" in row for row in rows)
    langevin_orders.draw(records, tmp_path)
    assert not [*tmp_path.iterdir()]


def test_hops_are_arrivals_in_another_core():
    """A path that leaves its well and returns, goes over, turns back halfway, and goes on."""
    x = np.array([[0, 2.5, 0.2, 3.5, tau, 5.0, tau + 0.9, 4.0, 3.0, tau, 2 * tau - 0.5, 2 * tau]])
    found = langevin_estimates.of_particles(np.repeat(x, 2, axis=0), 0.5, 11)
    assert found["hopping rate"] == [2 / 5.5, 0.0]
    assert found["diffusion"][0] == pytest.approx(tau**2 * 4 / 11, rel=1e-15)  # 0


def test_levy_areas_of_coarse_steps_are_their_integrals():
    """Compare with Simpson's rule, which is exact for the parabolas of a piecewise linear path."""
    W = np.random.default_rng(1).normal(size=8)
    h, points = 0.25, np.linspace(0, 2, 17)
    path = np.interp(points, points[::2], np.append(0, np.cumsum(W)))
    weights = np.tile([2.0, 4.0], 9)[:17]
    weights[[0, -1]] = 1
    bridge = path - points / 2 * path[-1]
    H = weights @ bridge * h / 6 / 2
    K = weights @ (bridge * (1 - points)) * h / 6 / 4
    fine = np.array([W, 0 * W, 0 * W])
    found = langevin_estimates.coarse_areas(fine, h, 8)[:, 0]
    assert found == pytest.approx([path[-1], H, K], abs=5e-15)  # 2.2e-16


def test_levy_areas_are_the_same_by_one_step_and_by_two():
    fine = np.random.default_rng(2).normal(size=(3, 5, 12))
    once = langevin_estimates.coarse_areas(fine, 0.1, 12)
    twice = langevin_estimates.coarse_areas(langevin_estimates.coarse_areas(fine, 0.1, 4), 0.4, 3)
    assert twice == pytest.approx(once, abs=1e-14)  # 4.4e-16


@pytest.mark.parametrize(
    ("depth", "friction", "limit", "bound"),
    [
        (1e-6, 0.7, 2 / 0.7, 1e-11),  # Einstein; 3.7e-13
        (1.5, 300.0, 2 / 300 / iv(0, 0.75) ** 2, 1e-4),  # Lifson and Jackson; 5.8e-6
    ],
)
def test_the_exact_diffusion_has_its_limits(depth, friction, limit, bound):
    assert exact_diffusion(depth, friction, 2.0) == pytest.approx(limit, rel=bound)


def test_rotation_matrices_have_the_axes_as_columns():
    turn = [cos(pi / 6), 0, 0, sqrt(1 - cos(pi / 6) ** 2)]  # by 60 degrees about z
    found = langevin_estimates.axes(np.array(turn))
    expected = [[0.5, -sqrt(0.75), 0], [sqrt(0.75), 0.5, 0], [0, 0, 1]]
    assert found == pytest.approx(np.array(expected), abs=5e-15)  # 2.2e-16


def test_our_particles_diffuse_as_theory_predicts():
    """60 particles over 200 s: an error of the diffusion of about 15 %."""
    size = langevin.QUICK_SIZES["particle"]
    known = langevin.exact()
    for name, (value, error) in langevin.particle(**langevin.PARTICLE, **size, seed=1).items():
        assert abs(value - known.get(name, value)) < SIGMAS * error


def test_our_bodies_have_the_temperature():
    size, known = langevin.QUICK_SIZES["body"], langevin.exact()
    found = langevin.body(**langevin.BODY, **size, seed=1)
    assert len(found.keys() & known.keys()) == 5
    for name in found.keys() & known.keys():
        assert abs(found[name][0] - known[name]) < SIGMAS * found[name][1]
