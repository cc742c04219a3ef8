"""Access to C memory and C functions from compiled code.

No address is part of the compiled code: functions and variables are external symbols that are bound
when the code is loaded, so that cached code is valid in every process.
"""

import ctypes
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np

from magmotor.numerics import c_types as types
from magmotor.numerics import symbols
from magmotor.numerics.c_types import Signature
from magmotor.numerics.deferred import Deferred, External, Intrinsic, subroutine
from magmotor_plugin import slots
from magmotor_plugin.library import library

UNBOUNDED = 1 << 30
"""Length of arrays whose actual length is not looked up."""

ASLEEP = 0
"""mjS_ASLEEP, in `body_awake`."""

MULTIPLIER = np.uint64(0x9E3779B97F4A7C15)
"""Odd number that spreads bits: 2^64 over the golden ratio."""


def bind_function(name: str, function: Any) -> None:
    """Bind a ctypes function to the external symbol `name` of compiled code."""
    symbols.bind(name, ctypes.cast(function, ctypes.c_void_p).value or 0)


VARIABLES: dict[str, ctypes.c_int64] = {}
STORAGES: dict[str, Any] = {}
"""The variables by symbol, and the memory whose addresses are in some of them."""


def bind_variable(name: str, variable: ctypes.c_int64) -> None:
    """Bind a ctypes variable to the external symbol `name` of compiled code."""
    VARIABLES[name] = variable
    symbols.bind(name, ctypes.addressof(variable))


def bind_storage(name: str, storage: Any) -> None:
    """Bind a variable with the address of ctypes words to the external symbol `name`."""
    STORAGES[name] = storage
    bind_variable(name, VARIABLES.get(name) or ctypes.c_int64(ctypes.addressof(storage)))


def bind_compiled(name: str, function: Any) -> None:
    """Bind a C function that Numba has compiled to the external symbol `name` of other code.

    What is compiled separately is neither compiled nor optimized again with each of its callers.
    """
    symbols.bind(name, function.address)


def bind_unused(*names: str) -> None:
    """Bind symbols of compiled code to nothing, in a process that compiles and does not call it."""
    for name in names:
        symbols.bind(name, 1)


def bind_mujoco(*names: str) -> None:
    """Bind functions of MuJoCo's C library to their own names in compiled code."""
    for name in names:
        bind_function(name, getattr(library(), name))


bind_mujoco("mj_markStack", "mj_stackAllocByte", "mj_freeStack")

_slot = ctypes.c_int64(slots.register())
_magnetometer_slot = ctypes.c_int64(slots.slot(slots.MAGNETOMETER))
bind_variable("magmotor_plugin_slot", _slot)
bind_variable("magmotor_magnetometer_slot", _magnetometer_slot)

mark_stack = External("mj_markStack", types.void(types.int64))
"""Mark the top of the stack of an mjData."""

allocate = External("mj_stackAllocByte", types.int64(types.int64, types.uint64, types.uint64))
"""Allocate bytes with an alignment on the stack of an mjData, and return their address."""

free_stack = External("mj_freeStack", types.void(types.int64))
"""Free everything allocated since the last mark."""


_on_stack = partial(Intrinsic, "memory", "on_stack")
"""Return a compiled function that returns the address of some 64-bit zeros.

It is valid until the calling function returns.
"""

word_on_stack = _on_stack(1)
pair_on_stack = _on_stack(2)
error_on_stack = _on_stack(5)
details_on_stack = _on_stack(16)
row_on_stack = _on_stack(17)


_pointer = Intrinsic("memory", "pointer")
_array_at = Deferred(lambda: import_module("numba").carray)

load_shared = Intrinsic("memory", "load_shared")
"""Load the word at an address that other threads may store, and what they stored before it."""

store_shared = Intrinsic("memory", "store_shared")
"""Store a word at an address for other threads, after all that was stored before it."""

borrowed = Intrinsic("memory", "borrowed")
"""Return a caller's array, or a tuple of some, without reference counts, which slow loops.

The caller keeps the arrays; what is returned must not leave compiled code.
"""


@subroutine(forceinline=True)
def words(address, count):
    """Return an array of `count` 64-bit integers at an address."""
    return _array_at(_pointer(address), (count,), np.int64)


@subroutine(forceinline=True)
def records(address, count, kind):
    """Return an array of `count` records of a type at an address."""
    return _array_at(_pointer(address), (count,), kind)


@subroutine(forceinline=True)
def integers(address, count):
    """Return an array of `count` C ints at an address, as unsigned integers."""
    return _array_at(_pointer(address), (count,), np.uint32)


@subroutine(forceinline=True)
def bytes_at(address, count):
    """Return an array of `count` bytes at an address."""
    return _array_at(_pointer(address), (count,), np.uint8)


@subroutine
def starts_with(address, prefix):
    """Whether the C string at an address starts with the bytes of `prefix`, a tuple."""
    characters = bytes_at(address, len(prefix))
    k = 0
    while k < len(prefix) and characters[k] == prefix[k]:
        k += 1
    return k == len(prefix)


@subroutine
def spread(address, bits):
    """Return a number of some bits, which differs for addresses that are near."""
    return np.int64((np.uint64(address) * MULTIPLIER) >> np.uint64(64 - bits))


@subroutine(forceinline=True)
def numbers(address, rows, columns):
    """Return a `rows` x `columns` array of doubles at an address."""
    return _array_at(_pointer(address), (rows, columns), np.float64)


@subroutine(forceinline=True)
def singles(address, rows, columns):
    """Return a `rows` x `columns` array of floats in single precision at an address."""
    return _array_at(_pointer(address), (rows, columns), np.float32)


@subroutine(forceinline=True)
def rows_of_integers(address, rows, columns):
    """Return a `rows` x `columns` array of C ints at an address, as unsigned integers."""
    return _array_at(_pointer(address), (rows, columns), np.uint32)


@subroutine(forceinline=True)
def from_column(array, first):
    """Return a view of a matrix from column `first` on; unlike a slice, it has the same type."""
    return numbers(array.ctypes.data + 8 * first, array.shape[0], array.shape[1])


@subroutine(forceinline=True)
def any_number(array, row, first, last):
    """Whether a row has nonzero numbers in columns `first` to `last` - 1."""
    present = False
    for k in range(first, last):
        present = present or array[row, k] != 0.0
    return present


@subroutine(forceinline=True)
def all_finite(array, row, columns):
    """Whether the first columns of a row are finite numbers."""
    total = 0.0
    for k in range(columns):
        total += 0.0 * array[row, k]
    return total == 0.0


address_of = partial(Intrinsic, "memory", "address_of")
"""Return a compiled function that returns the address bound to a symbol."""

variable = partial(Intrinsic, "memory", "variable")
"""Return a compiled function that reads a 64-bit integer, bound by `bind_variable`."""


def function_at(name: str, signature: Signature) -> Any:
    """Return a compiled function that calls a C function, whose address is in a bound variable.

    It takes a tuple of the arguments. Unlike the address of a symbol, this one may be set after the
    caller has been compiled.
    """
    address, call = variable(name), Intrinsic("memory", "call_at", str(signature))

    @subroutine(forceinline=True)
    def function(arguments):
        return call(address(), arguments)

    return function


plugin_slot = variable("magmotor_plugin_slot")
magnetometer_slot = variable("magmotor_magnetometer_slot")
"""Slots of the plugins in MuJoCo's table."""
