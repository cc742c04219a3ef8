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
from numba import cfunc, types

from magmotor import dipoles
from magmotor.dipoles import COINCIDENCE_SQUARED, sum_over_sources
from magmotor.engines.mujoco import layout, memory

_SIGNATURE = types.void(types.int64, types.int64)
_C_TYPE = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)


def compile_callback(offsets: layout.Layout, kernels: int):
    """Compile the callback for one layout of the structs, or load it from Numba's disk cache.

    The offsets and `kernels` (a checksum of the modules compiled in) are closure cells, because
    Numba's cache keys hold a function's bytecode and cells but not its globals or what it calls.
    They are plain numbers: a compiled function among them would be a new key in every process.
    """

    @cfunc(_SIGNATURE, cache=True, error_model="numpy")
    def callback(model, data):
        _ = kernels  # a part of the cache's key
        m = memory.words(model, 1 << 20)
        d = memory.words(data, 1 << 20)
        nsite = m[offsets.nsite // 8]
        nuser = memory.integers(model + offsets.nuser_site, 1)[0]
        if nsite == 0 or nuser == 0:
            if memory.no_dipoles_reported() == 0:
                memory.report_no_dipoles()
            return
        moment = memory.numbers(m[offsets.site_user // 8], nsite, nuser)
        body_of = memory.integers(m[offsets.site_bodyid // 8], nsite)
        weld_of = memory.integers(m[offsets.body_weldid // 8], 1 << 20)
        freedoms = memory.integers(m[offsets.body_dofnum // 8], 1 << 20)
        position = memory.numbers(d[offsets.site_xpos // 8], nsite, 3)
        frame = memory.numbers(d[offsets.site_xmat // 8], nsite, 9)
        centre = memory.numbers(d[offsets.xipos // 8], 1 << 20, 3)
        applied = memory.numbers(d[offsets.xfrc_applied // 8], 1 << 20, 6)

        sources = memory.stack_tile()
        dipole_count = 0
        start = 0
        while start < nsite:
            first = start
            count = 0
            while start < nsite and count < memory.TILE:
                if moment[start, 0] != 0.0:
                    sources[0, count] = position[start, 0]
                    sources[1, count] = position[start, 1]
                    sources[2, count] = position[start, 2]
                    sources[3, count] = moment[start, 0] * frame[start, 2]
                    sources[4, count] = moment[start, 0] * frame[start, 5]
                    sources[5, count] = moment[start, 0] * frame[start, 8]
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
                    for k in range(6):
                        applied[body, k] = 0.0
                last_body = body
                x, y, z = position[i, 0], position[i, 1], position[i, 2]
                mx = moment[i, 0] * frame[i, 2]
                my = moment[i, 0] * frame[i, 5]
                mz = moment[i, 0] * frame[i, 8]
                fx, fy, fz, bx, by, bz, coincident = sum_over_sources(
                    (x, y, z, mx, my, mz), weld, sources, count
                )
                if coincident > 0:
                    for j in range(first, start):
                        square = 0.0
                        for k in range(3):
                            square += (position[i, k] - position[j, k]) ** 2
                        apart = weld_of[body_of[j]] != weld
                        if moment[j, 0] != 0.0 and apart and square < COINCIDENCE_SQUARED:
                            names = m[offsets.names // 8]
                            starts = memory.integers(m[offsets.name_siteadr // 8], nsite)
                            memory.fatal_coincidence(i, names + starts[i], j, names + starts[j])
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
