"""Field and magnetic energy of a model in a state, for pictures, controllers and checks."""

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.exceptions import ArgumentError, InputError
from magmotor.common.hints import Points
from magmotor.dipoles import COINCIDENCE as CLOSEST
from magmotor.mjcf import error_raising, layout, memory
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.declarations.marks import COUPLINGS, DIPOLES, IRON, SHAPES
from magmotor.mjcf.declarations.reader import acting_kinds, table_of
from magmotor.mjcf.declared import couplings, name_of
from magmotor.mjcf.error_numbers import BEHIND, COINCIDENCE, OUTSIDE, WORDS
from magmotor.mjcf.error_reports import report
from magmotor.mjcf.forces import drives, responses
from magmotor.mjcf.forces.dipole_table import BODY, FIRST, SIZE
from magmotor.mjcf.forces.gaps import moment_of_piece
from magmotor.mjcf.forces.magnetic_energy import energy_of
from magmotor.mjcf.forces.magnetic_state import (
    field_at,
    misplaced_dipole,
    read_state,
    stack_bytes,
)
from magmotor.mjcf.forces.magnetic_wrenches import find_coincidence
from magmotor.mjcf.hooks import errors_raised
from magmotor.numerics.compiled_once import compiled_once
from magmotor.numerics.deferred import subroutine


@checked
def field(model: mujoco.MjModel, data: mujoco.MjData, points: Points) -> Array:
    """Compute the magnetic field of a model: that of dipoles, coils, iron and applied fields.

    Parameters
    ----------
    model : mujoco.MjModel
        `magnetism` says what acts in it.
    data : mujoco.MjData
        Its positions and orientations must be up to date, as after `mj_step`, `mj_forward` or
        `mj_kinematics`.
    points : array_like, shape (..., 3)
        World coordinates in m.

    Returns
    -------
    ndarray, shape (..., 3)
        Magnetic flux density in T, or in the model's unit of it; see `magnetism`.

    Raises
    ------
    ValueError
        A point coincides with a dipole, is outside the table of an applied field or below the plane
        of iron; a dipole or piece of iron is there; or the data have no positions yet, or belong to
        another model.

    Examples
    --------
    >>> import mujoco
    >>> import magmotor as mm
    >>> model = mujoco.MjModel.from_xml_string('''
    ... <mujoco><worldbody><site user="1"/></worldbody></mujoco>''')
    >>> data = mujoco.MjData(model)
    >>> mujoco.mj_forward(model, data)
    >>> mm.field(model, data, [0, 0, 0.1])
    array([0.    , 0.    , 0.0002])
    """
    points = np.asarray(points)
    result = np.empty(points.shape).reshape(-1, 3)
    rows = np.require(points, float, ["C", "A", "W", "E"]).reshape(-1, 3)  # as compiled code wants
    _observed(model, data, rows, result)
    return result.reshape(points.shape)


@checked
def magnetic_energy(model: mujoco.MjModel, data: mujoco.MjData) -> float:
    """Compute the magnetic energy of a model, of which the forces are the negative gradient.

    It is the sum of -c m_i.B_j(x_i) over all pairs of dipoles that act on one another, where c is
    the factor of their bodies' coupling; of -m_i.B(x_i) over all dipoles in applied fields; half of
    that over all dipoles in the field of images; and the energy of iron, which is half the sum of
    q_i phi_i/mu0 where it is linear: the charges at its nodes in the potential of everything else.
    Dipoles with hysteresis add what they store, and -m.B of their own bodies; the heat in them is
    not included.

    Parameters
    ----------
    model : mujoco.MjModel
    data : mujoco.MjData
        Its positions and orientations must be up to date, as after `mj_forward`.

    Returns
    -------
    float
        In J, or in the model's unit of energy; see `magnetism`.

    Raises
    ------
    ValueError
        Two dipoles that act on one another coincide, a dipole or piece of iron is outside the table
        of an applied field or below the plane of iron, or the data have no positions yet, or belong
        to another model.
    """
    return _observed(model, data, energy=True)[0]


