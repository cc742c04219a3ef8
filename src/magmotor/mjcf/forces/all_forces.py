"""All forces on a model."""

import ctypes

from magmotor.mjcf import error_numbers, layout, memory
from magmotor.mjcf.declarations import reader
from magmotor.mjcf.declarations.marks import (
    COILS,
    CONDUCTORS,
    DIPOLES,
    FIELDS,
    HYSTERESIS,
    IRON,
    NOISE,
    POTENTIALS,
    SHAPES,
)
from magmotor.mjcf.declarations.reader import find_error
from magmotor.mjcf.forces import (
    brownian_wrenches,
    dipole_wrenches,
    drives,
    eddy_wrenches,
    hysteresis,
    resolution,
    responses,
)
from magmotor.mjcf.forces.brownian_wrenches import (
    clear_driven_bodies,
    has_step_number,
    noise_is_ready,
)
from magmotor.mjcf.forces.joint_potentials import add_potential_forces
from magmotor.mjcf.forces.magnetic_wrenches import set_dipole_wrenches, set_magnetic_wrenches
from magmotor.mjcf.late_functions import LateFunction, loading_failed
from magmotor.numerics import c_types as types
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.deferred import External, subroutine

UNKNOWN = -(1 << 40)
"""Stands for how many forces act while Ctrl-C is on its way from the compilation of their code."""

_word, _flag = types.int64, types.boolean
_APPLY = types.int64(_word, _word, _word, _word, _word, _word, _flag, _word)

apply_forces = External("magmotor_apply_forces", _APPLY)
"""Compute all forces except noise, and return how many act, or `UNKNOWN`.

The arguments are the addresses of mjModel, mjData and the table of the model; the bits of what
acts; the addresses of the wrenches (nbody, 6), which overwrite those of the bodies on which any
act, and of the forces on joints (nv,), to which those of potentials are added; whether this is a
later stage of RK4; and the address of the words of an error. Without one, the second and the third
are those of `unresolved_body`.
"""

_address = ctypes.c_int64()
_forces_of_dipoles = memory.function_at("magmotor_forces_address", _APPLY)
_all_forces = LateFunction(
    "magmotor_all_forces_address", _APPLY, lambda: _apply_forces(layout.current(), True)
)
_all_are_ready, _all = _all_forces.is_ready, _all_forces.call


def bind_others() -> None:
    """Bind what the forces call, and the function through which others will call the forces."""
    reader.bind_others()
    reader.bind_check()
    brownian_wrenches.bind()
    drives.bind()
    resolution.bind()
    responses.bind()
    dipole_wrenches.bind()
    eddy_wrenches.bind()
    hysteresis.bind()
    _all_forces.bind()
    memory.bind_variable("magmotor_forces_address", _address)
    memory.bind_compiled("magmotor_apply_forces", _forward())


def bind() -> None:
    """Load the forces, after what they call; until then, nothing may call them."""
    _address.value = _apply_forces(layout.current(), False).address


def is_cached() -> bool:
    """Whether the forces have been compiled before."""
    return _apply_forces.is_cached(layout.current(), False)


def compile_alone() -> None:
    """Compile the forces into Numba's cache, in a process that does nothing else."""
    memory.bind_unused(
        "magmotor_brownian_address",
        "magmotor_clusters_address",
        "magmotor_find_error",
        "magmotor_load",
        "magmotor_loading_failed",
        "magmotor_tiles_address",
    )
    drives.bind()
    resolution.bind()
    _apply_forces(layout.current(), False)


@compiled_once(_APPLY, error_model="numpy")
def _forward(checksum: int):
    """Define what the symbol of `apply_forces` is bound to, so that callers can be compiled first.

    The call takes 4 ns longer.
    """

    def forward(model, data, table, kinds, applied, generalized, later, error):
        _ = checksum
        arguments = model, data, table, kinds, applied, generalized, later, error
        if kinds >= 0 and kinds & (FIELDS | COILS | IRON | SHAPES | CONDUCTORS | HYSTERESIS):
            # Others than dipoles are compiled when a first model has them.
            if _all_are_ready():
                return _all(arguments)
            memory.words(error, 1)[0] = error_numbers.UNLOADED if loading_failed() else -1
            return UNKNOWN
        return _forces_of_dipoles(arguments)

    return forward


@compiled_once(_APPLY, error_model="numpy")
def _apply_forces(checksum: int, offsets: layout.Layout, everything: bool):
    """Define `apply_forces` for one layout of the structs: of all, or without fields and iron."""

    def apply_forces(model, data, table, kinds, applied, generalized, later, error):
        _ = checksum
        words = memory.words(error, error_numbers.WORDS)
        wrenches = memory.numbers(applied, memory.UNBOUNDED, 6)
        forces = memory.numbers(generalized, 1, memory.UNBOUNDED)[0]
        # Numbers may have changed since the last step; those of large tables are read once.
        at_start = memory.numbers(data + offsets.time, 1, 1)[0, 0] == 0.0
        extent = error_numbers.AT_START if at_start else error_numbers.IN_STEP
        find_error(model, table, kinds, extent, error)
        if words[0] >= 0:
            return 0
        m, d = memory.words(model, memory.UNBOUNDED), memory.words(data, memory.UNBOUNDED)
        # Noise clears the rows of its bodies, before magnetism fills some of them.
        acting, found = 0, error_numbers.NO_ERROR
        if kinds & NOISE and m[offsets.nuser_body // 8] > 0:
            found = _begin_noise(model, data, m, d, offsets, wrenches)
        if found[0] < 0 and (
            kinds & (IRON | SHAPES) or (kinds & DIPOLES and m[offsets.nuser_site // 8] > 0)
        ):
            arguments = m, d, offsets, table, kinds, wrenches, later
            if everything:
                acting, found = set_magnetic_wrenches(*arguments)
            else:
                acting, found = set_dipole_wrenches(*arguments)
        if found[0] < 0 and kinds & POTENTIALS and m[offsets.nuser_jnt // 8] > 0:
            acting += add_potential_forces(m, d, offsets, forces)
        words[0], words[1], words[2] = found
        return acting

    return apply_forces


@subroutine
def _begin_noise(model, data, m, d, offsets, applied):
    """Set the wrenches of bodies with noise to zero; return an error in what selects the noise."""
    invalid = clear_driven_bodies(m, d, offsets, applied)
    if invalid >= 0:
        return error_numbers.PATH, invalid, -1
    if not noise_is_ready() and loading_failed():
        return error_numbers.UNLOADED, -1, -1
    return (
        error_numbers.NO_ERROR
        if has_step_number(model, data, offsets)
        else (error_numbers.TIME, -1, -1)
    )
