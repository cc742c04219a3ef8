"""All forces on a model, and what is invalid among the things that cause them."""

# Numba's intrinsics hide their first parameter:
# pyright: reportCallIssue=false

from numba import njit

from magmotor.mjcf import errors, memory
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
from magmotor.mjcf.forces.marks import COILS, COUPLINGS, DIPOLES, FIELDS, IRON, NOISE, POTENTIALS
from magmotor.mjcf.forces.tolerance import invalid_tolerance


@njit(forceinline=True)
def apply_forces(model, data, offsets, kinds, applied, generalized, later):
    """Compute all forces except noise; return how many act, and an error for `report`.

    Without an error, its other numbers are those of `unresolved_body`.
    `model` and `data` are the addresses of mjModel and mjData, `offsets` is their layout, and
    `kinds` are the bits of `forces_of`. The wrenches overwrite those of the bodies on which any
    act, in `applied` (nbody, 6); forces on joints are added to `generalized` (nv,).
    `later` is whether this is a later stage of RK4.
    """
    m = memory.words(model, memory.UNBOUNDED)
    d = memory.words(data, memory.UNBOUNDED)
    error = first_error(m, offsets, kinds, False)
    if error[0] >= 0:
        return 0, error
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


@njit
def first_error(m, offsets, kinds, thorough):
    """Check a model's mark, and the `user` numbers, numerics and tuples that act.

    Returns the number of the error, or -1, and of the element. Only a thorough check reads all
    numbers of tables, and the coils that `read_drives` will read.
    """
    if kinds < 0:
        return errors.MARK, -1, -1
    site = invalid_moment(m, offsets) if kinds & DIPOLES else -1
    if site >= 0:
        return errors.MOMENT, site, -1
    numeric = invalid_tolerance(m, offsets) if kinds & DIPOLES else -1
    if numeric >= 0:
        return errors.TOLERANCE, numeric, -1
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
