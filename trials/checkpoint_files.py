"""Checkpoint files, read and written according to the description of their format."""

import json
import zlib

import numpy as np


def read(path):
    """The first line, and the arrays."""
    return parsed(path.read_bytes())


def parsed(whole):
    """The result of `read` for the content of a file."""
    line, _, content = whole.partition(b"\n")
    mark, checksum, text = line[:19], line[20:28], line[29:]
    assert mark == b"magmotor checkpoint"
    assert int(checksum, 16) == zlib.crc32(text + b"\n")
    head, arrays = json.loads(text), {}
    for name, kind, *shape in head["arrays"]:
        size = np.dtype(kind).itemsize * int(np.prod(shape))
        piece, content = content[:size], content[size:]
        arrays[name] = np.frombuffer(piece, kind).reshape(shape).copy()
    assert not content
    return head, arrays


def write(path, head, arrays, /, **other):
    """A file with valid checksums; the first line describes the arrays, or is changed."""
    content = b"".join(array.tobytes() for array in arrays.values())
    told = {
        "arrays": [[name, a.dtype.str, *a.shape] for name, a in arrays.items()],
        "checksum": zlib.crc32(content),
    }
    text = json.dumps(head | told | other).encode() + b"\n"
    path.write_bytes(b"magmotor checkpoint %08x " % zlib.crc32(text) + text + content)
