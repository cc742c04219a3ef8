"""Units and labels of public observables, and of the measures that reduce observables."""

from typing import get_type_hints

import numpy as np
import pytest
import xarray as xr

import magmotor as mm
from magmotor import observables
from magmotor.device import Observable, labeled

NUMERICS = {"method": "variational/baoab", "timestep": 0.05, "duration": 2.0}
SCENES = {
    "Top": mm.Top(),
    "Motor": mm.Motor(),
    "Disk": mm.Disk(),
    "LangevinParticle": mm.LangevinParticle(),
}


@pytest.fixture(scope="module")
def runs():
    """A run of each device, a motor whose ball flies, and ensembles and replicas of the disk."""
    found = {name: mm.simulate(scene, **NUMERICS) for name, scene in SCENES.items()}
    around = np.linspace(0, 9, len(found["Motor"].time))
    circle = np.stack([np.cos(around), np.sin(around), np.full_like(around, 0.04)], axis=-1)
    found["flying"] = found["Motor"].assign(position=(("time", "space"), circle))
    found["replicas"] = mm.simulate(SCENES["Disk"], **NUMERICS, replicas=3)
    found["ensemble"] = mm.ensemble(
        SCENES["Disk"], **{**NUMERICS, "duration": 20.0}, replicas=3, sample_interval=2,
        trajectories=3,
    )  # fmt: skip
    return found


READ_FROM = {
    "azimuth": ["Top", "Motor"],
    "d_diffusion": ["replicas"],
    "dwell_times": ["Motor", "flying"],
    "efficiency": ["Motor"],
    "energy_balance": [*SCENES, "replicas"],
    "flight_survival": ["ensemble"],
    "flights": ["Motor", "flying"],
    "local_slope": ["ensemble"],
    "mode_temperatures": ["Motor"],
    "momentum_balance": ["Top"],
    "ring_attitude": ["Motor"],
    "transitions": ["Motor", "flying"],
}
"""The public observables that return labeled data, and the runs that each is tried on."""


def test_all_public_observables_of_runs_are_tried():
    labeled = {
        name
        for name in observables.__all__
        if get_type_hints(getattr(observables, name)).get("return") in (xr.Dataset, xr.DataArray)
    }
    assert labeled == {*READ_FROM}


UNITS: dict[str, dict[str, list[str]]] = {
    "azimuth": {"rad": ["azimuth"], "s": ["time"]},
    "d_diffusion": {"1": ["diffusion", "diffusion_error"]},
    "dwell_times": {"1": ["replica", "censored"], "s": ["begin", "end"]},
    "efficiency": {
        "J": ["kicks", "transferred", "reached"],
        "1": ["efficiency", "share"],
        "s": ["time"],
    },
    "energy_balance": {
        "J": ["gain", "heat", "work", "injected", "martingale", "load_work", "residual"],
        "s": ["time"],
    },
    "flight_survival": {"1": ["survival", "survival_error", "flight_duration"]},
    "flights": {"1": ["replica", "revolutions", "censored"], "s": ["begin", "once", "end"]},
    "local_slope": {"1": ["slope", "slope_error", "begin", "end", "time"]},
    "mode_temperatures": {"J": ["temperature", "temperature_error", "theory"]},
    "momentum_balance": {"N m": ["torque"], "kg m^2/s": ["integral", "residual"], "s": ["time"]},
    "ring_attitude": {"rad": ["tilt", "yaw"], "s": ["time"]},
    "transitions": {"1": ["replica", "well", "step"], "s": ["time"]},
}
"""Variables of each observable by their units; those of the disk are dimensionless."""

DIMENSIONLESS = {"Disk", "LangevinParticle", "replicas", "ensemble"}


@pytest.mark.parametrize("name", READ_FROM)
def test_every_variable_has_a_unit_and_a_label(name, runs):
    expected = {variable: unit for unit, of in UNITS[name].items() for variable in of}
    seen = set()
    for kind in READ_FROM[name]:
        found = getattr(observables, name)(runs[kind])
        data = found.to_dataset(name=name) if isinstance(found, xr.DataArray) else found
        axes = [coordinate for coordinate in data.coords if data[coordinate].dtype.kind == "f"]
        numbers = [str(variable) for variable in (*data.data_vars, *axes)]
        units = {v: data[v].attrs.get("units") for v in numbers}
        assert units == {v: "1" if kind in DIMENSIONLESS else expected[v] for v in numbers}, kind
        labels = [data[v].attrs.get("long_name", "") for v in numbers]
        assert all(map(is_label, labels)), labels
        assert len({*labels}) == len(labels), labels
        seen |= {*numbers}
    assert seen == {*expected}


