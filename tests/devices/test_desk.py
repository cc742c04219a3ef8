"""Motors of other sizes with the paper's dimensionless groups."""

import numpy as np
import pytest

import magmotor as mm
from magmotor.observables import motor_wells


@pytest.mark.parametrize("run", ["uniform-a", "nonuniform-a"])
@pytest.mark.parametrize("options", [{}, {"inner_radius": 0.31, "grade": "C5"}])
def test_the_same_groups_give_the_same_run_in_scaled_units(run, options):
    """On one Brownian path, to rounding, for 2000 steps."""
    paper, desk = mm.Motor.paper(run), mm.Motor.desk(run, **options)
    scale = desk.units.time / paper.units.time
    runs = [
        mm.simulate(
            scene, method="variational/middle", timestep=step, duration=2000 * step, seed=2,
            record_interval=10,
        )
        for scene, step in ((paper, 0.4), (desk, 0.4 * scale))
    ]  # fmt: skip
    places = [r.position.values / s.inner_radius for r, s in zip(runs, (paper, desk), strict=True)]
    assert np.abs(places[0] - places[1]).max() < 6e-14  # 2e-15
    assert np.abs(places[0] - places[0][0]).max() > 0.01  # 0.012 and 0.15
    heats = [r.heat.values / s.units.energy for r, s in zip(runs, (paper, desk), strict=True)]
    np.testing.assert_allclose(*heats, rtol=0, atol=3e-13 * heats[0].max())  # 1e-14


def test_all_groups_but_the_weight_are_the_papers():
    paper, desk = mm.Motor().groups._asdict(), mm.Motor.desk().groups._asdict()
    weights = paper.pop("weight"), desk.pop("weight")
    assert desk == pytest.approx(paper, rel=1e-14, abs=0)
    assert weights[0] / weights[1] > 1000  # 3419: the magnets are that much stronger


def test_the_desk_of_neodymium():
    """The values of an independent calculation, for a remanence of 1.26 T instead of 1.265 T."""
    desk = mm.Motor.desk()
    assert desk.ball_radius == pytest.approx(10.7e-3, rel=0.005)
    assert desk.ball_mass == pytest.approx(0.038, rel=0.01)
    assert desk.moment == pytest.approx(5.1, rel=0.01)
    assert desk.moment == pytest.approx(
        mm.magnet("sphere", (2 * desk.ball_radius,), grade="N40").moment, rel=1e-12
    )
    assert desk.units.time == pytest.approx(2.2, rel=0.02)
    assert desk.kT == pytest.approx(2.3e-4, rel=0.01)
    assert desk.friction_ball == pytest.approx(1.3, rel=0.01)
    assert desk.friction_ring == pytest.approx(0.09, rel=0.03)
    barrier = motor_wells(desk).barrier
    assert barrier / desk.kT == pytest.approx(motor_wells(mm.Motor()).barrier / mm.Motor().kT)
    assert 20e-6 * desk.moment / barrier < 2  # 0.74 for a field along the dipole


@pytest.mark.parametrize(("options", "message"), [
    ({"inner_radius": 0}, "inner_radius = 0: must be greater than 0 m"),
    ({"grade": "N99"}, "grade = 'N99': must be one of"),
    ({"run": "uniform"}, "run = 'uniform': must be one of"),
    ({"ball_mass": -1}, "ball_mass = -1: must be greater than 0 kg"),
])  # fmt: skip
def test_bad_values_are_named(options, message):
    with pytest.raises(ValueError, match=message):
        mm.Motor.desk(**options)
