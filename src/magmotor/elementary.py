"""Branch-free elementary functions, which the compiler can run on all lanes of a vector at once.

Angles are in turns, so that their range is reduced without rounding. The polynomials are Chebyshev
interpolants; the functions are good to a few units in the last place.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import math

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

FASTMATH = {"nnan", "ninf", "nsz", "arcp", "contract", "afn"}
"""All but `reassoc`, with which LLVM makes slower code of polynomials."""

_LN2 = 0.6931471805599453
_SQRT_HALF_BITS = np.int64(0x3FE6A09E667F3BCD)


@intrinsic
def bits_as_float(typingctx, bits):
    """The double that 64 bits stand for."""

    def codegen(context, builder, signature, args):
        return builder.bitcast(args[0], ir.DoubleType())

    return types.float64(types.uint64), codegen


@intrinsic
def float_as_bits(typingctx, number):
    """The 64 bits of a double."""

    def codegen(context, builder, signature, args):
        return builder.bitcast(args[0], ir.IntType(64))

    return types.uint64(types.float64), codegen


@intrinsic
def nearest_integer(typingctx, number):
    """The nearest integer, as a double."""

    def codegen(context, builder, signature, args):
        function = builder.module.declare_intrinsic("llvm.rint", [ir.DoubleType()])
        return builder.call(function, [args[0]])

    return types.float64(types.float64), codegen


@intrinsic
def prefer_wide_vectors(typingctx):
    """Have LLVM use 512-bit vectors in the calling function, where the processor has them.

    By default it uses 256 bits on many such processors, at half the speed.
    """

    def codegen(context, builder, signature, args):
        # llvmlite checks names against a list that lacks this one.
        set.add(builder.function.attributes, '"prefer-vector-width"="512"')
        return context.get_dummy_value()

    return types.void(), codegen


@njit(inline="always", fastmath=FASTMATH)
def sine_of_quarter(q):
    """sin(2 pi q) for |q| <= 1/4."""
    y = q * q
    p = -0.7177337921413454 + y * 0.10089695501646812
    p = -15.0946416761179 + y * (3.8199280942271643 + y * p)
    p = -76.70585975282492 + y * (42.058693925428685 + y * p)
    p = -41.341702240399755 + y * (81.60524927607362 + y * p)
    return q * (6.283185307179586 + y * p)


@njit(inline="always", fastmath=FASTMATH)
def cosine_of_quarter(q):
    """cos(2 pi q) for |q| <= 1/4."""
    y = q * q
    p = -1.7132184107005932 + y * 0.2719458494999813
    p = -26.426254066690255 + y * (7.903462492085097 + y * p)
    p = -85.45681720598061 + y * (60.24464131316041 + y * p)
    p = -19.739208802178705 + y * (64.93939402266395 + y * p)
    return 1.0 + y * p


@njit(inline="always", fastmath=FASTMATH)
def cosine(turns):
    """cos(2 pi turns) of any number."""
    return sine_of_quarter(0.25 - abs(turns - nearest_integer(turns)))


@njit(inline="always", fastmath=FASTMATH)
def sine(turns):
    """sin(2 pi turns) of any number."""
    r = turns - nearest_integer(turns)
    return sine_of_quarter(math.copysign(min(abs(r), 0.5 - abs(r)), r))


@njit(inline="always", fastmath=FASTMATH)
def logarithm(number):
    """Natural logarithm of a positive, normal double: 2^k z with z near 1, by the area tangent."""
    bits = np.int64(float_as_bits(number))
    k = (bits - _SQRT_HALF_BITS) >> np.int64(52)
    z = bits_as_float(np.uint64(bits - (k << np.int64(52))))
    s = (z - 1.0) / (z + 1.0)
    y = s * s
    p = 0.15331721600556042 + y * 0.14616449685043406
    p = 0.2222221113479508 + y * (0.18182889125261723 + y * p)
    p = 0.666666666666667 + y * (0.39999999999899505 + y * (0.28571428625975487 + y * p))
    return k * _LN2 + s * (2.0 + y * p)
