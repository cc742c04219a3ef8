"""Narrow gaps between pieces of iron: derivatives, saturation, and what has no such gap.

That forces are right is tested against multipoles in `test_iron_at_short_range.py`, and against
finite elements in `test_gaps_by_elements.py`, `test_circuits.py` and `test_pull_forces.py`.
"""

import math

import mujoco
import numpy as np
import pytest
from energy_slopes import wrenches_by_energy
from iron_models import free, iron, load

import magmotor as mm

MU0 = 4e-7 * math.pi
SHAPES = {
    "box": 'type="box" size="0.008 0.006 0.005"',
    "cylinder": 'type="cylinder" size="0.007 0.005"',
    "ellipsoid": 'type="ellipsoid" size="0.008 0.007 0.005"',
    "capsule": 'type="capsule" size="0.005 0.006" euler="90 0 0"',
    "sphere": 'size="0.005"',
}
PLANE = '<geom name="plane" type="plane" size="1 1 1"/>'
MAGNET = '<body pos="0.02 0.004 0.02"><freejoint/><geom size="0.001"/><site user="0.5"/></body>'


def bars(gap, field, material):
    """The pull on one of two bars of 10 x 10 x 60 mm, end to end."""
    bar = 'type="box" size="0.005 0.005 0.03"'
    bodies = free(bar) + free(bar, f"0 0 {0.06 + gap}", "other")
    return -iron(bodies, f"0 0 {field}", material, "piece other")[1].xfrc_applied[2, 2]


@pytest.mark.parametrize(("saturation", "factor"), [(0, 1), (1.6e6, 1), (1.6e6, 8)])
@pytest.mark.parametrize("shape", SHAPES)
def test_forces_are_derivatives_of_the_energy(shape, saturation, factor):
    """Of two pieces 0.4 mm apart and as far above a plane, tilted, in a field that varies.

    The largest error is 5e-5 of the largest force for the box, whose edges make the distance bend,
    2e-6 for the others, and 3e-11 m times it for torques.
    """
    low, height = SHAPES[shape], 0.0054
    box = 'type="box" size="0.006 0.006 0.004"'
    bodies = (
        f'<body pos="0 0 {height}" euler="1 2 0"><freejoint/><geom name="piece" {low}/></body>'
        f'<body pos="0.001 0.002 {height + 0.0094}" euler="-1 1 20"><freejoint/>'
        f'<geom name="other" {box}/></body>'
    )
    field = " ".join(str(factor * x) for x in (0.03, 0.01, 0.05, 0.4, 0, 0.1, 0.3, -0.2))
    model = load(PLANE + bodies + MAGNET, field, f"800 {saturation}", "piece other plane")
    data = mujoco.MjData(model)
    with mm.magnetism():
        mujoco.mj_forward(model, data)
    found = data.xfrc_applied[1:3].reshape(-1, 2, 3)
    error = np.abs(found - wrenches_by_energy(model, data, 2)).max(axis=(0, 2))
    assert error[0] < (5e-4 if shape == "box" else 4e-5) * np.abs(found).max()
    assert error[1] < 5e-10 * np.abs(found).max()


def test_the_pull_rises_as_a_gap_closes():
    """Also where nodes begin to miss flux."""
    gaps = np.concatenate([np.linspace(0, 1e-3, 21), np.linspace(1.2e-3, 0.01, 45)])
    pulls = np.array([bars(gap, 0.02, "1000") for gap in gaps])
    falls = -np.diff(pulls) / pulls[:-1]
    assert (falls > 0).all()
    assert falls.max() < 0.3  # 0.21
