"""Where Numba keeps compiled code if neither the package nor a home can hold it."""

import os
import stat
import sys


def choose_cache_folder() -> None:
    """Set NUMBA_CACHE_DIR to a private folder in the temporary one where Numba would find none.

    Numba looks in the folders of the package, then in the user's cache; with neither, it raises.
    What lies in a cache is run: a folder that others own or can write to is never used.

    Raises
    ------
    RuntimeError
        There is no such folder, and none can be made.
    """
    chosen = os.environ.keys() & {"NUMBA_CACHE_DIR", "NUMBA_CACHE_LOCATOR_CLASSES"}
    if chosen or not hasattr(os, "getuid"):  # on Windows, there is always a home
        return
    package = os.path.dirname(__file__)  # noqa: PTH120
    home = os.environ.get("XDG_CACHE_HOME", os.path.expanduser("~/.cache"))  # noqa: PTH111
    if _can_hold(f"{package}/__pycache__") or _can_hold(f"{home}/numba"):
        return
    try:
        folder = _private_folder()
    except OSError as error:
        raise RuntimeError(
            f"no place for compiled code: {package} and {home} cannot be written to, nor can a"
            f" private folder be made ({error}); set NUMBA_CACHE_DIR to a folder of your own"
        ) from None
    os.environ["NUMBA_CACHE_DIR"] = folder
    if "numba" in sys.modules:
        sys.modules["numba"].config.CACHE_DIR = folder


def _can_hold(folder: str) -> bool:
    """Whether this user can write to a folder, or make it, and no stranger has or can."""
    folder = os.path.abspath(folder)  # noqa: PTH100
    while not os.path.lexists(folder):
        folder = os.path.dirname(folder)  # noqa: PTH120
    if not os.path.isdir(folder) or not os.access(folder, os.W_OK | os.X_OK):  # noqa: PTH112
        return False
    found = os.stat(folder)  # noqa: PTH116
    others = 0o002 if found.st_gid == os.getgid() else 0o022
    return found.st_uid in (0, os.getuid()) and not found.st_mode & others


def _private_folder() -> str:
    """A folder of this user's in the temporary one, which nobody else can write to."""
    import tempfile

    folder = f"{tempfile.gettempdir()}/magmotor-{os.getuid()}"
    os.makedirs(folder, mode=0o700, exist_ok=True)  # noqa: PTH103
    found = os.lstat(folder)
    private = stat.S_ISDIR(found.st_mode) and not found.st_mode & 0o022
    if not private or found.st_uid != os.getuid():
        raise PermissionError(f"{folder} is another user's, or others can write to it")
    return folder
