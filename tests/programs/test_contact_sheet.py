"""Contact sheets show every run in its own tile."""

import subprocess
from typing import Any, cast

import imageio_ffmpeg
import numpy as np
import pytest
from refusals import refused

import magmotor as mm
from magmotor.device import Gauge
from magmotor.render.contact_sheet import FRAME_RATE, Sheet, Tile
from magmotor.render.encoder import frame_times

HEADER = 36
LABEL = (slice(0, 34), slice(0, 90))


@pytest.fixture(scope="module")
def scenes():
    return [mm.Top(tilt=tilt) for tilt in (0.0, 0.05, 0.2)]


@pytest.fixture(scope="module")
def runs(scenes):
    method = {
        "method": "variational/verlet",
        "timestep": 0.025,
        "duration": 15,
        "record_interval": 2,
    }
    return [mm.simulate(scene, **method) for scene in scenes]


def drawn(runs, scenes, labels, columns, moments):
    """Return frames at some times, shape (T, 720, 1280, 3), and the boxes of the tiles."""
    times = np.array(moments)
    tiles = [Tile(*shown, times) for shown in zip(runs, scenes, labels, strict=True)]
    with Sheet(tiles, times, columns) as sheet:
        return np.stack([sheet.draw(i) for i in range(len(times))]).astype(int), sheet.boxes


def cut(frames, box):
    left, top, right, bottom = box
    return frames[..., top:bottom, left:right, :]


def dark(pictures):
    """Return a mask of the pixels with the dark gray of ball and text."""
    return pictures.max(axis=-1) < 75


def decoded(path):
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24"]
    raw = subprocess.run([*command, "-"], capture_output=True, check=True).stdout
    return np.frombuffer(raw, np.uint8).reshape(-1, 720, 1280, 3).astype(int)


def test_a_sheet_has_its_frames_and_size(opengl, runs, scenes, tmp_path):
    path = tmp_path / "sheet.mp4"
    mm.render.contact_sheet(runs, scenes, [*"abc"], path, columns=2, speed=50.0)
    frames = decoded(path)
    assert len(frames) == 10  # every 1.67 s of 15 s
    still, _ = drawn(runs, scenes, [*"abc"], 2, frame_times(0.0, 15.0, 50.0, FRAME_RATE))
    assert np.abs(frames[-1] - still[-1])[HEADER:].mean() < 3  # what the encoder loses: 1
    assert np.abs(frames[-1] - frames[0]).max() > 100


def test_every_ball_moves_as_in_its_run(opengl, runs, scenes):
    (start, end), boxes = drawn(runs, scenes, ["", "", ""], 3, [0.0, 15.0])
    first, last = ([cut(frame, box) for box in boxes[:3]] for frame in (start, end))
    for one, other in ((0, 1), (1, 2), (0, 2)):
        assert np.abs(last[one] - last[other]).max() > 100
    for run, before, after in zip(runs, first, last, strict=True):
        balls = (dark(before) & ~dark(after), dark(after) & ~dark(before))
        places = [np.argwhere(ball[60:260, 80:340]).mean(axis=0) for ball in balls]
        moved = run.position.values[-1, :2] - run.position.values[0, :2]
        meter = (places[1] - places[0]) / [-moved[1], moved[0]]
        seen = (
            2 * 1.231 * np.tan(np.pi / 8)
        )  # meters from lower to upper edge, at the ball's height
        assert meter == pytest.approx(np.full(2, 319 / seen), rel=0.03)  # 1.3e-2 at most
    blue = [(tile[..., 2] > tile[..., 0] + 80)[:, :380].sum() for tile in first + last]
    assert max(blue[:3]) == 0
    assert min(blue[3:]) > 200  # 252


def test_labels_are_in_their_tiles(opengl, runs, scenes):
    (named,), boxes = drawn(runs, scenes, ["tilt 0, height 0.2", "", "tilt 0.2"], 3, [0.0])
    counts = [dark(cut(named, box)[LABEL]).sum() for box in boxes[:3]]
    assert counts[1] == 0
    assert counts[0] > counts[2] > 25  # 99 and 37
    assert dark(cut(named, boxes[0])[19:34, :90]).sum() > 50  # the second line: 75
    assert dark(cut(named, boxes[2])[19:34, :90]).sum() == 0


def test_bars_show_the_spin_on_one_scale(opengl, runs, scenes):
    (end,), boxes = drawn(runs, scenes, ["", "", ""], 3, [15.0])
    spins = [float(r.momentum_map[-1]) / s.inertia[2] for r, s in zip(runs, scenes, strict=True)]
    bars = []
    for box in boxes[:3]:
        column = cut(end, box)[:, -12]
        blue = np.flatnonzero((column[:, 2] > 150) & (column[:, 0] < 50))
        bars.append(len(blue))
    largest = int(np.abs(spins).argmax())
    for bar, spin in zip(bars, spins, strict=True):
        assert bar == pytest.approx(bars[largest] * abs(spin / spins[largest]), abs=2)  # 0.19


