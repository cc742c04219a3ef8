"""The front door: one call runs any scene with any method and returns a dataset."""

import dataclasses
import json
from collections.abc import Generator, Mapping
from importlib import import_module
from typing import Any

import xarray as xr
from tqdm import tqdm

from magmotor.checks import check_choice, check_integer, check_number, reject
from magmotor.dataset import assemble
from magmotor.devices import DEVICES, Scene
from magmotor.engines.job import Job
from magmotor.noise import BrownianPath, check_seed, path_of
from magmotor.states import rows

ENGINES = {
    "mujoco": "magmotor.engines.mujoco.run",
    "scipy": "magmotor.engines.scipy.run",
    "variational": "magmotor.engines.variational.run",
}


class SimulationDiverged(RuntimeError):
    """A run left what its method or model can follow; nothing recorded is lost.

    Attributes
    ----------
    time : float
        When, in seconds: the first recorded time that is not in `dataset`.
    method : str
    timestep : float
    dataset : xarray.Dataset
        What was recorded until then.
    """

    def __init__(self, reason: str, time: float, dataset: xr.Dataset):
        self.reason, self.time, self.dataset = reason, time, dataset
        self.method, self.timestep = dataset.attrs["method"], dataset.attrs["timestep"]
        super().__init__(
            f"{self.method} with timestep {self.timestep:g} s stopped at t = {time:g} s: {reason}"
        )

    def __reduce__(self):
        """Pickle whole, as worker processes need."""
        return type(self), (self.reason, self.time, self.dataset)


class SimulationInterrupted(KeyboardInterrupt):
    """Ctrl-C during a run; `dataset` holds what was recorded until then."""

    def __init__(self, dataset: xr.Dataset):
        super().__init__("simulation interrupted")
        self.dataset = dataset


def methods(scene: Scene) -> tuple[str, ...]:
    """Names `engine/scheme` of the methods that a scene takes."""
    return _device(scene).methods(scene)


def simulate(
    scene: Scene,
    *,
    method: str,
    timestep: float,
    duration: float,
    seed: int = 0,
    replicas: int | None = None,
    record_interval: int | None = None,
    initial: Mapping[str, Any] | xr.Dataset | None = None,
    path: BrownianPath | None = None,
) -> xr.Dataset:
    """Run a scene.

    Parameters
    ----------
    scene : Top, Disk or LangevinParticle
        What to run.
    method : str
        One of `methods(scene)`.
    timestep : float
        Step in seconds; for `scipy/dop853`, which chooses its own, the unit of recording.
    duration : float
        In seconds; whole steps that fit into it are taken.
    seed : int
        Of the Brownian forces; kept with the run, without effect where a scene has no noise.
    replicas : int, optional
        Number of independent runs: only for scenes with noise.
    record_interval : int, optional
        Record every n-th step (default: every step); the initial state is always recorded.
    initial : mapping or dataset, optional
        Replaces parts of the scene's initial state, each as in the result: for the top
        `position`, `velocity`, `axis`, `angular_velocity` or `orientation`, for the disk `x`, `v`,
        `theta`, `omega`. Of a dataset the last time; where seed and timestep are the same, the
        Brownian path goes on from there.
    path : BrownianPath, optional
        The Brownian path to follow, instead of the one that seed and timestep have: a coarser or
        finer view of another run's.

    Returns
    -------
    xarray.Dataset
        Of the top `time`, `position`, `velocity`, `axis`, `angular_velocity`, `slip_velocity`,
        `momentum_map`, `energy` and, from MuJoCo, `orientation`; of the disk `time`, `x`, `v`,
        `theta`, `omega`, `energy`. Units in their attributes; dimension `replica` where asked for.

    Raises
    ------
    ValueError
        Bad input: names the argument, its value and the bound.
    SimulationDiverged
        The run is no longer finite, gained energy that it cannot have, or the magnetic lift
        exceeds the weight of a ball that is held on its plane; holds what was recorded.
    SimulationInterrupted
        Ctrl-C; holds what was recorded.

    Warns
    -----
    UserWarning
        The timestep is too long for the flights of the disk at its temperature.
    """
    interval = 1 if record_interval is None else record_interval
    _check_arguments(scene, method, timestep, duration, seed, interval)
    device = _device(scene)
    device.check_run(scene, method, timestep, replicas)
    followed = BrownianPath(seed, float(timestep)) if path is None else path
    if abs(followed.timestep / timestep - 1) > 1e-12:
        raise reject("path.timestep", followed.timestep, f"{timestep:g}, the timestep")
    first = device.initial_state(scene, initial, replicas)
    records = int(duration / timestep * (1 + 1e-12)) // interval
    engine, scheme = method.split("/")
    attributes = {
        "method": method,
        "timestep": timestep,
        "duration": duration,
        "record_interval": interval,
        "seed": followed.seed,
        "path": None if path is None else json.dumps(dataclasses.asdict(path)),
        "first_step": _first_step(initial, followed, method) or None,
        "replicas": replicas,
    }
    job = Job(
        scene, scheme, timestep, records, interval, first, followed, attributes["first_step"] or 0
    )
    chunks = import_module(ENGINES[engine]).run(job)
    return _collect(scene, first, chunks, records * interval * timestep, attributes)


def _first_step(initial: Any, path: BrownianPath, method: str) -> int:
    """Where on its Brownian path a run begins that continues another."""
    if not isinstance(initial, xr.Dataset) or method.startswith("scipy"):
        return 0
    told = initial.attrs
    if "seed" not in told or path_of(told) != path:
        return 0
    return int(told.get("first_step", 0)) + round(float(initial.time[-1]) / path.timestep)


def _device(scene: Scene) -> Any:
    if type(scene) not in DEVICES:
        raise reject("scene", scene, "a scene, such as magmotor.Top()")
    return DEVICES[type(scene)]


def _collect(
    scene: Scene, first: Any, chunks: Generator[Any], duration: float, attributes: dict
) -> xr.Dataset:
    """Assemble the chunks while they are good; when that ends early, raise with those that were."""
    kept = [first]
    guard = _device(scene).guard(scene, first)
    bar = "{l_bar}{bar}| {n:.0f}/{total:.0f} s [{elapsed}<{remaining}]"
    progress = tqdm(total=duration, desc="simulate", bar_format=bar, delay=2, disable=None)
    try:
        for states in chunks:
            good, reason = guard.first_wrong(states)
            kept.append(rows(states, slice(good)))
            if reason:
                time = float(states.time[good])
                raise SimulationDiverged(reason, time, assemble(scene, kept, **attributes))
            progress.update(states.time[-1] - progress.n)
    except KeyboardInterrupt:
        raise SimulationInterrupted(assemble(scene, kept, **attributes)) from None
    except ArithmeticError as failure:
        time = float(kept[-1].time[-1])
        partial = assemble(scene, kept, **attributes)
        raise SimulationDiverged(str(failure), time, partial) from failure
    finally:
        # A suspended engine would keep its callback installed for as long as the error lives.
        chunks.close()
        progress.close()
    return assemble(scene, kept, **attributes)


def _check_arguments(scene, method, timestep, duration, seed, interval) -> None:
    check_choice("method", method, methods(scene))
    check_number("timestep", timestep, above=0, unit="s")
    check_number("duration", duration, at_least=timestep, unit="s (one timestep)")
    check_seed(seed)
    check_integer("record_interval", interval, at_least=1)
    if interval > duration / timestep * (1 + 1e-12):
        raise reject("record_interval", interval, f"at most {int(duration / timestep)} steps")
