"""Access to memory and to what symbols stand for, written in LLVM's language."""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.sigutils import normalize_signature
from numba.extending import intrinsic

from magmotor.numerics import symbols

CELL = "magmotor_cell_"
"""Beginning of the symbols of cells."""


@intrinsic
def pointer(typingctx, address):
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


def address_of(name):
    """Return a compiled function that returns the address bound to a symbol."""

    @intrinsic
    def read(typingctx):
        def codegen(context, builder, signature, args):
            return builder.ptrtoint(_place(builder, name), ir.IntType(64))

        return types.int64(), codegen

    return read


def variable(name):
    """Return a compiled function that reads a 64-bit integer, bound by `bind_variable`."""

    @intrinsic
    def read(typingctx):
        def codegen(context, builder, signature, args):
            return builder.load(_place(builder, name), typ=ir.IntType(64))

        return types.int64(), codegen

    return read


def _place(builder: Any, name: str) -> Any:
    """Return the address of what a symbol stands for; in a library, a cell has it."""
    word = ir.IntType(64)
    kind, symbol = (word.as_pointer(), CELL + name) if symbols.INDIRECT else (word, name)
    place = builder.module.globals.get(symbol)
    place = place or ir.GlobalVariable(builder.module, kind, symbol)
    if not symbols.INDIRECT:
        return place
    address = builder.load(place, typ=kind)
    address.set_metadata("invariant.load", builder.module.add_metadata([]))
    return address


def call_at(signature):
    """Return a compiled function that calls the C function at an address with a tuple."""
    parameters, returned = normalize_signature(signature)
    assert returned is not None

    @intrinsic
    def call(typingctx, place, arguments):
        def codegen(context, builder, types_of_call, args):
            kinds = [context.get_argument_type(kind) for kind in parameters]
            result = context.get_argument_type(returned)
            function = builder.inttoptr(args[0], ir.FunctionType(result, kinds).as_pointer())
            values = zip(parameters, cgutils.unpack_tuple(builder, args[1]), strict=True)
            given = [context.get_value_as_argument(builder, *each) for each in values]
            return context.get_returned_value(builder, returned, builder.call(function, given))

        return returned(place, types.Tuple(parameters)), codegen

    return call
