"""All forces on a model, and what is invalid among the things that cause them."""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

import ctypes

from numba import types

from magmotor.mjcf import errors, layout, memory
from magmotor.mjcf.forces import coils, dipole_wrenches, resolution, valid_indices
from magmotor.mjcf.forces.brownian_wrenches import (
    clear_driven_bodies,
    has_step_number,
    invalid_row,
)
from magmotor.mjcf.forces.coils import invalid_coil
from magmotor.mjcf.forces.couplings import invalid_coupling
from magmotor.mjcf.forces.dipole_sites import invalid_moment
from magmotor.mjcf.forces.fields import invalid_field, invalid_field_tuple
from magmotor.mjcf.forces.iron import coupled_iron, invalid_iron, invalid_material, invalid_size
from magmotor.mjcf.forces.joint_potentials import add_potential_forces, invalid_potential
from magmotor.mjcf.forces.magnetic_wrenches import set_magnetic_wrenches
from magmotor.mjcf.forces.marks import (
    COILS,
    COUPLINGS,
    DIPOLES,
    FIELDS,
    IRON,
    NOISE,
    POTENTIALS,
    UNMARKED,
    UNREADABLE,
)
from magmotor.mjcf.forces.tolerance import invalid_tolerance
from magmotor.mjcf.forces.units import invalid_constant
from magmotor.mjcf.forces.valid_indices import invalid_index
from magmotor.numerics.numba_cache import compiled_once
from magmotor.numerics.subroutine import subroutine

_word, _flag = types.int64, types.boolean
_APPLY = types.int64(_word, _word, _word, _word, _word, _flag, _word)
_CHECK = types.void(_word, _word, _flag, _word)

apply_forces = types.ExternalFunction("magmotor_apply_forces", _APPLY)
"""Compute all forces except noise, and return how many act.

The arguments are the addresses of mjModel and mjData; the bits of `forces_of`; the addresses of the
wrenches (nbody, 6), which overwrite those of the bodies on which any act, and of the forces on
joints (nv,), to which those of potentials are added; whether this is a later stage of RK4; and the
address of three words. These receive an error for `report`; without one, the second and the third
are those of `unresolved_body`.
"""

first_error = types.ExternalFunction("magmotor_first_error", _CHECK)
"""Check a model's mark, and the `user` numbers, numerics and tuples that act.

The arguments are the address of mjModel, the bits of `forces_of`, whether the check is thorough,
and the address of three words, which receive an error for `report`. Only a thorough check reads all
numbers of tables, and the coils that `read_drives` will read.
"""

_address = ctypes.c_int64()
_forces = memory.function_at("magmotor_forces_address", _APPLY)


def bind_others() -> None:
    """Bind what the forces call, and the function through which others will call the forces."""
    coils.bind()
    resolution.bind()
    dipole_wrenches.bind()
    valid_indices.bind()
    memory.bind_compiled("magmotor_first_error", _first_error(layout.current()))
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
        "magmotor_first_error",
        "magmotor_tile_task",
    )
    coils.bind()
    resolution.bind()
    _apply_forces(layout.current())


@compiled_once(_APPLY, error_model="numpy")
def _forward(checksum: int):
    """Define what the symbol of `apply_forces` is bound to, so that callers can be compiled first.

    The call takes 4 ns longer.
    """

    def forward(model, data, kinds, applied, generalized, later, error):
        _ = checksum
        return _forces((model, data, kinds, applied, generalized, later, error))

    return forward


@compiled_once(_APPLY, error_model="numpy")
def _apply_forces(checksum: int, offsets: layout.Layout):
    """Define `apply_forces` for one layout of the structs."""

    def apply_forces(model, data, kinds, applied, generalized, later, error):
        _ = checksum
        words = memory.words(error, 3)
        wrenches = memory.numbers(applied, memory.UNBOUNDED, 6)
        forces = memory.numbers(generalized, 1, memory.UNBOUNDED)[0]
        first_error(model, kinds, False, error)
        if words[0] >= 0:
            return 0
        acting, found = _apply(model, data, offsets, kinds, wrenches, forces, later)
        words[0], words[1], words[2] = found
        return acting

    return apply_forces


@compiled_once(_CHECK, error_model="numpy")
def _first_error(checksum: int, offsets: layout.Layout):
    """Define `first_error` for one layout of the structs."""

    def first_error(model, kinds, thorough, error):
        _ = checksum
        words = memory.words(error, 3)
        m = memory.words(model, memory.UNBOUNDED)
        words[0], words[1], words[2] = _find_error(m, offsets, kinds, thorough)

    return first_error


@subroutine(forceinline=True)
def _apply(model, data, offsets, kinds, applied, generalized, later):
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
        acting, found = set_magnetic_wrenches(m, d, offsets, kinds, applied, later)
        if found[0] >= 0:
            return 0, found
    if kinds & POTENTIALS and m[offsets.nuser_jnt // 8] > 0:
        acting += add_potential_forces(m, d, offsets, generalized)
    return acting, found


@subroutine(forceinline=True)
def _find_error(m, offsets, kinds, thorough):
    """Implement `first_error`."""
    if kinds == UNREADABLE:
        place = memory.details_on_stack()
        field = invalid_index(m.ctypes.data, place)
        return errors.INDEX, field, memory.words(place, 1)[0]
    if kinds < 0:
        return errors.MARK, -1, -1
    site = invalid_moment(m, offsets) if kinds & DIPOLES else -1
    if site >= 0:
        return errors.MOMENT, site, -1
    numeric = invalid_tolerance(m, offsets) if kinds & DIPOLES else -1
    if numeric >= 0:
        return errors.TOLERANCE, numeric, -1
    numeric = invalid_constant(m, offsets) if kinds != UNMARKED else -1
    if numeric >= 0:
        return errors.CONSTANT, numeric, -1
    pair = invalid_coupling(m, offsets) if kinds & COUPLINGS else -1
    if pair >= 0:
        return errors.COUPLING, pair, -1
    body = invalid_row(m, offsets) if kinds & NOISE else -1
    if body >= 0:
        return errors.WRENCH, body, -1
    joint = invalid_potential(m, offsets) if kinds & POTENTIALS else -1
    if joint >= 0:
        return errors.POTENTIAL, joint, -1
    if kinds & COILS and (thorough or kinds & DIPOLES == 0 or m[offsets.nuser_site // 8] == 0):
        coil = invalid_coil(m, offsets)[0]
        if coil >= 0:
            return errors.COIL, coil, -1
    if kinds & FIELDS:
        numeric = invalid_field(m, offsets, thorough)
        if numeric >= 0:
            return errors.FIELD, numeric, -1
        owner = invalid_field_tuple(m, offsets)[0]
        if owner >= 0:
            return errors.FIELD_TUPLE, owner, -1
    if kinds & IRON:
        pieces = invalid_iron(m, offsets)[0]
        if pieces >= 0:
            return errors.IRON, pieces, -1
        material = invalid_material(m, offsets)
        if material >= 0:
            return errors.MATERIAL, material, -1
        geom = invalid_size(m, offsets)
        if geom >= 0:
            return errors.SIZE, geom, -1
        geom, pair = coupled_iron(m, offsets) if kinds & COUPLINGS else (-1, -1)
        if geom >= 0:
            return errors.COUPLED_IRON, geom, pair
    return errors.NO_ERROR
