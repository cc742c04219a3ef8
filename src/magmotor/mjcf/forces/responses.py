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

SATURATES, MATERIAL, PER_GEOM = 2, 3, 7
"""Numbers on which a response depends: the susceptibility, the largest distance between nodes in m,
or 0 for an automatic one, and whether the material saturates; and for each geom, its type, its
size, and its position."""

(
    NEXT, KEY, GEOMS, COUNT, PADDED, RADIUS, VOLUME, CENTER, EXTENT, FACES, FACE, CAPACITY, POINTS,
    POINT, START,
) = (
    0, 1, 2, 3, 4, 5, 6, 7, 10, 11, 12, 13, 14, 15, 16
)  # fmt: skip
"""Words of a response: the address of the next one; where the numbers above start, and for how many
geoms; how many nodes there are, and that number padded to whole eights; the radius of the balls of
charge at nodes; the volume; the center in the frame of the first geom, and the radius of a sphere
around the nodes; how many rectangles of flat faces there are, and where they start; the capacity in
m; how many points there are for gaps, and where they start; and where the rows x, y, z of the
nodes, the slopes of modes and the equilibrium start, which the matrix follows, or the modes if the
material saturates, and the reluctances."""

ROWS = 5
"""Number of rows before the matrix."""

BITS = 8
"""Responses are kept in 2^8 lists."""

MARK = b"MAGIRON5"
"""The first eight bytes of a file of responses."""

_lists = (ctypes.c_int64 * (1 << BITS))()
_lists_address = memory.variable("magmotor_responses_address")
_compute = External("magmotor_compute_response", types.int64(types.int64, types.int64, types.int64))
_kept: dict[tuple[float, ...], Any] = {}
_lock = threading.RLock()


def bind() -> None:
    """Bind the lists, and the function that computes, to their symbols in compiled code."""
    memory.bind_storage("magmotor_responses_address", _lists)
    memory.bind_function("magmotor_compute_response", _computed)


@subroutine
def response_of(key, geoms):
    """Return the address of the response of a piece of some geoms, or 0 if there is none.

    It is computed if need be. The numbers of the key are those above.
    """
    count = MATERIAL + PER_GEOM * geoms
    number, bits = np.uint64(0), memory.words(key.ctypes.data, count)
    for k in range(count):
        number = (number + np.uint64(bits[k])) * memory.MULTIPLIER
    head = _lists_address() + 8 * memory.spread(np.int64(number), BITS)
    address = memory.load_shared(head)
    while address != 0:
        words = memory.words(address, START)
        same = words[GEOMS] == geoms
        if same:
            known = memory.words(address + 8 * words[KEY], count)
            for k in range(count):
                same = same and known[k] == bits[k]
        if same:
            return address
        address = words[NEXT]
    return _compute(key.ctypes.data, geoms, head)


@ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, ctypes.c_int64, ctypes.c_int64)
@returning
def _computed(place: int, geoms: int, head: int) -> int:
    """Compute a response, and return its address."""
    key = tuple((ctypes.c_double * (MATERIAL + PER_GEOM * geoms)).from_address(place))
    if interrupted.is_set():
        return 0
    with _lock:
        if key not in _kept:
            from magmotor.numerics.iron.response import of_geoms

            numbers = np.array(key[MATERIAL:]).reshape(geoms, PER_GEOM)
            response = of_geoms(numbers[:, 0], numbers[:, 1:4], numbers[:, 4:], *key[:2])
            block = _block(key, response)
            first = ctypes.c_int64.from_address(head)
            block[NEXT] = first.value
            _kept[key] = block
            first.value = block.ctypes.data  # last, since other threads read it without a lock
        return _kept[key].ctypes.data


def _block(key: tuple[float, ...], response: Any) -> Any:
    """Return the words of a response."""
    count = len(response.points)
    padded = -(-count // 8) * 8
    face = START + (ROWS + 2 * count) * padded
    point = face + response.faces.size
    start = point + response.gap_points.size
    words = np.zeros(start + len(key), np.int64)
    numbers = words.view(float)
    numbers[start:], words[KEY], words[GEOMS] = key, start, len(key) // PER_GEOM
    words[COUNT], words[PADDED] = count, padded
    numbers[RADIUS], numbers[VOLUME] = response.radius, response.volume
    numbers[CENTER:EXTENT], numbers[EXTENT] = response.center, response.extent
    numbers[CAPACITY] = response.capacity
    words[POINTS], words[POINT] = response.gap_points.shape[1], point
    numbers[face:point], numbers[point:start] = response.faces.ravel(), response.gap_points.ravel()
    words[FACES], words[FACE] = len(response.faces), face
    rows = numbers[START:face].reshape(ROWS + 2 * count, padded)
    rows[:3, :count] = response.points.T
    rows[3, :count], rows[4, :count] = response.slopes, response.equilibrium
    rows[ROWS : ROWS + count, :count] = response.modes if key[2] else response.matrix
    rows[ROWS + count :, :count] = response.reluctances
    return words


def kept() -> list[Any]:
    """Return the words of all responses that this process has computed."""
    with _lock:
        return list(_kept.values())
