"""Eight doubles as one value of compiled code, with sums whose order nobody may choose.

Left to itself, LLVM adds a loop's terms in as many partial sums as the processor's vectors hold, so
that the last digits depend on the processor. An `Eight` is one vector of AVX-512, two of AVX or
four of SSE and NEON, with the same bits: every operation is rounded as IEEE 754 says, and
multiplication and addition are one operation where `fused` says so, nowhere else.

A processor without a fused multiply-add (x86-64 before its third level) rounds the product, too.
"""

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import extending, types
from numba.core import cgutils
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import lower_builtin, models, register_model

COUNT = 8
"""Doubles in an Eight: those of the widest vector, and of a cache line."""

intrinsic: Any = extending.intrinsic  # which hides the first parameter of what it decorates

_VECTOR = ir.VectorType(ir.DoubleType(), COUNT)
_WORD = ir.IntType(32)


class Eight(types.Type):
    """Numba's type of eight doubles; they add, subtract, multiply and divide one by one."""

    def __init__(self):
        super().__init__(name="Eight")


EIGHT = Eight()


@register_model(Eight)
class _Model(models.PrimitiveModel):
    def __init__(self, manager, kind):
        super().__init__(manager, kind, _VECTOR)


def _let(operation: Callable, instruction: str) -> None:
    """Compile a Python operator on two Eights as an instruction of LLVM."""

    @infer_global(operation)  # pyright: ignore[reportOptionalCall]
    class _Typing(ConcreteTemplate):
        cases = [signature(EIGHT, EIGHT, EIGHT)]  # noqa: RUF012

    @lower_builtin(operation, EIGHT, EIGHT)
    def _lower(context, builder, signature, args):
        return getattr(builder, instruction)(*args)


for _operation, _instruction in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _let(_operation, _instruction)


def _call(builder, name: str, args):
    """Call an intrinsic function of LLVM on doubles or Eights."""
    kind = args[0].type
    suffix = "f64" if isinstance(kind, ir.DoubleType) else f"v{COUNT}f64"
    function = ir.FunctionType(kind, [kind] * len(args))
    name = f"llvm.{name}.{suffix}"
    return builder.call(cgutils.get_or_insert_function(builder.module, function, name), args)


@intrinsic
def fused(typingctx, a, b, c):
    """The number a b + c, or Eight, rounded once where the processor can."""
    kind = EIGHT if a is EIGHT else types.float64

    def codegen(context, builder, signature, args):
        return _call(builder, "fmuladd", args)

    return kind(kind, kind, kind), codegen


@intrinsic
def square_root(typingctx, eight):
    """The square root of each."""

    def codegen(context, builder, signature, args):
        return _call(builder, "sqrt", args)

    return EIGHT(EIGHT), codegen


@intrinsic
def spread(typingctx, number):
    """Eight times the same number."""

    def codegen(context, builder, signature, args):
        first = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), args[0], _WORD(0))
        return builder.shuffle_vector(first, first, ir.Constant(ir.VectorType(_WORD, COUNT), None))

    return EIGHT(types.float64), codegen


@intrinsic
def counted(typingctx):
    """The numbers 0 to 7."""

    def codegen(context, builder, signature, args):
        return ir.Constant(_VECTOR, [float(k) for k in range(COUNT)])

    return EIGHT(), codegen


def _place(context, builder, signature, args):
    """Pointer to an Eight in an array."""
    kind = signature.args[0]
    assert (kind.ndim, kind.layout) == (2, "C")
    view = context.make_array(kind)(context, builder, args[0])
    place = cgutils.get_item_pointer(context, builder, kind, view, args[1:3], wraparound=False)
    return builder.bitcast(place, _VECTOR.as_pointer())


@intrinsic
def taken(typingctx, array, row, first):
    """Eight numbers of a row of a two-dimensional array in C's order, from column `first` on."""

    def codegen(context, builder, signature, args):
        place = _place(context, builder, signature, args)
        return builder.load(place, align=8, typ=_VECTOR)

    return EIGHT(array, types.intp, types.intp), codegen


@intrinsic
def put(typingctx, array, row, first, eight):
    """Write eight numbers where `taken` would read them."""

    def codegen(context, builder, signature, args):
        builder.store(args[3], _place(context, builder, signature, args), align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, types.intp, EIGHT), codegen


def _where(predicate: str):
    @intrinsic
    def where(typingctx, a, b, x, y):
        def codegen(context, builder, signature, args):
            return builder.select(builder.fcmp_ordered(predicate, *args[:2]), *args[2:])

        return EIGHT(EIGHT, EIGHT, EIGHT, EIGHT), codegen

    return where


where_equal, where_less = _where("=="), _where("<")
"""Functions of (a, b, x, y): x where a equals, or is less than, b, and y elsewhere."""


def _folded(by: Callable):
    @intrinsic
    def folded(typingctx, eight):
        def codegen(context, builder, signature, args):
            (value,) = args
            half = COUNT
            while half > 1:
                half //= 2
                places = ir.VectorType(_WORD, half)
                parts = [
                    builder.shuffle_vector(
                        value, value, ir.Constant(places, [*range(start, start + half)])
                    )
                    for start in (0, half)
                ]
                value = by(builder, *parts)
            return builder.extract_element(value, _WORD(0))

        return types.float64(EIGHT), codegen

    return folded


total = _folded(lambda builder, a, b: builder.fadd(a, b))
"""Their sum: of the halves, then of the halves of that, then of the last two."""

least = _folded(lambda builder, a, b: builder.select(builder.fcmp_ordered("<", a, b), a, b))
"""The least of numbers that are not NaN."""
