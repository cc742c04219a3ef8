"""The vectors of `magmotor.numerics.simd`, written in LLVM's language."""

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import extending, types
from numba.core import cgutils
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import lower_builtin, models, register_model

from magmotor.numerics.constants import COUNT

intrinsic: Any = extending.intrinsic  # which hides the first parameter of the decorated function

_VECTOR = ir.VectorType(ir.DoubleType(), COUNT)
_WORD = ir.IntType(32)


class Eight(types.Type):
    """Numba type of eight doubles with elementwise arithmetic."""

    def __init__(self):
        super().__init__(name="Eight")


EIGHT = Eight()


@register_model(Eight)
class _Model(models.PrimitiveModel):
    def __init__(self, manager, kind):
        super().__init__(manager, kind, _VECTOR)


def _define_operator(operation: Callable, instruction: str) -> None:
    """Compile a Python operator on two Eights, or one and a number, as an LLVM instruction."""

    @infer_global(operation)  # pyright: ignore[reportOptionalCall]
    class _Typing(ConcreteTemplate):
        cases = [  # noqa: RUF012
            signature(EIGHT, EIGHT, EIGHT),
            signature(EIGHT, EIGHT, types.float64),
            signature(EIGHT, types.float64, EIGHT),
        ]

    def lower(context, builder, signature, args):
        eights = [
            value if kind is EIGHT else _broadcast(builder, value)
            for kind, value in zip(signature.args, args, strict=True)
        ]
        return getattr(builder, instruction)(*eights)

    for case in _Typing.cases:
        lower_builtin(operation, *case.args)(lower)


def _broadcast(builder, number):
    """Return a vector whose elements all equal a number."""
    first = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), number, _WORD(0))
    return builder.shuffle_vector(first, first, ir.Constant(ir.VectorType(_WORD, COUNT), None))


for _operation, _instruction in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _define_operator(_operation, _instruction)


def _call(builder, name: str, args):
    """Call an LLVM intrinsic function on doubles or Eights."""
    kind = args[0].type
    suffix = "f64" if isinstance(kind, ir.DoubleType) else f"v{COUNT}f64"
    function = ir.FunctionType(kind, [kind] * len(args))
    name = f"llvm.{name}.{suffix}"
    return builder.call(cgutils.get_or_insert_function(builder.module, function, name), args)


@intrinsic
def fused(typingctx, a, b, c):
    """Return a b + c for doubles or Eights, rounded once if the processor supports it."""
    kind = EIGHT if a is EIGHT else types.float64

    def codegen(context, builder, signature, args):
        return _call(builder, "fmuladd", args)

    return kind(kind, kind, kind), codegen


@intrinsic
def square_root(typingctx, a):
    """Return the square root of a double, or of each element of an Eight."""
    kind = EIGHT if a is EIGHT else types.float64

    def codegen(context, builder, signature, args):
        return _call(builder, "sqrt", args)

    return kind(kind), codegen


@intrinsic
def negative(typingctx, eight):
    """Return the negative of each element, at no cost as a factor of `fused`."""

    def codegen(context, builder, signature, args):
        return builder.fneg(args[0])

    return EIGHT(EIGHT), codegen


@intrinsic
def broadcast(typingctx, number):
    """Return an Eight whose elements all equal a number."""

    def codegen(context, builder, signature, args):
        return _broadcast(builder, args[0])

    return EIGHT(types.float64), codegen


@intrinsic
def lane_numbers(typingctx):
    """Return the Eight of the numbers 0 to 7."""

    def codegen(context, builder, signature, args):
        return ir.Constant(_VECTOR, [float(k) for k in range(COUNT)])

    return EIGHT(), codegen


def _address(context, builder, signature, args):
    """Return the address of an Eight in an array."""
    kind = signature.args[0]
    assert (kind.ndim, kind.layout) == (2, "C")
    view = context.make_array(kind)(context, builder, args[0])
    item = cgutils.get_item_pointer(context, builder, kind, view, args[1:3], wraparound=False)
    return builder.bitcast(item, _VECTOR.as_pointer())


@intrinsic
def load(typingctx, array, row, first):
    """Read eight numbers of a row of a C-contiguous matrix, starting at column `first`."""

    def codegen(context, builder, signature, args):
        address = _address(context, builder, signature, args)
        return builder.load(address, align=8, typ=_VECTOR)

    return EIGHT(array, types.intp, types.intp), codegen


@intrinsic
def store(typingctx, array, row, first, eight):
    """Write eight numbers to where `load` reads them."""

    def codegen(context, builder, signature, args):
        builder.store(args[3], _address(context, builder, signature, args), align=8)
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
"""Functions of (a, b, x, y) that return x where a == b, or a < b, and y elsewhere."""


def _folded(by: Callable):
    @intrinsic
    def folded(typingctx, eight):
        def codegen(context, builder, signature, args):
            (value,) = args
            half = COUNT
            while half > 1:
                half //= 2
                indices = ir.VectorType(_WORD, half)
                parts = [
                    builder.shuffle_vector(
                        value, value, ir.Constant(indices, [*range(start, start + half)])
                    )
                    for start in (0, half)
                ]
                value = by(builder, *parts)
            return builder.extract_element(value, _WORD(0))

        return types.float64(EIGHT), codegen

    return folded


total = _folded(lambda builder, a, b: builder.fadd(a, b))
"""Sum of an Eight's elements: its halves are added, then the halves of that, then the last two."""

minimum = _folded(lambda builder, a, b: builder.select(builder.fcmp_ordered("<", a, b), a, b))
"""Smallest element of an Eight without NaN."""
