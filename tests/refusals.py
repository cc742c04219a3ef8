"""What a refusal is, without its words: those are in the tables of tests/messages."""

import pytest

import magmotor as mm


def refused(argument):
    """Expect an `ArgumentError` about `argument`."""
    return pytest.raises(mm.ArgumentError, check=lambda error: error.argument == argument)


def misdeclared(kind, element):
    """Expect a `DeclarationError` of this kind about this element."""
    is_it = lambda error: (error.kind, error.element) == (kind, element)  # noqa: E731
    return pytest.raises(mm.DeclarationError, check=is_it)
