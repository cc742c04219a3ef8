"""What movies say and sketch: numbers, titles, flights, and the ring's tilt."""

import math

import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

import magmotor as mm
from magmotor.commands.movie import summary
from magmotor.device.movie import SideView
from magmotor.devices.motor.movie import MotorMovieContent
from magmotor.devices.top.movie import TopMovieContent
from magmotor.render.sketch import Sketch

METHOD = "variational/verlet"


@pytest.fixture(scope="module")
def top_run():
    return mm.simulate(mm.Top(), method=METHOD, timestep=0.025, duration=22.0)


def test_the_spin_of_the_top_is_shown_without_its_sign(top_run):
    scene, end = mm.Top(), 21.55
    content = TopMovieContent(top_run, scene, np.array([0.0, end]))
    spin = top_run.momentum_map.values / scene.inertia[2]
    assert spin.min() < -7  # -7.17: the sign that is not shown
    assert content.value[0] == 0
    assert content.value[1] == pytest.approx(-spin[862], rel=1e-14)  # 0
    assert content.lines(1) == ["|spin|  7.17 rad/s", "|J|  1.86 × 10⁻⁴ kg m²/s"]
    shown, theory = content.plot(Figure().add_subplot())
    np.testing.assert_allclose(np.asarray(shown.get_ydata()), np.abs(spin), rtol=1e-15)
    np.testing.assert_allclose(
        np.asarray(theory.get_ydata()), np.abs(spin), rtol=0, atol=2e-3
    )  # 3.8e-4


def test_the_top_has_a_title_a_caption_and_a_result(top_run):
    content = TopMovieContent(top_run, mm.Top(), np.array([0.0]))
    assert content.title == "Hamel's top acquires spin"
    assert content.caption == "A magnetic ball under a ring of magnets tilted by 2.8°"
    assert content.result() == "Largest |spin|: 7.17 rad/s, at t = 21.6 s"
    spinning = mm.Top(spin=3.0)
    run = mm.simulate(spinning, method=METHOD, timestep=0.025, duration=1.0)
    assert TopMovieContent(run, spinning, np.array([0.0])).title == "Hamel's top"
    level = mm.Top.paper(3)
    run = mm.simulate(level, method=METHOD, timestep=0.025, duration=1.0)
    content = TopMovieContent(run, level, np.array([0.0]))
    assert content.title == "Hamel's top"
    assert content.caption == "A magnetic ball under a ring of magnets that is level"
    assert content.result() == "The ball has not acquired spin."


def test_the_side_view_follows_the_direction_of_the_tilt(top_run):
    times = top_run.time.values[[0, 400]]
    x, y = top_run.position.values[[0, 400], :2].T
    for azimuth, expected in ((0.0, x), (math.pi / 2, y)):
        scene = mm.Top(tilt_azimuth=azimuth)
        view = TopMovieContent(top_run.drop_attrs(), scene, times).side_view
        assert view is not None
        np.testing.assert_allclose(view.ball, expected, rtol=0, atol=3e-17)  # 1e-18
        assert (view.height == 0.2).all()
        assert (view.tilt == math.pi / 64).all()


def test_the_command_prints_the_spin_and_the_balance(top_run):
    spin, balance = summary(top_run, mm.Top())
    assert spin.startswith("maximum spin: |J| = 1.858e-04 kg m^2/s, 7.17 rad/s, at t = 21.62 s (")
    assert balance.startswith("balance of J: differs from the integral of theory by at most ")


@pytest.mark.parametrize(
    ("tilt", "factor"), [(0.0, 1), (math.pi / 64, 5), (0.01, 20), (0.3, 1), (0.5, 1)]
)
def test_a_sketch_exaggerates_small_tilts(tilt, factor):
    one = np.ones(2)
    sketch = Sketch(SideView(0.34, 0.2 * one, tilt * one, 0.018, np.array([-0.1, 0.1])), 1.0)
    assert sketch.factor == factor
    left, right = (np.asarray(sketch.draw(i)).astype(int) for i in range(2))
    assert left.shape == (120, 210, 3)
    blue = [np.argwhere((p[..., 2] > 140) & (p[..., 0] < 60)).mean(axis=0) for p in (left, right)]
    assert blue[1][1] - blue[0][1] == pytest.approx(0.2 * sketch.zoom, abs=1)  # 0.1
    red = np.argwhere((left[..., 0] > 170) & (left[..., 1] < 90))
    ends = [red[red[:, 1] < 105].mean(axis=0), red[red[:, 1] > 105].mean(axis=0)]
    slope = math.atan2(*(ends[1] - ends[0]))
    assert slope == pytest.approx(factor * tilt, abs=0.03)  # 0.008


