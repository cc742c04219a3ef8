"""What a builder meets first, and the shaken plate: what the figures' numbers rest on."""

import math

import numpy as np
import pytest
import xarray as xr

import magmotor as mm
from paper.prototype import builder_motor, builder_top, shaken_plate
from paper.prototype.builder_motor import DESK, PAPER

BARRIERS = mm.theory.motor_tolerances(PAPER), mm.theory.motor_tolerances(DESK)


@pytest.mark.parametrize("effect", ["none", "floor_tilt", "background_field", "drag"])
def test_an_effect_of_one_size_is_the_same_on_the_desk(effect):
    """Sizes in barriers, or in 1/T_0, on one Brownian path: to rounding, for 500 steps."""
    places, plain = [], []
    for scene, allowed in zip((PAPER, DESK), BARRIERS, strict=True):
        changed = scene
        if effect == "floor_tilt":
            changed = scene.replace(floor_tilt=(math.asin(30 * allowed.floor_tilt), 0.0))
        elif effect == "background_field":
            changed = scene.replace(background_field=(30 * allowed.background_field, 0.0, 0.0))
        elif effect == "drag":
            drag = 0.3 * 0.7 * scene.ball_mass / scene.units.time
            changed = scene.replace(drag=drag, rotational_drag=drag * scene.ball_radius**2)
            assert builder_motor.rolling_rate(changed) == pytest.approx(0.3, rel=1e-12)
        for case, found in ((changed, places), (scene, plain)):
            step = builder_motor.TIMESTEP * scene.units.time
            run = mm.simulate(
                case, method=builder_motor.METHOD, timestep=step, duration=500 * step, seed=2
            )
            found.append(run.position.values / scene.inner_radius)
    assert np.abs(places[0] - places[1]).max() < 3e-13  # 1e-14
    if effect != "none":
        assert np.abs(places[0] - plain[0]).max() > 1e-3


def test_the_rate_of_damping_is_that_of_a_ball_that_cannot_slip():
    """The slowest eigenvalue of the linear equation of v and w, as friction of the slip grows."""
    scene = PAPER.in_air(0.002)
    mass = np.array([scene.ball_mass, scene.ball_inertia])
    arm = np.array([1.0, scene.ball_radius])
    friction = 1e6 * np.outer(arm, arm) + np.diag([scene.drag, scene.rotational_drag])
    rates = np.linalg.eigvals(friction / mass[:, None])
    found = builder_motor.rolling_rate(scene) / scene.units.time
    assert rates.min() == pytest.approx(found, rel=1e-4)
    assert found == pytest.approx(6e-5, rel=0.1)  # 6.1e-5 /s


def test_flights_are_counted_by_run():
    """Three turns, one turn and none; both flights end, and one of the runs goes back."""
    turns = np.zeros((3, 401))
    turns[0, :200], turns[0, 200:] = np.linspace(0, 3, 200), np.linspace(3, 2.7, 201)
    turns[1, :200], turns[1, 200:] = np.linspace(0, -1.5, 200), np.linspace(-1.5, -1.2, 201)
    azimuth = 2 * math.pi * turns
    ring = 0.59 * np.stack([np.cos(azimuth), np.sin(azimuth), 0 * azimuth], axis=-1)
    time = PAPER.units.time * np.arange(401.0)
    run = xr.Dataset(
        {"position": (("replica", "time", "space"), ring)},
        coords={"time": time, "replica": range(3), "space": ["x", "y", "z"]},
    )
    found = builder_motor.flown_in(run, PAPER)
    assert found.turns == pytest.approx(1.5)
    assert found.turns_error == pytest.approx(math.sqrt(2.25 + 2.25) / math.sqrt(2) / math.sqrt(3))
    assert found.longest == pytest.approx(3.0)
    once = [math.ceil(199 / 3), math.ceil(199 / 1.5)]
    assert found.lasts == pytest.approx(199 - sum(once) / 2)
    apart = (once[1] - once[0]) / 2  # from the mean, in two runs; none in the third
    assert found.lasts_error == pytest.approx(math.sqrt(2 * apart**2 * 3 / 2) / 2)


