"""The paper's four disks, each from rest and in its stationary state."""

from collections.abc import Callable

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.devices.disk.gibbs import gibbs
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.devices.disk.system import System

Scene = Disk | LangevinParticle


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
