"""The magnetism callback: dipole forces and torques for any MJCF with dipole sites.

A dipole is a site: its z axis is the dipole's direction, the first of its `user` numbers the
moment in A m^2 (zero or none: not a dipole). Dipoles of one rigid body do not act on one another.
Bodies that can move and carry dipoles get the wrench in `xfrc_applied`, which is overwritten.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import ctypes
import inspect
import threading
import warnings
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

import mujoco
import numpy as np
from numba import cfunc, literal_unroll, njit, types

from magmotor import dipoles
from magmotor.dipoles import COINCIDENCE_SQUARED, sum_over_sources
from magmotor.engines.mujoco import layout, memory

_SIGNATURE = types.void(types.int64, types.int64)
UNBOUNDED = 1 << 30
_C_TYPE = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)


@njit(inline="always")
def _dipole(i, moment, position, frame):
    """Position and moment of a site: its z axis is the third column of its frame."""
    strength = moment[i, 0]
    x, y, z = position[i, 0], position[i, 1], position[i, 2]
    return x, y, z, strength * frame[i, 2], strength * frame[i, 5], strength * frame[i, 8]


def compile_callback(offsets: layout.Layout, kernels: int):
    """Compile the callback for one layout of the structs, or load it from Numba's disk cache.

    The offsets and `kernels` (a checksum of the modules compiled in) are closure cells, because
    Numba's cache keys hold a function's bytecode and cells but not its globals or what it calls.
    They are plain numbers: a compiled function among them would be a new key in every process.
    """

    @cfunc(_SIGNATURE, cache=True, error_model="numpy")
    def callback(model, data):
        _ = kernels  # a part of the cache's key
        m = memory.words(model, UNBOUNDED)
        d = memory.words(data, UNBOUNDED)
        nsite = m[offsets.nsite // 8]
        nuser = m[offsets.nuser_site // 8]
        moment = memory.numbers(m[offsets.site_user // 8], nsite, nuser)
        body_of = memory.integers(m[offsets.site_bodyid // 8], nsite)
        weld_of = memory.integers(m[offsets.body_weldid // 8], UNBOUNDED)
        freedoms = memory.integers(m[offsets.body_dofnum // 8], UNBOUNDED)
        position = memory.numbers(d[offsets.site_xpos // 8], nsite, 3)
        frame = memory.numbers(d[offsets.site_xmat // 8], nsite, 9)
        centre = memory.numbers(d[offsets.xipos // 8], UNBOUNDED, 3)
        applied = memory.numbers(d[offsets.xfrc_applied // 8], UNBOUNDED, 6)

        sources = memory.stack_tile()
        dipole_count = 0
        start = 0 if nuser > 0 else nsite
        while start < nsite:
            first = start
            count = 0
            while start < nsite and count < memory.TILE:
                if moment[start, 0] != 0.0:
                    source = _dipole(start, moment, position, frame)
                    for row in literal_unroll((0, 1, 2, 3, 4, 5)):
                        sources[row, count] = source[row]
                    sources[6, count] = weld_of[body_of[start]]
                    count += 1
                start += 1
            dipole_count += count
            last_body = -1
            for i in range(nsite):
                body = body_of[i]
                weld = weld_of[body]
                if freedoms[weld] == 0 or moment[i, 0] == 0.0:
                    continue
                if first == 0 and body != last_body:
                    applied[body] = 0.0
                last_body = body
                target = _dipole(i, moment, position, frame)
                fx, fy, fz, bx, by, bz, coincident = sum_over_sources(target, weld, sources, count)
                if coincident > 0:
                    names = m[offsets.names // 8]
                    starts = memory.integers(m[offsets.name_siteadr // 8], nsite)
                    for j in range(first, start):
                        gap = position[i] - position[j]
                        near = np.sum(gap * gap) < COINCIDENCE_SQUARED
                        if near and moment[j, 0] != 0.0 and weld_of[body_of[j]] != weld:
                            memory.fatal_coincidence(i, names + starts[i], j, names + starts[j])
                x, y, z, mx, my, mz = target
                x -= centre[body, 0]
                y -= centre[body, 1]
                z -= centre[body, 2]
                applied[body, 0] += fx
                applied[body, 1] += fy
                applied[body, 2] += fz
                applied[body, 3] += my * bz - mz * by + y * fz - z * fy
                applied[body, 4] += mz * bx - mx * bz + z * fx - x * fz
                applied[body, 5] += mx * by - my * bx + x * fy - y * fx
        if dipole_count == 0 and memory.no_dipoles_reported() == 0:
            memory.report_no_dipoles()

    return callback


@cache
def compiled_callback():
    """The callback for the MuJoCo that is running, compiled once a process at the most."""
    memory.bind_function("mju_error", memory.library().mju_error)
    memory.bind_function("magmotor_report_no_dipoles", _report)
    memory.bind_variable("magmotor_no_dipoles_reported", _reported)
    sources = (inspect.getsource(module) for module in (dipoles, memory))
    return compile_callback(layout.current(), zlib.crc32("".join(sources).encode()))


_reported = ctypes.c_int64(0)


@ctypes.CFUNCTYPE(None)
def _report():
    _reported.value = 1
    warnings.warn(
        'this model has no dipole sites: give a site user="MOMENT" in A m^2 and let its z axis'
        " point along the dipole; magnetism does nothing here",
        stacklevel=2,
    )


_lock = threading.Lock()
_depth = 0
_previous = None


@contextmanager
def magnetism() -> Iterator[None]:
    """Make every MuJoCo model with dipole sites magnetic inside a `with` block.

    The callback is installed as `mjcb_control`, for all models and threads of the process, and
    what was installed before is put back at the end. Blocks may be nested and may overlap in
    several threads. It works with `mj_step`, `mj_forward`, `mujoco.rollout`,
    `mujoco.batch.Batch` and the viewer, without the GIL.

    Warns
    -----
    UserWarning
        Once a block, when a model without dipole sites is stepped.

    Raises
    ------
    LayoutError
        This version of MuJoCo keeps its data in other places than it declares.
    mujoco.FatalError
        While stepping: two dipoles of different bodies coincide; the message names the sites.

    Notes
    -----
    Forces follow physics of point dipoles: F = grad(m.B), torque m x B. Actuation must not be
    disabled by flag, since MuJoCo then skips the callback.
    """
    global _depth, _previous
    with _lock:
        if _depth == 0:
            function = _C_TYPE(compiled_callback().address or 0)
            _reported.value = 0
            _previous = mujoco.get_mjcb_control()
            mujoco.set_mjcb_control(function)
        _depth += 1
    try:
        yield
    finally:
        with _lock:
            _depth -= 1
            if _depth == 0:
                mujoco.set_mjcb_control(_previous)
                _previous = None
