"""The addresses of the C functions and variables to which compiled code is bound, by symbol."""

import sys
from typing import Protocol

ADDRESSES: dict[str, int] = {}

INDIRECT = False
"""Whether code that Numba compiles shall find addresses in cells, as a library needs it."""


class Binds(Protocol):
    """Code in which symbols are bound to addresses."""

    def bind(self, symbol: str, address: int) -> None:
        """Bind a symbol, if the code has it."""


_libraries: list[Binds] = []


def bind(symbol: str, address: int) -> None:
    """Bind a symbol: now if LLVM is there, or else when it is imported for our code."""
    ADDRESSES[symbol] = address
    for library in _libraries:
        library.bind(symbol, address)
    llvm = sys.modules.get("llvmlite.binding")
    if llvm is not None:
        llvm.add_symbol(symbol, address)


def bind_in(library: Binds) -> None:
    """Bind all symbols in a library, also those that are not known yet."""
    _libraries.append(library)
    for symbol, address in [*ADDRESSES.items()]:  # another thread may bind more
        library.bind(symbol, address)
