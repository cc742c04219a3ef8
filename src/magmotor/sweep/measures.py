"""Measures: named numbers that are read off a run, of which a sweep records a list."""

from collections.abc import Callable
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common.checks import check_choice, reject
from magmotor.devices import Scene, device_of
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.devices.motor.flights import flights, transitions
from magmotor.devices.motor.observables import azimuth
from magmotor.devices.motor.scene import Motor
from magmotor.devices.motor.theory import slip_mobility
from magmotor.devices.top.observables import momentum_balance
from magmotor.devices.top.scene import Top

TRAJECTORY = "trajectory"
"""The measure that is the whole run; it stands alone."""

LATE = 0.1
"""The part of a run, at its end, in which a top is looked at for where it has settled."""


class Measure(NamedTuple):
    """A number of a run; of a run with replicas, one of each."""

    function: Callable[[xr.Dataset, Any], Any]
    unit: str
    label: str


def measures(scene: Scene) -> dict[str, Measure]:
    """The measures of a kind of scene, by name.

    Raises
    ------
    ValueError
        It is no scene.
    """
    device_of(scene)
    return MEASURES[type(scene)]


class FromFile(str):
    """The name of a measure of a user's own that was read from a file: text, and never imported."""


def is_own(name: str) -> bool:
    """Whether a name is that of a function of the user's own, `package.module:function`."""
    return ":" in name


def measure_of(scene: Scene, name: str) -> Measure:
    """A measure by its name, or one of the user's own, which is imported when it is called.

    Raises
    ------
    ValueError
        There is none; lists those that there are.
    """
    if not is_own(name):
        known = measures(scene)
        check_choice("measure", name, (*known, TRAJECTORY))
        return known[name]
    module, function = name.split(":", 1)
    if not all(map(str.isidentifier, [*module.split("."), function])):
        raise reject("measure", str(name), "package.module:function")
    return Measure(lambda run, scene: imported(name)(run, scene), "1", function)


def imported(name: str) -> Callable[[xr.Dataset, Any], Any]:
    """The function of the user's own that a name stands for; nothing else imports by name.

    Raises
    ------
    ValueError
        The name is a file's, and nobody has allowed it, or there is no such function.
    """
    if isinstance(name, FromFile):
        bound = (
            "allowed by whoever runs it, since a file names it and it would run code: sweep_of and"
            f" rerun take measures=[{str(name)!r}], scripts/rerun.py --allow-measure {name}"
        )
        raise reject("measure", str(name), bound)
    module, function = name.split(":", 1)
    try:
        found = getattr(import_module(module), function)
    except Exception as error:  # a module may raise anything
        raise reject("measure", name, f"a function that can be imported ({error})") from None
    if not callable(found):
        raise reject("measure", name, "a function that can be imported (it cannot be called)")
    return found


def _spin(run: xr.Dataset, scene: Top) -> xr.DataArray:
    return run.momentum_map / scene.inertia[2]


def _late(run: xr.Dataset) -> xr.Dataset:
    first, last = run.time.values[[0, -1]]
    return run.isel(time=run.time >= last - LATE * (last - first))


def _radius(run: xr.Dataset) -> xr.DataArray:
    x, y = run.position.sel(space="x"), run.position.sel(space="y")
    return np.hypot(x, y)


def _speed(run: xr.Dataset) -> xr.DataArray:
    return np.sqrt((run.velocity**2).sum("space"))


def _momentum_residual(run: xr.Dataset, scene: Top) -> float:
    residual = np.abs(momentum_balance(run, scene).residual).max()
    largest = np.abs(run.momentum_map).max()
    return float(residual / largest) if largest else 0.0


def _each_replica(run: xr.Dataset, replica: NDArray[Any], values: NDArray[Any]) -> Any:
    """Sums of what is found in each replica; a number if the run has none."""
    sums = np.bincount(replica, values, minlength=run.sizes.get("replica", 1))
    return sums if "replica" in run.dims else sums[0]


