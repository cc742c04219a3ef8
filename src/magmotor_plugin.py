"""The engine plugin `magmotor.forces`, which makes magnetism a part of a MuJoCo model.

MuJoCo 4 and newer call `register` whenever `mujoco` is imported, through the entry point group
`mujoco.plugins`; `import magmotor` calls it, too. It compiles nothing and imports only ctypes. The
compiled code takes its place in MuJoCo's table when the first model with the plugin is compiled.
"""

import _thread
import ctypes
import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, wraps
from importlib.util import find_spec
from pathlib import Path
from typing import Any

NAME = b"magmotor.forces"
KEY = b"act"
"""The only key of the plugin's configuration: which forces act."""

PASSIVE = 1 << 2
"""mjPLUGIN_PASSIVE."""

FAILED = -1
"""Result of `init` for which MuJoCo raises an error."""

SLOW = 3.0
"""Seconds after which loading is explained."""

_COMPILING = "magmotor: compiling the forces, once after installation, for about half a minute"
_FORKED = (
    "this process was forked while another thread loaded the forces, which are missing here;"
    " compile a model before, or use the start method 'spawn'"
)
_ATTRIBUTES = (ctypes.c_char_p * 1)(KEY)
_NSTATE = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_int)
_INIT = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)
_RESET = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)
_COMPUTE = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int, ctypes.c_int)


class Plugin(ctypes.Structure):
    """MuJoCo's mjpPlugin."""

    _fields_ = [
        ("name", ctypes.c_char_p),
        ("nattribute", ctypes.c_int),
        ("attributes", ctypes.POINTER(ctypes.c_char_p)),
        ("capabilityflags", ctypes.c_int),
        ("needstage", ctypes.c_int),
        ("nstate", ctypes.c_void_p),
        ("nsensordata", ctypes.c_void_p),
        ("init", ctypes.c_void_p),
        ("destroy", ctypes.c_void_p),
        ("copy", ctypes.c_void_p),
        ("reset", ctypes.c_void_p),
        ("compute", ctypes.c_void_p),
        ("unused", ctypes.c_void_p * 9),  # functions for other kinds of plugins
    ]


@cache
def register() -> int:
    """Register the plugin with MuJoCo, and return its slot.

    Raises
    ------
    ImportError
        MuJoCo is not installed, or its library is missing.
    """
    plugin = Plugin()
    library().mjp_defaultPlugin(ctypes.byref(plugin))
    plugin.name, plugin.capabilityflags = NAME, PASSIVE
    plugin.nattribute, plugin.attributes = 1, _ATTRIBUTES
    for member, function in _STUBS.items():
        setattr(plugin, member, ctypes.cast(function, ctypes.c_void_p).value)
    return library().mjp_registerPlugin(ctypes.byref(plugin))


def register_with_older_mujoco() -> None:
    """Register the plugin if `mujoco` has been imported, or would not load entry points.

    MuJoCo numbers plugins in the order of their registration, and stores the numbers in binary
    models. Therefore, its own plugins must come first.
    """
    if "mujoco" in sys.modules or not _loads_entry_points():
        import mujoco  # noqa: F401 - registers MuJoCo's own plugins

        register()


def _loads_entry_points() -> bool:
    """Whether the installed MuJoCo is 4 or newer, by its header: importlib.metadata is slow."""
    for folder in _folders():
        header = Path(folder) / "include" / "mujoco" / "mujoco.h"
        if header.exists():
            version = header.read_text(encoding="utf-8").partition("mjVERSION_HEADER")[2].split()
            return bool(version) and int(version[0]) >= 4_000_000
    return False


def _folders() -> list[str]:
    """Return the folders of the package mujoco, without importing it."""
    spec = find_spec("mujoco")
    return [*(spec.submodule_search_locations or [])] if spec else []


@cache
def library() -> ctypes.CDLL:
    """Return MuJoCo's C library.

    Raises
    ------
    ImportError
        MuJoCo is not installed, or its library is missing.
    """
    for folder in _folders():
        for pattern in ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll"):
            for path in Path(folder).glob(pattern):
                return ctypes.CDLL(str(path))
    raise ImportError("there is no MuJoCo library: pip install mujoco")


def returning(function: Callable) -> Callable:
    """Make a function return None instead of raising, for use as a C callback.

    A C callback that raises returns an undefined value. Ctrl-C is delivered a little later.
    """

    @wraps(function)
    def call(*arguments: Any) -> Any:
        try:
            return function(*arguments)
        except KeyboardInterrupt:
            _interrupt_later()
        except BaseException:
            _print_exception()
        return None

    return call


def _print_exception() -> None:
    import traceback

    traceback.print_exc()


def _interrupt_later() -> None:
    threading.Timer(0.05, _thread.interrupt_main).start()


@_NSTATE
def _nstate(model, instance):
    """Load the compiled code, since this is the first function that MuJoCo calls."""
    _ensure_loaded()
    return 0


@_INIT
def _init(model, data, instance):
    """Called if no model with the plugin has been compiled, but one was loaded from a file."""
    if not _ensure_loaded():
        return FAILED
    if not getattr(_this_thread, "probes", False):
        from magmotor.mjcf.callbacks import prepare

        prepare(model, data, instance)
    return 0


@_RESET
def _reset(model, state, data, instance):
    """Required by MuJoCo; the plugin has no state."""


@_COMPUTE
def _compute(model, data, instance, capability):
    """Replaced by compiled code, except while that code is being loaded."""


_STUBS = {"nstate": _nstate, "init": _init, "reset": _reset, "compute": _compute}
_lock = threading.Lock()
_loading = _loaded = _failed = False
_this_thread = threading.local()


@contextmanager
def without_code() -> Iterator[None]:
    """Compile models with the plugin in this thread without loading its code; it does nothing."""
    _this_thread.probes = True
    try:
        yield
    finally:
        _this_thread.probes = False


def _ensure_loaded() -> bool:
    """Load the compiled code once, in a new thread; return whether it could be loaded.

    Loading calls MuJoCo, which must not happen in a thread that is inside of MuJoCo: its errors
    would jump to the innermost call. Ctrl-C is delivered afterwards.
    """
    global _loading
    interrupted = False
    while not (_loaded or _failed or getattr(_this_thread, "probes", False)):
        try:
            with _lock:
                if not (_loaded or _failed):
                    _loading = True
                    loader = threading.Thread(target=_load)
                    loader.start()
                    loader.join()
                    _loading = False
        except KeyboardInterrupt:
            interrupted = True
    if interrupted:
        _interrupt_later()
    return not _failed


def _after_fork() -> None:
    """Give up in a child whose parent was loading: its locks are held by threads that are gone."""
    global _lock, _loading, _failed
    _lock = threading.Lock()
    if _loading:
        _loading, _failed = False, True
        print(f"magmotor: {_FORKED}", file=sys.stderr)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)


def _load() -> None:
    global _loaded, _failed
    notice = threading.Timer(SLOW, print, (_COMPILING,), {"file": sys.stderr})
    notice.start()
    try:
        from magmotor.mjcf.callbacks import compiled_plugin

        found = library().mjp_getPluginAtSlot
        found.restype = ctypes.POINTER(Plugin)
        init, compute = compiled_plugin()
        table = found(register()).contents
        table.compute, table.init = compute.address, init.address
        _loaded = True
    except BaseException:
        _print_exception()
        _failed = True
    finally:
        notice.cancel()
