"""Responses of pieces of iron, which Python computes once per process, and kernels find.

A response depends on the shape and the material of a piece; see `numerics/iron/response.py`. It is
kept until the process ends, so that kernels can read it without a lock.
"""

import ctypes
import threading
from typing import Any

import numpy as np

from magmotor.mjcf import memory
from magmotor.numerics import c_types as types
from magmotor.numerics.deferred import External, subroutine
from magmotor_plugin.c_callbacks import interrupted, returning

NUMBERS = 7
"""Numbers on which a response depends: type and three sizes of a geom, the susceptibility, the
largest distance between nodes in m, or 0 for an automatic one, and whether the material saturates.
"""

KEY, COUNT, PADDED, RADIUS, VOLUME, DISTANCES, START = 1, 8, 9, 10, 11, 12, 15
"""Words of a response, after the address of the next one: the numbers above; how many nodes there
are, and that number padded to whole eights; the radius of the balls of charge at nodes; the volume;
the distances of nodes on flat faces, or 0; and where the rows x, y, z of the nodes and
the slopes of modes start, which the matrix follows, or the modes if the material saturates."""

ROWS = 4
"""Number of rows before the matrix."""

BITS = 8
"""Responses are kept in 2^8 lists."""

MARK = b"MAGIRON1"
"""The first eight bytes of a file of responses."""

_lists = (ctypes.c_int64 * (1 << BITS))()
_lists_address = memory.variable("magmotor_responses_address")
_compute = External("magmotor_compute_response", types.int64(types.int64, types.int64))
_kept: dict[tuple[float, ...], Any] = {}
_lock = threading.RLock()


def bind() -> None:
    """Bind the lists, and the function that computes, to their symbols in compiled code."""
    memory.bind_storage("magmotor_responses_address", _lists)
    memory.bind_function("magmotor_compute_response", _computed)


@subroutine
def response_of(geom, material, m, offsets):
    """Return the address of the response of a geom of a material, or 0 if there is none.

    It is computed if need be. The numbers of the material are those of a tuple of iron.
    """
    place = memory.details_on_stack()
    key = memory.numbers(place, 1, NUMBERS)[0]
    shape = memory.integers(m[offsets.geom_type // 8], memory.UNBOUNDED)
    size = memory.numbers(m[offsets.geom_size // 8], memory.UNBOUNDED, 3)
    key[0], key[4] = shape[geom], material[0]
    for k in range(3):
        key[1 + k] = size[geom, k]
    key[5] = material[2] if len(material) > 2 else 0.0
    key[6] = 1.0 if len(material) > 1 and material[0] > 0.0 and material[1] > 0.0 else 0.0
    number, bits = np.uint64(0), memory.words(place, NUMBERS)
    for k in range(NUMBERS):
        number = (number + np.uint64(bits[k])) * memory.MULTIPLIER
    head = _lists_address() + 8 * memory.spread(np.int64(number), BITS)
    address = memory.load_shared(head)
    while address != 0:
        words, same = memory.words(address, START), True
        for k in range(NUMBERS):
            same = same and words[KEY + k] == bits[k]
        if same:
            return address
        address = words[0]
    return _compute(place, head)


@ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, ctypes.c_int64)
@returning
def _computed(place: int, head: int) -> int:
    """Compute a response, and return its address."""
    key = tuple((ctypes.c_double * NUMBERS).from_address(place))
    if interrupted.is_set():
        return 0
    with _lock:
        if key not in _kept:
            from magmotor.numerics.iron.response import of_geom

            block = _block(key, of_geom(int(key[0]), key[1:4], key[4], key[5]))
            first = ctypes.c_int64.from_address(head)
            block[0] = first.value
            _kept[key] = block
            first.value = block.ctypes.data  # last, since other threads read it without a lock
        return _kept[key].ctypes.data


def _block(key: tuple[float, ...], response: Any) -> Any:
    """Return the words of a response."""
    count = len(response.points)
    padded = -(-count // 8) * 8
    words = np.zeros(START + (ROWS + count) * padded, np.int64)
    numbers = words.view(float)
    numbers[KEY:COUNT] = key
    words[COUNT], words[PADDED] = count, padded
    numbers[RADIUS], numbers[VOLUME] = response.radius, response.volume
    numbers[DISTANCES:START] = response.distances
    rows = numbers[START:].reshape(ROWS + count, padded)
    rows[:3, :count], rows[3, :count] = response.points.T, response.slopes
    rows[ROWS:, :count] = response.modes if key[6] else response.matrix
    return words


def kept() -> list[Any]:
    """Return the words of all responses that this process has computed."""
    with _lock:
        return list(_kept.values())
