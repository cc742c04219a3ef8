"""What the motor's geometry decides without a run: wells and lean over a grid."""

import math

import numpy as np
import pytest

import magmotor as mm
from paper.motor.geometry import statics


def test_wells_and_lean_over_a_grid():
    scene = mm.Motor()
    vary = {"outer_radius": [0.9, 0.98], ("inner_height", "outer_height"): [0.4, 0.48, 0.6]}
    found = statics(scene, vary)
    assert found.barrier.dims == ("outer_radius", "inner_height")
    near = scene.replace(outer_radius=0.9, inner_height=0.6, outer_height=0.6)
    expected = mm.observables.motor_wells(near).barrier / scene.kT
    assert float(found.barrier[0, 2]) == pytest.approx(expected, rel=1e-15, abs=0)  # 0
    lean = math.degrees(math.sqrt(scene.kT / 0.0733))
    assert float(found.lean[1, 1]) == pytest.approx(lean, rel=3e-3)  # 1e-4
    assert np.isnan(statics(scene, {"outer_height": [0.48, 0.65]}).lean).values.tolist() == [
        False,
        True,
    ]
