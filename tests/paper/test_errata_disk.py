"""The paper's wrong formulas of the disk compared with the right ones, and the lines they imply."""

import numpy as np
import pytest
from matplotlib.figure import Figure

import magmotor as mm
from magmotor import theory
from paper import errata
from paper.disk import pictures
from paper.disk.pictures import FIGURES, disk_figure, disk_overview
from paper.disk.system import System

PAPER = mm.Disk()


@pytest.mark.parametrize("sigma", [0.5, 1.0, 3.0])
def test_coefficients_are_right_only_where_sigma_is_one(sigma):
    scene = PAPER.replace(sigma=sigma)
    for name in ("velocity_noise_coefficient", "y_diffusion", "flat_x_diffusion"):
        ratio = getattr(errata, name)(scene) / getattr(theory, name)(scene)
        assert (abs(ratio - 1) < 1e-12) == (sigma == 1)  # 0.6, 0.4, 1.6 at sigma = 1/2


def test_numbers_as_printed():
    assert errata.y_diffusion(PAPER) == pytest.approx(1000, rel=1e-15, abs=0)  # 0
    assert errata.flat_x_diffusion(PAPER) == pytest.approx(444.44, abs=0.01)  # 0.0044
    assert errata.velocity_noise_coefficient(PAPER) == pytest.approx(6.325, abs=1e-3)  # 4.4e-4
    assert errata.upper_ballistic_bound(PAPER) == pytest.approx(333.3, abs=0.1)  # 0.033
    assert errata.lower_ballistic_bound(PAPER) == pytest.approx(20.83, abs=0.01)  # 0.0033


def test_papers_lower_bound_fails_in_the_reduced_equation():
    model, bound = theory.ReducedDisk(PAPER), errata.lower_ballistic_bound(PAPER)
    t = np.array([1e3, 1e4, 1e5, 1e6, 1e9])
    above = model.msd_from_gibbs(t) / t**2 / bound
    assert above[:2].min() > 2  # 2.35
    assert above[2] < 1  # 0.853
    assert above[3] < 0.25  # 0.231
    assert above[4] < 1e-3  # 5e-4


@pytest.fixture(scope="module")
def systems():
    """Systems too small to decide anything."""
    made = []
    for name in ("symmetric", "flat"):
        run = mm.ensemble(
            mm.Disk(potential=name), method="variational/baoab", timestep=0.05, duration=50,
            replicas=4, sample_interval=20, trajectories=4,
        )  # fmt: skip
        made.append(System(name, run, run))
    return made


def drawn(guide, name, system):
    """Times and values of the lines drawn for a system."""
    axes = Figure().subplots()
    guide.draw(axes, name, system)
    return [np.asarray(line.get_data(), dtype=float) for line in axes.lines]


def test_lines_are_of_the_papers_growth(systems):
    uneven, flat = systems
    for name in FIGURES:
        guide = errata.paper_lines(systems, name)
        assert (guide is not None) == (name in errata.LINES)
        if guide is None:
            continue
        (found,), (level,) = drawn(guide, name, uneven), drawn(guide, name, flat)
        if name == "slope":
            assert [*found[1], *level[1]] == [2, 2, 1, 1]
            continue
        power = 1 if name == "diffusion" else 2
        factor = found[1] / found[0] ** power
        assert np.ptp(factor) < 5e-15 * factor.max()  # 4e-16
        rate = level[1] if name == "diffusion" else level[1] / level[0]
        assert rate == pytest.approx(444.44, abs=0.01)  # 0.0044
        assert ("; flat: 444.4" in guide.label) == (name != "slope")
    overview = errata.paper_lines(systems, "overview")
    assert overview is not None
    assert overview.label == "the paper: ∝ t²; flat: 444.4 t"
    assert not drawn(overview, "mean", uneven)


def test_they_are_drawn_only_if_they_are_passed_in(systems, tmp_path, monkeypatch):
    figures: list[Figure] = []
    monkeypatch.setattr(pictures.style, "save", lambda figure, *_, **__: figures.append(figure))
    path = tmp_path / "disk.png"
    for name in ("diffusion", "overview"):
        for guide in (None, errata.paper_lines(systems, name)):
            if name == "overview":
                disk_overview(systems, path, guide=guide)
            else:
                disk_figure(systems, name, path, guide=guide)
    labels = [[text.get_text() for text in figure.legends[0].get_texts()] for figure in figures]
    assert [any("paper" in label for label in some) for some in labels] == [False, True] * 2
    dotted = [
        sum(line.get_linestyle() == ":" for axes in figure.axes for line in axes.lines)
        for figure in figures
    ]
    assert dotted == [0, 4, 0, 6]  # both panels of each system; three panels of the overview


def test_the_legend_of_four_systems_is_inside_the_picture(systems, tmp_path, monkeypatch):
    figures: list[Figure] = []
    monkeypatch.setattr(pictures.style, "save", lambda figure, *_, **__: figures.append(figure))
    names = ("symmetric", "asymmetric", "flat", "control")
    four = [System(name, systems[0].rest, systems[0].stationary) for name in names]
    for name in ("msd", "mean"):  # with the paper's lines, and without
        guide = errata.paper_lines(four, name)
        disk_figure(four, name, tmp_path / "disk.png", guide=guide, beside=four)
    for figure in figures:
        figure.draw_without_rendering()
        (legend,) = figure.legends
        box = legend.get_window_extent()
        assert figure.bbox.x0 <= box.x0 < box.x1 <= figure.bbox.x1
    assert len(figures) == 2
