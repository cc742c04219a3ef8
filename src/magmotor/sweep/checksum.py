"""Files that reveal damage: JSON with a checksum among its entries, and bytes that end in one."""

import hashlib
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from magmotor.common.exceptions import InputError
from magmotor.sweep.case import canonical

SUM = "checksum"
LENGTH = 64
"""Characters in a checksum: SHA-256 in hexadecimal digits."""


class Damaged(InputError):
    """A file of a sweep does not contain what was written to it."""


@contextmanager
def naming_damage(file: Path) -> Iterator[None]:
    """Name the file in any `Damaged` error that is raised inside a `with` block."""
    try:
        yield
    except Damaged as damage:
        raise Damaged(f"{file} is damaged: {damage}") from None


def parsed(content: str | bytes) -> Any:
    """Parse untrusted JSON; ValueError if it is invalid."""
    try:
        return json.loads(content)
    except RecursionError:
        raise InputError("it is nested too deeply") from None


def with_checksum(entries: dict[str, Any]) -> bytes:
    """Return the content of a JSON file that includes a checksum of all its entries."""
    return canonical({**entries, SUM: hashlib.sha256(canonical(entries)).hexdigest()}) + b"\n"


def verified(content: bytes) -> dict[str, Any]:
    """Return the entries that were passed to `with_checksum`.

    Raises
    ------
    Damaged
        Any byte differs.
    """
    try:
        entries = parsed(content)
        del entries[SUM]
        if with_checksum(entries) == content:
            return entries
    except (ValueError, TypeError, KeyError):
        pass
    raise Damaged("its checksum differs")


def bytes_with_checksum(content: bytes, key: str) -> bytes:
    """Append a checksum of content and key, which netCDF ignores at the end of a file."""
    return content + _checksum(content, key)


def verified_bytes(content: bytes, key: str) -> bytes:
    """Return the content that was passed to `bytes_with_checksum`.

    Raises
    ------
    Damaged
        Any byte or the key differs.
    """
    content, checksum = content[:-LENGTH], content[-LENGTH:]
    if checksum != _checksum(content, key):
        raise Damaged("its checksum differs")
    return content


def _checksum(content: bytes, key: str) -> bytes:
    digest = hashlib.sha256(key.encode())
    digest.update(content)
    return digest.hexdigest().encode()
