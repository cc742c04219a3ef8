"""`simulate`: one call that runs any scene by any method and returns a dataset."""

import dataclasses
import json
import math
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common.arguments import checked
from magmotor.common.checks import check_integer, check_number, check_type
from magmotor.common.environment import physical_memory
from magmotor.common.exceptions import ArgumentError
from magmotor.common.files import parsed_attributes
from magmotor.common.hints import Seconds
from magmotor.device.checkpoint import Checkpoint, Expected
from magmotor.device.device import Scene
from magmotor.device.engine import Engine
from magmotor.device.job import Job
from magmotor.device.provenance import attributes_of
from magmotor.device.states import checksum, concatenate, rows
from magmotor.device.stops import SimulationDiverged, SimulationInterrupted, stopped
from magmotor.noise import LARGEST_STEP, BrownianPath, check_seed, path_of
from magmotor.numerics.compilation_notice import Progress
from magmotor.run.dataset import assemble
from magmotor.run.recommend import Engines, recommend


@checked
def methods(scene: Scene) -> tuple[str, ...]:
    """Return the names `engine/scheme` of the methods that support a scene.

    Examples
    --------
    >>> import magmotor as mm
    >>> mm.methods(mm.LangevinParticle())
    ('variational/euler', 'variational/verlet', 'variational/baoab', 'variational/middle')
    """
    return scene.device.methods(scene)


@checked(finite=False)
def simulate(  # noqa: PLR0913 (options)
    scene: Scene,
    *,
    method: str | None = None,
    timestep: Seconds | None = None,
    engine: Engines = "mujoco",
    duration: Seconds,
    seed: int = 0,
    replicas: int | None = None,
    record_interval: int | None = None,
    initial: Mapping[str, Any] | xr.Dataset | None = None,
    path: BrownianPath | None = None,
    checkpoint: str | Path | None = None,
    allow_unstable: bool = False,
) -> xr.Dataset:
    """Simulate a scene.

    Parameters
    ----------
    scene : Top, Motor, Disk or LangevinParticle
    method : str, optional
        One of `methods(scene)`; by default the one that `recommend` returns, which is printed.
    timestep : float, optional
        In seconds (for the disk, dimensionless); for `scipy/dop853`, which chooses its own steps,
        the unit of recording. By default that of `path`, or as recommended.
    engine : str
        As in `recommend`, which chooses among MuJoCo's methods by default, or among all with "any".
        It has no effect if a method is given.
    duration : float
        In seconds (for the disk, dimensionless). The run takes as many whole steps as fit into it,
        and ends with the last recorded one.
    seed : int
        Seed of the Brownian forces. Stored with the run; it has no effect without noise.
    replicas : int, optional
        Number of independent runs; only for scenes with noise.
    record_interval : int, optional
        Record every n-th step (default: every step); the initial state is always recorded. All
        records are held in memory.
    initial : mapping or dataset, optional
        Replaces parts of the scene's initial state, named as in the result: for the top
        `position`, `velocity`, `axis`, `angular_velocity` or `orientation`; for the motor also
        `ring_axis` or `ring_orientation` and `ring_angular_velocity`; for the disk `x`, `v`,
        `theta`, `omega`. Values are shared by all replicas or given for each. From a dataset, the
        last time is taken; with the same seed and timestep, the Brownian path continues from there.
    path : BrownianPath, optional
        The Brownian path to follow instead of the one given by seed and timestep: a coarser or
        finer view of the path of another run.
    checkpoint : str or Path, optional
        File to which everything is saved every half minute and at the end. The run resumes from it
        if it exists; the result is the same bit for bit.
    allow_unstable : bool
        Accept a timestep at which the method is unstable in theory, so that one can watch it fail.

    Returns
    -------
    xarray.Dataset
        For the top `time`, `position`, `velocity`, `axis`, `angular_velocity`, `slip_velocity`,
        `momentum_map`, `energy` and `orientation`, which `scipy/dop853` computes only of a ball
        that is not balanced; for the motor also
        `ring_axis`, `ring_orientation`, `ring_angular_velocity`, `ring_energy` and, accumulated
        from the start, `heat`, `work`, `ring_heat`, `ring_work`; for the disk `time`, `x`, `v`,
        `theta`, `omega`, `energy`. Units are in the attributes; there is a dimension `replica` if
        `replicas` is given.

    Raises
    ------
    ValueError
        Bad input, including a checkpoint that is damaged or belongs to another task, or more
        records than fit in memory; the message names the argument, its value and the bound.
    SimulationDiverged
        The run is no longer finite or has gained impossible energy; holds the records so far.
    PhysicalEvent
        The magnetic lift exceeds the weight of a ball that is constrained to its plane, the ball is
        far from the rings, on a tilted floor or under a load, or the motor's inner ring is tilted
        by more than 20 degrees; holds the records so far.
    SimulationInterrupted
        Ctrl-C; holds the records so far.

    Warns
    -----
    UserWarning
        The timestep is too long for the flights of the disk at this temperature, or a motor's
        energy, heat and work drift apart by more than a tenth of the heat between its temperatures.
        Use replicas, whose spread says which drift is chance; see the page on methods. Heat and
        work of top and disk are not recorded, hence not checked: see `energy_balance`.

    Examples
    --------
    >>> import magmotor as mm
    >>> run = mm.simulate(mm.Top(), method="variational/verlet", timestep=0.1, duration=30.0)
    >>> print(f"{abs(run.momentum_map).max():.2e} {run.momentum_map.units}")
    1.86e-04 kg m^2/s
    """
    device = scene.device
    if timestep is None and isinstance(path, BrownianPath):
        timestep = path.timestep
    if method is None or timestep is None:
        choice = recommend(scene, method=method, timestep=timestep, engine=engine)
        print(choice, file=sys.stderr)
        method, timestep = choice.method, choice.timestep
    device.check_method(scene, method)
    duration = check_number("duration", duration, at_least=timestep, unit="s (one timestep)")
    steps = duration / timestep
    interval = _checked_interval(record_interval, steps)
    device.check_run(scene, method, timestep, replicas, allow_unstable)
    replicas = None if replicas is None else int(replicas)
    followed = _followed(path, seed, timestep)
    first_step = _first_step(initial, followed, method)
    first = device.followed(scene, device.initial_state(scene, initial, replicas), method)
    record = sum(column.nbytes for column in first if column is not None)
    check_memory(steps / interval * record, interval)
    if (first_step + steps) * followed.factor > LARGEST_STEP:
        allowed = "must be so short that the Brownian path has fewer than 2^53 steps"
        raise ArgumentError("duration", duration, allowed)
    records = int(steps * (1 + 1e-12)) // interval
    library, scheme = method.split("/")
    attributes = {
        "method": method,
        "timestep": timestep,
        "duration": duration,
        "record_interval": interval,
        "seed": followed.seed,
        "path": None if path is None else json.dumps(dataclasses.asdict(path)),
        "first_step": first_step or None,
        "replicas": replicas,
        "initial": None if initial is None else "the first record",
    }
    job = Job(scene, scheme, timestep, records, interval, first, followed, first_step)
    task = attributes_of(scene, **attributes) | {"initial": checksum(first)}
    integrator = _engine(scene, library)
    saved = Checkpoint(
        checkpoint, task, records, lambda done: _expected(job, integrator.start(job), done)
    )
    return _collect(job, integrator.run, saved, attributes)


