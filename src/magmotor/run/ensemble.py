"""Ensembles of any device: many replicas, of which moments are kept and no trajectory is."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from magmotor.common.arguments import checked
from magmotor.common.checks import reject
from magmotor.common.hints import Count, NotNegative, Positive, Seed, integer
from magmotor.device.device import Scene
from magmotor.device.provenance import attributes_of
from magmotor.run.simulate import simulate


@checked(finite=False)
def ensemble(
    scene: Scene,
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
    """Run many replicas, keeping statistics only.

    A replica's path is the one that `simulate` gives it, number for number. The disk and the
    Langevin particle have a kernel and statistics of their own; of every other device that has
    noise, the moments of its numbers are taken, at the end: until then all samples are in memory.

    Parameters
    ----------
    scene : Scene
        Of a device with noise.
    method : str
        One of `methods(scene)`; of the disk and the particle `variational/...`.
    timestep, duration : float
    replicas : int
        Number of independent runs.
    seed : int
        Of the Brownian paths; the replica's number does the rest.
    sample_interval : int, optional
        Steps between the samples that statistics see; by default, the steps in a time of 1.
    burn_in : float
        Time after which correlations, histograms and flights begin; of the disk and the particle.
    initial : mapping, optional
        Replaces parts of the scene's initial state, as in `simulate`: numbers, or arrays of each
        replica's. Of `gibbs(scene, replicas)`, the disk's stationary state.
    trajectories : int
        Of so many replicas, x at all recorded times is kept; of the disk and the particle.
    threads : int, optional
        By default, the number of processors; of the disk and the particle.
    checkpoint : str or Path, optional
        File to save all to, every half minute and at the end, and to go on from if it is there; of
        the disk and the particle.

    Returns
    -------
    xarray.Dataset
        Over `time`, by `quantity`: `mean`, `mean_square` and their standard errors `mean_error`,
        `mean_square_error`. Of the disk and the particle (with quantities x and y = x + theta since
        the start, d = -v + sigma omega, the slip v + omega, v, omega and energy, and times that are
        logarithmic and even), besides: over `lag`, `increment_correlation` of
        x(t + 2 lag) - x(t + lag) and x(t + lag) - x(t), `mean_square_increment`, and their errors.
        `density` of x mod 2 pi, v and omega over `bin`; `flights` and `unfinished_flights` by
        `flight_duration`, the number of times between changes of sign of d with a hysteresis of
        0.1 standard deviations, seen at the samples. Correlations and errors are NaN at lags where
        there are too few samples or replicas for them. By `replica`, the numbers at the end (`x`,
        `v`, `theta`, `omega`), and `initial_x` and so on where `initial` was given.

    Raises
    ------
    ValueError
        Bad input, also a checkpoint that is damaged or of another task: names it, its value and
        the bound.
    SimulationDiverged
        A replica is no longer finite or has energy that it cannot have; holds what was recorded.
    SimulationInterrupted
        Ctrl-C; holds what was recorded, after a last checkpoint.

    Warns
    -----
    UserWarning
        The timestep is too long for the flights at this temperature, or a checkpoint could not be
        written: the one before it stays, and the run goes on.

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
    own = scene.device.ensemble(scene)
    if own is not None:
        return own(
            scene, **numerics, replicas=replicas, sample_interval=sample_interval,
            burn_in=burn_in, initial=initial, trajectories=trajectories, threads=threads,
            checkpoint=checkpoint,
        )  # fmt: skip
    given = {"burn_in": burn_in, "trajectories": trajectories}
    given |= {"threads": threads, "checkpoint": checkpoint}
    for name, value in given.items():
        if value:
            kind = type(scene).__name__
            raise reject(name, value, f"must be left out: ensembles of a {kind} know moments only")
    interval = max(1, round(1 / timestep)) if sample_interval is None else sample_interval
    run = simulate(
        scene, **numerics, replicas=replicas, record_interval=interval, initial=initial
    )  # fmt: skip
    told = {"replicas": replicas, "sample_interval": interval, **given}
    kept = None if initial is None else "not kept"
    return _reduced(run).assign_attrs(attributes_of(scene, **numerics, **told, initial=kept))


def _reduced(run: xr.Dataset) -> xr.Dataset:
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
    """Of means over replicas, axis 1; NaN of one replica."""
    count = values.shape[1]
    if count == 1:
        return np.full(values[:, 0].shape, np.nan)
    return values.std(axis=1, ddof=1) / np.sqrt(count)
