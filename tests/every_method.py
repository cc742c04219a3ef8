"""Every method of every scene class, as parameters of a test; includes new methods."""

from typing import Any

import pytest

import magmotor as mm

SCENES = {
    "top": mm.Top(),
    "top on a plane": mm.Top(surface="plane", coulomb_friction=0.1),
    "top, scripted": mm.Top.experiment(),
    "motor": mm.Motor(),
    "motor on a plane": mm.Motor(surface="plane"),
    "motor without noise": mm.Motor(alpha_ball=0.0, alpha_ring=0.0, velocity=(0.01, 0.02)),
    "disk": mm.Disk(),
    "disk on a plane": mm.Disk(surface="plane"),
    "disk without noise": mm.Disk(noise=0.0),
    "particle": mm.LangevinParticle(),
    "particle without noise": mm.LangevinParticle(noise=0.0),
}

EVERY_METHOD = [
    pytest.param(scene, method, id=f"{name}, {method}")
    for name, scene in SCENES.items()
    for method in mm.methods(scene)
]


def short(scene: Any, method: str) -> dict[str, Any]:
    """Arguments of `simulate` for 60 steps, with two replicas if there is noise."""
    noisy = any(scene.noises) if isinstance(scene, mm.Motor) else getattr(scene, "noise", 0) > 0
    timestep = 0.001 if isinstance(scene, mm.Top) else 0.04
    return {
        "method": method,
        "timestep": timestep,
        "duration": 60 * timestep,
        "record_interval": 3,
        "seed": 3,
        "replicas": 2 if noisy else None,
    }
