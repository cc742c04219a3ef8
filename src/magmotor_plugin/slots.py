"""The plugins in MuJoCo's table, and the functions in their place until their code is loaded."""

import ctypes
import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from types import ModuleType
from typing import Any

from magmotor_plugin.c_callbacks import (
    called_by_c,
    interrupt_later,
    interrupted,
    print_exception,
)
from magmotor_plugin.library import library

NAMES = FORCES, MAGNETOMETER = b"magmotor.forces", b"magmotor.magnetometer"
"""The names of the plugins."""

KEY = b"act"
"""The only key of the configuration of the forces: which of them act."""

ACTUATOR, SENSOR, PASSIVE = 1, 1 << 1, 1 << 2
"""mjPLUGIN_ACTUATOR, mjPLUGIN_SENSOR and mjPLUGIN_PASSIVE."""

ACCELERATION_STAGE = 3
"""mjSTAGE_ACC, which finite differences with respect to controls repeat."""

PROBED = 3
"""Numbers of the state of a model without code, whose layout is to be seen."""

FAILED = -1
"""Result of `init` for which MuJoCo raises an error."""

_FORKED = (
    "this process was forked while another thread loaded the forces, which are missing here;"
    " compile a model before, or use the start method 'spawn'"
)
_ATTRIBUTES = (ctypes.c_char_p * 1)(KEY)
_NSENSORDATA = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_int, ctypes.c_int)
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
        ("advance", ctypes.c_void_p),
        ("unused", ctypes.c_void_p * 8),  # functions for other kinds of plugins
    ]


def register() -> int:
    """Register the plugins with MuJoCo, and return the slot of the forces.

    Raises
    ------
    ImportError
        MuJoCo is not installed, or its library is missing.
    """
    forces = slot(FORCES)
    slot(MAGNETOMETER)
    return forces


@cache
def slot(name: bytes) -> int:
    """Register a plugin, and return its slot.

    A program in C that embeds Python may have registered its own, which serves Python, too.
    """
    find, found = library().mjp_getPlugin, ctypes.c_int()
    find.restype = ctypes.c_void_p
    if find(name, ctypes.byref(found)):
        return found.value
    plugin = described(name)
    for member, function in STUBS[name].items():
        setattr(plugin, member, ctypes.cast(function, ctypes.c_void_p).value)
    return library().mjp_registerPlugin(ctypes.byref(plugin))


def described(name: bytes) -> Plugin:
    """Return a plugin without its functions."""
    plugin = Plugin()
    library().mjp_defaultPlugin(ctypes.byref(plugin))
    plugin.name = name
    if name == FORCES:
        # MuJoCo passes the actuator's stage only to plugins that claim to be actuators.
        plugin.capabilityflags = PASSIVE | ACTUATOR
        plugin.nattribute, plugin.attributes = 1, _ATTRIBUTES
    else:
        plugin.capabilityflags, plugin.needstage = SENSOR, ACCELERATION_STAGE
    return plugin


def callbacks() -> ModuleType:
    """Return the module with the compiled code; `magmotor_plugin` replaces this, and knows it."""
    raise NotImplementedError


