"""The dataset that an ensemble returns."""

from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.common.checks import check_integer, check_number
from magmotor.common.exceptions import ArgumentError
from magmotor.device.provenance import attributes_of
from magmotor.devices.disk.ensemble.accumulators import (
    BINS,
    HYSTERESIS,
    REACH,
    Statistics,
    flight_bin_edges,
    quantities,
    unfinished_flights,
)
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.devices.disk.states import DiskStates
from magmotor.devices.disk.variational import TURN, unpack
from magmotor.noise import LARGEST_STEP

RECORDS_PER_DECADE = 24


class Plan(NamedTuple):
    """Schedule of an ensemble.

    `interval` is the number of steps between samples. `samples`, `records` and `burn_in` are
    numbers of samples: in all, at each record, and before the statistics begin. `levels` is the
    number of lags.
    """

    interval: int
    samples: int
    records: NDArray[np.int64]
    burn_in: int
    levels: int

    def times(self, timestep: float) -> Array:
        """Return the times of the records."""
        return np.asarray(self.interval * timestep * self.records, float)


def plan(timestep: float, duration: float, sample_interval: int, burn_in: float) -> Plan:
    """Plan records with logarithmic and, for curves over linear time, with even spacing.

    Raises
    ------
    ValueError
        An argument is out of bounds; the message names the argument, its value and the bound.
    """
    timestep = check_number("timestep", timestep, above=0)
    sample_interval = check_integer("sample_interval", sample_interval, at_least=1)
    least, most = 4 * sample_interval * timestep, LARGEST_STEP * timestep
    check_number("duration", duration, at_least=least, unit="(4 sample intervals)")
    duration = check_number("duration", duration, below=most, unit="(2^53 timesteps)")
    burn_in = check_number("burn_in", burn_in, at_least=0)
    samples = int(duration / (sample_interval * timestep) * (1 + 1e-12))
    if burn_in / (sample_interval * timestep) >= samples - 3.5:
        last = (samples - 4) * sample_interval * timestep
        sentence = f"must be at most {last:g} (4 sample intervals before the end)"
        raise ArgumentError("burn_in", burn_in, sentence)
    first = round(burn_in / (sample_interval * timestep))
    decades = np.log10(samples)
    logarithmic = np.logspace(0, decades, 1 + int(np.ceil(RECORDS_PER_DECADE * decades)))
    even = np.linspace(0, samples, 101)
    records = np.unique(np.concatenate([logarithmic, even]).round().astype(np.int64))
    # The longest lag has about four pairs of successive increments in each replica.
    levels = int(np.log2((samples - first) / 4)) + 1
    return Plan(sample_interval, samples, records, first, levels)


def result(
    scene: Disk | LangevinParticle,
    task: dict[str, Any],
    when: Plan,
    given: DiskStates | None,
    sample: int,
    arrays: dict[str, NDArray],
    deviations: tuple[float, float, float],
) -> xr.Dataset:
    """Return the dataset of everything up to a sample; it has the initial state if `given`."""
    unit, replicas = when.interval * task["timestep"], task["replicas"]
    statistics = Statistics(*[arrays[name] for name in Statistics._fields])
    done = when.records <= sample
    final = unpack(np.zeros(1), arrays["states"][np.newaxis, :, :replicas], scene.has_rotation)
    parts = [
        _moments(scene, replicas, arrays["moments"][done]),
        _correlations(statistics),
        _densities(scene, statistics, deviations),
        _states(final),
        xr.Dataset({"path": (("path_replica", "time"), TURN * arrays["paths"][done].T)}),
    ]
    if given is not None:
        parts.append(_states(given, "initial_"))
    if scene.has_rotation:
        parts.append(_flights(statistics, replicas, sample - when.burn_in, unit))
    data = xr.merge(parts).assign_coords(
        time=when.times(task["timestep"])[done], lag=unit * 2.0 ** np.arange(when.levels)
    )
    for name in (*data.data_vars, *data.coords):
        data[name].attrs.setdefault("units", "1")
    excluded = ("scene", "scene_fields", "version")
    arguments = {name: task[name] for name in task if name not in excluded}
    data.attrs = attributes_of(scene, **arguments, time_reached=sample * unit)
    return data


