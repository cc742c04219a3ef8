"""Content that shows damage: JSON with a checksum among its entries, bytes that end in one."""

import hashlib
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from magmotor.sweep.case import canonical

SUM = "checksum"
LENGTH = 64
"""Characters of a checksum, SHA-256 in hexadecimal digits."""


class Damaged(ValueError):
    """A file of a sweep does not hold what was written to it."""


@contextmanager
def naming(file: Path) -> Iterator[None]:
    """Say which file is damaged, if inside a `with` block one is found to be."""
    try:
        yield
    except Damaged as damage:
        raise Damaged(f"{file} is damaged: {damage}") from None


def parsed(content: str | bytes) -> Any:
    """JSON from a file, whatever it holds; ValueError if it is none."""
    try:
        return json.loads(content)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None


def sealed(entries: dict[str, Any]) -> bytes:
    """A file of JSON with a checksum of all its entries."""
    return canonical({**entries, SUM: hashlib.sha256(canonical(entries)).hexdigest()}) + b"\n"


def opened(content: bytes) -> dict[str, Any]:
    """The entries that `sealed` was given.

    Raises
    ------
    Damaged
        Any byte is another.
    """
    try:
        entries = parsed(content)
        del entries[SUM]
        if sealed(entries) == content:
            return entries
    except (ValueError, TypeError, KeyError):
        pass
    raise Damaged("its checksum differs")


def sealed_bytes(content: bytes, key: str) -> bytes:
    """The content and, at its end, where netCDF does not look, a checksum of content and key."""
    return content + _checksum(content, key)


def opened_bytes(content: bytes, key: str) -> bytes:
    """The content that `sealed_bytes` was given.

    Raises
    ------
    Damaged
        Any byte is another, or the key is.
    """
    content, checksum = content[:-LENGTH], content[-LENGTH:]
    if checksum != _checksum(content, key):
        raise Damaged("its checksum differs")
    return content


def _checksum(content: bytes, key: str) -> bytes:
    found = hashlib.sha256(key.encode())
    found.update(content)
    return found.hexdigest().encode()
