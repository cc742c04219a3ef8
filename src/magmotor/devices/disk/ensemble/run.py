"""Ensembles of disk and particle: what is asked for, against the scene."""

import dataclasses
import json
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import xarray as xr
from numpy.typing import ArrayLike

from magmotor.common.checks import check_choice, reject
from magmotor.common.environment import thread_count
from magmotor.device.states import checksum
from magmotor.devices.disk.ensemble.march import March
from magmotor.devices.disk.ensemble.result import plan
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.noise import check_seed
from magmotor.numerics import splittings as schemes


def ensemble(
    scene: Disk | LangevinParticle,
    *,
    method: str,
    timestep: float,
    duration: float,
    replicas: int,
    seed: int,
    sample_interval: int | None,
    burn_in: float,
    initial: Mapping[str, ArrayLike] | None,
    trajectories: int,
    threads: int | None,
    checkpoint: str | Path | None,
) -> xr.Dataset:
    """Ensembles of disk and particle; `mm.ensemble` tells the arguments, and has checked them."""
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
