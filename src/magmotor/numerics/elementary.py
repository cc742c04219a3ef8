"""Elementary functions without branches, which the compiler can vectorize.

Angles are in turns, so that range reduction is exact. The polynomials are Chebyshev interpolants.
The functions are accurate to a few units in the last place and have the same bits on every
processor; see `magmotor.numerics.simd`.
"""

import math

import numpy as np

from magmotor.numerics.deferred import Intrinsic, subroutine, twofold
from magmotor.numerics.simd import fused

_LN2 = 0.6931471805599453
_TANGENT_OF_EIGHTH = 0.41421356237309503
_QUARTER, _HALF = 0.7853981633974483, 1.5707963267948966
_TINY = 1e-300
_SQRT_HALF_BITS = np.int64(0x3FE6A09E667F3BCD)


bits_as_float = Intrinsic("bits", "bits_as_float")
"""Reinterpret 64 bits as a double."""

float_as_bits = Intrinsic("bits", "float_as_bits")
"""Reinterpret a double as 64 bits."""

nearest_integer = Intrinsic("bits", "nearest_integer")
"""Round to the nearest integer, as a double."""

prefer_wide_vectors = Intrinsic("bits", "prefer_wide_vectors")
"""Make LLVM use 512-bit vectors in the calling function if the processor supports them.

By default, LLVM uses 256 bits on many such processors, at half the speed.
"""


@subroutine(forceinline=True)
def sine_of_quarter(q):
    """sin(2 pi q) for |q| <= 1/4."""
    y = q * q
    p = fused(y, 0.10089695501646812, -0.7177337921413454)
    p = fused(y, fused(y, p, 3.8199280942271643), -15.0946416761179)
    p = fused(y, fused(y, p, 42.058693925428685), -76.70585975282492)
    p = fused(y, fused(y, p, 81.60524927607362), -41.341702240399755)
    return q * fused(y, p, 6.283185307179586)


@subroutine(forceinline=True)
def cosine_of_quarter(q):
    """cos(2 pi q) for |q| <= 1/4."""
    y = q * q
    p = fused(y, 0.2719458494999813, -1.7132184107005932)
    p = fused(y, fused(y, p, 7.903462492085097), -26.426254066690255)
    p = fused(y, fused(y, p, 60.24464131316041), -85.45681720598061)
    p = fused(y, fused(y, p, 64.93939402266395), -19.739208802178705)
    return fused(y, p, 1.0)


@twofold(python=lambda turns: math.cos(2.0 * math.pi * turns), forceinline=True)
def cosine(turns):
    """cos(2 pi turns) for any number."""
    return sine_of_quarter(0.25 - abs(turns - nearest_integer(turns)))


@subroutine(forceinline=True)
def sine(turns):
    """sin(2 pi turns) for any number."""
    r = turns - nearest_integer(turns)
    return sine_of_quarter(math.copysign(min(abs(r), 0.5 - abs(r)), r))


@twofold(python=math.log, forceinline=True)
def logarithm(number):
    """Natural logarithm of a positive, normal double: k log 2 + 2 artanh((z-1)/(z+1)), z near 1."""
    bits = np.int64(float_as_bits(number))
    k = (bits - _SQRT_HALF_BITS) >> np.int64(52)
    z = bits_as_float(np.uint64(bits - (k << np.int64(52))))
    s = (z - 1.0) / (z + 1.0)
    y = s * s
    p = fused(y, 0.14616449685043406, 0.15331721600556042)
    p = fused(y, fused(y, p, 0.18182889125261723), 0.2222221113479508)
    p = fused(y, fused(y, p, 0.28571428625975487), 0.39999999999899505)
    return fused(float(k), _LN2, s * fused(y, fused(y, p, 0.666666666666667), 2.0))


@twofold(python=math.atan2, forceinline=True)
def arctangent(y, x):
    """Angle of the point (x, y) in radians, from -pi to pi, as `math.atan2`; 0 at the origin."""
    small, large = min(abs(x), abs(y)), max(abs(x), abs(y)) + _TINY
    beyond = small > _TANGENT_OF_EIGHTH * large
    t = (small - large if beyond else small) / (small + large if beyond else large)
    q = t * t
    p = fused(q, 0.021135371518539687, -0.04348052081991591)
    p = fused(q, fused(q, p, 0.05688349180558202), -0.06640233921597649)
    p = fused(q, fused(q, p, 0.07689953495290895), -0.09090773074736334)
    p = fused(q, fused(q, p, 0.11111106180452844), -0.14285714180976392)
    p = fused(q, fused(q, p, 0.19999999998855109), -0.3333333333332844)
    angle = fused(t * q, p, t) + (_QUARTER if beyond else 0.0)
    angle = _HALF - angle if abs(y) > abs(x) else angle
    angle = 2.0 * _HALF - angle if x < 0.0 else angle
    return math.copysign(angle, y)
