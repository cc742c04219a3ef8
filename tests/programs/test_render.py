"""Movies and pictures show the recorded motion."""

import subprocess
from contextlib import closing
from pathlib import Path
from typing import Any, cast

import imageio_ffmpeg
import mediapy
import mujoco
import numpy as np
import pytest
from refusals import refused

import magmotor as mm
from magmotor.devices.ball.coordinates import BallCoordinates
from magmotor.devices.top.states import start
from magmotor.render import camera as camera_module
from magmotor.render.camera import NoOpenGL
from magmotor.render.curves import Panel
from magmotor.render.frames import Frames
from magmotor.render.region import Region
from magmotor.render.trail import Trail
from magmotor.render.views import Views

MODELS = Path(__file__).parents[2] / "models"
SIZE = (180, 240)
CAMERAS = ("front", "top", "ball")


@pytest.fixture(scope="module")
def run():
    return mm.simulate(mm.Top(), method="mujoco/rk4", timestep=0.025, duration=22)


def pictures(scene, states, trail=None):
    views = Views(scene, dict.fromkeys(CAMERAS, SIZE))
    try:
        views.pose(BallCoordinates(scene.surface, scene.ball_radius).joints(states)[0])
        return {camera: views.draw(camera, trail, 1e9).astype(int) for camera in CAMERAS}
    finally:
        views.close()


def decoded(path):
    """Return the bytes of all frames of a movie."""
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24"]
    raw = subprocess.run([*command, "-"], capture_output=True, check=True).stdout
    return np.frombuffer(raw, np.uint8)


def red(picture):
    """Return a mask of the pixels with the red of the dipoles' arrows."""
    return (picture[..., 0] > 2 * picture[..., 1]) & (picture[..., 0] > 80)


@pytest.mark.parametrize(
    "scene",
    [mm.Top(), mm.Top(ring_dipoles=1), mm.Top(ring_dipoles=40), mm.Top(ball_radius=0.05)],
    ids=["paper", "one dipole", "40 dipoles", "large ball"],
)
def test_every_camera_sees_the_dipoles(opengl, scene):
    seen = pictures(scene, start(scene))
    for camera, picture in seen.items():
        assert picture.shape == (*SIZE, 3)
        assert picture.std() > 5, camera
        assert red(picture).sum() >= 5, camera


