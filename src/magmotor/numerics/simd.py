"""Vectors of eight doubles in compiled code, whose sums have a fixed order.

By default, LLVM sums a loop's terms in as many partial sums as fit in the processor's vectors, so
that the last digits depend on the processor. An `Eight` is one vector of AVX-512, two of AVX or
four of SSE and NEON, and gives the same bits on all of these: every operation is rounded according
to IEEE 754, and multiplication and addition are fused only by `fused`. Operators take two Eights,
or one and a double.

A processor without a fused multiply-add (x86-64 below level v3) also rounds the product.
"""

from functools import partial

from magmotor.numerics.deferred import Intrinsic

_vector = partial(Intrinsic, "vectors")

fused = _vector("fused")
"""Return a b + c for doubles or Eights, rounded once if the processor supports it."""

square_root = _vector("square_root")
"""Return the square root of a double, or of each element of an Eight."""

negative = _vector("negative")
"""Return the negative of each element, at no cost as a factor of `fused`."""

broadcast = _vector("broadcast")
"""Return an Eight whose elements all equal a number."""

lane_numbers = _vector("lane_numbers")
"""Return the Eight of the numbers 0 to 7."""

load = _vector("load")
"""Read eight numbers of a row of a C-contiguous matrix: (array, row, first column)."""

store = _vector("store")
"""Write eight numbers to where `load` reads them: (array, row, first column, eight)."""

where_equal, where_less = _vector("where_equal"), _vector("where_less")
"""Functions of (a, b, x, y) that return x where a == b, or a < b, and y elsewhere."""

total = _vector("total")
"""Sum of an Eight's elements: its halves are added, then the halves of that, then the last two."""

minimum = _vector("minimum")
"""Smallest element of an Eight without NaN."""
