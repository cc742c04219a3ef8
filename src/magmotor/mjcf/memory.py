"""Access to C memory and C functions from compiled code.

No address is part of the compiled code: functions and variables are external symbols that are bound
when the code is loaded, so that cached code is valid in every process.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import ctypes
from typing import Any

import llvmlite.binding as llvm
import numpy as np
from llvmlite import ir
from numba import carray, types
from numba.core import cgutils
from numba.extending import intrinsic

from magmotor.numerics.subroutine import subroutine
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
    llvm.add_symbol(name, ctypes.cast(function, ctypes.c_void_p).value)


def bind_variable(name: str, variable: ctypes.c_int64) -> None:
    """Bind a ctypes variable to the external symbol `name` of compiled code."""
    llvm.add_symbol(name, ctypes.addressof(variable))


def bind_compiled(name: str, function: Any) -> None:
    """Bind a C function that Numba has compiled to the external symbol `name` of other code.

    What is compiled separately is neither compiled nor optimized again with each of its callers.
    """
    llvm.add_symbol(name, function.address)


def bind_unused(*names: str) -> None:
    """Bind symbols of compiled code to nothing, in a process that compiles and does not call it."""
    for name in names:
        llvm.add_symbol(name, 1)


def bind_mujoco(*names: str) -> None:
    """Bind functions of MuJoCo's C library to their own names in compiled code."""
    for name in names:
        bind_function(name, getattr(library(), name))


bind_mujoco("mj_markStack", "mj_stackAllocByte", "mj_freeStack")

_slot = ctypes.c_int64(slots.register())
_magnetometer_slot = ctypes.c_int64(slots.slot(slots.MAGNETOMETER))
bind_variable("magmotor_plugin_slot", _slot)
bind_variable("magmotor_magnetometer_slot", _magnetometer_slot)

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


def on_stack(count):
    """Return a compiled function that returns the address of some 64-bit zeros.

    It is valid until the calling function returns.
    """

    @intrinsic
    def place(typingctx):
        def codegen(context, builder, signature, args):
            zeros = ir.Constant(ir.ArrayType(ir.IntType(64), count), None)
            room = cgutils.alloca_once_value(builder, zeros)
            builder.store(zeros, room)
            return builder.ptrtoint(room, ir.IntType(64))

        return types.int64(), codegen

    return place


word_on_stack = on_stack(1)
pair_on_stack = on_stack(2)
error_on_stack = on_stack(5)
details_on_stack = on_stack(16)
row_on_stack = on_stack(17)


@subroutine(forceinline=True)
def words(address, count):
    """Return an array of `count` 64-bit integers at an address."""
    return carray(_pointer(address), (count,), np.int64)


@subroutine(forceinline=True)
def records(address, count, kind):
    """Return an array of `count` records of a type at an address."""
    return carray(_pointer(address), (count,), kind)


@intrinsic
def load_shared(typingctx, address):
    """Load a word that other threads may store, and what they stored before it."""

    def codegen(context, builder, signature, args):
        place = builder.inttoptr(args[0], ir.IntType(64).as_pointer())
        return builder.load_atomic(place, "acquire", 8, typ=ir.IntType(64))

    return types.int64(address), codegen


@intrinsic
def store_shared(typingctx, address, word):
    """Store a word for other threads, after all that was stored before it."""

    def codegen(context, builder, signature, args):
        place = builder.inttoptr(args[0], ir.IntType(64).as_pointer())
        builder.store_atomic(args[1], place, "release", 8)
        return context.get_dummy_value()

    return types.void(address, word), codegen


@subroutine(forceinline=True)
def integers(address, count):
    """Return an array of `count` C ints at an address, as unsigned integers."""
    return carray(_pointer(address), (count,), np.uint32)


@subroutine(forceinline=True)
def bytes_at(address, count):
    """Return an array of `count` bytes at an address."""
    return carray(_pointer(address), (count,), np.uint8)


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
    return carray(_pointer(address), (rows, columns), np.float64)


@intrinsic
def borrowed(typingctx, value: Any):
    """Return a caller's array, or a tuple of some, without reference counts, which slow loops.

    The caller keeps the arrays; what is returned must not leave compiled code.
    """

    def without_counts(context: Any, builder: Any, kind: Any, value: Any) -> Any:
        if isinstance(kind, types.Array):
            array = context.make_array(kind)(context, builder, value)
            array.meminfo = array.parent = ir.Constant(ir.IntType(8).as_pointer(), None)
            return array._getvalue()
        for i, element in enumerate(getattr(kind, "types", ())):
            part = without_counts(context, builder, element, builder.extract_value(value, i))
            value = builder.insert_value(value, part, i)
        if not hasattr(kind, "types") and context.data_model_manager[kind].contains_nrt_meminfo():
            raise TypeError(f"cannot borrow {kind}: its reference would be counted")
        return value

    def codegen(context, builder, signature, args):
        return without_counts(context, builder, signature.args[0], args[0])

    return value(value), codegen


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


def address_of(name):
    """Return a compiled function that returns the address bound to a symbol."""

    @intrinsic
    def read(typingctx):
        def codegen(context, builder, signature, args):
            word = ir.IntType(64)
            place = builder.module.globals.get(name)
            place = place or ir.GlobalVariable(builder.module, word, name)
            return builder.ptrtoint(place, word)

        return types.int64(), codegen

    return read


def variable(name):
    """Return a compiled function that reads a 64-bit integer, bound by `bind_variable`."""

    @intrinsic
    def read(typingctx):
        def codegen(context, builder, signature, args):
            word = ir.IntType(64)
            place = builder.module.globals.get(name)
            place = place or ir.GlobalVariable(builder.module, word, name)
            return builder.load(place, typ=word)

        return types.int64(), codegen

    return read


def function_at(name, signature):
    """Return a compiled function that calls a C function, whose address is in a bound variable.

    It takes a tuple of the arguments. Unlike the address of a symbol, this one may be set after the
    caller has been compiled.
    """
    address = variable(name)

    @intrinsic
    def call(typingctx, place, arguments):
        def codegen(context, builder, types_of_call, args):
            kinds = [context.get_argument_type(kind) for kind in signature.args]
            result = context.get_argument_type(signature.return_type)
            function = builder.inttoptr(args[0], ir.FunctionType(result, kinds).as_pointer())
            values = zip(signature.args, cgutils.unpack_tuple(builder, args[1]), strict=True)
            given = [context.get_value_as_argument(builder, *each) for each in values]
            returned = builder.call(function, given)
            return context.get_returned_value(builder, signature.return_type, returned)

        return signature.return_type(place, types.Tuple(signature.args)), codegen

    @subroutine(forceinline=True)
    def function(arguments):
        return call(address(), arguments)

    return function


plugin_slot = variable("magmotor_plugin_slot")
magnetometer_slot = variable("magmotor_magnetometer_slot")
"""Slots of the plugins in MuJoCo's table."""
