"""The motor's geometry: stiffness of the level ring, and the longest flight."""

import math

import numpy as np
import pytest
import xarray as xr
from scipy.spatial.transform import Rotation

import magmotor as mm
from magmotor.devices.motor.ring_stability import ring_stiffness


def energy_of_the_rings(scene, tilt, azimuth):
    """Return the energy of the tilted inner ring in the field of the outer one, pair by pair."""
    turn = Rotation.from_rotvec(tilt * np.array([-math.sin(azimuth), math.cos(azimuth), 0.0]))
    rings = []
    for count, radius in (
        (scene.inner_dipoles, scene.inner_radius),
        (scene.outer_dipoles, scene.outer_radius),
    ):
        around = 2 * math.pi * np.arange(count) / count
        outward = np.stack([np.cos(around), np.sin(around), 0 * around], axis=1)
        rings.append((radius * outward, outward))
    (inner, one), (outer, two) = rings
    inner, one = turn.apply(inner), turn.apply(one)
    r = inner[:, np.newaxis] - outer - [0, 0, scene.outer_height - scene.inner_height]
    distance = np.linalg.norm(r, axis=-1)
    unit = r / distance[..., np.newaxis]
    along = np.sum(unit * one[:, np.newaxis], axis=-1) * np.sum(unit * two, axis=-1)
    return scene.coupling * float(np.sum((one @ two.T - 3 * along) / distance**3))


@pytest.mark.parametrize(
    "changes",
    [{}, {"outer_dipoles": 2, "inner_dipoles": 7}, {"outer_height": 0.6}, {"outer_radius": 0.85}],
)
def test_stiffness_of_the_level_ring(changes):
    """The smallest over all sides; of two outer dipoles it depends on the side."""
    scene = mm.Motor(**changes)
    tilt = 0.003
    level = energy_of_the_rings(scene, 0.0, 0.0)
    found = [
        (energy_of_the_rings(scene, tilt, a) + energy_of_the_rings(scene, -tilt, a) - 2 * level)
        / tilt**2
        for a in np.radians(np.arange(0, 180, 2))
    ]
    largest = max(map(abs, found))
    assert ring_stiffness(scene) == pytest.approx(min(found), abs=0.05 * largest)  # 0.009
    assert (ring_stiffness(scene) < 0) == (min(found) < 0)


def test_the_longest_flight_of_each_replica():
    turns = xr.DataArray(
        [[0, 1.5, 1.2, 4.7], [0, -2.6, -0.5, -0.4], [0, 0.2, 0, 0.3]], dims=("replica", "corner")
    )
    time = np.arange(400.0)
    theta = 2 * np.pi * np.array([np.interp(time, [0, 100, 200, 399], row) for row in turns])
    path = np.stack([np.cos(theta), np.sin(theta), 0 * theta], axis=-1)
    run = xr.Dataset(
        {"position": (("replica", "time", "space"), path)},
        {"time": time, "space": ["x", "y", "z"]},
    )
    measure = mm.sweep.measures(mm.Motor())["longest_flight"]
    found = measure.function(run, mm.Motor())
    np.testing.assert_allclose(found, [3.5, 2.6, 0], rtol=3e-14)  # 1e-15
    one = measure.function(run.isel(replica=1), mm.Motor())
    assert one == pytest.approx(2.6, rel=1e-12)
