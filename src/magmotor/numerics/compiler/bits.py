"""The bits of numbers, and hints, written in LLVM's language."""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

from llvmlite import ir
from numba import types
from numba.extending import intrinsic


@intrinsic
def bits_as_float(typingctx, bits):
    """Reinterpret 64 bits as a double."""

    def codegen(context, builder, signature, args):
        return builder.bitcast(args[0], ir.DoubleType())

    return types.float64(types.uint64), codegen


@intrinsic
def float_as_bits(typingctx, number):
    """Reinterpret a double as 64 bits."""

    def codegen(context, builder, signature, args):
        return builder.bitcast(args[0], ir.IntType(64))

    return types.uint64(types.float64), codegen


@intrinsic
def nearest_integer(typingctx, number):
    """Round to the nearest integer, as a double."""

    def codegen(context, builder, signature, args):
        function = builder.module.declare_intrinsic("llvm.rint", [ir.DoubleType()])
        return builder.call(function, [args[0]])

    return types.float64(types.float64), codegen


@intrinsic
def prefer_wide_vectors(typingctx):
    """Make LLVM use 512-bit vectors in the calling function if the processor supports them.

    By default, LLVM uses 256 bits on many such processors, at half the speed.
    """

    def codegen(context, builder, signature, args):
        # llvmlite checks names against a list that lacks this one.
        set.add(builder.function.attributes, '"prefer-vector-width"="512"')
        return context.get_dummy_value()

    return types.void(), codegen
