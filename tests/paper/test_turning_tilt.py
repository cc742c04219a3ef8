"""The claims about a turning tilt fail for a ball that does not roll."""

import pytest

import magmotor as mm
from paper.top import turning_tilt


@pytest.fixture(scope="module")
def slippery():
    """Runs without friction, in which the ball slides and does not spin."""
    return {
        f"{seconds} s": mm.simulate(
            mm.Top.turning(seconds, friction=0.0), method="mujoco/rk4", timestep=0.025,
            duration=seconds + turning_tilt.AFTERWARD, record_interval=8,
        )
        for seconds in turning_tilt.TURNS
    }  # fmt: skip


def test_a_ball_that_slides_would_follow_differently_and_would_not_spin(slippery):
    verdicts = [claim.verdict for claim in turning_tilt.claims(slippery)]
    assert verdicts == ["right", "wrong", "wrong", "wrong", "wrong"]


def test_a_ball_that_slides_has_the_inertia_of_its_mass(slippery, monkeypatch):
    """The prediction for rolling, with the inertia of sliding in its place, is right for it."""
    inertia, spin = turning_tilt.rolling()
    scene = mm.Top()
    (x, y, _), axis = mm.theory.resting_ball(scene)
    sliding = scene.ball_mass * (x**2 + y**2) + scene.inertia[0] * (axis[0] ** 2 + axis[1] ** 2)
    assert sliding < 0.6 * inertia
    monkeypatch.setattr(turning_tilt, "rolling", lambda: (sliding, spin))
    for seconds in (60, 45):
        tilt, ball = turning_tilt.azimuths(slippery[f"{seconds} s"], seconds)
        found = turning_tilt.largest_lag(tilt, ball)
        predicted = turning_tilt.predicted_lag.__wrapped__(seconds)
        assert predicted == pytest.approx(found, rel=0.2)  # 0.12