def _moments(scene: Any, replicas: int, powers: Array) -> xr.Dataset:
    first, second, fourth = powers.transpose(2, 1, 0)
    names = quantities(scene)
    columns = {
        "mean": first,
        "mean_error": _error(second - first**2, replicas),
        "mean_square": second,
        "mean_square_error": _error(fourth - second**2, replicas),
    }
    data = xr.Dataset({name: (("quantity", "time"), values) for name, values in columns.items()})
    return data.assign_coords(quantity=list(names), description=("quantity", list(names.values())))


def _correlations(statistics: Statistics) -> xr.Dataset:
    """Return correlations of successive increments, with jackknife errors."""
    sums = statistics.sums
    total = sums.sum(axis=0)
    rho, square = _correlation(total)
    rest = total - sums
    rho_without, square_without = _correlation(rest)
    columns = {
        "increment_correlation": rho,
        "increment_correlation_error": _jackknife(rho, rho_without, sums[..., 0]),
        "mean_square_increment": square,
        "mean_square_increment_error": _jackknife(square, square_without, sums[..., 0]),
    }
    return xr.Dataset({name: ("lag", values) for name, values in columns.items()})


def _correlation(sums: Array) -> tuple[Array, Array]:
    number, a, b, aa, bb, ab = np.moveaxis(sums, -1, 0)
    with np.errstate(invalid="ignore", divide="ignore"):
        a, b, aa, bb, ab = a / number, b / number, aa / number, bb / number, ab / number
        return (ab - a * b) / np.sqrt((aa - a**2) * (bb - b**2)), bb


def _jackknife(whole: Array, without: Array, sizes: Array) -> Array:
    """Return standard errors from the estimate of all replicas, and those without one group each.

    The delete-m_j jackknife of Busing, Meijer and van der Leeden, Statistics and Computing 9
    (1999), for groups of unequal sizes; for equal sizes it is the ordinary jackknife.
    """
    groups = len(without)
    if groups < 2:
        return np.full(without.shape[1:], np.nan)
    rest = sizes.sum(axis=0) - sizes
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.mean(rest / rest.mean(axis=0) * without, axis=0)
        ratio = rest / sizes
        center = mean + (ratio + 1 - groups) / ratio * (whole - mean)
        scale = rest.mean(axis=0) / sizes.mean(axis=0)
        return np.sqrt(scale * np.mean(ratio / scale * (without - center) ** 2, axis=0))


def _densities(scene: Any, statistics: Statistics, deviations: tuple[float, ...]) -> xr.Dataset:
    counts = statistics.counts.sum(axis=0)
    edges = {"x": np.linspace(0, TURN, BINS + 1)}
    for name, deviation in zip(scene.velocity_names, deviations, strict=False):
        edges[name] = deviation * np.linspace(-REACH, REACH, BINS + 1)
    parts = {}
    for (name, edge), count in zip(edges.items(), counts, strict=False):
        total = max(count.sum(), 1) * np.diff(edge)
        label = f"stationary density of {name}" + (" mod 2 pi" if name == "x" else "")
        parts[f"density_{name}"] = (f"{name}_bin", count / total, {"long_name": label})
    centers = {f"{name}_bin": (edge[:-1] + edge[1:]) / 2 for name, edge in edges.items()}
    return xr.Dataset(parts).assign_coords(centers)


def _flights(statistics: Statistics, replicas: int, sample: int, unit: float) -> xr.Dataset:
    edges = flight_bin_edges()
    unfinished = unfinished_flights(statistics, replicas, sample)
    label = f"flights: d keeps its sign, to {HYSTERESIS} of its standard deviation"
    columns = {
        "flights": ("flight_duration", statistics.flights.sum(axis=0), {"long_name": label}),
        "unfinished_flights": ("flight_duration", unfinished),
    }
    used = edges[:-1] <= max(sample, 1)
    data = xr.Dataset(columns).assign_coords(flight_duration=unit * edges[:-1])
    return data.isel(flight_duration=used)


def _states(states: DiskStates, prefix: str = "") -> xr.Dataset:
    columns = {k: v for k, v in states._asdict().items() if k != "time" and v is not None}
    return xr.Dataset({prefix + name: ("replica", row[-1]) for name, row in columns.items()})


def _error(variance: Array, replicas: int) -> Array:
    return np.sqrt(np.maximum(variance, 0) / replicas)
