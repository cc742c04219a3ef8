"""The type of named tuples whose numbers are constants of compiled code."""

import zlib
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.imputils import lower_constant
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    NativeValue,
    infer_getattr,
    lower_getattr_generic,
    models,
    register_model,
    typeof_impl,
    unbox,
)

from magmotor.numerics import symbols
from magmotor.numerics.constants import ConstantInCode

OFFSETS = "magmotor_offsets"
"""The symbol of the numbers in a library."""


class _Constants(types.Type):
    """The type of one named tuple, which has its numbers."""

    def __init__(self, numbers: Any) -> None:
        self.numbers = numbers
        super().__init__(f"{type(numbers).__name__}({zlib.crc32(repr(numbers).encode()):08x})")

    @property
    def key(self) -> Any:
        """Return what two instances of one type share."""
        return self.numbers


register_model(_Constants)(models.OpaqueModel)
typeof_impl.register(ConstantInCode)(lambda value, _context: _Constants(value))


@infer_getattr
class _Number(AttributeTemplate):
    key = _Constants

    def generic_resolve(self, constants: _Constants, name: str) -> types.Type | None:
        return types.int64 if hasattr(constants.numbers, name) else None


@lower_getattr_generic(_Constants)
def _number(context: Any, builder: Any, constants: _Constants, _value: Any, name: str) -> Any:
    if symbols.INDIRECT:  # a library learns the numbers when it is loaded
        kind = ir.ArrayType(ir.IntType(64), len(constants.numbers))
        table = builder.module.globals.get(OFFSETS)
        if table is None:
            table = ir.GlobalVariable(builder.module, kind, OFFSETS)
            table.global_constant = True
        place = ir.IntType(32)(constants.numbers._fields.index(name))
        return builder.load(builder.gep(table, [ir.IntType(32)(0), place], inbounds=True))
    return context.get_constant(types.int64, getattr(constants.numbers, name))


@lower_constant(_Constants)
def _frozen(context: Any, *_: Any) -> Any:
    return context.get_dummy_value()


@unbox(_Constants)
def _unboxed(_constants: _Constants, _value: Any, c: Any) -> NativeValue:
    return NativeValue(c.context.get_dummy_value())
