"""The front door of ensembles: what is asked for, checked."""

import dataclasses
import json
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import xarray as xr
from numpy.typing import ArrayLike

from magmotor.common.arguments import Count, NotNegative, Positive, Seed, checked, integer
from magmotor.common.checks import check_choice, reject
from magmotor.common.environment import thread_count
from magmotor.device.states import checksum
from magmotor.devices.disk.ensemble.march import March
from magmotor.devices.disk.ensemble.result import plan
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.noise import check_seed
from magmotor.numerics import splittings as schemes


@checked(finite=False)
def ensemble(
    scene: Disk | LangevinParticle,
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

    A replica's path is the one that `simulate` gives it, number for number, and nothing in the
    result depends on the number of threads or on interruptions.

    Parameters
    ----------
    scene : Disk or LangevinParticle
    method : str
        `variational/euler` or `variational/baoab`.
    timestep, duration : float
    replicas : int
        Number of independent runs.
    seed : int
        Of the Brownian paths; the replica's number does the rest.
    sample_interval : int, optional
        Steps between the samples that statistics see; by default, the steps in a time of 1.
    burn_in : float
        Time after which correlations, histograms and flights begin.
    initial : mapping, optional
        `x`, `v`, `theta`, `omega`, numbers or arrays (replicas,), instead of the scene's own: of
        `gibbs(scene, replicas)`, the stationary state.
    trajectories : int
        Of so many replicas, x at all recorded times is kept.
    threads : int, optional
        By default, the number of processors.
    checkpoint : str or Path, optional
        File to save all to, every half minute and at the end, and to go on from if it is there.

    Returns
    -------
    xarray.Dataset
        Over `time` (logarithmic and even), by `quantity`: `mean`, `mean_square` and their standard
        errors, of the displacements x and y = x + theta since the start, d = -v + sigma omega, the
        slip v + omega, v, omega and the energy. Over `lag`: `increment_correlation` of
        x(t + 2 lag) - x(t + lag) and x(t + lag) - x(t), `mean_square_increment`, and their errors.
        `density` of x mod 2 pi, v and omega over `bin`; `flights` and `unfinished_flights` by
        `flight_duration`, the number of times between changes of sign of d with a hysteresis of
        0.1 standard deviations, seen at the samples. Correlations and errors are NaN at lags where
        there are too few samples or replicas for them. Final `x`, `v`, `theta`, `omega` by
        `replica`, and `initial_x` and so on where `initial` was given.

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
    check_choice("method", method, schemes.methods(schemes.DISK, noise=scene.noise > 0))
    seed = check_seed(seed)
    if trajectories > replicas:
        raise reject("trajectories", trajectories, f"at most {replicas}, the replicas")
    if not scene.noise:
        raise reject("noise", scene.noise, "positive: all replicas would be the same")
    steps = max(1, round(1 / timestep)) if sample_interval is None else sample_interval
    when = plan(timestep, duration, steps, burn_in)
    device: Any = scene.device
    device.check_run(scene, method, timestep, replicas)
    first = device.initial_state(scene, initial, replicas)
    task = {
        "scene": type(scene).__name__,
        "scene_fields": json.dumps(dataclasses.asdict(scene)),
        "method": method,
        "timestep": timestep,
        "duration": duration,
        "replicas": replicas,
        "seed": seed,
        "sample_interval": when.interval,
        "burn_in": burn_in,
        "trajectories": trajectories,
        "version": version("magmotor"),
        "initial": None if initial is None else checksum(first),
    }
    march = March(scene, task, when, first, checkpoint)
    return march.to_the_end(threads or thread_count())
