"""The addresses of the C functions and variables to which compiled code is bound, by symbol."""

import sys

ADDRESSES: dict[str, int] = {}


def bind(symbol: str, address: int) -> None:
    """Bind a symbol: now if LLVM is there, or else when it is imported for our code."""
    ADDRESSES[symbol] = address
    llvm = sys.modules.get("llvmlite.binding")
    if llvm is not None:
        llvm.add_symbol(symbol, address)
