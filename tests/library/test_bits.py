"""The same bits on every processor: code for three types of processors and for this one."""

import json
from pathlib import Path

import llvmlite.binding as llvm
import numpy as np
import pytest
from numba import njit
from numba.core import config

import magmotor as mm
from magmotor.devices.motor.states import start_motor
from magmotor.dipoles import pack_sources
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.constants import COUNT
from magmotor.numerics.simd import (
    broadcast,
    fused,
    lane_numbers,
    load,
    minimum,
    total,
    where_less,
)
from trials.bits import (
    CASES,
    PROCESSORS,
    RECORD,
    SUMS,
    checksums,
    finish,
    runs_here,
    start,
    versions,
)


@pytest.fixture(scope="module")
def found():
    """Checksums: all for this processor, and those of sums for one of other vectors, if it can.

    That is Haswell, which has AVX2, or on Haswell itself Zen, with other orders of instructions.
    Where this processor has AVX-512, also those of many magnets, by tiles and by clusters.
    `python -m trials.bits --record` compares all cases on all processors.
    """
    others = (name for name in PROCESSORS if name != llvm.get_host_cpu_name() and runs_here(name))
    other = next(others, None)
    if other is None:
        pytest.skip("no processor of x86-64-v3")
    wider = ["many magnets"] if runs_here("skylake-avx512") else []
    process = start(other, *SUMS, *wider)
    own = checksums(*CASES)
    return {"this": own, other: finish(process)}


def test_every_processor_computes_the_same_bits(found):
    for name, theirs in found.items():
        assert theirs == {case: found["this"][case] for case in theirs}, name


def test_the_bits_are_those_recorded(found):
    record = json.loads(RECORD.read_text())
    if record["versions"] != versions():
        pytest.skip("recorded with other versions")
    assert found["this"] == record["checksums"]  # written by `python -m trials.bits --record`


@njit
def _sums(array, count):
    sums, nearest = broadcast(0.0), broadcast(np.inf)
    for j in range(0, count, COUNT):
        inside = broadcast(float(count - j))
        value = where_less(lane_numbers(), inside, load(array, 0, j), broadcast(0.0))
        sums = fused(value, load(array, 1, j), sums)
        nearest = where_less(value, nearest, value, nearest)
    return total(sums), minimum(nearest)


def test_an_eight_is_eight_doubles_added_by_a_fixed_tree():
    rows = np.random.default_rng(1).normal(size=(100, 2, 8))
    found, smallest = np.array([_sums(row, 8) for row in rows]).T
    lanes = (rows[:, 0] * rows[:, 1]).T
    halves = lanes[:4] + lanes[4:]
    quarters = halves[:2] + halves[2:]
    np.testing.assert_array_equal(found, quarters[0] + quarters[1])
    np.testing.assert_array_equal(smallest, rows[:, 0].min(axis=1))
    neighbors = lanes[::2] + lanes[1::2]
    neighbors = neighbors[::2] + neighbors[1::2]
    assert (found != neighbors[0] + neighbors[1]).any()  # 51 rows
    assert (found != sum(lanes)).any()  # 52
    found = np.array([_sums(row, 3)[0] for row in rows])
    np.testing.assert_array_equal(found, (lanes[0] + lanes[2]) + lanes[1])


def test_no_compiled_function_may_reorder_sums():
    package = Path(mm.__file__).parent
    texts = {file.name: file.read_text() for file in package.rglob("*.py")}
    assert "simd.py" in texts
    for word in ("fastmath", "reassoc", '"contract"', '"fast"'):
        assert not [name for name, text in texts.items() if word in text]


def test_multiplication_and_addition_are_rounded_once():
    @njit
    def error(a, b):
        return fused(a, b, -(a * b))

    assert error(1 + 2.0**-30, 1 + 2.0**-30) == 2.0**-60


def test_sources_are_padded_to_whole_eights():
    sources = pack_sources(np.ones((9, 3)), np.ones((9, 3)))
    assert sources.shape == (7, 16)
    np.testing.assert_array_equal(sources[6], [0] * 9 + [-1] * 7)


def test_every_processor_has_its_own_index_in_the_cache(monkeypatch):
    def index(processor):
        monkeypatch.setattr(config, "CPU_NAME", processor)
        return compiled_once()(_identity)()._cache.files.stem

    assert index("haswell") == index("haswell") != index("skylake-avx512")


def _identity(checksum):
    def identity(x):
        _ = checksum
        return x

    return identity


def test_the_motor_starts_where_the_slope_changes_its_sign():
    scene = mm.Motor()
    x = start_motor(scene).position[0, 0, 0]

    def slope(radius):
        place = [radius, 0.0, scene.ball_radius]
        field = mm.dipoles.field(place, *scene.ring_sources())
        moment = scene.moment * field / np.linalg.norm(field)
        return -mm.dipoles.wrench(place, moment, *scene.ring_sources())[0][0]

    assert slope(x) <= 0 < slope(np.nextafter(x, 1))
