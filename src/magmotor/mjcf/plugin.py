"""The engine plugin `magmotor.forces`: magnetism, noise and potentials as a part of the model.

MuJoCo calls it wherever it computes passive forces. Registration compiles nothing and needs no
Numba, since it may run whenever MuJoCo is imported; the compiled code takes its place in MuJoCo's
table when the first `mjData` of a model with the plugin is made.
"""

import ctypes
import threading
import warnings
from functools import cache
from typing import Any

NAME = b"magmotor.forces"
ATTRIBUTES = (ctypes.c_char_p * 1)(b"act")
PASSIVE = 1 << 2
"""mjPLUGIN_PASSIVE."""

_COUNT = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_int)
_INIT = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)
_RESET = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)
_COMPUTE = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int, ctypes.c_int)


class Plugin(ctypes.Structure):
    """MuJoCo's mjpPlugin, as far as its first `compute`; the rest stays empty."""

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
        ("rest", ctypes.c_void_p * 9),
    ]


@_COUNT
def _no_state(model, instance):
    return 0


@_INIT
def _load(model, data, instance):
    """Put the compiled code into MuJoCo's table, when the first mjData is made.

    In a thread of its own: MuJoCo's errors jump back to the last call of their thread.
    """
    if _loading.locked():  # by `load`, which makes the mjData of a probe
        return 0
    thread = threading.Thread(target=_try_to_load)
    thread.start()
    thread.join()
    return -1 if _failures else 0


_loading = threading.Lock()
_failures: list[BaseException] = []


def _try_to_load() -> None:
    try:
        with _loading:
            load()
    except BaseException as error:
        _failures.append(error)
        warnings.warn(f"{NAME.decode()}: {error}", stacklevel=1)


@_RESET
def _reset(model, state, data, instance):
    """Nothing is kept that could be reset."""


@_COMPUTE
def _compute(model, data, instance, capability):
    """Never called: `init` comes first, and replaces it."""


@cache
def register() -> int:
    """Register the plugin with MuJoCo; returns its slot."""
    mujoco = _library()
    plugin = Plugin()
    mujoco.mjp_defaultPlugin(ctypes.byref(plugin))
    plugin.name, plugin.capabilityflags = NAME, PASSIVE
    plugin.nattribute, plugin.attributes = 1, ATTRIBUTES
    for member, function in (
        ("nstate", _no_state), ("init", _load), ("reset", _reset), ("compute", _compute),
    ):  # fmt: skip
        setattr(plugin, member, ctypes.cast(function, ctypes.c_void_p).value)
    return mujoco.mjp_registerPlugin(ctypes.byref(plugin))


@cache
def load() -> Any:
    """Load the compiled code and have MuJoCo call it."""
    from magmotor.mjcf.magnetism import compiled_plugin

    function = compiled_plugin()
    find = _library().mjp_getPluginAtSlot
    find.restype = ctypes.POINTER(Plugin)
    find(register()).contents.compute = function.address
    return function


@cache
def _library() -> ctypes.CDLL:
    """MuJoCo's own C library, which is loaded already."""
    from importlib.util import find_spec
    from pathlib import Path

    spec = find_spec("mujoco")
    folder = Path(spec.submodule_search_locations[0])
    for pattern in ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll"):
        for path in folder.glob(pattern):
            return ctypes.CDLL(str(path))
    raise ImportError(f"no MuJoCo library in {folder}")
