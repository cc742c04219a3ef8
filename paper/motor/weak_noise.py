"""The motor at nonuniform temperature with a weaker noise than the paper's.

At the paper's strengths the inner ring tips over before friction takes what the noise injects. At
half the smallest of them the ring heats up to where the ball cools its tilt, long before it tips.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from magmotor import dipoles
from magmotor.devices.motor.plot_panels import MotorRun
from magmotor.devices.motor.scene import Motor
from paper.motor.runs import REFERENCE, ManyRuns, collected, until_tipping

SCENE = Motor(temperature="nonuniform", alpha_ring=1e-4)

WARM = 5e4
"""Time, in s, after which the tilt of the ring is warm."""

REPLICAS, BATCHES = 24, 8
"""Runs simulated together, which end when one of them tips over, and repetitions."""

QUICK_REPLICAS = 8
"""Runs of the only batch at reduced size; they have five flights on average."""

NUMERICS = {
    "method": REFERENCE, "timestep": 0.2, "duration": 1e5, "record_interval": 50,
}  # fmt: skip
QUICK_NUMERICS = NUMERICS | {"timestep": 0.4, "record_interval": 25}


class WeakNoise(NamedTuple):
    """Runs from `WARM` on, and what the axial swinging of the ring has taken at their ends."""

    many: ManyRuns
    axial: NDArray[np.float64]
    """energy of the inner ring's rotation about its own axis, with its cogging energy, over the
    energy injected"""

    @property
    def strength(self) -> float:
        """Strength of the noise, in N m sqrt(s)."""
        return SCENE.noises[-1]


@cache
def weak_noise(quick: bool) -> WeakNoise:
    """Simulate the runs."""
    count, replicas = (1, QUICK_REPLICAS) if quick else (BATCHES, REPLICAS)
    numerics = QUICK_NUMERICS if quick else NUMERICS
    batches = [
        until_tipping(SCENE, seed=seed, replicas=replicas, **numerics)
        for seed in range(1, count + 1)
    ]
    warm = (
        MotorRun("nonuniform", batch.isel(replica=k).sel(time=slice(WARM, None)))
        for batch in batches
        for k in range(replicas)
    )
    axial = np.concatenate([_axial_share(batch) for batch in batches])
    return WeakNoise(collected("nonuniform", warm), axial)


def axial_part(scene: Motor) -> float:
    """Return the part of the injected energy that goes to rotation about the ring's own axis.

    White noise alpha dW injects alpha^2/2 over the moment of inertia about each axis.
    """
    across, other, axial = scene.inner_moments
    return 1 / axial / (1 / across + 1 / other + 1 / axial)


def cogging(scene: Motor, angles: ArrayLike) -> NDArray[np.float64]:
    """Return the energy of the level inner ring, turned about its axis, above the start's.

    The dipoles of the outer ring are as near to those of the inner one as these are to each other,
    so that the energy has a well for each dipole of the inner ring.

    Parameters
    ----------
    scene : Motor
    angles : array_like, shape (A,)
        In rad.

    Returns
    -------
    ndarray, shape (A,)
        In J.
    """
    positions, outward = scene.inner_dipole_frame()
    outer, center = scene.outer_sources(), np.array([0.0, 0.0, scene.inner_height])
    angles = np.append(0.0, angles)
    energies = np.empty(len(angles))
    for k, turn in enumerate(Rotation.from_rotvec(angles[:, np.newaxis] * [0.0, 0.0, 1.0])):
        places = turn.apply(positions) + center
        moments = scene.moment * turn.apply(outward)
        energies[k] = -np.sum(moments * dipoles.field(places, *outer))
    return energies[1:] - energies[0]


def _axial_share(data: xr.Dataset) -> NDArray[np.float64]:
    last = data.isel(time=-1)
    across, other, axial = SCENE.inner_moments
    rate = (last.ring_axis * last.ring_angular_velocity).sum("space").values
    w, _, _, z = last.ring_orientation.transpose("component", "replica").values
    injected = SCENE.noises[-1] ** 2 / 2 * (1 / across + 1 / other + 1 / axial) * float(last.time)
    return (axial / 2 * rate**2 + cogging(SCENE, 2 * np.arctan2(z, w))) / injected
