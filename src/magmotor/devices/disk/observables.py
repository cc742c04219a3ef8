"""Observables of the sliding disk and of the Langevin particle."""

from typing import Annotated, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common.arrays import Array
from magmotor.common.exceptions import ArgumentError
from magmotor.common.files import parsed_attributes
from magmotor.common.hints import number
from magmotor.device.analysis import OWN, analysis
from magmotor.device.observable import labeled
from magmotor.devices.disk.scene import Disk, LangevinParticle, derivative

LABELS = {
    "survival": ("1", "probability that a flight lasts longer"),
    "survival_error": ("1", "standard error of the survival probability"),
    "flight_duration": ("1", "duration of flights"),
    "diffusion": ("1", "diffusion coefficient of d"),
    "diffusion_error": ("1", "standard error of the diffusion coefficient"),
    "slope": ("1", "local slope of log MSD over log t"),
    "slope_error": ("1", "standard error of the slope"),
    "begin": ("1", "earlier time"),
    "end": ("1", "later time"),
    "time": ("1", "geometric mean of the two times"),
}


def energy(scene: Disk | LangevinParticle, x: Array, v: Array, omega: Array | None = None) -> Array:
    """Return E = v^2/2 + sigma omega^2/2 + U(x), equation (slidingdiskE); any shape."""
    kinetic = 0.5 * v**2
    if scene.has_rotation and omega is not None:
        kinetic = kinetic + 0.5 * scene.masses[-1] * omega**2
    return kinetic + derivative(scene.coefficients, x)


@analysis("flights", "unfinished_flights", of=Disk)
def flight_survival(run: xr.Dataset) -> xr.Dataset:
    r"""Estimate the probability that a flight lasts at least a given time, from an ensemble.

    The product-limit estimate of Kaplan and Meier is S(t) = prod (1 - e_j/n_j) over the bins j of
    durations below t: n_j flights have lasted at least to bin j, and e_j of them end in it. A
    flight that has not ended at the end of the run counts in n_j for all bins up to its duration,
    and as one half in the last of these. `ensemble` defines flights.

    Parameters
    ----------
    run : xarray.Dataset
        From `ensemble`, of a `Disk`.

    Returns
    -------
    xarray.Dataset
        `survival` and its standard error `survival_error` (Greenwood's formula) over
        `flight_duration`, the durations at which the bins begin, up to the last flight's.

    Raises
    ------
    ValueError
        Some of the ensemble's bins are missing.
    """
    durations = run.flight_duration.values
    attributes = parsed_attributes(run.attrs)
    if "sample_interval" in attributes and not _has_all_bins(durations, attributes):
        raise ArgumentError(
            "flight_duration", durations.tolist(), "must have all bins of the ensemble"
        )
    ended, unfinished = run.flights.values, run.unfinished_flights.values
    at_risk = np.cumsum((ended + unfinished)[::-1])[::-1]
    seen = at_risk > 0
    ended, at_risk = ended[seen], (at_risk - unfinished / 2)[seen]
    survival = np.cumprod(np.append(1.0, 1 - ended / at_risk))[:-1]
    left = np.maximum(at_risk - ended, 0.5)  # zero only in the last bin, which is not used
    terms = np.append(0.0, ended / (at_risk * left))[:-1]
    values = {"survival": survival, "survival_error": survival * np.sqrt(np.cumsum(terms))}
    data = {name: ("flight_duration", value) for name, value in values.items()}
    return labeled(xr.Dataset(data, {"flight_duration": durations[seen]}), LABELS)


def _has_all_bins(durations: NDArray[np.float64], attributes: dict[str, Any]) -> bool:
    """Whether durations include all bins, from one sample to the longest possible flight."""
    for name in ("timestep", "time_reached", "burn_in"):
        if name not in attributes:
            raise ArgumentError("attributes", [*attributes], f"must include {name}")
    sample = attributes["sample_interval"] * attributes["timestep"]
    seen = attributes["time_reached"] - attributes["burn_in"]
    ratio = 2**0.25
    even = np.allclose(durations[1:], ratio * durations[:-1], rtol=1e-6)
    return bool(even and np.isclose(durations[0], sample) and durations[-1] * ratio > seen)


