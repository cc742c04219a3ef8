"""The front door: one call runs any scene with any method and returns a dataset."""

from collections.abc import Generator, Mapping
from importlib import import_module
from typing import Any

import xarray as xr
from tqdm import tqdm

from magmotor.dataset import assemble
from magmotor.engines.state import States
from magmotor.guard import Guard
from magmotor.initial import initial_state
from magmotor.scenes import Top
from magmotor.scenes.fields import check_choice, check_integer, check_number, reject
from magmotor.scenes.top import DRY_FRICTION_RATE

MUJOCO = ("mujoco/euler", "mujoco/implicitfast", "mujoco/rk4")
ENGINES = {"mujoco": "magmotor.engines.mujoco.run", "scipy": "magmotor.engines.scipy"}


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


def methods(scene: Top) -> tuple[str, ...]:
    """Names `engine/scheme` of the methods that a scene takes."""
    planar = scene.surface == "planar"
    return (*MUJOCO, "scipy/dop853") if planar else MUJOCO


def simulate(
    scene: Top,
    *,
    method: str,
    timestep: float,
    duration: float,
    seed: int = 0,
    replicas: int | None = None,
    record_interval: int | None = None,
    initial: Mapping[str, Any] | xr.Dataset | None = None,
) -> xr.Dataset:
    """Run a scene.

    Parameters
    ----------
    scene : Top
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
        Replaces parts of the scene's initial state: `position`, `velocity`, `axis`,
        `angular_velocity` or `orientation`, each as in the result; of a dataset the last time.

    Returns
    -------
    xarray.Dataset
        `time`, `position`, `velocity`, `axis`, `angular_velocity`, `slip_velocity`,
        `momentum_map`, `energy` and, from MuJoCo, `orientation`; units in their attributes.

    Raises
    ------
    ValueError
        Bad input: names the argument, its value and the bound.
    SimulationDiverged
        The run is no longer finite, gained energy that it cannot have, or the magnetic lift
        exceeds the weight of a ball that is held on its plane; holds what was recorded.
    SimulationInterrupted
        Ctrl-C; holds what was recorded.
    """
    interval = 1 if record_interval is None else record_interval
    _check_arguments(scene, method, timestep, duration, seed, replicas, interval)
    first = initial_state(scene, initial)
    records = int(duration / timestep * (1 + 1e-12)) // interval
    engine, scheme = method.split("/")
    chunks = import_module(ENGINES[engine]).run(scene, scheme, timestep, records, interval, first)
    attributes = {
        "method": method,
        "timestep": timestep,
        "duration": duration,
        "record_interval": interval,
        "seed": seed,
    }
    return _collect(scene, first, chunks, records * interval * timestep, attributes)


def _collect(
    scene: Top, first: States, chunks: Generator[States], duration: float, attributes: dict
) -> xr.Dataset:
    """Assemble the chunks while they are good; when that ends early, raise with those that were."""
    kept = [first]
    guard = Guard(scene, first)
    bar = "{l_bar}{bar}| {n:.0f}/{total:.0f} s [{elapsed}<{remaining}]"
    progress = tqdm(total=duration, desc="simulate", bar_format=bar, delay=2, disable=None)
    try:
        for states in chunks:
            good, reason = guard.first_wrong(states)
            kept.append(states.rows(slice(good)))
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


def _check_arguments(scene, method, timestep, duration, seed, replicas, interval) -> None:
    if not isinstance(scene, Top):
        raise reject("scene", scene, "a scene, such as magmotor.Top()")
    check_choice("method", method, methods(scene))
    check_number("timestep", timestep, above=0, unit="s")
    if method in MUJOCO and any(scene.dry_friction):
        check_number("timestep", timestep, below=1 / DRY_FRICTION_RATE, unit="s with dry friction")
    check_number("duration", duration, at_least=timestep, unit="s (one timestep)")
    check_integer("seed", seed, at_least=0)
    check_integer("record_interval", interval, at_least=1)
    if interval > duration / timestep * (1 + 1e-12):
        raise reject("record_interval", interval, f"at most {int(duration / timestep)} steps")
    if replicas is not None:
        check_integer("replicas", replicas, at_least=1)
        raise reject("replicas", replicas, "None: this scene has no noise, all would be the same")
