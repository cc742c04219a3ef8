"""Access to C memory and C functions from compiled code.

No address is part of the compiled code: functions and variables are external symbols that are bound
when the code is loaded, so that cached code is valid in every process.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import ctypes
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import mujoco
import numpy as np
from llvmlite import ir
from numba import carray, njit, types
from numba.core import cgutils
from numba.extending import intrinsic

UNBOUNDED = 1 << 30
"""Length of arrays whose actual length is not looked up."""


def bind_function(name: str, function: Any) -> None:
    """Bind a ctypes function to the external symbol `name` of compiled code."""
    llvm.add_symbol(name, ctypes.cast(function, ctypes.c_void_p).value)


def bind_variable(name: str, variable: ctypes.c_int64) -> None:
    """Bind a ctypes variable to the external symbol `name` of compiled code."""
    llvm.add_symbol(name, ctypes.addressof(variable))


def library() -> ctypes.CDLL:
    """Return MuJoCo's C library, which the Python package has already loaded."""
    folder = Path(mujoco.__file__).parent
    patterns = ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll")
    found = [path for pattern in patterns for path in folder.glob(pattern)]
    if not found:
        raise ImportError(f"no MuJoCo library next to {mujoco.__file__}")
    return ctypes.CDLL(str(found[0]))


for _name in ("mju_error", "mj_markStack", "mj_stackAllocByte", "mj_freeStack"):
    bind_function(_name, getattr(library(), _name))

mark_stack = types.ExternalFunction("mj_markStack", types.void(types.int64))
"""Mark the top of the stack of an mjData."""

allocate = types.ExternalFunction(
    "mj_stackAllocByte", types.int64(types.int64, types.uint64, types.uint64)
)
"""Allocate bytes with an alignment on the stack of an mjData, and return their address."""

free_stack = types.ExternalFunction("mj_freeStack", types.void(types.int64))
"""Free everything allocated since the last mark."""


@intrinsic
def _pointer(typingctx, address):
    """Convert an integer address to a pointer."""

    def codegen(context, builder, signature, args):
        return builder.inttoptr(args[0], cgutils.voidptr_t)

    return types.voidptr(address), codegen


@njit(forceinline=True)
def words(address, count):
    """Return an array of `count` 64-bit integers at an address."""
    return carray(_pointer(address), (count,), np.int64)


@njit(forceinline=True)
def integers(address, count):
    """Return an array of `count` C ints at an address, as unsigned integers."""
    return carray(_pointer(address), (count,), np.uint32)


@njit
def starts_with(address, prefix):
    """Whether the C string at an address starts with the bytes of `prefix`, a tuple."""
    characters = carray(_pointer(address), (len(prefix),), np.uint8)
    k = 0
    while k < len(prefix) and characters[k] == prefix[k]:
        k += 1
    return k == len(prefix)


@njit(forceinline=True)
def numbers(address, rows, columns):
    """Return a `rows` x `columns` array of doubles at an address."""
    return carray(_pointer(address), (rows, columns), np.float64)


@njit(forceinline=True)
def borrowed(array):
    """Return a view of a caller's array without reference counting, which slows loops down."""
    return carray(_pointer(array.ctypes.data), array.shape, array.dtype)


@njit(forceinline=True)
def from_column(array, first):
    """Return a view of a matrix from column `first` on; unlike a slice, it has the same type."""
    return numbers(array.ctypes.data + 8 * first, array.shape[0], array.shape[1])


@njit(forceinline=True)
def any_number(array, row, first, last):
    """Whether a row has nonzero numbers in columns `first` to `last` - 1."""
    present = False
    for k in range(first, last):
        present = present or array[row, k] != 0.0
    return present


def _error(context, builder, text, pairs):
    """Call `mju_error` with pairs of a number and the address of a C string."""
    arguments = []
    for number, name in pairs:
        arguments.append(builder.trunc(number, ir.IntType(32)))
        arguments.append(builder.inttoptr(name, cgutils.voidptr_t))
    return _call_error(context, builder, text, arguments)


def _call_error(context, builder, text, arguments):
    """Call `mju_error` with a format and its arguments."""
    message = context.insert_const_string(builder.module, text)
    kind = ir.FunctionType(ir.VoidType(), [cgutils.voidptr_t], var_arg=True)
    function = cgutils.get_or_insert_function(builder.module, kind, "mju_error")
    builder.call(function, [message, *arguments])
    return context.get_dummy_value()


@intrinsic
def fatal_coincidence(typingctx, first, first_name, second, second_name):
    """Raise MuJoCo's error for two coincident sites; the names are addresses of C strings."""

    def codegen(context, builder, signature, args):
        text = "dipole sites %d '%s' and %d '%s' coincide: their force is undefined"
        return _error(context, builder, text, (args[:2], args[2:]))

    return types.void(first, first_name, second, second_name), codegen


def _fatal(text):
    """Return a compiled function of (number, name) that raises MuJoCo's error with both.

    The name is the address of a C string.
    """

    @intrinsic
    def fatal(typingctx, number, name):
        def codegen(context, builder, signature, args):
            return _error(context, builder, text, (args,))

        return types.void(number, name), codegen

    return fatal


fatal_coupling = _fatal("coupling tuple %d '%s': its elements must be two bodies with equal prm")
fatal_wrench = _fatal("body %d '%s': its user numbers must be rows of six, the Brownian wrenches")
fatal_potential = _fatal(
    "joint %d '%s': its user numbers must be pairs, the Fourier coefficients of a"
    " potential, and the joint must be a slide or a hinge"
)
fatal_moment = _fatal(
    "site %d '%s': its only user number must be its moment in A m^2, which must be finite"
)


@intrinsic
def fatal_path(typingctx, index, value):
    """Raise MuJoCo's error for an element of `userdata` with an invalid value, a double."""

    def codegen(context, builder, signature, args):
        text = (
            "userdata[%d] = %g: the numbers that select the noise (seed, replica, factor, level,"
            " first step) must be integers from 0 to 2^53 - 1, a factor at most 2^24 and a level"
            " at most 31"
        )
        return _call_error(
            context, builder, text, [builder.trunc(args[0], ir.IntType(32)), args[1]]
        )

    return types.void(index, value), codegen


@intrinsic
def report_inert(typingctx, reason):
    """Report to Python that a model on which nothing acts is being stepped."""

    def codegen(context, builder, signature, args):
        kind = ir.FunctionType(ir.VoidType(), [ir.IntType(64)])
        function = cgutils.get_or_insert_function(builder.module, kind, "magmotor_report_inert")
        builder.call(function, args)
        return context.get_dummy_value()

    return types.void(types.int64), codegen


@intrinsic
def inert_reported(typingctx):
    """Whether this has already been reported."""

    def codegen(context, builder, signature, args):
        word = ir.IntType(64)
        name = "magmotor_inert_reported"
        symbol = builder.module.globals.get(name) or ir.GlobalVariable(builder.module, word, name)
        return builder.load(symbol, typ=word)

    return types.int64(), codegen