def _checked_interval(record_interval: int | None, steps: float) -> int:
    """Return the number of steps between records, of a run of `steps`."""
    if record_interval is None:
        return 1
    interval = check_integer("record_interval", record_interval, at_least=1)
    if interval > steps * (1 + 1e-12):
        raise ArgumentError("record_interval", interval, f"must be at most {int(steps)} steps")
    return interval


def _followed(path: BrownianPath | None, seed: int, timestep: float) -> BrownianPath:
    """Return the Brownian path of a run: the given one, or that of its seed."""
    seed = check_seed(seed)
    if path is None:
        return BrownianPath(seed, timestep)
    check_type("path", path, BrownianPath)
    if abs(path.timestep / timestep - 1) > 1e-12:
        raise ArgumentError(
            "path.timestep", path.timestep, f"must equal the timestep, {timestep:g}"
        )
    return path


def _engine(scene: Scene, name: str) -> Engine:
    if name == "mujoco":
        from magmotor.run import in_mujoco

        return in_mujoco
    if name == "scipy":
        from magmotor.run import in_scipy

        return in_scipy
    return scene.device.variational


def check_memory(recorded: float, interval: int) -> None:
    """Raise ValueError if records of so many bytes do not fit in memory."""
    memory = physical_memory()
    if recorded > memory:
        least = math.ceil(interval * recorded / memory)
        size = f"the records would take {recorded:.3g} of {memory:.3g} bytes of memory"
        allowed = f"must be at least {least:.6g} for so long a duration: {size}"
        raise ArgumentError("record_interval", interval, allowed)