class _Code:
    """The compiled functions of one plugin, and the functions in their place until they are loaded.

    Loading calls MuJoCo, which must not happen in a thread that is inside of MuJoCo: its errors
    would jump to the innermost call. Therefore a new thread loads.
    """

    def __init__(self, name: bytes):
        self._name = name
        self._lock = threading.Lock()
        self.loading = self._loaded = False
        self._failed = ""  # or why nothing could be loaded
        self._nstate: Any = lambda model, instance: 0

    def ensure_loaded(self) -> bool:
        """Load the code once; return whether that has not failed.

        Ctrl-C ends the loading. Until it is delivered, nothing is loaded, and nothing has failed.
        """
        probes = getattr(_this_thread, "probes", False)
        while not (self._loaded or self._failed or probes or interrupted.is_set()):
            try:
                with self._lock:
                    if not (self._loaded or self._failed):
                        self._load_beside()
            except KeyboardInterrupt:
                interrupt_later()
        return not self._failed

    def _load_beside(self) -> None:
        """Load the code in a new thread, which Ctrl-C ends, too."""
        loader = threading.Thread(target=self._load)
        self.loading = True
        try:
            loader.start()
            loader.join()
        except KeyboardInterrupt:
            time.sleep(0.1)  # until it has started
            stop = ctypes.py_object(KeyboardInterrupt)
            while loader.is_alive():
                ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(loader.ident or 0), stop)
                loader.join(1.0)  # code that ignores exceptions may have received this one
            raise
        finally:
            self.loading = False

    def _load(self) -> None:
        try:
            for member, function in callbacks().compiled_plugin(self._name).items():
                if member == "nstate":  # the stub calls it, since it also serves probes
                    self._nstate = _NSTATE(function.address)
                else:
                    setattr(self._table(), member, function.address)
            self._loaded = True
        except KeyboardInterrupt:
            pass
        except BaseException as error:
            if not isinstance(error, ModuleNotFoundError):
                print_exception()
            self._failed = str(error) or type(error).__name__

    def _table(self) -> Any:
        """Return MuJoCo's entry of this plugin."""
        found = library().mjp_getPluginAtSlot
        found.restype = ctypes.POINTER(Plugin)
        return found(slot(self._name)).contents

    def _prepare(self, model: int, data: int, instance: int) -> None:
        """Do what the compiled `init` would have done for an mjData."""
        if self._name != FORCES or not self._loaded:
            return
        prepare = callbacks().prepare
        try:
            prepare(model, data, instance)
        except KeyboardInterrupt:
            interrupt_later()  # after the second attempt, which it cannot end
            prepare(model, data, instance)

    def after_fork(self) -> None:
        """Give up in a child whose parent was loading, whose lock a thread holds that is gone."""
        self._lock = threading.Lock()
        if self.loading:
            self.loading, self._failed = False, _FORKED
            print(f"magmotor: {_FORKED}", file=sys.stderr)

    def stubs(self) -> dict[str, Any]:
        """Return the functions of the plugin until its code is loaded."""

        @_NSTATE
        @called_by_c
        def nstate(model, instance):
            """Load the compiled code, since this is the first function that MuJoCo calls."""
            if getattr(_this_thread, "probes", False):
                return PROBED
            self.ensure_loaded()
            return self._nstate(model, instance)

        @_INIT
        @called_by_c
        def init(model, data, instance):
            """Called if a model was loaded from a file, and none with the plugin was compiled."""
            if not self.ensure_loaded():
                # MuJoCo's compiler adds warnings to its error.
                library().mju_warning(b"%s", self._failed.encode())
                return FAILED
            self._prepare(model, data, instance)
            return 0

        @_COMPUTE
        @called_by_c
        def compute(model, data, instance, capability):
            """Called if Ctrl-C ended the loading, but not the program."""
            self.ensure_loaded()
            if self._loaded:
                self._prepare(model, data, instance)
                _COMPUTE(self._table().compute)(model, data, instance, capability)

        return {"nstate": nstate, "init": init, "reset": _reset, "compute": compute}


@_RESET
@called_by_c
def _reset(model, state, data, instance):
    """Required by MuJoCo; nothing has been loaded that has a state."""


@_NSENSORDATA
@called_by_c
def _nsensordata(model, instance, sensor):
    """Return the number of components of a magnetometer."""
    return 3


_this_thread = threading.local()
_forces, _magnetometer = _Code(FORCES), _Code(MAGNETOMETER)
STUBS = {
    FORCES: _forces.stubs(),
    MAGNETOMETER: _magnetometer.stubs() | {"nsensordata": _nsensordata},
}


@contextmanager
def without_code() -> Iterator[None]:
    """Compile models with the plugins in this thread without loading code; they do nothing."""
    _this_thread.probes = True
    try:
        yield
    finally:
        _this_thread.probes = False


def _after_fork() -> None:
    for code in (_forces, _magnetometer):
        code.after_fork()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)
