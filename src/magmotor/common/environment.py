"""The environment: OpenGL backend, memory, threads, MJCF folder."""

import ctypes.util
import math
import os
import sys
from pathlib import Path

PACKAGES = {
    "Debian or Ubuntu": "sudo apt-get install libegl1 libgl1",
    "Fedora": "sudo dnf install mesa-libEGL mesa-libGL mesa-dri-drivers",
}


def choose_gl_backend() -> None:
    """On Linux, set MUJOCO_GL to `egl`, `osmesa` or, if neither is found, `disable`, unless set.

    With `disable`, MuJoCo and dm_control import and simulate silently; only rendering fails.
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


def gl_setting() -> str:
    """Return in words how the OpenGL backend was chosen, and what to do if that was too late."""
    setting = os.environ.get("MUJOCO_GL")
    if setting == "glfw":
        return "MUJOCO_GL=glfw needs a display: set it to egl or osmesa, or unset it"
    if setting is not None:
        return f"MUJOCO_GL={setting}"
    if sys.platform != "linux":
        return "MUJOCO_GL is not set"
    return "mujoco was imported first: import magmotor before it, or set MUJOCO_GL to egl or osmesa"


def physical_memory() -> float:
    """Physical memory in bytes; infinite if the system does not report it."""
    if not hasattr(os, "sysconf"):  # Windows
        return math.inf
    return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))


def thread_count() -> int:
    """OMP_NUM_THREADS, by which workers and clusters divide processors, or else all processors."""
    setting = os.environ.get("OMP_NUM_THREADS", "")
    return int(setting) if setting.isdecimal() and int(setting) > 0 else os.cpu_count() or 1


def data_folder(name: str) -> Path:
    """Return `models` or `examples`: in the installed package, or next to `src` in a checkout."""
    package = Path(__file__).parents[1]
    for folder in (package / name, package.parents[1] / name):
        if folder.is_dir():
            return folder
    raise FileNotFoundError(f"no folder named {name} in {package} or {package.parents[1]}")