def test_effects_that_end_no_flights_are_not_said_to():
    """Claims are refuted by flights that are alike with any effect, and by few runs."""
    same = builder_motor.Flown(24.0, 2.0, 30.0, 3.0, 50.0)
    few, half = same._replace(turns=2.0, turns_error=0.3), same._replace(turns=10.0)

    def verdicts(strong, air, rough=same):
        sizes = {1.0: same, 10.0: strong}
        limit = builder_motor.LIMIT
        data = builder_motor.BuilderMotor(
            same, rough, rough, air, {"floor_tilt": sizes, "background_field": sizes},
            {"cold": {limit: same, 10 * limit: strong}}, strong, 32,
        )  # fmt: skip
        found = [claim.verdict for claim in builder_motor.claims(data)]
        assert found[5:7] == ["right", "right"]  # theory and statics
        return [*found[:5], found[7]]

    assert verdicts(few, half) == ["right"] * 6
    assert verdicts(few._replace(turns_error=1.0), half) == ["wrong"] * 3 + ["right"] * 3
    assert verdicts(same, same) == ["wrong"] * 5 + ["right"]
    assert verdicts(few, half, rough=few)[-1] == "wrong"


def test_aluminum_at_the_distance_found_damps_at_the_limit():
    """By mu0^2 sigma m^2/(128 pi h^3) on the center; the desk's ball has its magnet's moment."""
    for scene, moment in ((PAPER, 4.472), (DESK, 2.2089)):
        height = builder_motor._aluminum(scene)
        drag = (4e-7 * math.pi * moment) ** 2 * 3.5e7 / (128 * math.pi * height**3)
        rate = drag / (1.4 * scene.ball_mass) * scene.units.time
        assert rate == pytest.approx(1 / 57, rel=1e-3)


def test_the_top_is_told_of_each_effect():
    """Each field of the scene that a curve sets is set, and nothing else."""
    for name, effect in builder_top.EFFECTS.items():
        for size in effect.judged:
            scene = effect.scene.replace(**effect.fields(size))
            assert scene != effect.scene, name
            reset = {field: getattr(effect.scene, field) for field in effect.fields(size)}
            assert scene.replace(**reset) == effect.scene
            assert effect.reach[0] <= size <= effect.reach[1]


def test_bandwidth_and_stroke_of_the_plate():
    """Half of the power at the bandwidth, by the transform of a hold; the displacement's bound."""
    hold = 25
    turn = math.pi * shaken_plate.bandwidth(hold) * hold * shaken_plate.STEP
    assert (math.sin(turn) / turn) ** 2 == pytest.approx(0.5, rel=1e-3)
    per_second = 2 * DESK.kT / DESK.friction_ball
    assert shaken_plate.stroke(20.0) == pytest.approx(1e3 * math.sqrt(10 * per_second))
    power = per_second / (hold * shaken_plate.STEP)
    assert shaken_plate.speed(hold) == pytest.approx(1e3 * math.sqrt(power))


def test_the_ball_rolls_to_and_fro_at_the_frequency_of_its_well():
    """A quiet motor, started beside its well, passes it twice in each period.

    The ring leans toward the ball meanwhile, which the theory leaves out: the well is stiffer.
    """
    quiet = DESK.replace(alpha_ball=0.0, alpha_ring=0.0)
    place = quiet.resting_place()[0]
    start = 0.02
    run = mm.simulate(
        quiet.replace(position=(place * math.cos(start), place * math.sin(start))),
        method="variational/middle", timestep=shaken_plate.STEP, duration=400.0, record_interval=4,
    )  # fmt: skip
    azimuth = mm.observables.azimuth(run).values
    crossings = run.time.values[1:][np.diff(np.sign(azimuth)) != 0]
    period = 2 * float(np.diff(crossings).mean())
    expected = 1 / shaken_plate.rolling_frequency(DESK)
    assert period == pytest.approx(expected, rel=0.1)  # 0.073
