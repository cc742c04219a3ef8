"""Which OpenGL library draws: chosen before MuJoCo is imported, which is when it looks."""

import ctypes.util
import os
import sys

PACKAGES = {
    "Debian or Ubuntu": "sudo apt-get install libegl1 libgl1",
    "Fedora": "sudo dnf install mesa-libEGL mesa-libGL",
}


def choose_gl_backend() -> None:
    """On Linux, set MUJOCO_GL to EGL or else OSMesa, unless it is set or neither is there."""
    if sys.platform != "linux" or "MUJOCO_GL" in os.environ or "mujoco" in sys.modules:
        return
    for name, library in (("egl", "EGL"), ("osmesa", "OSMesa")):
        if ctypes.util.find_library(library):
            os.environ["MUJOCO_GL"] = name
            return