@analysis("v", "omega", of=Disk, records=2)
def d_diffusion(run: xr.Dataset, scene: Disk = OWN) -> xr.Dataset:
    r"""Estimate the diffusion coefficient D(d) of d = -v + sigma omega from replicas with equal d.

    By Einstein's relation, the variance of d over the replicas grows at the rate 2 D between the
    first and the last record of the run. At first, d also oscillates with the potential; leave out
    these records, as in ``d_diffusion(run.sel(time=slice(20, None)))``. The last record must come
    before d has changed so much that D differs. `magmotor.theory.d_diffusion` gives the theory.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate`, of a `Disk`, with replicas from ``gibbs(scene, replicas, d=d)``; or the
        final states of ensembles of different durations, joined along `time`.
    scene : Disk, optional
        By default, the run's own.

    Returns
    -------
    xarray.Dataset
        `diffusion`, dimensionless (d^2 over time), and its standard error `diffusion_error`, from
        the scatter of the replicas' squares.

    Raises
    ------
    ValueError
        There are fewer than two records or replicas.
    """
    replicas = run.sizes.get("replica", 1)
    if replicas < 2:
        raise ArgumentError(
            "replicas", replicas, "must be at least 2, since D is the growth of their scatter"
        )
    d = (scene.sigma * run.omega - run.v).values
    early, late = (column - column.mean() for column in (d[:, 0], d[:, -1]))
    grown = (late**2 - early**2) / (2 * float(run.time[-1] - run.time[0]))
    error = grown.std() / replicas**0.5
    data = xr.Dataset({"diffusion": grown.mean(), "diffusion_error": error})
    return labeled(data, LABELS)


@analysis("path", of=(Disk, LangevinParticle), records=2)
def local_slope(run: xr.Dataset, factor: Annotated[float, number(above=1)] = 2.0) -> xr.Dataset:
    """Estimate the local slope d log MSD / d log t of x, between times about a factor apart.

    The error is that of a difference of two logarithms of means over the *same* replicas, to first
    order. The two means are correlated, so the errors of the MSD alone would be misleading.

    Parameters
    ----------
    run : xarray.Dataset
        From `ensemble`, with all replicas among its `trajectories`.
    factor : float
        Ratio of the later time to the earlier, above 1; approximate, since both are recorded times.

    Returns
    -------
    xarray.Dataset
        `slope` and its standard error `slope_error`, and the two times `begin` and `end`, over
        `time`, their geometric mean.

    Raises
    ------
    ValueError
        The first record is not the start, or the factor is larger than any between two records.
    """
    if run.time.values[0] != 0:
        raise ArgumentError(
            "first time in run",
            float(run.time[0]),
            "must be 0, since displacements count from the start",
        )
    square = (run.path.values - run.path.values[:, :1]) ** 2
    times = run.time.values
    end = np.searchsorted(times, factor * times[1:] * (1 - 1e-9))
    begin = np.flatnonzero(end < len(times)) + 1
    if not len(begin):
        raise ArgumentError(
            "factor",
            factor,
            "must be at most the ratio of the last recorded time to the first after zero",
        )
    end = end[begin - 1]
    mean = square.mean(axis=0)
    width = np.log(times[end] / times[begin])
    scatter = np.std(square[:, end] / mean[end] - square[:, begin] / mean[begin], axis=0)
    columns = {
        "slope": np.log(mean[end] / mean[begin]) / width,
        "slope_error": scatter / width / np.sqrt(len(square)),
        "begin": times[begin],
        "end": times[end],
    }
    data = {name: ("time", values) for name, values in columns.items()}
    return labeled(xr.Dataset(data, {"time": np.sqrt(times[begin] * times[end])}), LABELS)
