"""Pictures of sweeps show the numbers in the dataset."""

import json

import matplotlib.colors
import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from PIL import Image
from refusals import refused
from scipy.stats import qmc, sem

import magmotor as mm
from magmotor.common.measure_panels import axis_of

NAMES = {"tilt": ("rad", "angle"), "height": ("m", "height"), "friction": ("kg/s", "friction")}


@pytest.fixture
def picture(monkeypatch, tmp_path):
    """Return a function that draws a sweep and returns its figure and the pixels of its file."""
    figures, save = [], Figure.savefig

    def watched(self, *args, **options):
        figures.append(self)
        return save(self, *args, **options)

    monkeypatch.setattr(Figure, "savefig", watched)

    def draw(data):
        path = tmp_path / "sweep.png"
        mm.plots.sweep(data, path, dpi=100)  # that of the figure, so that pixels can be found
        assert path.stat().st_size < 200e3  # the largest design below: 93 kB
        return figures[-1], np.asarray(Image.open(path).convert("RGB")).astype(int)

    return draw


def field(name, values, dim=None):
    units, meaning = NAMES[name]
    return dim or name, values, {"units": units, "long_name": meaning}


def sweep(axes, coords, dims, **measures):
    attrs = {"units": "kg m^2/s", "long_name": "largest |J|"}
    variables = {name: (dims, values, attrs) for name, values in measures.items()}
    return xr.Dataset(variables, coords, {"axes": json.dumps(axes)})


def one_axis(seeds=8):
    values = 1e-4 * np.random.default_rng(1).standard_normal((21, seeds))
    values[4], values[7, 2:] = np.nan, np.nan
    coords = {"tilt": field("tilt", np.linspace(0, 0.3, 21)), "seed": range(seeds)}
    return sweep(["tilt"], coords, ("tilt", "seed"), momentum=values)


def grid(x, y):
    values = np.add.outer(np.arange(len(x)), 100.0 * np.arange(len(y)))
    coords = {"friction": field("friction", x), "height": field("height", y)}
    return sweep(["friction", "height"], coords, ("friction", "height"), momentum=values)


def design(count, *names):
    points = qmc.Sobol(2, rng=1).random(count).T
    coords = {
        name: field(name, values, "sample") for name, values in zip(names, points, strict=False)
    }
    return sweep(["sample"], coords, ("sample",), momentum=points.sum(axis=0))


def words(figure):
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


@pytest.mark.parametrize("count", [4, 6, 8, 9])
def test_labels_along_an_axis_do_not_touch(picture, count):
    """Eight of them did: 0.8331.24."""
    values = np.ones((count, 1))
    coords = {"friction": field("friction", np.geomspace(0.833, 13.3, count)), "seed": [0]}
    names = ("momentum", "number", "distance", "fraction")
    figure, _ = picture(
        sweep(["friction"], coords, ("friction", "seed"), **dict.fromkeys(names, values))
    )
    labels = [label for label in figure.axes[0].get_xticklabels() if label.get_text()]
    boxes = [label.get_window_extent() for label in labels]
    inside = [box for box in boxes if figure.axes[0].bbox.padded(20).contains(box.x0, box.y1)]
    assert len(inside) >= 4
    space = np.diff([box.x0 for box in inside]) - [box.width for box in inside[:-1]]
    assert space.min() > 6  # pixels; at least 18, and 3 when they touched


def test_a_curve_is_the_mean_of_the_seeds_with_its_error(picture):
    data = one_axis()
    figure, _ = picture(data)
    (axes,) = figure.axes
    ((line, _, (bars,)),) = axes.containers
    there = np.arange(21) != 4
    ends = np.array([bar[:, 1] for bar in bars.get_segments() if len(bar)])
    np.testing.assert_array_equal(line.get_xdata(), data.tilt)
    mean = np.nanmean(data.momentum[there], axis=1)
    np.testing.assert_allclose(line.get_ydata()[there], mean, rtol=1e-15)  # 0
    assert np.isnan(line.get_ydata()[4])  # a gap
    error = sem(data.momentum[there], axis=1, nan_policy="omit")
    np.testing.assert_allclose(np.diff(ends)[:, 0] / 2, 2 * error, rtol=5e-15)  # 2.6e-16
    assert axes.get_xlabel() == "angle (rad)"
    assert axes.get_ylabel() == "largest |J| (kg m²/s)"
    assert set(words(figure)) == {
        "single run", "missing or failed", "mean, ± 2 standard errors"
    }  # fmt: skip


def test_replicas_are_averaged_and_axes_of_one_value_omitted(picture):
    data = one_axis()
    both = data.expand_dims(replica=3, height=[0.2]).assign_attrs(axes='["tilt", "height"]')
    shifted = both + xr.DataArray([-1e-4, 0, 1e-4], dims="replica")
    shifted.attrs = both.attrs
    figures = [picture(each)[0] for each in (data, shifted)]
    ((one, _, _),), ((other, _, _),) = (figure.axes[0].containers for figure in figures)
    np.testing.assert_allclose(one.get_ydata(), other.get_ydata(), rtol=2e-14)  # 9e-16


