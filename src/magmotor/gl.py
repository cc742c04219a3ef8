"""Which OpenGL library draws: chosen before MuJoCo is imported, which is when it looks."""

import ctypes.util
import os
import sys

PACKAGES = {
    "Debian or Ubuntu": "sudo apt-get install libegl1 libgl1",
    "Fedora": "sudo dnf install mesa-libEGL mesa-libGL mesa-dri-drivers",
}


def choose_gl_backend() -> None:
    """On Linux, set MUJOCO_GL to EGL, OSMesa or, where neither is found, to none, unless it is set.

    With none, MuJoCo and dm_control import and simulate without a word, and only drawing fails.
    """
    if sys.platform != "linux" or "MUJOCO_GL" in os.environ or "mujoco" in sys.modules:
        return
    found = ctypes.util.find_library
    if found("EGL") and (found("GL") or found("OpenGL")):
        os.environ["MUJOCO_GL"] = "egl"
    elif found("OSMesa"):
        os.environ["MUJOCO_GL"] = "osmesa"
    else:
        os.environ["MUJOCO_GL"] = "disable"
