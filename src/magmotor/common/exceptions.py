"""The errors of this package, by type; `except mm.MagmotorError` catches all of them."""

import dataclasses
from typing import Any

import numpy as np

SHOWN = 200
"""Maximum number of characters of a value that a message shows."""

PLAIN = str | bytes | int | float | complex | np.ndarray | np.generic | None
"""Values that are sent to other processes with their error."""


class MagmotorError(Exception):
    """Base of all errors of this package; each is also one of Python's, such as ValueError."""


class InputError(MagmotorError, ValueError):
    """Something that was given is invalid: an argument, a model, a file or a combination of them.

    `ArgumentError` and `DeclarationError` say by their attributes what it is.
    """


class ArgumentError(InputError):
    """The value of an argument, or a number of a model or a file, is not allowed.

    Attributes
    ----------
    argument : str
        Its name.
    value : object
        Its value; in another process than that of the error, only its text if it is an object.
    allowed : str
        What is allowed, such as "must be at least 0".
    """

    def __init__(self, argument: str, value: Any, allowed: str):
        self.argument, self.value, self.allowed = argument, value, allowed
        super().__init__(f"{argument} = {_shown(value)}: {allowed}")

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle all arguments, but the text of a value that may not be pickled."""
        value = self.value if isinstance(self.value, PLAIN) else _Text(_shown(self.value))
        return type(self), (self.argument, value, self.allowed)


class DeclarationError(InputError):
    """What a model declares about its magnets, fields, noise or sensors is invalid.

    While MuJoCo steps, the same fault is a `mujoco.FatalError` with the same sentence.

    Attributes
    ----------
    kind : str
        What is wrong, such as "moment", "coil" or "coincidence": a name of
        `magmotor.mjcf.error_numbers`.
    element : int
        The number of the first site, body, tuple, ... that the sentence names, or -1.
    """

    def __init__(self, sentence: str, kind: str, element: int):
        self.kind, self.element = kind, element
        super().__init__(sentence)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle all arguments."""
        return type(self), (str(self), self.kind, self.element)


class _Text(str):
    """The text of a value."""

    __slots__ = ()
    __repr__ = str.__str__


def _shown(value: Any) -> str:
    """Return a value as text; of a record with many fields, only the name of its class."""
    text = " ".join(repr(value.item() if isinstance(value, np.generic) else value).split())
    if len(text) <= SHOWN:
        return text
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return f"{type(value).__name__}(...)"
    return f"{text[: SHOWN - 3]}..."
