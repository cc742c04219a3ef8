"""The environment: OpenGL backend, cache for compiled code, memory, threads, MJCF folder."""

import ctypes.util
import math
import os
import stat
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


def choose_cache_folder() -> None:
    """Set NUMBA_CACHE_DIR to a private temporary folder if Numba's default ones cannot be used.

    Numba tries the package's folders, then the user's cache, and raises if both fail. Cached code
    is executed, so a folder that others own or can write to is never used.

    Raises
    ------
    RuntimeError
        No such folder exists, and none can be created.
    """
    chosen = os.environ.keys() & {"NUMBA_CACHE_DIR", "NUMBA_CACHE_LOCATOR_CLASSES"}
    if chosen or not hasattr(os, "getuid"):  # Windows always has a home directory
        return
    package = os.path.dirname(os.path.dirname(__file__))  # noqa: PTH120
    home = os.environ.get("XDG_CACHE_HOME", os.path.expanduser("~/.cache"))  # noqa: PTH111
    if _can_hold(f"{package}/__pycache__") or _can_hold(f"{home}/numba"):
        return
    try:
        folder = _private_folder()
    except OSError as error:
        raise RuntimeError(
            f"no place for compiled code: {package} and {home} are not writable, and no private"
            f" folder can be created ({error}); set NUMBA_CACHE_DIR to a folder of your own"
        ) from None
    os.environ["NUMBA_CACHE_DIR"] = folder
    if "numba" in sys.modules:
        sys.modules["numba"].config.CACHE_DIR = folder


def _can_hold(folder: str) -> bool:
    """Whether this user can write to a folder or create it, and other users cannot write to it."""
    folder = os.path.abspath(folder)  # noqa: PTH100
    while not os.path.lexists(folder):
        folder = os.path.dirname(folder)  # noqa: PTH120
    if not os.path.isdir(folder) or not os.access(folder, os.W_OK | os.X_OK):  # noqa: PTH112
        return False
    found = os.stat(folder)  # noqa: PTH116
    others = 0o002 if found.st_gid == os.getgid() else 0o022
    return found.st_uid in (0, os.getuid()) and not found.st_mode & others


def _private_folder() -> str:
    """Create a temporary folder that only this user can write to, and return its path."""
    import tempfile

    folder = f"{tempfile.gettempdir()}/magmotor-{os.getuid()}"
    os.makedirs(folder, mode=0o700, exist_ok=True)  # noqa: PTH103
    found = os.lstat(folder)
    private = stat.S_ISDIR(found.st_mode) and not found.st_mode & 0o022
    if not private or found.st_uid != os.getuid():
        raise PermissionError(f"{folder} belongs to another user, or others can write to it")
    return folder


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
