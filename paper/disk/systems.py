"""The paper's four sliding disks, each from rest and in its stationary state."""

from functools import cache
from typing import Any, NamedTuple

import xarray as xr

from magmotor.commands.disk import BESIDE, FULL
from magmotor.devices.disk.four_systems import disk_scenes, simulate_system
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.devices.disk.system import System
from magmotor.run.ensemble import ensemble
from magmotor.run.simulate import methods

Scene = Disk | LangevinParticle

QUICK = FULL | {"timestep": 0.02, "duration": 5000.0, "replicas": 1024}

BESIDE_QUICK = BESIDE | {"replicas": 32}


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
