"""All forces on a model."""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import ctypes

from numba import types

from magmotor.mjcf import errors, layout, memory
from magmotor.mjcf.declarations import reader
from magmotor.mjcf.declarations.marks import DIPOLES, IRON, NOISE, POTENTIALS
from magmotor.mjcf.declarations.reader import find_error
from magmotor.mjcf.forces import dipole_wrenches, drives, resolution
from magmotor.mjcf.forces.brownian_wrenches import clear_driven_bodies, has_step_number
from magmotor.mjcf.forces.joint_potentials import add_potential_forces
from magmotor.mjcf.forces.magnetic_wrenches import set_magnetic_wrenches
from magmotor.numerics.numba_cache import compiled_once
from magmotor.numerics.subroutine import subroutine

_word, _flag = types.int64, types.boolean
_APPLY = types.int64(_word, _word, _word, _word, _word, _word, _flag, _word)

apply_forces = types.ExternalFunction("magmotor_apply_forces", _APPLY)
"""Compute all forces except noise, and return how many act.

The arguments are the addresses of mjModel, mjData and the table of the model; the bits of what
acts; the addresses of the wrenches (nbody, 6), which overwrite those of the bodies on which any
act, and of the forces on joints (nv,), to which those of potentials are added; whether this is a
later stage of RK4; and the address of the words of an error. Without one, the second and the third
are those of `unresolved_body`.
"""

_address = ctypes.c_int64()
_forces = memory.function_at("magmotor_forces_address", _APPLY)


def bind_others() -> None:
    """Bind what the forces call, and the function through which others will call the forces."""
    reader.bind()
    drives.bind()
    resolution.bind()
    dipole_wrenches.bind()
    memory.bind_variable("magmotor_forces_address", _address)
    memory.bind_compiled("magmotor_apply_forces", _forward())


def bind() -> None:
    """Load the forces, after what they call; until then, nothing may call them."""
    _address.value = _apply_forces(layout.current()).address


def is_cached() -> bool:
    """Whether the forces have been compiled before."""
    return _apply_forces.is_cached(layout.current())


def compile_alone() -> None:
    """Compile the forces into Numba's cache, in a process that does nothing else."""
    memory.bind_unused(
        "mju_dispatch",
        "magmotor_add_clustered_wrenches",
        "magmotor_cluster_task",
        "magmotor_find_error",
        "magmotor_tile_task",
    )
    drives.bind()
    resolution.bind()
    _apply_forces(layout.current())


@compiled_once(_APPLY, error_model="numpy")
def _forward(checksum: int):
    """Define what the symbol of `apply_forces` is bound to, so that callers can be compiled first.

    The call takes 4 ns longer.
    """

    def forward(model, data, table, kinds, applied, generalized, later, error):
        _ = checksum
        return _forces((model, data, table, kinds, applied, generalized, later, error))

    return forward


@compiled_once(_APPLY, error_model="numpy")
def _apply_forces(checksum: int, offsets: layout.Layout):
    """Define `apply_forces` for one layout of the structs."""

    def apply_forces(model, data, table, kinds, applied, generalized, later, error):
        _ = checksum
        words = memory.words(error, errors.WORDS)
        wrenches = memory.numbers(applied, memory.UNBOUNDED, 6)
        forces = memory.numbers(generalized, 1, memory.UNBOUNDED)[0]
        find_error(model, table, kinds, False, error)
        if words[0] >= 0:
            return 0
        acting, found = _apply(model, data, offsets, table, kinds, wrenches, forces, later)
        words[0], words[1], words[2] = found
        return acting

    return apply_forces


@subroutine(forceinline=True)
def _apply(model, data, offsets, table, kinds, applied, generalized, later):
    """Implement `apply_forces` for a valid model; also return an error."""
    m = memory.words(model, memory.UNBOUNDED)
    d = memory.words(data, memory.UNBOUNDED)
    acting, found = 0, errors.NO_ERROR
    if kinds & NOISE and m[offsets.nuser_body // 8] > 0:
        invalid = clear_driven_bodies(m, d, offsets, applied)
        if invalid >= 0:
            return 0, (errors.PATH, invalid, -1)
        if not has_step_number(model, data, offsets):
            return 0, (errors.TIME, -1, -1)
    if kinds & IRON or (kinds & DIPOLES and m[offsets.nuser_site // 8] > 0):
        acting, found = set_magnetic_wrenches(m, d, offsets, table, kinds, applied, later)
        if found[0] >= 0:
            return 0, found
    if kinds & POTENTIALS and m[offsets.nuser_jnt // 8] > 0:
        acting += add_potential_forces(m, d, offsets, generalized)
    return acting, found