@pytest.mark.parametrize("name", ["disk", "motor", "motor_plane", "top", "top_plane"])
def test_the_viewer_opens_a_model_with_all_of_it_in_view(opengl, name):
    model = mujoco.MjModel.from_xml_path(str(MODELS / f"{name}.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with mujoco.Renderer(model, *SIZE) as renderer:
        renderer.update_scene(data)  # by the free camera
        picture = renderer.render().astype(int)
    shown = np.ptp(picture, axis=-1) > 60  # the floor and its shadows are gray
    rows, columns = np.nonzero(shown)
    assert len(rows) > 200  # 449 to 1939
    assert 5 < rows.min() < rows.max() < SIZE[0] - 5
    assert 5 < columns.min() < columns.max() < SIZE[1] - 5


def test_arrows_go_around_the_ring(opengl):
    rows, columns = np.nonzero(red(pictures(mm.Top(), start(mm.Top()))["top"]))
    azimuth = np.arctan2(rows - SIZE[0] / 2, columns - SIZE[1] / 2)
    assert (np.histogram(azimuth, bins=8, range=(-np.pi, np.pi))[0] > 0).all()


def test_the_pattern_of_the_ball_rotates_with_it(opengl):
    scene = mm.Top()
    state = start(scene)
    quarter = np.array([[np.sqrt(0.5), 0, 0, np.sqrt(0.5)]])
    still, turned = (
        pictures(scene, s)["ball"] for s in (state, state._replace(orientation=quarter))
    )
    middle = (slice(60, 120), slice(80, 160))
    assert np.abs(still - turned)[middle].mean() > 10  # measured: 79


def test_the_trail_is_drawn_where_the_ball_was(opengl, run):
    trail = Trail(run.time.values, run.position.values, 0.005)
    scene = mm.Top()
    without, with_trail = (pictures(scene, start(scene), t)["top"] for t in (None, trail))
    rows = np.nonzero(np.abs(with_trail - without).max(axis=-1) > 20)[0]
    assert len(rows) > 100
    # From left to right it goes through y > 0, the picture's upper half.
    assert np.mean(rows < SIZE[0] / 2) > 0.8


@pytest.mark.parametrize("suffix", [".mp4", ".webm", ".gif"])
def test_a_movie_has_its_frames_and_size(opengl, run, tmp_path, suffix):
    short = run.isel(time=slice(0, 21))
    path = tmp_path / f"top{suffix}"
    mm.render.movie(short, mm.Top(), path, speed=2.0, fps=10, size=(640, 360))
    frames = decoded(path).reshape(-1, 360, 640, 3).astype(int)
    assert len(frames) == 3 + 20  # a quarter of a second, and two seconds with the result
    assert frames[0].std() > 10
    assert np.abs(frames[-1] - frames[0]).max() > 50
    caption = (slice(25, 50), slice(10, 350))
    assert np.abs(frames[-1] - frames[2])[caption].max() > 100
    assert np.abs(frames[-1] - frames[3]).mean() < 1  # held


@pytest.fixture(scope="module")
def motor_run():
    return mm.simulate(mm.Motor(), method="mujoco/euler", timestep=0.05, duration=60, seed=1)


def test_the_motor_is_filmed(opengl, motor_run, tmp_path):
    scene = mm.Motor()
    mm.render.movie(motor_run, scene, tmp_path / "motor.mp4", speed=300.0, fps=5)
    frames = decoded(tmp_path / "motor.mp4").reshape(-1, 720, 1280, 3).astype(int)
    assert len(frames) == 2 + 10
    text = (slice(590, 720), slice(0, 260))
    assert np.abs(frames[1] - frames[0])[text].max() > 100
    mm.render.still(motor_run, scene, tmp_path / "motor.png", 60.0)
    still = mediapy.read_image(tmp_path / "motor.png").astype(int)
    assert np.abs(still - frames[1]).mean() < 3  # what the encoder loses


def test_the_rings_ball_and_trail_of_the_motor_are_visible(opengl, motor_run):
    scene = mm.Motor()
    with Frames(motor_run, scene, [0.0, 60.0]) as frames:
        start, end = (frames.draw(i)[:360, 800:].astype(int) for i in range(2))
    rows, columns = np.nonzero(red(start))
    radius = np.hypot(rows - 180, columns - 240)
    azimuth = np.arctan2(180 - rows, columns - 240)
    inner, outer = (np.abs(radius - r) < 12 for r in (112, 144))
    assert (np.histogram(azimuth[inner], bins=20, range=(-3.3, 2.983))[0] > 0).all()
    turn = (azimuth[outer] + np.pi / 5) % (2 * np.pi / 5) - np.pi / 5
    assert np.abs(turn).max() < 0.1  # under each of the five of the outer ring
    assert len(np.unique(np.round(azimuth[outer] / (2 * np.pi / 5)) % 5)) == 5
    ball = (slice(170, 190), slice(305, 325))
    assert (start[ball].min(axis=-1) < 110).sum() > 10
    assert np.abs(end - start).max() > 100  # the ball has moved


def test_what_cannot_be_filmed_is_named(motor_run, tmp_path):
    replicas = motor_run.expand_dims(replica=2)
    with refused("replicas"):
        mm.render.still(replicas, mm.Motor(), tmp_path / "motor.png", 1.0)
    with refused("scene"):
        mm.render.still(motor_run, cast(Any, mm.Disk()), tmp_path / "disk.png", 1.0)
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("near", "argument"), [("front", "RotorMovieContent.near"), ("side", "camera")]
)
def test_a_camera_that_is_missing_or_shown_twice_is_named(
    rotor, monkeypatch, tmp_path, near, argument
):
    run = mm.simulate(rotor.Rotor(), method="variational/baoab", timestep=0.01, duration=0.1)
    monkeypatch.setattr(rotor.RotorMovieContent, "near", near)
    with refused(argument):
        mm.render.movie(run, None, tmp_path / "rotor.mp4")
    with refused(argument):
        mm.render.still(run, None, tmp_path / "rotor.png", 0.05)
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "options", "argument"),
    [
        ("top.avi", {}, "path"),
        ("top", {}, "path"),
        ("missing/top.mp4", {}, "path"),
        ("top.mp4", {"size": (641, 360)}, "size"),
        ("top.mp4", {"size": (200, 100)}, "size"),
        ("top.mp4", {"size": 720}, "size"),
        ("top.mp4", {"fps": 0}, "fps"),
        ("top.mp4", {"speed": 1e-6}, "speed"),
        ("top.gif", {"speed": 0.01}, "path"),
    ],
)
def test_a_movie_that_cannot_be_written_is_refused_before_rendering(
    run, monkeypatch, tmp_path, name, options, argument
):
    monkeypatch.setattr(Frames, "__enter__", None)
    with refused(argument):
        mm.render.movie(run, mm.Top(), tmp_path / name, **options)
    assert not any(tmp_path.iterdir())


