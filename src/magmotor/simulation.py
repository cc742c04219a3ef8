"""The front door: one call runs any scene with any method and returns a dataset."""

from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import Any

import numpy as np
import xarray as xr
from tqdm import tqdm

from magmotor.dataset import assemble, states_of
from magmotor.engines.state import States, smallest_turn, start
from magmotor.observables.motion import energy, kinetic_energy, magnetic_energy, magnetic_lift
from magmotor.scenes import Top
from magmotor.scenes.fields import check_choice, check_integer, check_number, reject

MUJOCO = ("mujoco/euler", "mujoco/implicitfast", "mujoco/rk4")
ENGINES = {"mujoco": "magmotor.engines.mujoco.run", "scipy": "magmotor.engines.scipy"}
STATE = ("position", "velocity", "axis", "angular_velocity", "orientation")


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
    first = _initial_state(scene, initial)
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
    scene: Top, first: States, chunks: Iterator[States], duration: float, attributes: dict
) -> xr.Dataset:
    kept = [first]
    bound = _energy_bound(scene, first)
    bar = "{l_bar}{bar}| {n:.0f}/{total:.0f} s [{elapsed}<{remaining}]"
    try:
        with tqdm(total=duration, desc="simulate", bar_format=bar, delay=2, disable=None) as progress:
            for states in chunks:
                good, reason = _good_rows(scene, states, bound)
                kept.append(States(*(x if x is None else x[:good] for x in states)))
                if reason:
                    partial = assemble(scene, kept, **attributes)
                    raise SimulationDiverged(reason, float(states.time[good]), partial)
                progress.update(states.time[-1] - progress.n)
    except KeyboardInterrupt:
        raise SimulationInterrupted(assemble(scene, kept, **attributes)) from None
    except ArithmeticError as failure:
        partial = assemble(scene, kept, **attributes)
        raise SimulationDiverged(str(failure), float(kept[-1].time[-1]), partial) from failure
    return assemble(scene, kept, **attributes)


def _good_rows(scene: Top, states: States, bound: float) -> tuple[int, str]:
    """How many rows precede the first that is wrong, and what is wrong with that."""
    blocks = [x.reshape(len(states.time), -1) for x in states if x is not None]
    finite = np.isfinite(np.hstack(blocks)).all(axis=1)
    until = len(finite) if finite.all() else int(finite.argmin())
    head = States(*(x if x is None else x[:until] for x in states))
    failures = [(until, "a value is not finite")] if until < len(finite) else []
    wild = energy(scene, head) > bound
    if wild.any():
        failures.append((int(wild.argmax()), "energy grew beyond what the motion can have"))
    if scene.surface == "planar":
        weight = scene.ball_mass * scene.gravity
        lift = magnetic_lift(scene, head)
        if (lift > weight).any():
            row = int((lift > weight).argmax())
            failures.append(
                (
                    row,
                    f"the magnetic lift, {lift[row]:.3g} N, exceeds the ball's weight,"
                    f" {weight:.3g} N, and the plane cannot hold it down: use a larger `gravity`"
                    " or surface = 'plane'",
                )
            )
    return min(failures, default=(until, ""))


def _energy_bound(scene: Top, first: States) -> float:
    """An energy that no accurate run reaches: a fixed ring does no work, a moving one not much."""
    scale = kinetic_energy(scene, first) + np.abs(magnetic_energy(scene, first))
    return float((energy(scene, first) + (10 if scene.ring_script else 1) * scale)[0])


def _check_arguments(scene, method, timestep, duration, seed, replicas, interval) -> None:
    if not isinstance(scene, Top):
        raise reject("scene", scene, "a scene, such as magmotor.Top()")
    check_choice("method", method, methods(scene))
    check_number("timestep", timestep, above=0, unit="s")
    if method in MUJOCO and any(scene.dry_friction):
        check_number("timestep", timestep, below=1 / 200.0, unit="s with dry friction")
    check_number("duration", duration, at_least=timestep, unit="s (one timestep)")
    check_integer("seed", seed, at_least=0)
    check_integer("record_interval", interval, at_least=1)
    if interval > duration / timestep * (1 + 1e-12):
        raise reject("record_interval", interval, f"at most {int(duration / timestep)} steps")
    if replicas is not None:
        check_integer("replicas", replicas, at_least=1)
        raise reject("replicas", replicas, "None: this scene has no noise, all would be the same")


def _initial_state(scene: Top, initial: Mapping[str, Any] | xr.Dataset | None) -> States:
    state = start(scene)
    if initial is None:
        return state
    if isinstance(initial, xr.Dataset):
        last = states_of(initial)
        given = {name: getattr(last, name) for name in STATE if getattr(last, name) is not None}
        given = {name: values[-1] for name, values in given.items()}
    else:
        given = dict(initial)
        for name in given:
            check_choice("initial", name, STATE)
        if "axis" in given and "orientation" in given:
            raise reject("initial", [*given], "given with axis or orientation, not both")
    return _replace_state(scene, state, given)


def _replace_state(scene: Top, state: States, given: dict[str, Any]) -> States:
    rows = {}
    for name, value in given.items():
        row = np.asarray(value, dtype=float)
        shape = (4,) if name == "orientation" else (3,)
        if name in ("position", "velocity") and row.shape == (2,):
            row = np.append(row, scene.ball_radius if name == "position" else 0.0)
        if row.shape != shape or not np.isfinite(row).all():
            raise reject(f"initial[{name!r}]", value, f"{shape[0]} finite numbers")
        if name in ("axis", "orientation"):
            if not row.any():
                raise reject(f"initial[{name!r}]", value, "not all zero")
            row = row / np.linalg.norm(row)
        rows[name] = row
    if scene.surface == "planar":
        for name, only in (("position", scene.ball_radius), ("velocity", 0.0)):
            if name in rows and rows[name][2] != only:
                raise reject(f"initial[{name!r}]", given[name], f"{only:g} along z on the plane")
    if "orientation" in rows:
        rows["axis"] = _third_column(rows["orientation"])
    elif "axis" in rows:
        rows["orientation"] = smallest_turn(rows["axis"])
    return state._replace(**{name: row[np.newaxis] for name, row in rows.items()})


def _third_column(quaternion: np.ndarray) -> np.ndarray:
    w, x, y, z = quaternion
    return np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
