"""Checkpoint files, read and written according to the description of their format."""

import hashlib
import json

import numpy as np


def read(path):
    """The first line, and the arrays."""
    return parsed(path.read_bytes())


def parsed(whole):
    """The result of `read` for the content of a file."""
    line, _, content = whole.partition(b"\n")
    content, checksum = content[:-64], content[-64:].decode()
    assert checksum == hashlib.sha256(whole[:-64]).hexdigest()
    head, arrays = json.loads(line), {}
    assert _line(head) == line + b"\n"
    for name, kind, *shape in head["arrays"]:
        size = np.dtype(kind).itemsize * int(np.prod(shape))
        piece, content = content[:size], content[size:]
        arrays[name] = np.frombuffer(piece, kind).reshape(shape).copy()
    assert not content
    return head, arrays


def write(path, head, arrays, /, **other):
    """A file with valid checksums; the first line describes the arrays, or is changed."""
    content = b"".join(array.tobytes() for array in arrays.values())
    told = {"arrays": [[name, a.dtype.str, *a.shape] for name, a in arrays.items()]}
    whole = _line(head | told | other) + content
    path.write_bytes(whole + hashlib.sha256(whole).hexdigest().encode())


def _line(head):
    """The first line: entries in order, without spaces, with the checksum of the others."""
    others = {name: value for name, value in head.items() if name != "checksum"}
    own = {**others, "checksum": hashlib.sha256(_text(others)).hexdigest()}
    return _text(own) + b"\n"


def _text(entries):
    return json.dumps(entries, sort_keys=True, separators=(",", ":")).encode()
