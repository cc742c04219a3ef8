"""The addresses of the C functions and variables to which compiled code is bound, by symbol."""

_addresses: dict[str, int] = {}
_binders: list = []


def bind(symbol: str, address: int) -> None:
    """Bind a symbol, now or when compiled code is loaded."""
    _addresses[symbol] = address
    for add in _binders:
        add(symbol, address)


def give_to(add) -> None:
    """Call a function with each symbol and its address, also with those that are bound later."""
    _binders.append(add)
    for symbol, address in [*_addresses.items()]:
        add(symbol, address)