def test_a_map_has_each_value_in_its_own_cell(picture):
    x, y = np.geomspace(1e-3, 1, 13), np.array([0.3, 0.1, 0.4, 0.12])
    data = grid(x, y)
    figure, _ = picture(data)
    axes, bar = figure.axes
    mesh = axes.collections[0]
    corners = mesh.get_coordinates()
    right, up = corners[0, :, 0], corners[:, 0, 1]
    assert (right[:-1] < x).all()
    assert (x < right[1:]).all()
    np.testing.assert_allclose(x, np.sqrt(right[1:] * right[:-1]), rtol=1e-14)  # 3.5e-16
    assert (up[:-1] < np.sort(y)).all()
    assert (np.sort(y) < up[1:]).all()
    values = mesh.get_array().reshape(4, 13)
    np.testing.assert_array_equal(values, data.momentum.sortby("height").T)
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "linear")
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("friction (kg/s)", "height (m)")
    assert bar.get_ylabel() == "largest |J| (kg m²/s)"
    assert words(figure) == []


def test_missing_cells_are_hatched(picture):
    data = grid(np.linspace(0, 1, 21), np.linspace(0.1, 0.4, 31))
    data.momentum[5:9, 10:20] = np.nan
    figure, pixels = picture(data)
    assert words(figure) == ["missing or failed"]
    axes = figure.axes[0]
    low, high = axes.transData.transform([(0.235, 0.2), (0.415, 0.29)]).astype(int)
    hole = pixels[len(pixels) - high[1] : len(pixels) - low[1], low[0] : high[0]]
    white = (hole.min(axis=-1) > 250).mean()
    assert 0.3 < white < 0.9  # 0.56: lines on white
    assert np.ptp(hole, axis=-1).max() < 30  # 15: no color


def test_both_signs_have_distinct_colors_about_zero(picture):
    data = grid(np.linspace(0, 1, 5), np.linspace(0, 1, 4))
    one_sign = picture(data)[0].axes[0].collections[0]
    both = picture(data.assign(momentum=data.momentum - 100))[0].axes[0].collections[0]
    assert one_sign.get_clim() == (0, 304)
    assert both.get_clim() == (-204, 204)
    red, _, blue = matplotlib.colors.to_rgb(both.cmap(0.0))
    assert blue > red


@pytest.mark.parametrize(
    ("values", "scale"),
    [
        (np.linspace(0.1, 10, 9), "linear"),
        ([1e-3, 3e-3, 1e-2, 3e-2], "log"),
        ([1, 2, 4, 8], "log"),
        ([0, 1, 10, 100], "linear"),
        ([0.1, 10], "linear"),
    ],
)
def test_values_spaced_by_ratio_have_a_logarithmic_axis(values, scale):
    assert axis_of(xr.DataArray(values, name="friction")).scale == scale


def test_a_design_of_one_field_is_points(picture):
    figure, _ = picture(design(64, "tilt"))
    ((line, _, _),) = figure.axes[0].containers
    assert (line.get_linestyle(), line.get_marker()) == ("None", "o")
    assert len(line.get_xdata()) == 64


def test_a_design_of_two_fields_is_colored_points(picture):
    data = design(64, "tilt", "friction")
    data.momentum[:5] = np.nan
    figure, _ = picture(data)
    points, missing = figure.axes[0].collections
    places = np.stack([data.tilt, data.friction], axis=1)
    np.testing.assert_array_equal(points.get_offsets(), places[5:])
    np.testing.assert_array_equal(points.get_array(), data.momentum[5:])
    np.testing.assert_array_equal(missing.get_offsets(), places[:5])


def test_a_design_beside_a_grid_is_points_too(picture):
    coords = {"friction": field("friction", [0.3, 0.1], "sample"), "tilt": field("tilt", range(3))}
    values = np.arange(6.0).reshape(2, 3)
    data = sweep(["sample", "tilt"], coords, ("sample", "tilt"), momentum=values)
    points = picture(data)[0].axes[0].collections[0]
    places = [(c, t) for c in (0.3, 0.1) for t in range(3)]
    np.testing.assert_array_equal(points.get_offsets(), places)
    np.testing.assert_array_equal(points.get_array(), np.arange(6))


def test_fields_that_vary_together_are_one_axis(picture):
    data = one_axis()
    together = data.assign_coords(height=field("height", data.tilt.values + 0.2, "tilt"))
    (axes,) = picture(together)[0].axes
    assert axes.get_xlabel() == "angle (rad)"


def test_only_measures_have_panels(picture):
    data = one_axis()
    for k in range(4):
        data[f"more_{k}"] = (("tilt",), np.arange(21) + k, {"units": "1"})
    data["empty"] = (("tilt",), np.full(21, np.nan), {"units": "s", "long_name": "duration"})
    data["path"] = (("tilt", "time"), np.zeros((21, 5)), {"units": "m"})
    data["reason"] = (("tilt",), np.full(21, "diverged"))
    figure, _ = picture(data)
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert labels == ["largest |J| (kg m²/s)", "more 0", "more 1", "more 2", "more 3", ""]
    assert figure.axes[-1].get_title(loc="left") == "duration"
    assert [text.get_text() for text in figure.axes[-1].texts] == ["nothing yet"]


def test_a_large_design_is_a_small_file(picture):
    data = design(4096, "tilt", "friction")
    for k in range(5):
        data[f"more_{k}"] = data.momentum * np.cos(k * data.tilt)
    figure, _ = picture(data)
    assert len(figure.axes) == 12  # with their color bars


def test_the_reason_why_a_sweep_cannot_be_drawn_is_named(tmp_path):
    path = tmp_path / "sweep.png"
    three = design(8, "tilt", "friction").assign_coords(height=field("height", range(8), "sample"))
    with refused("axes"):
        mm.plots.sweep(three, path)
    with refused("axes"):
        mm.plots.sweep(one_axis().isel(tilt=[3]), path)
    trajectories = one_axis().rename(seed="time")
    with refused("measures"):
        mm.plots.sweep(trajectories, path)
    assert not path.exists()