def dipole_sites(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[Array, Array, NDArray]:
    """Positions (n, 3) in m, moments (n, 3) in A m^2 and bodies (n,) of all dipoles and iron."""
    room = np.empty((model.nsite + model.ngeom, 7))
    dipoles = room[: _observed(model, data, dipoles=room)[1]]
    return dipoles[:, :3], dipoles[:, 3:6], dipoles[:, 6].astype(int)


NOWHERE, NONE = np.empty((0, 3)), np.empty((0, 7))


def _observed(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    points: Array = NOWHERE,
    fields: Array = NOWHERE,
    dipoles: Array = NONE,
    *,
    energy: bool = False,
) -> tuple[float, int]:
    """Return the energy, if asked for, and the number of dipoles.

    Writes the field at points (P, 3) to `fields` (P, 3), and the dipoles to the rows of `dipoles`,
    unless that has none: positions, moments and bodies.
    """
    if (len(data.site_xpos), len(data.geom_xpos)) != (model.nsite, model.ngeom):
        raise ArgumentError(
            "number of sites of data", len(data.site_xpos), f"must be {model.nsite}"
        )
    # Without sites and geoms, there are fields of the world only.
    magnetic = acting_forces(model) & (DIPOLES | IRON | SHAPES) and model.nsite + model.ngeom > 0
    if magnetic and not data.xquat[0].any():  # of the world, as in new data
        sentence = "are not known before mujoco.mj_forward(model, data), mj_kinematics or mj_step"
        raise InputError(f"positions and orientations of data {sentence}")
    if (needed := stack_bytes(model)) > data.narena - data.parena - data.pstack:
        sentence = f"must be larger by about {needed} bytes, for the dipoles"
        raise ArgumentError("size memory of the model", data.narena, sentence)
    drives.bind()
    responses.bind()
    observe = _observe(layout.current())
    try:
        with errors_raised():
            result = observe(model._address, data._address, points, fields, dipoles, energy)
    except mujoco.FatalError as error:
        raise error_raising.declaration_error(error) from error
    total, count, why, point, numeric = result
    if why == OUTSIDE:
        name = name_of(model, "numeric", numeric)
        raise ArgumentError(
            "points", points[point], f"must be inside the table of numeric {name!r}"
        )
    if why == BEHIND:
        raise ArgumentError("points", points[point], "must be above the plane of iron")
    if why == COINCIDENCE:
        sentence = f"must not coincide with a dipole (within {CLOSEST:g} m)"
        raise ArgumentError("points", points[point], sentence)
    return total, count


@subroutine
def _write_dipoles(state, dipoles):
    """Write the dipoles to rows of positions, moments and bodies, if there are rows; count them."""
    table, magnets, count = state.table, state.magnets, 0
    for k in range(magnets.number):
        for i in range(int(table[FIRST, k]), int(table[FIRST, k] + table[SIZE, k])):
            if len(dipoles) > 0:
                moment = table[3, i], table[4, i], table[5, i]
                if k >= magnets.sources:
                    moment = moment_of_piece(state, i - magnets.iron)
                for row in range(3):
                    dipoles[count, row] = table[row, i]
                    dipoles[count, 3 + row] = moment[row] / state.scale
                dipoles[count, 6] = table[BODY, k]
            count += 1
    return count


@compiled_once(nogil=True, error_model="numpy")
def _observe(checksum: int, offsets: layout.Layout):
    """Define the function that reads a state for `_observed`.

    It also returns why the field at a point is undefined, the point and the numeric, or -1.
    """

    def observe(model, data, points, fields, dipoles, energy):
        _ = checksum
        m = memory.words(model, memory.UNBOUNDED)
        d = memory.words(data, memory.UNBOUNDED)
        memory.mark_stack(data)
        own, place = table_of(model, False), memory.error_on_stack()
        state = read_state(m, d, offsets, own, acting_kinds(own, m, offsets))
        magnets, problem = state.magnets, state.error
        total, count = 0.0, 0
        why = point = numeric = -1
        if problem[0] < 0 and energy:
            problem = misplaced_dipole(state, m, offsets)
        if problem[0] < 0 and energy:
            total = energy_of(state, m, offsets)
            if not math.isfinite(total):
                problem = find_coincidence(state)
        if problem[0] < 0:
            count = _write_dipoles(state, dipoles)
        for i in range(len(points) if problem[0] < 0 else 0):
            x, y, z = points[i, 0], points[i, 1], points[i, 2]
            found, error, other = field_at(state, magnets.shaped, x, y, z, m, offsets)
            if why < 0 and (error >= 0 or found[6]):
                why, point, numeric = error if error >= 0 else COINCIDENCE, i, other
            flux = found[3:6]
            for k in range(3):
                fields[i, k] = state.scale * flux[k]
        memory.free_stack(data)
        words = memory.words(place, WORDS)
        words[0], words[1], words[2] = problem
        report(words, model, data)
        return total, count, why, point, numeric

    return observe


def coupling_factors(model: mujoco.MjModel):
    """The function that says how strongly the dipoles of two bodies act on one another."""
    factors = couplings(model) if acting_forces(model) & COUPLINGS else {}
    weld = model.body_weldid.tolist()
    moves = (model.body_dofnum[model.body_weldid] > 0).tolist()

    def factor_of(body: int, other: int) -> float:
        if weld[body] == weld[other] or not (moves[body] or moves[other]):
            return 0.0
        return factors.get(frozenset({body, other}), 1.0) if factors else 1.0

    return factor_of