def is_label(text):
    """Whether a text has words, and nothing that a format has left."""
    return len(text) >= 4 and "{" not in text and "}" not in text


MEASURES: dict[str, dict[str, tuple[str, str | None]]] = {
    "Top": {
        "max_spin": ("rad/s", "rad/s"),
        "final_spin": ("rad/s", "rad/s"),
        "max_momentum_map": ("kg m^2/s", "kg m^2/s"),
        "settling_radius": ("m", "m"),
        "settling_speed": ("m/s", "m/s"),
        "momentum_residual": ("1", None),
    },
    "Motor": {
        "flights": ("1", None),
        "revolutions_flown": ("1", None),
        "longest_flight": ("1", None),
        "flying": ("1", None),
        "transitions": ("1", None),
        "revolutions": ("1", "rad"),
        "slip_temperature": ("J", None),
    },
    "Disk": {
        "displacement": ("1", "1"),
        "square_displacement": ("1", "1"),
        "largest_displacement": ("1", "1"),
        "temperature": ("1", "1"),
        "mean_energy": ("1", "1"),
        "slip_temperature": ("1", None),
    },
    "LangevinParticle": {
        "displacement": ("1", "1"),
        "square_displacement": ("1", "1"),
        "largest_displacement": ("1", "1"),
        "temperature": ("1", "1"),
        "mean_energy": ("1", "1"),
    },
    "Rotor": {"turns": ("1", "rad"), "temperature": ("J", None)},
}
"""Unit of each measure, and of the observable that it reduces, if there is one."""


@pytest.mark.parametrize("name", MEASURES)
def test_measures_and_their_observables_have_units_and_labels(name, runs, rotor):
    """An observable that is a variable of the run also has the unit of that variable."""
    if name == "Rotor":
        scene = rotor.Rotor()
        run = mm.simulate(scene, **NUMERICS)
    else:
        scene, run = SCENES[name], runs[name]
    found = mm.sweep.measures(scene)
    units = {k: (m.unit, m.observable and m.observable.unit) for k, m in found.items()}
    assert units == MEASURES[name]
    labels = [measure.label for measure in found.values()]
    assert all(map(is_label, labels)), labels
    assert len({*labels}) == len(labels), labels
    for measure in found.values():
        assert np.ndim(measure.function(run, scene)) == 0
        if measure.observable is None:
            continue
        values = measure.observable(run, scene)
        assert values.dims == ("time",)
        assert values.attrs["units"] == measure.observable.unit
        assert is_label(values.attrs["long_name"])
        assert values.attrs["long_name"] == measure.observable.label
        for variable in run.data_vars.values():
            assert not values.equals(variable) or values.units == variable.units


def test_the_label_of_a_measure_contains_that_of_its_observable():
    speed = Observable(lambda run, scene: run.v, "m/s", "speed")
    plain = speed.measure("largest {} of all", lambda v: v.max("time"))
    assert (plain.unit, plain.label) == ("m/s", "largest speed of all")
    square = speed.measure("square", lambda v: (v**2).max("time"), unit="m^2/s^2")
    assert (square.unit, square.label) == ("m^2/s^2", "square")
    labels = {name: m.label for name, m in mm.sweep.measures(mm.Top()).items()}
    assert labels["max_spin"] == "largest magnitude of the spin"


def test_labeled_data_keep_their_other_attributes():
    data = xr.Dataset({"x": ("time", [1.0], {"note": "own"}), "y": ("time", [2.0])})
    found = labeled(data, {"x": ("m", "distance"), "absent": ("s", "time")})
    assert found.x.attrs == {"note": "own", "units": "m", "long_name": "distance"}
    assert found.y.attrs == {}
    assert data.x.attrs == {"note": "own"}
