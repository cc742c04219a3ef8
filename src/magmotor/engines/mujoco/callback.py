"""The compiled callback: all that this package adds to MuJoCo's step, in one C function.

It reads what acts from the model itself: dipole sites and periodic potentials of joints (see
`forces`) and Brownian wrenches of bodies (see `brownian`). Bodies on which any of these acts get
the sum as their wrench in `xfrc_applied`, which is overwritten.
"""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import ctypes
import warnings
from functools import cache

from numba import cfunc, types

from magmotor import dipoles, eights, elementary, noise
from magmotor.code_version import code_version, specialised
from magmotor.engines.mujoco import (
    brownian,
    dipole_sites,
    forces,
    layout,
    magnets,
    memory,
    potential,
    step_number,
)
from magmotor.engines.mujoco.brownian import add_brownian_wrenches
from magmotor.engines.mujoco.dipole_sites import (
    NO_DIPOLES,
    NONE_MOVES,
    ONE_RIGID_BODY,
    SWITCHED_OFF,
    why_inert,
)
from magmotor.engines.mujoco.forces import apply_forces

_SIGNATURE = types.void(types.int64, types.int64)
COMPILED_IN = (
    dipoles,
    eights,
    elementary,
    noise,
    memory,
    dipole_sites,
    magnets,
    step_number,
    brownian,
    potential,
    forces,
)
"""Every module with code that becomes part of the callback."""


def compile_callback(offsets: layout.Layout, sources: int):
    """Compile the callback for one layout of the structs, or load it from Numba's disk cache.

    The offsets and `sources` (a checksum of the modules compiled in) are closure cells, because
    Numba's cache keys hold a function's bytecode and cells but not its globals or what it calls.
    They are plain numbers: a compiled function among them would be a new key in every process.
    """

    @cfunc(_SIGNATURE, cache=True, error_model="numpy")
    @specialised(offsets)
    def callback(model, data):
        _ = sources  # a part of the cache's key
        acting = apply_forces(model, data, offsets)
        m = memory.words(model, memory.UNBOUNDED)
        if m[offsets.nuser_body // 8] > 0:
            acting += add_brownian_wrenches(model, data, offsets)
        if acting == 0 and memory.inert_reported() == 0:
            memory.report_inert(why_inert(m, offsets))

    return callback


@cache
def compiled_callback():
    """The callback for the MuJoCo that is running, compiled once a process at the most."""
    memory.bind_function("magmotor_report_inert", _report)
    memory.bind_variable("magmotor_inert_reported", _reported)
    return compile_callback(layout.current(), code_version(*COMPILED_IN))


def report_again() -> None:
    """Have the next step of a model on which nothing acts be reported."""
    _reported.value = 0


_reported = ctypes.c_int64(0)


_REASONS = {
    NO_DIPOLES: 'it has no dipole sites (a site with user="MOMENT" in A m^2, along its z axis)',
    ONE_RIGID_BODY: "its dipole sites are all on one rigid body, and there must be another",
    NONE_MOVES: "none of the bodies with dipole sites can move: one must have a joint",
    SWITCHED_OFF: "its couplings switch all magnetism off (prm 0, which a missing prm means, too)",
}


@ctypes.CFUNCTYPE(None, ctypes.c_int64)
def _report(reason):
    _reported.value = 1
    warnings.warn(
        f"nothing acts on this model: {_REASONS[reason]}; nor has it Brownian wrenches (a body with"
        " rows of six user numbers) or periodic potentials (a joint with pairs of them)",
        stacklevel=2,
    )
