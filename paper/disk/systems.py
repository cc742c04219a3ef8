"""The paper's four sliding disks, each from rest and in its stationary state."""

from collections.abc import Callable
from functools import cache, partial

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.devices.disk.gibbs import gibbs
from magmotor.devices.disk.plot_panels import System
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.run.ensemble import ensemble

Scene = Disk | LangevinParticle

FULL = {"timestep": 0.01, "duration": 50_000.0, "replicas": 10_000}
"""The paper's timestep and duration; it does not state the number of realizations."""

QUICK = {"timestep": 0.02, "duration": 5000.0, "replicas": 1024}


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


@cache
def paper_systems(quick: bool) -> list[System]:
    """Simulate the four systems at the paper's parameters, with its scheme."""
    numerics = QUICK if quick else FULL
    sizes = {name: numerics[name] for name in ("duration", "replicas")}

    def run(_suffix: str, scene: Scene, **special) -> xr.Dataset:
        return ensemble(scene, method="variational/euler", **numerics, **special)

    simulated = partial(simulate_system, run, **sizes)
    scenes = disk_scenes(Disk()).items()
    return [simulated(name, scene, seed=2 * n) for n, (name, scene) in enumerate(scenes)]