@pytest.mark.parametrize(
    ("tilt", "words"), [(0.0, "level"), (0.1, "tilt 5.7°, drawn × 2"), (0.5, "tilt 28.6°")]
)
def test_a_sketch_names_the_angle(tilt, words, written):
    one = np.ones(1)
    Sketch(SideView(0.34, 0.2 * one, tilt * one, 0.018, 0 * one), 1.0).draw(0)
    assert written == [words]


@pytest.fixture(scope="module")
def flight():
    """A run of the motor with a flight of 2.24 revolutions in 30 s, after a drift of 10 s."""
    run = mm.simulate(mm.Motor(), method="mujoco/euler", timestep=0.1, duration=60, seed=1)
    time = run.time.values
    turns = -np.interp(time, [0, 10, 40, 50], [0, -0.02, 2.22, 2.1])
    radius = 0.1
    position = run.position.values.copy()
    position[:, 0], position[:, 1] = (
        radius * np.cos(2 * np.pi * turns),
        radius * np.sin(2 * np.pi * turns),
    )
    return run.assign(position=run.position.copy(data=position)).assign_coords(time=time + 100)


def test_flights_begin_and_end_in_words(flight):
    times = np.array([105.0, 111.0, 125.0, 139.0, 155.0])
    content = MotorMovieContent(flight, mm.Motor(), times)
    assert [content.event(i) for i in range(5)] == [
        "",
        "the flight begins",
        "in flight: 1.1 revolutions",
        "in flight: 2.2 revolutions",
        "flight over: 2.2 revolutions",
    ]
    assert content.result() == "A flight of 2.2 revolutions in 30 s"
    axes = Figure().add_subplot()
    content.plot(axes)
    assert axes.patches[0].get_extents().width > 0
    rest = flight.isel(time=slice(0, 90))
    content = MotorMovieContent(rest, mm.Motor(), times[:1])
    assert (content.event(0), content.result()) == ("", "No flight in this run")


def test_the_azimuth_counts_the_revolutions_before(flight):
    later = flight.assign_attrs(revolutions_before=-3)
    shown = [MotorMovieContent(run, mm.Motor(), np.array([125.0])) for run in (flight, later)]
    np.testing.assert_allclose(shown[0].value, -1.1, rtol=6e-15)  # 2e-16
    np.testing.assert_allclose(shown[1].value, -4.1, rtol=6e-15)  # 2e-16
    assert shown[1].lines(0)[0] == "ball  θ -4.10 revolutions"


def test_numbers_of_the_ring_are_its_tilt_and_its_yaw(flight):
    """The ring is tilted by 3 degrees, and then turned by -40 degrees about the vertical."""
    tilt, yaw = Rotation.from_euler("x", 3, degrees=True), Rotation.from_euler("z", -40, True)
    turned = yaw * tilt
    values = {
        "ring_axis": turned.apply([0, 0, 1]),
        "ring_orientation": np.roll(turned.as_quat(), 1),
    }
    run = flight.assign({k: flight[k].copy(data=0 * flight[k] + v) for k, v in values.items()})
    content = MotorMovieContent(run, mm.Motor(), np.array([125.0]))
    assert content.lines(0)[1] == "ring  tilt 3.0°, yaw -40°"


def test_a_frame_tells_the_time_and_the_flight(opengl, flight, written, tmp_path):
    mm.render.still(flight, mm.Motor(), tmp_path / "motor.png", 125.0)
    assert "t = 125.0 s" in written
    assert "in flight: 1.1 revolutions" in written
    assert "ball  θ −1.10 revolutions" in written


def test_captions_say_what_noise_shakes(flight):
    content = MotorMovieContent(flight, mm.Motor(), np.array([105.0]))
    assert content.title == "The fluctuation-driven motor"
    assert content.caption.endswith("; noise shakes the ball and the inner ring")
