"""Every field of the top is checked, and its presets are the paper's."""

import dataclasses
import math
import re
from pathlib import Path

import numpy as np
import pytest

import magmotor as mm
from magmotor.devices.top.movie import TopMovieContent
from magmotor.devices.top.scene import Waypoint, pose

TABLE = Path(__file__).parents[1] / "messages" / "scenes.py"


@pytest.mark.parametrize("kind", [mm.Top, mm.Motor, mm.Disk])
def test_every_field_has_a_unit_a_doc_and_a_bad_value_in_the_table(kind):
    refusals = re.findall(rf">>> mm\.{kind.__name__}\((.*)\)\nArgumentError", TABLE.read_text())
    tried = {name for fields in refusals for name in re.findall(r"(\w+)=", fields)}
    for field in dataclasses.fields(kind):
        assert "doc" in field.metadata
        assert ("unit" in field.metadata) == (field.name != "ring_script")
        assert field.name in tried, field.name


def test_presets_are_the_papers_cases():
    assert mm.Top.paper() == mm.Top.paper(4) == mm.Top()
    table = {
        1: (0.0, 0.0, (0.01, 0.005)),
        2: (math.pi / 64, 0.0, (0.01, 0.005)),
        3: (0.0, 0.3, (0.01, 0.005)),
        4: (math.pi / 64, 0.3, (-0.05, 0.02)),
    }
    for case, (tilt, friction, position) in table.items():
        scene = mm.Top.paper(case)
        assert (scene.tilt, scene.friction, scene.position) == (tilt, friction, position)
        assert (scene.ball_mass, scene.ball_radius) == (0.2, 0.018)
        assert (scene.ring_dipoles, scene.ring_radius, scene.ring_height) == (20, 0.34, 0.2)
        assert scene.moment == pytest.approx(10.0, rel=1e-15, abs=0)  # 0
        assert scene.inertia == pytest.approx([2.592e-5] * 3, rel=2e-15, abs=0)  # 1.3e-16
    assert mm.Top.si().moment == pytest.approx(100.0, rel=1e-15, abs=0)  # 0
    assert mm.Top.paper(3, ring_dipoles=40).ring_dipoles == 40


def test_the_ring_leans_into_its_azimuth_and_points_outward():
    scene = mm.Top(tilt=0.1, tilt_azimuth=0.7, ring_dipoles=12)
    positions, moments = scene.ring_sources()
    normal = np.array([np.sin(0.1) * np.cos(0.7), np.sin(0.1) * np.sin(0.7), np.cos(0.1)])
    center = np.array([0.0, 0.0, scene.ring_height])
    np.testing.assert_allclose((positions - center) @ normal, 0, rtol=0, atol=1e-16)  # 1.6e-17
    outward = (positions - center) / scene.ring_radius
    np.testing.assert_allclose(
        moments, scene.moment * outward, rtol=0, atol=1e-14
    )  # 1.8e-15, of 10
    low_side = positions[np.argmin(positions[:, 2])] - center
    assert low_side[:2] @ [np.cos(0.7), np.sin(0.7)] > 0


def test_the_script_passes_its_waypoints_at_rest():
    poses = (1.0, 0.5, 0.0, 0.3), (3.0, 0.2, 0.0, 0.3), (4.0, 0.2, 0.1, 2.0)
    script = tuple(Waypoint(*each) for each in poses)
    assert pose(script, -5.0) == (0.5, 0.0, 0.3)
    assert pose(script, 9.0) == (0.2, 0.1, 2.0)
    for time, *there in poses:
        assert pose(script, time) == pytest.approx(tuple(there), rel=1e-15, abs=0)  # 0
    for waypoint in script:
        before, after = (pose(script, waypoint.time + s)[0] for s in (-1e-4, 1e-4))
        assert abs(after - before) < 5e-12  # 4e-13
    assert pose(script, 2.0)[0] == pytest.approx(0.35, rel=1e-15, abs=0)  # 0, or rounding


def test_a_turning_tilt_goes_once_around_and_starts_with_the_ball_at_rest():
    scene = mm.Top.turning(40.0, tilt_azimuth=0.5, friction=0.1)
    assert scene.friction == 0.1
    assert scene.tilt_direction(0.0) == 0.5
    assert scene.tilt_direction(20.0) == pytest.approx(0.5 + math.pi, rel=1e-15)
    assert scene.tilt_direction(50.0) == 0.5 + 2 * math.pi
    still = mm.Top(tilt_azimuth=0.5, position=scene.position, axis=scene.axis)
    run = mm.simulate(still, method="mujoco/rk4", timestep=0.02, duration=5)
    assert abs(run.velocity).max() < 1e-14  # 4e-16
    run = mm.simulate(scene, method="mujoco/rk4", timestep=0.02, duration=21, record_interval=50)
    assert TopMovieContent(run, scene, np.array([20.0])).lines(0)[-1] == (
        "ring  20.0 cm high, tilt 2.8° toward 209°"
    )


def test_the_experiment_lowers_the_ring_then_tilts_it():
    scene = mm.Top.experiment()
    heights, tilts = zip(*(scene.ring_pose(t) for t in (0.0, 3.0, 8.0, 20.0)), strict=True)
    assert heights[0] > heights[1] > heights[2] == heights[3] == 0.2
    assert tilts[2] == 0.0
    assert tilts[3] == math.pi / 64
    assert scene == mm.Top(**dataclasses.asdict(scene))