def _first_step(initial: Any, path: BrownianPath, method: str) -> int:
    """Return the step on its Brownian path at which a run begins; not 0 if it continues another."""
    if not isinstance(initial, xr.Dataset) or method.startswith("scipy"):
        return 0
    attributes = parsed_attributes(initial.attrs)
    if "seed" not in attributes or path_of(attributes) != path:
        return 0
    first = check_integer("attributes['first_step']", attributes.get("first_step", 0), at_least=0)
    if "time" not in initial.coords:
        raise ArgumentError(
            "initial", [*initial.coords], "must be a dataset with the coordinate time"
        )
    check_integer("number of records in initial", initial.time.size, at_least=1)
    if "replica" in initial.coords:
        numbers = np.atleast_1d(initial.replica.values).tolist()
        if numbers != [*range(len(numbers))]:
            sentence = "must be 0, 1, 2, ... to continue their Brownian paths; or use another seed"
            raise ArgumentError("initial.replica", numbers, sentence)
    if "step" in initial.coords:
        step = initial.step.values.flat[-1]
        return check_integer("initial.step", step, at_least=0, at_most=LARGEST_STEP)
    reached = check_number("initial.time", initial.time.values.flat[-1], at_least=0)
    return first + round(min(reached / path.timestep, LARGEST_STEP))


def _collect(job: Job, run: Callable, checkpoint: Checkpoint, attributes: dict) -> xr.Dataset:
    """Assemble the chunks of a run; if it ends early, raise with the records so far."""
    guard = job.scene.device.guard(job.scene, job.initial)
    kept, job = _resume(job, checkpoint.load())
    chunks, reached = run(job), (job.done, job.state)
    unit = job.record_interval * job.timestep
    bar = "{l_bar}{bar}| {n:.0f}/{total:.0f} s [{elapsed}<{remaining}]"
    progress = Progress(
        total=job.records * unit, initial=job.done * unit, desc="simulate",
        bar_format=bar, delay=2, disable=None,
    )  # fmt: skip
    try:
        for states, after in chunks:
            good, failure = guard.first_wrong(states)
            kept.append(rows(states, slice(good)))
            if failure is not None:
                time = float(states.time[good])
                raise stopped(failure, time, assemble(job.scene, kept, **attributes))
            # One assignment, since Ctrl-C may come between any two.
            reached = reached[0] + len(states.time), after
            progress.update(states.time[-1] - progress.n)
            if checkpoint.due:
                _save(checkpoint, kept, *reached)
        if job.done < job.records:
            _save(checkpoint, kept, *reached)
    except KeyboardInterrupt:
        _save(checkpoint, kept, *reached)
        records = assemble(job.scene, kept, **attributes)
        raise SimulationInterrupted(records, checkpoint.path) from None
    except ArithmeticError as failure:
        time = float(kept[-1].time[-1])
        partial = assemble(job.scene, kept, **attributes)
        raise SimulationDiverged(str(failure), time, partial) from failure
    finally:
        # A suspended engine would keep its callback installed as long as the error lives.
        chunks.close()
        progress.close()
    result = assemble(job.scene, kept, **attributes)
    job.scene.device.check_result(job.scene, result)
    return result


def _expected(job: Job, start: NDArray, done: int) -> dict[str, Expected]:
    """Return the expected contents of a checkpoint: the new records and the engine's state.

    The times are not among them, since the task determines them.
    """
    columns = {k: v for k, v in job.initial._asdict().items() if v is not None and k != "time"}
    like = {k: np.broadcast_to(v[0], (done, *v.shape[1:])) for k, v in columns.items()}
    return {k: Expected(v) for k, v in {**like, "engine_state": start}.items()}


def _resume(job: Job, saved: tuple[int, dict[str, NDArray]] | None) -> tuple[list[Any], Job]:
    """Return the records so far, beginning with the initial state, and the remaining job."""
    if saved is None:
        return [job.initial], job
    done, arrays = saved
    state = arrays.pop("engine_state")
    records = job.initial._replace(time=job.times(0, done), **arrays)
    return [concatenate([job.initial, records])], job._replace(done=done, state=state)


def _save(checkpoint: Checkpoint, kept: list[Any], done: int, state: NDArray | None) -> None:
    """Save the first `done` records and the engine's state after them, if there is any."""
    if state is None or checkpoint.path is None:
        return
    kept[:] = [concatenate(kept)]
    columns = rows(kept[0], slice(1, done + 1))._asdict()
    arrays = {k: v for k, v in columns.items() if v is not None and k != "time"}
    checkpoint.save(done, {**arrays, "engine_state": state})
