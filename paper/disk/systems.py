"""The paper's four sliding disks, each from rest and in its stationary state."""

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.devices.disk.gibbs import gibbs
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.run.ensemble import ensemble
from magmotor.run.simulate import methods
from paper.disk.system import System

Scene = Disk | LangevinParticle

METHOD = "mujoco/baoab"
"""The method of MuJoCo's paths and ensembles."""

FULL = {
    "method": "variational/euler",
    "timestep": 0.01,
    "duration": 50_000.0,
    "replicas": 5000,
}
"""The paper's scheme, timestep and duration; it does not state the number of realizations."""

BESIDE = {"method": METHOD, "timestep": 0.05, "replicas": 64}
"""MuJoCo's own ensembles: as many replicas as two cores simulate in a good minute at full size."""

QUICK = FULL | {"timestep": 0.05, "duration": 2500.0, "replicas": 512}

BESIDE_QUICK = BESIDE | {"replicas": 8}


def disk_scenes(disk: Disk) -> dict[str, Scene]:
    """Return the four scenes by name: a disk on three potentials, and the control particle."""
    control = LangevinParticle(friction=disk.friction, noise=disk.noise)
    disks = {name: disk.replace(potential=name) for name in ("symmetric", "asymmetric", "flat")}
    return {**disks, "control": control}


def simulate_system(
    run: Callable[..., xr.Dataset],
    name: str,
    scene: Scene,
    *,
    duration: float,
    replicas: int,
    seed: int,
) -> System:
    """Simulate one system from rest, as in the paper, and stationary, for "t large" and flights.

    Parameters
    ----------
    run : callable
        `run(suffix, scene, seed=..., **arguments)` makes the ensemble; `suffix` is "" or
        "_stationary", and `arguments` are further arguments of `ensemble`.
    name : str
    scene : Disk or LangevinParticle
    duration : float
    replicas : int
    seed : int
        Seed of the run from rest; the stationary run has the next one.
    """
    rest = run("", scene, seed=seed, burn_in=duration / 2, trajectories=replicas)
    initial = stationary_state(scene, replicas, seed)
    return System(name, rest, run("_stationary", scene, seed=seed + 1, initial=initial))


def stationary_state(scene: Scene, replicas: int, seed: int) -> dict[str, NDArray[np.float64]]:
    """Draw states of the Gibbs measure; on flat U, where d is constant, d = 0 as from rest."""
    state = gibbs(scene, replicas, seed=seed)
    if isinstance(scene, Disk) and not scene.coefficients:
        d = scene.sigma * state["omega"] - state["v"]
        state["v"] += d / (1 + scene.sigma)
        state["omega"] -= d / (1 + scene.sigma)
    return state


class Disks(NamedTuple):
    """The four systems by the reference, and by MuJoCo those of which it has a model."""

    reference: list[System]
    mujoco: list[System]


def named(systems: list[System]) -> dict[str, System]:
    """Return systems by their names."""
    return {system.name: system for system in systems}


@cache
def paper_disks(quick: bool) -> Disks:
    """Simulate the systems at the paper's parameters, by its scheme and by MuJoCo."""
    reference = QUICK if quick else FULL
    beside = (BESIDE_QUICK if quick else BESIDE) | {"duration": reference["duration"]}
    scenes = disk_scenes(Disk())
    return Disks(_systems(scenes, reference, 0), _systems(scenes, beside, 8))


def _systems(scenes: dict[str, Scene], numerics: dict[str, Any], seed: int) -> list[System]:
    def run(_suffix: str, scene: Scene, **special) -> xr.Dataset:
        return ensemble(scene, **numerics, **special)

    sizes = {name: numerics[name] for name in ("duration", "replicas")}
    return [
        simulate_system(run, name, scene, seed=seed + 2 * number, **sizes)
        for number, (name, scene) in enumerate(scenes.items())
        if numerics["method"] in methods(scene)
    ]
