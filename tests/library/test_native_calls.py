"""How Python calls functions of the library: words of arguments, results, and the GIL."""

import ctypes
import struct
import sys
import threading
import weakref

import numpy as np
import pytest
from numba import typeof

import magmotor as mm
from library.ahead_of_time import kind_of
from magmotor import dipoles
from magmotor.numerics import native_library
from magmotor.numerics.native_calls import NativeFunction, _packed
from magmotor.numerics.native_library import Version

BUILT = pytest.mark.skipif(
    native_library.library() is None, reason="there is no library: python -m library.build"
)


@BUILT
def test_other_threads_go_on_while_the_library_computes():
    """This thread keeps the GIL for 1000 s unless a call releases it."""
    interval, done, woken = sys.getswitchinterval(), threading.Event(), []

    def wake():
        while not done.wait(1e-3):
            woken.append(1)

    targets, sources = np.ones((4096, 6)), np.zeros((6, 4096))
    arguments = targets, sources, np.empty((4096, 7))
    call = dipoles._force_and_field._call_with(arguments)
    assert call is not None
    thread = threading.Thread(target=wake)
    try:
        sys.setswitchinterval(1000)
        thread.start()
        before, calls = len(woken), 0
        while len(woken) == before and calls < 1000:  # the other thread may take a while
            call()
            calls += 1
        goes_on = len(woken) > before
    finally:
        sys.setswitchinterval(interval)
        done.set()
        thread.join()
    assert goes_on


@pytest.mark.parametrize(
    "value",
    [
        1, -(2**63), 2**63, True, 1.5, np.bool_(True), np.int32(3), np.int64(4), np.uint64(2**63),
        np.float64(2.5), np.zeros(3), np.zeros((2, 3)), np.zeros((2, 3), order="F"),
        np.zeros((4, 4))[::2, ::2], np.zeros((2, 0)), np.zeros(3, int), np.zeros((2, 3, 4)),
        np.broadcast_to(0.0, (2, 2)), (), (1, 2.0), (np.zeros(2), (True, 3)), None, (None, 2.0),
        np.longlong(5), np.uint64(5), np.ulonglong(5),
    ],
    ids=repr,
)  # fmt: skip
def test_arguments_are_named_as_their_types_are_when_the_library_is_built(value):
    """Otherwise, code for other types would run."""
    assert _packed(value)[0] == kind_of(typeof(value))


@pytest.mark.parametrize(
    "value",
    [
        np.zeros(3, ">f8"), np.frombuffer(bytes(25), np.uint8)[1:].view(float), np.float32(1), "d",
        type("q", (int,), {})(5), [1.0],
    ],
    ids=repr,
)  # fmt: skip
def test_what_no_version_takes_has_a_kind_of_its_own(value):
    """Numba then decides; such arrays would be read as others, and a type named q as a word."""
    assert _packed(value) == ("of another type", b"")


def test_errors_are_those_of_numba():
    with pytest.raises(ZeroDivisionError):
        mm.noise.normal(1, 2, 3, 4, 0, 0)
    with pytest.raises(OverflowError):
        mm.noise.normal(2**64, 2, 3, 4, 1, 0)


def test_words_of_arguments_are_those_that_numba_passes():
    array = np.arange(6.0).reshape(2, 3)
    kind, words = _packed((array, 1.5, True, np.uint64(2**64 - 1), None, 7))
    found = [*np.frombuffer(words, np.int64)]
    assert kind == "(d2C,d,?,Q,NoneType,q)"
    assert found[:9] == [0, 0, 6, 8, array.ctypes.data, 2, 3, 24, 8]
    assert found[9] == np.float64(1.5).view(np.int64)
    assert found[10:] == [1, -1, 0, 7]


@pytest.mark.parametrize(
    ("format", "words", "result"),
    [("", [], None), ("q", [-3], -3), ("qd", [-3, 2], (-3, 2.0)), ("?", [1], True)],
)
def test_results_are_those_of_python(format, words, result):
    @ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p)
    def compiled(_, room):
        struct.pack_into(f"<{format}", (ctypes.c_char * 16).from_address(room), 0, *words)
        return 0

    call = _native(compiled, "q", format).call_with((1,))
    assert call is not None
    assert call() == result


def test_each_call_passes_its_own_arguments():
    """Words of tuples are kept from call to call, those of arrays are not."""
    found = []

    @ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p)
    def compiled(words, _):
        found.append([*(ctypes.c_int64 * 12).from_address(words)])
        return 0

    function = _native(compiled, "(q,q),q,d1C,q", "")
    first, second, array = (1, 2), (3, 4), np.zeros(2)
    for arguments in ((first, 5, array, 6), (first, 7, array, 8), (second, 5, array, 6)):
        call = function.call_with(arguments)
        assert call is not None
        call()
    numbers = [[*words[:3], words[10]] for words in found]
    assert numbers == [[1, 2, 5, 6], [1, 2, 7, 8], [3, 4, 5, 6]]
    kept = weakref.ref(array)
    del array, arguments, call
    assert kept() is None


def test_a_function_that_the_library_lacks_takes_all_arguments():
    assert NativeFunction([]).call_with((2**64,)) is None


def _native(compiled, arguments, result):
    address = ctypes.cast(compiled, ctypes.c_void_p).value or 0
    return NativeFunction([Version(address, arguments, result)])
