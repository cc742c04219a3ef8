"""Numba's access to C memory and C functions, for code that is compiled ahead and cached.

Nothing here bakes an address into compiled code: functions and status words are external symbols,
bound when the code is loaded, so that a cached callback is valid in every process.
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
"""Length of an array whose own is not looked up."""


def bind_function(name: str, function: Any) -> None:
    """Make a ctypes function known to compiled code as the external symbol `name`."""
    llvm.add_symbol(name, ctypes.cast(function, ctypes.c_void_p).value)


def bind_variable(name: str, variable: ctypes.c_int64) -> None:
    """Make a ctypes variable known to compiled code as the external symbol `name`."""
    llvm.add_symbol(name, ctypes.addressof(variable))


def library() -> ctypes.CDLL:
    """MuJoCo's own C library, which the Python package has loaded already."""
    folder = Path(mujoco.__file__).parent
    patterns = ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll")
    found = [path for pattern in patterns for path in folder.glob(pattern)]
    if not found:
        raise ImportError(f"no MuJoCo library beside {mujoco.__file__}")
    return ctypes.CDLL(str(found[0]))


for _name in ("mju_error", "mj_markStack", "mj_stackAllocByte", "mj_freeStack"):
    bind_function(_name, getattr(library(), _name))

mark_stack = types.ExternalFunction("mj_markStack", types.void(types.int64))
"""Remember how much of the stack of an mjData is in use."""

allocate = types.ExternalFunction(
    "mj_stackAllocByte", types.int64(types.int64, types.uint64, types.uint64)
)
"""Address of so many bytes, so aligned, on the stack of an mjData."""

free_stack = types.ExternalFunction("mj_freeStack", types.void(types.int64))
"""Free what was allocated since the last mark."""


@intrinsic
def _pointer(typingctx, address):
    """Turn an integer address into a pointer."""

    def codegen(context, builder, signature, args):
        return builder.inttoptr(args[0], cgutils.voidptr_t)

    return types.voidptr(address), codegen


@njit(forceinline=True)
def words(address, count):
    """`count` 64-bit integers at an address."""
    return carray(_pointer(address), (count,), np.int64)


@njit(forceinline=True)
def integers(address, count):
    """`count` C ints at an address."""
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
    """A `rows` x `columns` array of doubles at an address."""
    return carray(_pointer(address), (rows, columns), np.float64)


@njit(forceinline=True)
def borrowed(array):
    """A view of a caller's array without a count of references, which costs loops much time."""
    return carray(_pointer(array.ctypes.data), array.shape, array.dtype)


@njit(forceinline=True)
def from_column(array, first):
    """A two-dimensional array from one of its columns on; unlike a slice it is of the same type."""
    return numbers(array.ctypes.data + 8 * first, array.shape[0], array.shape[1])


@njit(forceinline=True)
def any_number(array, row, first, last):
    """Whether a row has numbers other than zero from column `first` to before `last`."""
    present = False
    for k in range(first, last):
        present = present or array[row, k] != 0.0
    return present


def _error(context, builder, text, pairs):
    """Call MuJoCo's error with pairs of a number and the address of a C string."""
    arguments = []
    for number, name in pairs:
        arguments.append(builder.trunc(number, ir.IntType(32)))
        arguments.append(builder.inttoptr(name, cgutils.voidptr_t))
    return _call_error(context, builder, text, arguments)


def _call_error(context, builder, text, arguments):
    """Call MuJoCo's error with what its text formats."""
    message = context.insert_const_string(builder.module, text)
    kind = ir.FunctionType(ir.VoidType(), [cgutils.voidptr_t], var_arg=True)
    function = cgutils.get_or_insert_function(builder.module, kind, "mju_error")
    builder.call(function, [message, *arguments])
    return context.get_dummy_value()


@intrinsic
def fatal_coincidence(typingctx, first, first_name, second, second_name):
    """Raise MuJoCo's error that names two sites; the names are addresses of C strings."""

    def codegen(context, builder, signature, args):
        text = "dipole sites %d '%s' and %d '%s' coincide: no force is defined"
        return _error(context, builder, text, (args[:2], args[2:]))

    return types.void(first, first_name, second, second_name), codegen


def _fatal(text):
    """Raises MuJoCo's error, which has a number and a name; the name is the address of a C string.

    For use in compiled code, with the two as arguments.
    """

    @intrinsic
    def fatal(typingctx, number, name):
        def codegen(context, builder, signature, args):
            return _error(context, builder, text, (args,))

        return types.void(number, name), codegen

    return fatal


fatal_coupling = _fatal("tuple %d '%s', a coupling: its elements must be two bodies with equal prm")
fatal_wrench = _fatal("body %d '%s': its user numbers must be whole rows of six, Brownian wrenches")
fatal_potential = _fatal(
    "joint %d '%s': its user numbers must be pairs, the Fourier coefficients of a"
    " potential, and the joint a slide or a hinge"
)
fatal_moment = _fatal(
    "site %d '%s': its user numbers must be one, its moment in A m^2 along its z axis, and finite"
)


@intrinsic
def fatal_path(typingctx, place, value):
    """Raise MuJoCo's error that names a number of the user's data and its value, a double."""

    def codegen(context, builder, signature, args):
        text = (
            "userdata[%d] = %g, which chooses the noise (seed, replica, factor, level, first step):"
            " it must be an integer, at least 0 and less than 2^53, a factor at most 2^24,"
            " a level at most 31"
        )
        return _call_error(
            context, builder, text, [builder.trunc(args[0], ir.IntType(32)), args[1]]
        )

    return types.void(place, value), codegen


@intrinsic
def report_inert(typingctx, reason):
    """Tell Python, through the bound hook, that a model on which nothing acts is being stepped."""

    def codegen(context, builder, signature, args):
        kind = ir.FunctionType(ir.VoidType(), [ir.IntType(64)])
        function = cgutils.get_or_insert_function(builder.module, kind, "magmotor_report_inert")
        builder.call(function, args)
        return context.get_dummy_value()

    return types.void(types.int64), codegen


@intrinsic
def inert_reported(typingctx):
    """Whether that has been told already."""

    def codegen(context, builder, signature, args):
        word = ir.IntType(64)
        name = "magmotor_inert_reported"
        place = builder.module.globals.get(name) or ir.GlobalVariable(builder.module, word, name)
        return builder.load(place, typ=word)

    return types.int64(), codegen
