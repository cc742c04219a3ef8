"""Files that reveal damage, of checkpoints and sweeps.

They are JSON with a checksum among its entries, or bytes that end in a checksum, or both.
"""

import hashlib
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from magmotor.common.exceptions import InputError

SUM = "checksum"
LENGTH = 64
"""Characters in a checksum: SHA-256 in hexadecimal digits."""


class Damaged(InputError):
    """A file does not contain what was written to it."""


@contextmanager
def naming_damage(file: Path) -> Iterator[None]:
    """Name the file in any `Damaged` error that is raised inside a `with` block."""
    try:
        yield
    except Damaged as damage:
        raise Damaged(f"{file} is damaged: {damage}") from None


def canonical(spec: Any) -> bytes:
    """Encode as canonical JSON, in which equal objects have equal bytes."""
    return json.dumps(spec, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()


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
    return content + checksum_of(key.encode(), content)


def verified_bytes(content: bytes, key: str) -> bytes:
    """Return the content that was passed to `bytes_with_checksum`.

    Raises
    ------
    Damaged
        Any byte or the key differs.
    """
    content, checksum = content[:-LENGTH], content[-LENGTH:]
    if checksum != checksum_of(key.encode(), content):
        raise Damaged("its checksum differs")
    return content


def checksum_of(*pieces: bytes | memoryview) -> bytes:
    """Return the checksum of pieces of a file, `LENGTH` characters."""
    digest = hashlib.sha256()
    for piece in pieces:
        digest.update(piece)
    return digest.hexdigest().encode()