def test_frames_in_a_row_are_those_drawn_singly(opengl, run):
    with Frames(run, mm.Top(), [0.0, 0.5, 1.0, 1.5]) as frames:
        shown = [*frames]
        assert len(shown) == len(frames)
        for i, frame in enumerate(shown):
            np.testing.assert_array_equal(frame, frames.draw(i))
        assert not np.array_equal(shown[0], shown[3])


@pytest.mark.parametrize(
    "scene",
    [mm.Top(), mm.Top.experiment(), mm.Motor()],
    ids=["top", "scripted ring", "moving ring"],
)
def test_a_background_that_is_rendered_once_shows_no_difference(opengl, scene, monkeypatch):
    """Edges of what rests may change by a sample of four where a region has other roundings."""
    run = mm.simulate(scene, timestep=0.01, duration=3, seed=1)
    times = np.array([0.0, 3.0])

    trail = Trail(run.time.values, run.position.values, 0.25 * scene.ball_radius)
    joints = scene.device.joints(run, scene, times)

    def drawn(has_background):
        views = Views(scene, {"front": (720, 800)})
        with closing(views):
            camera = views.cameras["front"]
            assert camera.has_background
            camera.has_background = has_background
            pictures = []
            for pose, time in zip(joints, times, strict=True):
                views.pose(pose, time)
                pictures.append(views.draw("front", trail, time))
            return np.array(pictures).astype(int), len(camera.backgrounds)

    (whole, none), (parts, count) = drawn(False), drawn(True)
    assert (none, count) == (0, 1)
    assert (np.abs(parts - whole).max(axis=-1) > 8).sum() <= 10  # of 1 152 000; 0, or 1 of more
    narrow = Region.around

    def too_narrow(*arguments):
        left, bottom, width, height = narrow(*arguments)
        return Region(left, bottom, width - width // 4, height)

    monkeypatch.setattr(Region, "around", too_narrow)
    cut, _ = drawn(True)
    assert (np.abs(cut - whole).max(axis=-1) > 8).sum() > 30  # measured: 48 and more


def test_a_camera_keeps_the_backgrounds_that_it_needs_again(opengl, monkeypatch):
    monkeypatch.setattr(camera_module, "MOST_BACKGROUNDS", 2)
    scene = mm.Top.experiment()  # whose ring moves
    run = mm.simulate(scene, timestep=0.01, duration=1)
    with Frames(run, scene, [0.0, 0.25, 0.5, 0.75], size=(320, 180)) as frames:
        camera, kept, pictures = frames.views.cameras["front"], [], {}
        for i in (0, 1, 1, 0, 2, 2, 0, 1):
            picture = frames.draw(i).astype(int)
            kept.append(list(camera.backgrounds))
            assert np.abs(picture - pictures.setdefault(i, picture)).mean() < 0.002  # 9e-5
    first, second, third = kept[0][0], kept[2][1], kept[5][1]
    assert kept == [
        [first],
        [first],  # the ring's pose of frame 1 is new
        [first, second],
        [second, first],
        [second, first],
        [first, third],  # the second was needed less recently
        [third, first],
        [first, second],
    ]


CAMERA = """
<mujoco>
  <worldbody>
    <camera name="front" pos="0 -3 1"/>
    <geom type="plane" size="1 1 1"/>
    <body><freejoint/><geom size="0.1"/></body>
    {}
  </worldbody>
  {}
</mujoco>
"""


@pytest.mark.parametrize(
    ("world", "rest"),
    [
        ("", '<asset><material name="mirror" reflectance="0.5"/></asset>'),
        ('<body><freejoint/><geom size="0.1"/><light/></body>', ""),
        ('<light mode="targetbody" target="ball"/><body name="ball"/>', ""),
        ('<site/>', ""),
        ('<site group="4" name="b"/><body><geom size="0.1"/><site group="4" name="a"/></body>',
         '<tendon><spatial><site site="a"/><site site="b"/></spatial></tendon>'),
    ],
    ids=["mirror", "moving light", "turning light", "site", "tendon"],
)  # fmt: skip
def test_there_is_a_background_only_if_motion_leaves_it_as_it_is(opengl, world, rest):
    plain = mujoco.MjModel.from_xml_string(CAMERA.format("<light/>", ""))
    assert camera_module._has_background(plain, 0)
    assert not camera_module._has_background(
        mujoco.MjModel.from_xml_string(CAMERA.format(world, rest)), 0
    )
    for attribute in ('mode="trackcom"', 'projection="orthographic"'):
        xml = CAMERA.replace('name="front"', f'name="front" {attribute}').format("", "")
        assert not camera_module._has_background(mujoco.MjModel.from_xml_string(xml), 0)
    aboard = CAMERA.format('<body><freejoint/><geom size="0.1"/><camera name="aboard"/></body>', "")
    model = mujoco.MjModel.from_xml_string(aboard)
    assert camera_module._has_background(model, 0)
    assert not camera_module._has_background(model, 1)


def test_ctrl_c_ends_a_movie_as_ctrl_c(opengl, run, tmp_path, monkeypatch):
    count = iter(range(10))

    def interrupted(self, *arguments):
        if next(count) == 5:
            raise KeyboardInterrupt
        return draw(self, *arguments)

    draw = Views.draw
    monkeypatch.setattr(Views, "draw", interrupted)
    with pytest.raises(KeyboardInterrupt):
        mm.render.movie(run, mm.Top(), tmp_path / "top.mp4")


def test_a_run_without_orientation_cannot_be_filmed(tmp_path):
    run = mm.simulate(mm.Top(), method="scipy/dop853", timestep=0.1, duration=1)
    with refused("run"):
        mm.render.movie(run, mm.Top(), tmp_path / "top.mp4")
    with refused("speed"):
        mm.render.movie(run, mm.Top(), tmp_path / "top.mp4", speed=0)
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize(
    "scene", [mm.Top(), mm.Top.experiment(), mm.Top.paper(1)], ids=["paper4", "script", "no spin"]
)
def test_the_overview_is_drawn(scene, tmp_path):
    run = mm.simulate(scene, method="mujoco/rk4", timestep=0.025, duration=2)
    mm.plots.overview(run, scene, tmp_path / "top.png")
    picture = mediapy.read_image(tmp_path / "top.png")
    assert min(picture.shape[:2]) > 500
    assert picture.std() > 10


def test_opengl_that_failed_is_not_tried_again(monkeypatch):
    tries = []

    def fail(*_):
        tries.append(1)
        raise RuntimeError("no context")

    monkeypatch.setattr(camera_module, "_failures", [])
    monkeypatch.setattr(camera_module, "Camera", fail)
    for _ in range(2):
        with pytest.raises(NoOpenGL, match="MUJOCO_GL") as stop:
            Views(mm.Top(), {"front": SIZE})
        assert str(stop.value.__cause__) == "no context"
    assert len(tries) == 1


@pytest.mark.parametrize("width", [150, 200, 400])
def test_the_legend_of_a_panel_of_any_width_is_inside_it(width):
    def plot(axes):
        return [*axes.plot([0, 1], label="spin"), *axes.plot([1, 0], label="theory, from friction")]

    picture = Panel(plot, (0, 1), 150, width, dpi=60).full
    edges = picture[:60, [0, -1]]  # the legend, above the axes
    assert (edges == picture[0, 0]).all()
