"""Units and labels of public observables, and of the measures that reduce observables."""

from typing import get_type_hints

import numpy as np
import pytest
import xarray as xr

import magmotor as mm
from magmotor import observables

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


@pytest.mark.parametrize("name", READ_FROM)
def test_every_variable_has_a_unit_and_a_label(name, runs):
    for kind in READ_FROM[name]:
        found = getattr(observables, name)(runs[kind])
        data = found.to_dataset(name=name) if isinstance(found, xr.DataArray) else found
        numbers = [*data.data_vars, *(c for c in data.coords if data[c].dtype.kind == "f")]
        missing = [v for v in numbers if not {"units", "long_name"} <= {*data[v].attrs}]
        assert missing == [], kind


CHANGED_UNITS = {"turns": "rad", "revolutions": "rad"}
"""Measures whose unit is not that of their observable, and the observable's unit."""


@pytest.mark.parametrize("name", [*SCENES, "Rotor"])
def test_measures_have_the_units_of_their_observables(name, runs, rotor):
    """An observable that is a variable of the run also has the unit of that variable."""
    if name == "Rotor":
        scene = rotor.Rotor()
        run = mm.simulate(scene, **NUMERICS)
    else:
        scene, run = SCENES[name], runs[name]
    tried = set()
    for key, measure in mm.sweep.measures(scene).items():
        if measure.observable is None:
            continue
        tried.add(key)
        values = measure.observable(run, scene)
        assert values.dims == ("time",)
        assert values.units == CHANGED_UNITS.get(key, measure.unit)
        assert np.ndim(measure.function(run, scene)) == 0
        for variable in run.data_vars.values():
            assert not values.equals(variable) or values.units == variable.units
    assert tried
