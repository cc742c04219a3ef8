"""The initial state of the motor: the default, and given parts."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import magmotor as mm
from magmotor.devices.motor.device import MOTOR

SHORT = {"method": "variational/baoab", "timestep": 0.1, "duration": 1.0}


@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_by_default_the_ball_is_at_rest_in_the_first_well(factor):
    still = mm.Motor(ball_ring_factor=factor, alpha_ball=0.0, alpha_ring=0.0)
    state = MOTOR.initial_state(still, None, None)
    radius = 0.5906 if factor == 2 else 0.5997
    assert np.hypot(*state.position[0, 0, :2]) == pytest.approx(radius, abs=5e-5)  # 1.9e-5
    run = mm.simulate(still, method="scipy/dop853", timestep=1.0, duration=30.0)
    # An equilibrium only for a fixed ring: the ball pulls the ring and tilts it a little.
    assert abs(run.position - run.position[0]).max() < 2e-3  # 7e-4


def test_axes_and_orientations_determine_one_another():
    ring = Rotation.from_euler("xyz", [0.1, -0.05, 0.8]).as_quat(scalar_first=True)
    state = MOTOR.initial_state(mm.Motor(), {"ring_orientation": 3 * ring, "axis": (0, 1, 1)}, 2)
    np.testing.assert_allclose(
        state.ring_orientation, np.broadcast_to(ring, (1, 2, 4)), rtol=2e-15
    )  # 1.2e-16
    rotation = Rotation.from_quat(state.orientation[0, 1], scalar_first=True)
    np.testing.assert_allclose(
        rotation.apply([0, 0, 1]), [0, 0.5**0.5, 0.5**0.5], rtol=3e-15
    )  # 1.6e-16


def test_each_replica_may_have_its_own_velocity():
    velocity = np.array([[0.01, 0.0], [0.0, -0.02], [0.0, 0.0]])
    run = mm.simulate(mm.Motor(), replicas=3, initial={"velocity": velocity}, **SHORT)
    np.testing.assert_array_equal(run.velocity[:, 0, :2], velocity)


def test_a_run_continues_another():
    """It also continues the Brownian path; heat and work are counted from its own start."""
    whole = mm.simulate(mm.Motor(), **{**SHORT, "duration": 20.0})
    first = mm.simulate(mm.Motor(), **{**SHORT, "duration": 12.0})
    second = mm.simulate(mm.Motor(), initial=first, **{**SHORT, "duration": 8.0})
    for name in ("position", "ring_angular_velocity", "energy"):
        scale = float(abs(whole[name]).max())
        assert abs(second[name][-1] - whole[name][-1]).max() < 1e-15 * scale  # 0, or rounding
    heat = float(second.heat[-1] - (whole.heat[-1] - first.heat[-1]))
    assert heat == pytest.approx(0, abs=1e-14 * float(whole.heat[-1]))  # 4e-16
