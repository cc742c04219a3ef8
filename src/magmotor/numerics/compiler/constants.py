"""The type of named tuples whose numbers are constants of compiled code."""

import operator
import zlib
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_constant
from numba.core.typing.templates import (
    AbstractTemplate,
    AttributeTemplate,
    infer_global,
    signature,
)
from numba.extending import (
    NativeValue,
    infer_getattr,
    lower_builtin,
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

MOST = 1 << 31
"""Number below which they are."""


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
    if symbols.INDIRECT:
        place = constants.numbers._fields.index(name)
        return _number_at(builder, constants, ir.IntType(64)(place))
    return context.get_constant(types.int64, getattr(constants.numbers, name))


@infer_global(operator.getitem)  # pyright: ignore[reportOptionalCall]
class _Item(AbstractTemplate):
    """The number at a place that only running code knows."""

    def generic(self, args: Any, kws: Any) -> Any:
        if isinstance(args[0], _Constants) and isinstance(args[1], types.Integer):
            return signature(types.int64, args[0], types.int64)
        return None


@lower_builtin(operator.getitem, _Constants, types.int64)
def _item(_context: Any, builder: Any, kinds: Any, args: Any) -> Any:
    return _number_at(builder, kinds.args[0], args[1])


def _number_at(builder: Any, constants: _Constants, place: Any) -> Any:
    kind = ir.ArrayType(ir.IntType(64), len(constants.numbers))
    if symbols.INDIRECT:  # a library learns the numbers when it is loaded
        table = builder.module.globals.get(OFFSETS)
        if table is None:
            table = ir.GlobalVariable(builder.module, kind, OFFSETS)
            table.global_constant = True
    else:
        table = cgutils.global_constant(builder, "numbers", kind([*constants.numbers]))
    number = builder.load(builder.gep(table, [ir.IntType(64)(0), place], inbounds=True))
    if symbols.INDIRECT:  # numbers that are not negative can be divided by a shift
        bounds = [ir.IntType(64)(bound) for bound in (0, MOST)]
        number.set_metadata("range", builder.module.add_metadata(bounds))
    return number


@lower_constant(_Constants)
def _frozen(context: Any, *_: Any) -> Any:
    return context.get_dummy_value()


@unbox(_Constants)
def _unboxed(_constants: _Constants, _value: Any, c: Any) -> NativeValue:
    return NativeValue(c.context.get_dummy_value())
