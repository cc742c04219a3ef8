"""Frames without a display, by EGL and by OSMesa, each in a process of its own."""

import ctypes.util
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from magmotor.common import environment

MODEL = Path(__file__).parents[2] / "models" / "top.xml"

LIBRARIES = {"egl": ("EGL", "libegl1 libgl1"), "osmesa": ("OSMesa", "libosmesa6")}
"""What renders, by the value of MUJOCO_GL: the library, and its packages in Debian."""

PROGRAM = """
import ctypes.util, sys
model, path, *absent = sys.argv[1:]
find = ctypes.util.find_library
ctypes.util.find_library = lambda name: None if name in absent else find(name)
import magmotor  # selects an OpenGL library
import mujoco
import numpy as np

model = mujoco.MjModel.from_xml_path(model)
data = mujoco.MjData(model)
frames = {}
ball = model.geom_bodyid == model.body("ball").id
groups = model.geom_group[ball].copy()
with mujoco.Renderer(model, 360, 400) as renderer:
    for name, camera, shift, hidden in (
        ("front", "front", 0, 0), ("top", "top", 0, 0), ("front without ball", "front", 0, 5),
        ("top without ball", "top", 0, 5), ("moved", "front", 0.01, 0),
    ):
        model.camera(camera).pos[0] += shift
        model.geom_group[ball] = hidden or groups
        mujoco.mj_resetDataKeyframe(model, data, 0)
        mujoco.mj_forward(model, data)
        renderer.update_scene(data, camera)
        frames[name] = renderer.render()
np.savez(path, **frames)
print(mujoco.GLContext.__module__)
"""

STEP = 30
"""Difference of a color, of 255, beyond that of most pixels that two rasterizers draw."""

UNLIKE = 0.04
"""Share of the pixels that differ by more, from which frames show different views."""

LOST = 0.6
"""The same share of the ball's pixels, from which the ball is missing."""


def frames(folder, library, absent=(), **variables):
    """Return frames by camera, and the module that has opened OpenGL for them."""
    name, packages = LIBRARIES[library]
    if ctypes.util.find_library(name) is None:
        pytest.skip(f"no library {name}; on Debian: apt-get install {packages}")
    path = folder / f"{library}.npz"
    kept = {k: v for k, v in os.environ.items() if k not in ("MUJOCO_GL", "PYOPENGL_PLATFORM")}
    command = [sys.executable, "-W", "error", "-c", PROGRAM, MODEL, path, *absent]
    done = subprocess.run(
        command, env=kept | variables, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    with np.load(path) as found:
        return {camera: found[camera].astype(int) for camera in found}, done.stdout.strip()


def differ(one, other):
    """Return which pixels differ by more than `STEP`."""
    return abs(one - other).max(axis=-1) > STEP


def shares(by_egl, view, other):
    """Return which share of all pixels differs from a view by EGL, and of those of the ball."""
    unlike = differ(by_egl[view], other)
    ball = differ(by_egl[view], by_egl[f"{view} without ball"])
    assert ball.sum() > 50  # 186, 128
    return unlike.mean(), unlike[ball].mean()


@pytest.fixture(scope="module")
def by_egl(tmp_path_factory):
    found, module = frames(tmp_path_factory.mktemp("egl"), "egl", MUJOCO_GL="egl")
    assert module == "mujoco.egl"
    return found


def test_egl_and_osmesa_draw_the_same_top_by_one_rasterizer(by_egl, tmp_path):
    drawn, module = frames(tmp_path, "osmesa", MUJOCO_GL="osmesa", GALLIUM_DRIVER="llvmpipe")
    assert module == "mujoco.osmesa"
    for view in ("front", "top"):
        np.testing.assert_array_equal(by_egl[view], drawn[view])


def test_another_rasterizer_draws_the_same_top(by_egl, tmp_path):
    """Mesa's second one does not smooth edges."""
    drawn, module = frames(tmp_path, "osmesa", MUJOCO_GL="osmesa", GALLIUM_DRIVER="softpipe")
    assert module == "mujoco.osmesa"
    for view in ("front", "top"):
        whole, ball = shares(by_egl, view, drawn[view])
        assert whole < UNLIKE  # 0.013, 0.014
        assert ball < LOST  # 0.15, 0.30
        assert shares(by_egl, view, drawn[f"{view} without ball"])[1] > LOST  # 1, 1


def test_the_comparison_notices_other_views_and_blank_frames(by_egl):
    front = by_egl["front"]
    assert differ(front, by_egl["moved"]).mean() > UNLIKE  # 0.079, by a centimeter
    assert differ(front, by_egl["top"]).mean() > UNLIKE  # 0.10
    assert differ(front, front.mean(axis=(0, 1))).mean() > UNLIKE  # 0.060


def test_osmesa_renders_where_egl_is_absent(tmp_path):
    drawn, module = frames(tmp_path, "osmesa", absent=["EGL"])
    assert module == "mujoco.osmesa"
    assert drawn["front"].std() > 5  # 27


@pytest.mark.parametrize(
    ("found", "chosen"),
    [
        ({"EGL", "GL", "OSMesa"}, "egl"),
        ({"GL", "OSMesa"}, "osmesa"),
        ({"EGL", "OSMesa"}, "osmesa"),
        ({"EGL"}, "disable"),
    ],
)
def test_the_library_that_is_found_is_chosen_unless_the_user_has(monkeypatch, found, chosen):
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(ctypes.util, "find_library", lambda name: name if name in found else None)
    monkeypatch.delitem(sys.modules, "mujoco", raising=False)
    monkeypatch.setenv("MUJOCO_GL", "glfw")
    environment.choose_gl_backend()
    assert os.environ["MUJOCO_GL"] == "glfw"
    monkeypatch.delenv("MUJOCO_GL")
    environment.choose_gl_backend()
    assert os.environ["MUJOCO_GL"] == chosen
