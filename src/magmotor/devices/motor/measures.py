"""Measures of the motor."""

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.device.observable import Measure
from magmotor.devices.motor.flights import flights, transitions
from magmotor.devices.motor.observables import AZIMUTH
from magmotor.devices.motor.scene import Motor
from magmotor.devices.motor.theory import slip_mobility


def _by_replica(
    run: xr.Dataset, replica: NDArray[Any], values: NDArray[Any], combine: np.ufunc = np.add
) -> Any:
    """Combine the values of each replica with 0; return a number if the run has no replicas."""
    found = np.zeros(run.sizes.get("replica", 1))
    combine.at(found, replica, values)
    return found if "replica" in run.dims else found[0]


def _flights(run: xr.Dataset, scene: Motor) -> Any:
    found = flights(run, scene)
    return _by_replica(run, found.replica.values, np.ones(found.sizes["flight"]))


def _revolutions_flown(run: xr.Dataset, scene: Motor) -> Any:
    found = flights(run, scene)
    return _by_replica(run, found.replica.values, np.abs(found.revolutions.values))


def _longest_flight(run: xr.Dataset, scene: Motor) -> Any:
    found = flights(run, scene)
    return _by_replica(run, found.replica.values, np.abs(found.revolutions.values), np.maximum)


def _flying(run: xr.Dataset, scene: Motor) -> Any:
    found = flights(run, scene)
    durations = (found.end - found.begin).values
    return _by_replica(run, found.replica.values, durations / float(run.time[-1]))


def _transitions(run: xr.Dataset, scene: Motor) -> Any:
    found = transitions(run, scene)
    return _by_replica(run, found.replica.values, np.ones(found.sizes["transition"]))


def _revolutions(azimuth: xr.DataArray) -> xr.DataArray:
    return (azimuth.isel(time=-1) - azimuth.isel(time=0)) / (2 * np.pi)


def _slip_temperature(run: xr.Dataset, scene: Motor) -> xr.DataArray:
    square = (run.slip_velocity.isel(space=slice(2)) ** 2).sum("space")
    return square.mean("time") / (2 * slip_mobility(scene))


MEASURES: dict[str, Measure] = {
    "flights": Measure(_flights, "1", "number of flights"),
    "revolutions_flown": Measure(
        _revolutions_flown, "1", "revolutions in flights, in either direction"
    ),
    "longest_flight": Measure(
        _longest_flight, "1", "revolutions in the longest flight, in either direction"
    ),
    "flying": Measure(_flying, "1", "fraction of the time spent in flights"),
    "transitions": Measure(_transitions, "1", "number of transitions between wells"),
    "revolutions": AZIMUTH.measure(
        "revolutions of the ball from start to end", _revolutions, unit="1"
    ),
    "slip_temperature": Measure(_slip_temperature, "J", "temperature of the slip, kT in theory"),
}
