"""Ensembles of any device: statistics of many replicas, without their trajectories."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from magmotor.common.arguments import checked
from magmotor.common.checks import check_type
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import Count, Described, NotNegative, Positive, Seed, integer
from magmotor.device.device import Scene
from magmotor.device.job import EnsembleOptions
from magmotor.device.provenance import attributes_of
from magmotor.run.simulate import simulate


def _with_noise(name: str, scene: Any) -> Any:
    """Return a scene if its device has noise, without which all replicas would be the same."""
    check_type(name, scene, Scene)
    if not scene.device.is_random:
        kind = type(scene).__name__
        sentence = f"a {kind} has no noise, and all replicas would be the same: use simulate"
        raise ArgumentError(name, scene, sentence)
    return scene


NOT_KEPT = "not kept"
"""Attribute `initial` of an ensemble that started from a given state."""


@checked(finite=False)
def ensemble(  # noqa: PLR0913 (options)
    scene: Annotated[Scene, Described("with noise", _with_noise)],
    *,
    method: str,
    timestep: Positive,
    duration: Positive,
    replicas: Count,
    seed: Seed = 0,
    sample_interval: Count | None = None,
    burn_in: NotNegative = 0.0,
    initial: Mapping[str, ArrayLike] | None = None,
    trajectories: Annotated[int, integer(at_least=0)] = 0,
    threads: Count | None = None,
    checkpoint: str | Path | None = None,
) -> xr.Dataset:
    """Run many replicas and keep only their statistics.

    Each replica follows the same path as in `simulate`, bit for bit. The disk and the Langevin
    particle have more statistics and, for the methods `variational/...`, a dedicated kernel. With
    any other method or device, the statistics are computed at the end, and all samples are in
    memory until then. Every other device with noise has the moments of its scalar variables.

    Parameters
    ----------
    scene : Scene
        A scene with noise.
    method : str
        One of `methods(scene)`.
    timestep, duration : float
    replicas : int
        Number of independent runs.
    seed : int
        Seed of the Brownian paths; each replica also uses its own number.
    sample_interval : int, optional
        Steps between samples; by default, the number of steps in one unit of time.
    burn_in : float
        Time at which correlations, histograms and flights begin (disk and particle only).
    initial : mapping, optional
        Replaces parts of the scene's initial state, as in `simulate`: numbers, or arrays with one
        value per replica. `gibbs(scene, replicas)` returns the disk's stationary state.
    trajectories : int
        Number of replicas whose x is kept at all recorded times (disk and particle only).
    threads : int, optional
        By default, the number of processors (disk and particle only, and not with MuJoCo).
    checkpoint : str or Path, optional
        File to which everything is saved every half minute and at the end; the run resumes from it
        if it exists (disk and particle only).

    Returns
    -------
    xarray.Dataset
        By `quantity` and `time`: `mean`, `mean_square` and their standard errors `mean_error`,
        `mean_square_error`. By `replica`: the final values (for the disk `x`, `v`, `theta`,
        `omega`). The disk and the particle have the quantities x and y = x + theta since the start,
        d = -v + sigma omega, the slip v + omega, v, omega and energy, at logarithmically and evenly
        spaced times. They also have, by `lag`, `increment_correlation` of x(t + 2 lag) - x(t + lag)
        and x(t + lag) - x(t), `mean_square_increment`, and their errors; `density` of x mod 2 pi, v
        and omega by `bin`; `flights` and `unfinished_flights` by `flight_duration`, the number of
        intervals between sign changes of d with a hysteresis of 0.1 standard deviations, observed
        at the samples; and `initial_x` etc. if `initial` was given. Correlations and errors are NaN
        at lags with too few samples or replicas.

    Raises
    ------
    ValueError
        Bad input, including a checkpoint that is damaged or belongs to another task; the message
        names the argument, its value and the bound.
    SimulationDiverged
        A replica is no longer finite or has gained impossible energy; holds the records so far.
    SimulationInterrupted
        Ctrl-C, after a last checkpoint; holds the records so far.

    Warns
    -----
    UserWarning
        The timestep is too long for the flights at this temperature, or a checkpoint could not be
        written; in that case the previous one is kept and the run continues.

    Examples
    --------
    >>> import magmotor as mm
    >>> many = mm.ensemble(
    ...     mm.Disk(), method="variational/baoab", timestep=0.02, duration=100.0, replicas=500
    ... )
    >>> many.mean_square.dims
    ('quantity', 'time')
    """
    numerics = {"method": method, "timestep": timestep, "duration": duration, "seed": seed}
    options = EnsembleOptions(
        **numerics, replicas=replicas, sample_interval=sample_interval, burn_in=burn_in,
        initial=initial, trajectories=trajectories, threads=threads, checkpoint=checkpoint,
    )  # fmt: skip
    own = scene.device.ensemble(scene)
    if own is not None:
        return own(scene, options, simulate)
    unsupported = {"burn_in": burn_in, "trajectories": trajectories}
    unsupported |= {"threads": threads, "checkpoint": checkpoint}
    for name, value in unsupported.items():
        if value:
            kind = type(scene).__name__
            raise ArgumentError(
                name, value, f"must be left out: ensembles of a {kind} have moments only"
            )
    interval = options.steps_between_samples
    run = simulate(
        scene, **numerics, replicas=replicas, record_interval=interval, initial=initial
    )  # fmt: skip
    numerics |= {"replicas": replicas, "sample_interval": interval}
    kept = None if initial is None else NOT_KEPT
    return _statistics(run).assign_attrs(
        attributes_of(scene, **numerics, **unsupported, initial=kept)
    )


def _statistics(run: xr.Dataset) -> xr.Dataset:
    names = [name for name in run.data_vars if set(run[name].dims) == {"replica", "time"}]
    values = np.stack([run[name].transpose("replica", "time").values for name in names])
    moments = {}
    for name, powers in (("mean", values), ("mean_square", values**2)):
        moments[name] = powers.mean(axis=1)
        moments[f"{name}_error"] = _standard_error(powers)
    columns = {name: (("quantity", "time"), value) for name, value in moments.items()}
    final = run[names].isel(time=-1, drop=True)
    coordinates = {"quantity": [*map(str, names)], "time": run.time, "replica": run.replica}
    return xr.Dataset({**columns, **final.data_vars}, coordinates)


def _standard_error(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the standard error of the mean over replicas (axis 1); NaN for one replica."""
    count = values.shape[1]
    if count == 1:
        return np.full(values[:, 0].shape, np.nan)
    return values.std(axis=1, ddof=1) / np.sqrt(count)