def test_a_run_that_ended_early_freezes_and_fades(opengl, runs, scenes):
    stopped = runs[1].isel(time=slice(0, 101))
    at_once = runs[2].isel(time=[0])
    shown = [runs[0], stopped, at_once]
    frames, boxes = drawn(shown, scenes, ["", "", ""], 3, [4.9, 5.0, 10.0, 15.0])
    going, held, gone = (cut(frames, box) for box in boxes[:3])
    assert np.abs(going[3] - going[2]).max() > 50
    np.testing.assert_array_equal(held[3], held[2])
    assert np.ptp(held[3][60:140]) < 0.5 * np.ptp(held[1][60:140])
    np.testing.assert_array_equal(gone[3], gone[1])
    whole, _ = drawn(runs, scenes, ["", "", ""], 3, [5.0])
    np.testing.assert_array_equal(cut(whole[0], boxes[0]), going[1])


def test_scenes_that_look_alike_share_their_views(opengl, runs, scenes):
    others = [*scenes, mm.Top(ring_height=0.3), mm.Top(ball_radius=0.03)]
    times = np.array([0.0])
    tiles = [Tile(runs[0], scene, "", times) for scene in others]
    with Sheet(tiles, times, 3) as sheet:
        assert len(sheet.views) == 2
        assert {views.model.stat.center[2] for views in sheet.views.values()} == {0.1, 0.15}


def test_motors_are_shown(opengl):
    scene = mm.Motor()
    method = {"method": "variational/baoab", "timestep": 0.1, "duration": 50}
    runs = [mm.simulate(scene, **method, seed=seed) for seed in (1, 2)]
    (end,), boxes = drawn(runs, [scene, scene], ["seed 1", "seed 2"], 2, [50.0])
    one, other = (cut(end, box) for box in boxes)
    assert one.std() > 10
    assert np.abs(one - other)[60:-60, 40:-40].max() > 100


def test_forty_tiles_fit(opengl, runs, scenes):
    (frame,), boxes = drawn([runs[0]] * 40, [scenes[0]] * 40, ["tilt 0"] * 40, 8, [15.0])
    assert len({*boxes}) == 40
    for left, top, right, bottom in boxes:
        assert 0 <= left < right <= 1280
        assert HEADER <= top < bottom <= 720
        assert dark(cut(frame, (left, top, right, bottom))[:20, :60]).sum() > 30


def test_ctrl_c_ends_a_sheet_as_ctrl_c(opengl, runs, scenes, tmp_path, monkeypatch):
    def interrupted(self, i):
        raise KeyboardInterrupt

    monkeypatch.setattr(Sheet, "draw", interrupted)
    with pytest.raises(KeyboardInterrupt):
        mm.render.contact_sheet(runs, scenes, [*"abc"], tmp_path / "sheet.mp4", columns=3)


def test_what_cannot_be_shown_is_named(runs, scenes, tmp_path):
    def rejected(argument, runs=runs, scenes=scenes, labels=("a", "b", "c"), columns=3, **options):
        with refused(argument):
            mm.render.contact_sheet(
                runs, scenes, labels, tmp_path / "sheet.mp4", columns=columns, **options
            )

    rejected("len(runs)", runs=[])
    rejected("len(runs)", runs=[*runs, *runs], columns=1)
    rejected("len(scenes)", scenes=scenes[:2])
    rejected("len(labels)", labels=["a", "b"])
    rejected("columns", columns=0)
    rejected("columns", columns=9)
    rejected("columns", columns=cast(Any, 1.5))
    rejected("scene", scenes=[mm.Disk()] * 3)
    rejected("scene", scenes=[*scenes[:2], mm.Motor()])
    rejected("replicas", runs=[*runs[:2], runs[2].expand_dims(replica=2)])
    rejected("run", runs=[*runs[:2], runs[2].drop_vars("orientation")])
    rejected("speed", speed=0)
    assert not any(tmp_path.iterdir())


def test_what_a_contact_sheet_requires_of_a_device_is_named(opengl, rotor, monkeypatch, tmp_path):
    parts: list[str] = []

    def composed(self, scene, *, visual):
        spec = rotor.compose(scene, visual=visual)
        if "ball" in parts:
            spec.body("needle").add_geom(name="ball", size=[0.01, 0, 0])
        if "top" in parts:
            spec.worldbody.add_camera(name="top", pos=[0, 0, 1])
        return spec

    def shown(angle, add_position=True):
        scene = rotor.Rotor(angle=angle)  # a new one each time, since models are cached
        run = mm.simulate(scene, method="variational/baoab", timestep=0.01, duration=0.1)
        if add_position:
            run["position"] = (("time", "space"), np.zeros((run.sizes["time"], 3)))
            run = run.assign_coords(space=[*"xyz"])
        path = tmp_path / "sheet.mp4"
        mm.render.contact_sheet([run], [scene], ["a"], path, columns=1, speed=2.0)
        return path

    gauge = Gauge("angle", "rad", ("theta",), lambda run, _: run.theta.values, (), lambda _: 0.1)
    monkeypatch.setattr(rotor.RotorDevice, "gauge", gauge)
    monkeypatch.setattr(rotor.RotorDevice, "compose", composed)
    with refused("runs[0]"):
        shown(0.11, add_position=False)
    with refused("scene"):
        shown(0.12)
    monkeypatch.setattr(rotor.Rotor, "ball_radius", 0.01, raising=False)
    with refused("geom"):
        shown(0.13)
    parts.append("ball")
    with refused("camera"):
        shown(0.14)
    assert not any(tmp_path.iterdir())
    parts.append("top")
    assert len(decoded(shown(0.15))) == 2
