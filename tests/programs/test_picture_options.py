"""Formats and dots per inch on the command line, and labels as a reader would say them."""

import json
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from refusals import refused

import magmotor as mm
from magmotor.commands import movie, sweep
from magmotor.commands.picture_options import PictureOptions
from paper.disk import panels
from paper.disk import program as disk
from paper.motor import program as motor


@pytest.mark.parametrize(
    "options",
    [disk.Options, motor.Options, movie.Options, movie.FlightOptions, sweep.Options, sweep.Combine],
)
def test_every_program_that_draws_has_the_options(options):
    assert issubclass(options, PictureOptions)


def test_a_picture_has_the_suffix_and_the_dots(tmp_path):
    options = PictureOptions(pictures="svg", dpi=50)
    written = options.draw(tmp_path / "top", lambda path, dpi: path.write_text(f"{dpi} dots"))
    assert written == tmp_path / "top.svg"
    assert written.read_text() == "50 dots"
    with refused("dpi"):
        PictureOptions(dpi=0).check_pictures()


@pytest.mark.parametrize("scene", [mm.Top(), mm.Disk(), mm.Motor()], ids=lambda s: type(s).__name__)
def test_axes_are_labeled_in_words(scene, tmp_path, monkeypatch):
    figures, save = [], Figure.savefig
    monkeypatch.setattr(
        Figure, "savefig", lambda self, *a, **k: [figures.append(self), save(self, *a, **k)]
    )
    fields = {
        field.name: field.metadata for field in scene.__dataclass_fields__.values()
        if isinstance(getattr(scene, field.name), float) and "unit" in field.metadata
    }  # fmt: skip
    name, about = next(iter(fields.items()))
    field = (name, np.arange(1.0, 4.0), {"units": about["unit"], "long_name": about["doc"]})
    measures = {
        key: (name, np.ones(3), {"units": measure.unit, "long_name": measure.label})
        for key, measure in scene.device.measures.items()
    }
    data = xr.Dataset(measures, {name: field}, {"axes": json.dumps([name])})
    mm.plots.sweep(data, tmp_path / "sweep.png", dpi=20)
    labels = [label for axes in figures[0].axes for label in (axes.get_xlabel(), axes.get_ylabel())]
    assert len(labels) == 2 * len(measures) > 0
    assert all(labels)
    assert not [label for label in labels if "_" in label]


def test_two_systems_of_flights_share_the_guides_and_their_labels(monkeypatch):
    t = np.geomspace(1, 1e4, 30)
    found = xr.Dataset(
        {
            "survival": ("flight_duration", (1 + t) ** -0.7),
            "survival_error": ("flight_duration", 0 * t),
        },
        {"flight_duration": t},
    )
    monkeypatch.setattr(panels, "flight_survival", lambda _: found)
    axes = Figure().add_subplot()
    for name in ("symmetric", "asymmetric"):
        system: Any = SimpleNamespace(name=name, stationary=None)
        panels.draw_flights(axes, system)
    assert [text.get_text() for text in axes.texts] == ["slope −0.5", "slope −1.9"]
    assert axes.get_xlabel() == "duration (dimensionless)"
