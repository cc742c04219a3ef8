"""How fast magnets turn and swing in one another's field.

A magnet of the moment m turns in the field B against the stiffness m B, and another magnet that
follows its turns stiffens it. It swings against the gradient of the force, at most 4 F/r of each
partner, twice that if the partner swings, too, and that of an applied field; where this varies, a
turn changes the force, and a swing the torque. Images in a plane of iron are partners that follow.
A joint swings in its periodic potential, against the largest curvature of that.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import mujoco
import numpy as np

from magmotor.common.arrays import Array
from magmotor.dipoles import PERMEABILITY_OVER_4PI
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.checking.attraction import nearest_of_dipoles
from magmotor.mjcf.checking.contact_rule import Approach
from magmotor.mjcf.checking.field_strengths import applied_field, variation
from magmotor.mjcf.checking.strengths import Magnet, magnets_of
from magmotor.mjcf.declarations.marks import POTENTIALS
from magmotor.mjcf.declarations.user_numbers import HINGE, SLIDE
from magmotor.mjcf.field_and_energy import coupling_factors
from magmotor.mjcf.lookup import disabled

FINE = 64
"""Points of a potential on its shortest wave, which give the curvature to 0.2 %."""


class Stiffness(NamedTuple):
    """What holds the dipoles of a model in place, shape (n,), worst case."""

    turning: Array
    """In N m."""
    swinging: Array
    """In N/m."""
    coupling: Array
    """Of a turn with a swing, in N."""


def frequencies(model: mujoco.MjModel, data: mujoco.MjData) -> dict[int, float]:
    """Return the frequency in rad/s of each rigid body with dipoles that can move."""
    whole = magnets_of(model, data)
    magnets = [magnet for magnet in whole if magnet.strengths.any()]
    planes = [magnet for magnet in whole if magnet.images]
    found, stiffness = {}, _stiffness(model, data, magnets, planes)
    for magnet, (turning, swinging, coupling) in zip(magnets, stiffness, strict=True):
        if _moves(model, magnet.body):
            linear, angular = _jacobians(model, data, magnet)
            for n in np.flatnonzero(coupling):
                # 2 c s t is at most c (e s^2 + t^2/e) for any e.
                swing, turn = (_frequency(model, data, own[n : n + 1]) for own in (linear, angular))
                if swing and turn:
                    swinging[n] += coupling[n] * turn / swing
                    turning[n] += coupling[n] * swing / turn
            rows = [
                np.sqrt(swinging)[:, None, None] * linear,
                np.sqrt(turning)[:, None, None] * angular,
            ]
            found[magnet.body] = _frequency(model, data, np.concatenate(rows))
    return found


def frequency_at_touch(
    model: mujoco.MjModel, data: mujoco.MjData, pair: tuple[Magnet, Magnet], approach: Approach
) -> float:
    """Return the largest frequency in rad/s of two magnets that touch.

    The stiffness against a turn of dipoles is F d/3 and, if both can turn, F d/2 (both head to tail
    and side by side, where they turn in opposite directions).
    """
    responses = [_turning_response(model, data, magnet) for magnet in pair]
    stiffness = approach.force * approach.distance / (2 if all(responses) else 3)
    return max(2 / approach.time, math.sqrt(stiffness * max(responses)))


def unstable_joints(model: mujoco.MjModel, data: mujoco.MjData) -> dict[int, float]:
    """Return the frequency in rad/s of each joint whose periodic potential is too stiff.

    It is that at the largest curvature, and exceeds 2/h, or what implicit damping makes of this.
    """
    found = {}
    if not (acting_forces(model) & POTENTIALS and model.nuser_jnt):
        return found
    integrator, kinds = model.opt.integrator, mujoco.mjtIntegrator
    explicit = integrator == kinds.mjINT_RK4 or (
        integrator == kinds.mjINT_EULER and disabled(model, "eulerdamp")
    )
    step = float(model.opt.timestep)
    for joint in np.flatnonzero(model.jnt_user.any(axis=1)).tolist():
        stiffness = largest_stiffness(model.jnt_user[joint])
        if model.jnt_type[joint] not in (SLIDE, HINGE) or not stiffness:
            continue
        dof = int(model.jnt_dofadr[joint])
        row = np.zeros((1, 1, model.nv))
        row[0, 0, dof] = 1.0
        root = _frequency(model, data, row)  # of the inverse inertia
        frequency = math.sqrt(stiffness) * root
        damping = 0.0 if explicit else max(0.0, float(model.dof_damping[dof]))
        # With implicit damping c, h^2 omega^2 < 4 + 2 h c/I is stable.
        kick, limit = frequency * step, math.sqrt(4.0 + 2 * step * damping * root * root)
        if kick > limit or kick == math.inf:
            found[joint] = frequency
    return found


def largest_stiffness(waves: Array) -> float:
    """Return the largest curvature of sum_k a_k sin kq + b_k cos kq; infinite if it overflows."""
    count = len(waves) // 2
    if not count:
        return 0.0
    sines, cosines = waves[: 2 * count].reshape(count, 2).T
    points, k = FINE * count, np.arange(1, count + 1)
    spectrum = np.zeros(points // 2 + 1, complex)
    spectrum[1 : count + 1] = -(k**2) * (cosines - 1j * sines) * points / 2
    curvature = np.fft.irfft(spectrum, points)
    return max(0.0, float(curvature.max())) if np.isfinite(curvature).all() else math.inf


def _turning_response(model: mujoco.MjModel, data: mujoco.MjData, magnet: Magnet) -> float:
    """Return the largest inverse inertia, in 1/(kg m^2), against which a torque turns a dipole."""
    if not (_moves(model, magnet.body) and magnet.strengths.any()):
        return 0.0
    _, angular = _jacobians(model, data, magnet)
    return max(_frequency(model, data, rows[np.newaxis]) ** 2 for rows in angular)


def swinging_response(model: mujoco.MjModel, data: mujoco.MjData, magnet: Magnet) -> float:
    """Return the largest inverse mass, in 1/kg, against which a force moves a dipole."""
    if not _moves(model, magnet.body):
        return 0.0
    linear, _ = _jacobians(model, data, magnet)
    return max(_frequency(model, data, rows[np.newaxis]) ** 2 for rows in linear)


def _moves(model: mujoco.MjModel, weld: int) -> bool:
    return bool(model.body_dofnum[weld])


def _stiffness(
    model: mujoco.MjModel, data: mujoco.MjData, magnets: list[Magnet], planes: list[Magnet]
) -> Iterator[Stiffness]:
    """Yield what holds the dipoles of each magnet."""
    if not magnets:
        return
    factor, k = coupling_factors(model), PERMEABILITY_OVER_4PI
    positions = np.concatenate([magnet.positions for magnet in magnets])
    moments = np.concatenate([magnet.strengths[:, None] * magnet.axes for magnet in magnets])
    extents = np.concatenate([magnet.extents for magnet in magnets])
    bodies = np.concatenate([magnet.bodies for magnet in magnets])
    welds = model.body_weldid[bodies]
    follows = model.body_dofnum[welds] > 0
    strengths = np.linalg.norm(moments, axis=1)
    given = np.nan_to_num(applied_field(model, data, positions, welds))  # elsewhere an error
    varies, bends = variation(model, data, positions, welds)
    sources = [(positions, moments, 0.0)]
    for plane in planes:
        normal = data.geom_xmat[plane.elements[0] - model.nsite, 2::3]
        height = (positions - plane.positions) @ normal
        images = 2 * np.outer(moments @ normal, normal) - moments
        sources.append((positions - 2 * np.outer(height, normal), images, plane.images))
    factors = {
        one: np.array([factor(one, int(other)) for other in bodies])
        for one in np.unique(bodies).tolist()
    }
    first = 0
    for magnet in magnets:
        turning, swinging = np.zeros((2, len(magnet.positions)))
        for n, body in enumerate(magnet.bodies.tolist()):
            i, field = first + n, given[first + n].copy()
            for places, sizes, mirror in sources:
                scale = k * (mirror * np.ones(len(bodies)) if mirror else factors[body])
                apart = positions[i] - places
                nearest = nearest_of_dipoles(extents[i], extents)
                distance = np.maximum(np.linalg.norm(apart, axis=1), nearest)
                along = (apart * sizes).sum(axis=1) / distance**2
                others = scale * (welds != magnet.body)  # one's own images turn against one
                field += others @ (
                    (3 * along[:, np.newaxis] * apart - sizes) / distance[:, None] ** 3
                )
                of_each = abs(scale) * strengths / distance**3
                turning[n] += strengths[i] * (of_each @ follows)
                swinging[n] += 24 * strengths[i] * (of_each / distance**2) @ (1 + follows)
            turning[n] += strengths[i] * np.linalg.norm(field)
        own = slice(first, first + len(magnet.positions))
        swinging += strengths[own] * bends[own]
        first = own.stop
        yield Stiffness(turning, swinging, strengths[own] * varies[own])


def _jacobians(model: mujoco.MjModel, data: mujoco.MjData, magnet: Magnet) -> tuple[Array, Array]:
    """Return the Jacobians (n, 3, nv) of dipoles' places, and of turns that torques can cause."""
    linear, angular = np.zeros((2, len(magnet.positions), 3, model.nv))
    for n, (place, body) in enumerate(zip(magnet.positions, magnet.bodies.tolist(), strict=True)):
        mujoco.mj_jac(model, data, linear[n], angular[n], place, body)
        angular[n] -= np.outer(magnet.axes[n], magnet.axes[n] @ angular[n])
    return linear, angular


def _frequency(model: mujoco.MjModel, data: mujoco.MjData, blocks: Array) -> float:
    """Return the root of the largest eigenvalue of R M^-1 R^T, where R are all rows of blocks.

    It is infinite where numbers overflow.
    """
    rows = np.ascontiguousarray(blocks.reshape(-1, model.nv))
    response = np.empty_like(rows)
    mujoco.mj_solveM(model, data, response, rows)
    wide = len(rows) <= model.nv  # if not, R^T R M^-1 has the same eigenvalues and is smaller
    matrix = rows @ response.T if wide else rows.T @ response
    if not np.isfinite(matrix).all():
        return math.inf
    values = np.linalg.eigvalsh(matrix) if wide else np.linalg.eigvals(matrix).real
    return math.sqrt(max(0.0, values.max()))
