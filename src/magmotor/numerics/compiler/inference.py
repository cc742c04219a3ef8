"""What Numba is told: the types of names that stand for its objects, and addresses of symbols."""

from typing import Any

import llvmlite.binding as llvm
from numba.core import compiler_lock, registry
from numba.extending import typeof_impl

import magmotor.numerics.compiler.constants  # noqa: F401  registers their type
from magmotor.numerics import symbols
from magmotor.numerics.constants import StandIn

for _symbol, _address in symbols.ADDRESSES.items():
    llvm.add_symbol(_symbol, _address)
LOCK: Any = compiler_lock.global_compiler_lock
"""Numba's lock, which the thread that compiles holds."""

_target: Any = registry.cpu_target  # whose members have no types


@typeof_impl.register(StandIn)
def _type(value: Any, _context: Any) -> Any:
    return _target.typing_context.resolve_value_type(value.real)


def refresh() -> None:
    """Let Numba read its lists of functions again, to which a new object may have added some."""
    _target.typing_context.refresh()
    _target.target_context.refresh()