def _flights(run: xr.Dataset, scene: Motor) -> Any:
    found = flights(run, scene)
    return _each_replica(run, found.replica.values, np.ones(found.sizes["flight"]))


def _flown(run: xr.Dataset, scene: Motor) -> Any:
    found = flights(run, scene)
    return _each_replica(run, found.replica.values, np.abs(found.revolutions.values))


def _flying(run: xr.Dataset, scene: Motor) -> Any:
    found = flights(run, scene)
    lasting = (found.end - found.begin).values
    return _each_replica(run, found.replica.values, lasting / float(run.time[-1]))


def _transitions(run: xr.Dataset, scene: Motor) -> Any:
    found = transitions(run, scene)
    return _each_replica(run, found.replica.values, np.ones(found.sizes["transition"]))


def _revolutions(run: xr.Dataset, scene: Motor) -> xr.DataArray:
    angle = azimuth(run)
    return (angle.isel(time=-1) - angle.isel(time=0)) / (2 * np.pi)


def _motor_slip_temperature(run: xr.Dataset, scene: Motor) -> xr.DataArray:
    square = (run.slip_velocity.isel(space=slice(2)) ** 2).sum("space")
    return square.mean("time") / (2 * slip_mobility(scene))


def _displacement(run: xr.Dataset, scene: Disk | LangevinParticle) -> xr.DataArray:
    return run.x.isel(time=-1) - run.x.isel(time=0)


def _slip_temperature(run: xr.Dataset, scene: Disk) -> xr.DataArray:
    return ((run.v + run.omega) ** 2).mean("time") / (1 + 1 / scene.sigma)


_OF_LANGEVIN = {
    "displacement": Measure(_displacement, "1", "x at the end less x at the start"),
    "square_displacement": Measure(
        lambda run, scene: _displacement(run, scene) ** 2, "1", "square displacement of x"
    ),
    "largest_displacement": Measure(
        lambda run, scene: abs(run.x - run.x.isel(time=0)).max("time"),
        "1",
        "largest |x - x(0)|",
    ),
    "temperature": Measure(
        lambda run, scene: (run.v**2).mean("time"), "1", "mean of v^2, kT at equilibrium"
    ),
    "mean_energy": Measure(lambda run, scene: run.energy.mean("time"), "1", "mean energy"),
}

MEASURES: dict[type, dict[str, Measure]] = {
    Top: {
        "max_spin": Measure(
            lambda run, scene: abs(_spin(run, scene)).max("time"), "rad/s", "largest |J|/I_3"
        ),
        "final_spin": Measure(
            lambda run, scene: _spin(run, scene).isel(time=-1), "rad/s", "J/I_3 at the end"
        ),
        "max_momentum_map": Measure(
            lambda run, scene: abs(run.momentum_map).max("time"), "kg m^2/s", "largest |J|"
        ),
        "settling_radius": Measure(
            lambda run, scene: _radius(_late(run)).mean("time"),
            "m",
            "mean distance from the centre in the last tenth of the run",
        ),
        "settling_speed": Measure(
            lambda run, scene: _speed(_late(run)).mean("time"),
            "m/s",
            "mean speed of the ball in the last tenth of the run",
        ),
        "momentum_residual": Measure(
            _momentum_residual, "1", "J against the integral of friction's torque, over max |J|"
        ),
    },
    Motor: {
        "flights": Measure(_flights, "1", "number of flights"),
        "revolutions_flown": Measure(_flown, "1", "revolutions in flights, in either direction"),
        "flying": Measure(_flying, "1", "part of the time spent in flights"),
        "transitions": Measure(_transitions, "1", "number of transitions between wells"),
        "revolutions": Measure(_revolutions, "1", "revolutions of the ball from start to end"),
        "slip_temperature": Measure(
            _motor_slip_temperature, "J", "temperature of the slip, kT in theory"
        ),
    },
    Disk: {
        **_OF_LANGEVIN,
        "slip_temperature": Measure(
            _slip_temperature, "1", "mean of s^2/(1 + 1/sigma), kT at equilibrium"
        ),
    },
    LangevinParticle: _OF_LANGEVIN,
}
