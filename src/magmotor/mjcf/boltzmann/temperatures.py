"""Temperatures of a run of any model, from its velocities and from its positions."""

from contextlib import nullcontext
from functools import partial

import mujoco
import numpy as np
import xarray as xr

from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.checks import check_array
from magmotor.common.exceptions import ArgumentError
from magmotor.mjcf.boltzmann.forces import Forces, resting_forces, without_noise
from magmotor.mjcf.boltzmann.metropolis import is_translation, joint_names, positions_only
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.declarations.marks import DIPOLES, POTENTIALS
from magmotor.mjcf.lookup import potential_checksum
from magmotor.mjcf.magnetism import magnetism
from magmotor.numerics.batch_means import BATCHES, mean_and_error, ratio_and_error

CALLS = 200_000
"""Largest number of force evaluations for the configurational temperature; seconds."""

STEP = 1e-5
"""Step of the finite differences, in rad; for lengths, over the extent of the model."""


@checked
def kinetic_temperature(model: mujoco.MjModel, run: xr.Dataset) -> xr.Dataset:
    """Compute the temperature of each joint from positions and velocities.

    By equipartition, <v_i (M(q) v)_i> = kT for each velocity v_i, where M is the mass matrix. The
    temperature of a joint is the mean over its velocities, and the total one that over all.

    Parameters
    ----------
    model : mujoco.MjModel
    run : xarray.Dataset
        `qpos` (replica, time, nq) and `qvel` (replica, time, nv) at equal times, in equilibrium;
        the dimension `replica` may be absent, and the others may have any names.

    Returns
    -------
    xarray.Dataset
        `temperature` and its standard error `error` over `joint`, the joints' names; `total` and
        `total_error`. In J.

    Raises
    ------
    ValueError
        The run lacks a variable, has too few records, or does not belong to the model.

    Notes
    -----
    The errors are computed from the means of batches: at least 16 in total, but at most 8 for each
    replica. They are too small unless a batch is much longer than the correlation time, the inverse
    of the smallest friction rate. With 16 replicas or more, each replica is a batch.

    A joint at a wrong temperature also changes those of the joints that inertia couples to it.

    Velocities of an integrator deviate even where its positions have no error: by BAOAB, those of
    an oscillation of angular frequency w have the temperature kT (1 - (w h)^2/4).

    A record takes about 3 µs for an arm.
    """
    positions, velocities = _records(run, qpos=model.nq, qvel=model.nv)
    model = positions_only(model)
    data = mujoco.MjData(model)
    momentum = np.empty(model.nv)
    products = np.empty(velocities.shape)
    for at in np.ndindex(velocities.shape[:2]):
        data.qpos[:] = positions[at]
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_mulM(model, data, momentum, velocities[at])
        products[at] = velocities[at] * momentum
    joints = [products[..., model.dof_jntid == k].mean(axis=-1) for k in range(model.njnt)]
    found = np.array([mean_and_error(series) for series in [*joints, products.mean(axis=-1)]])
    units = {"units": "J"}
    return xr.Dataset(
        {
            "temperature": ("joint", found[:-1, 0], units | {"long_name": "kinetic temperature"}),
            "error": ("joint", found[:-1, 1], units | {"long_name": "standard error"}),
            "total": ((), found[-1, 0], units | {"long_name": "kinetic temperature"}),
            "total_error": ((), found[-1, 1], units | {"long_name": "standard error"}),
        },
        {"joint": joint_names(model)},
    )


@checked
def configurational_temperature(
    model: mujoco.MjModel, run: xr.Dataset, forces: Forces | None = None
) -> xr.Dataset:
    """Compute the temperature from positions alone, by the forces that act there.

    Let f be the conservative forces, M the mass matrix and B = M^-1 f. Integration by parts over
    the law sqrt(det M) exp(-V/kT) yields kT = -<f . B>/<div B>, where div B is the divergence with
    respect to sqrt(det M) dq: the sum of d_i(sqrt(det M) B_i)/sqrt(det M). The derivatives are
    central differences along each velocity.

    Parameters
    ----------
    model : mujoco.MjModel
        The `effective_model` of a `Langevin`, if that disabled flags or softened constraints.
    run : xarray.Dataset
        `qpos` (replica, time, nq) in equilibrium; the dimension `replica` may be absent, and the
        others may have any names. Of a long run, evenly spaced records are used: those for which
        200000 evaluations of the forces suffice, 2 nv + 1 for each.
    forces : callable, optional
        A function of an `mjData` at rest, with positions and the mass matrix up to date, that
        returns the conservative forces (nv,). By default, these are all forces of the model: of
        gravity, springs, dipoles and potentials of joints, actuators, limits, equalities and
        contacts without friction as MuJoCo applies them at rest, and those applied by the user.
        Controls and applied forces are those that the run contains, else zero.

    Returns
    -------
    xarray.Dataset
        `temperature` and its standard error `error`, in J.

    Raises
    ------
    ValueError
        The run lacks `qpos`, has too few records, or was made with another potential; or two geoms
        touch with friction, which has no potential.

    Notes
    -----
    The formula holds if the boundary does not contribute, as without hard walls, and if the forces
    are the gradient of a potential. Only coordinates on which forces act contribute.

    The error is that of a ratio (delta method), from the means of batches as in
    `kinetic_temperature`.

    The formula is that of O. G. Jepps, G. Ayton and D. J. Evans, Phys. Rev. E 62, 4757 (2000),
    on a manifold with the metric M.
    """
    (positions,) = _records(run, qpos=model.nq)
    times = positions.shape[1]
    count = min(times, max(1, CALLS // ((2 * model.nv + 1) * len(positions))))
    positions = positions[:, np.linspace(0, times - 1, count).round().astype(int)]
    if run.attrs.get("potential", potential_checksum(model)) != potential_checksum(model):
        sentence = (
            "must be the effective_model of the Langevin that made this run, since it disabled"
            " flags or softened constraints"
        )
        raise ArgumentError("model", model, sentence)
    magnetic = forces is None and acting_forces(model) & (DIPOLES | POTENTIALS)
    model = without_noise(model) if forces is None else model
    data = mujoco.MjData(model)
    for name in {"ctrl", "qfrc_applied", "xfrc_applied"} & {*run}:
        applied = getattr(data, str(name))
        applied[:] = check_array(f"{name} of run", run[name], *applied.shape)
    forces = partial(resting_forces, model) if forces is None else _checked(forces, model.nv)
    squares, divergences = np.empty(positions.shape[:2]), np.empty(positions.shape[:2])
    with magnetism() if magnetic else nullcontext():
        for at in np.ndindex(positions.shape[:2]):
            squares[at], divergences[at] = _square_and_divergence(
                model, data, forces, positions[at]
            )
    if not (squares.any() and divergences.any()):
        zero = "divergences of forces" if squares.any() else "forces"
        sentence = "must not be zero everywhere: some force must depend on the position"
        raise ArgumentError(f"{zero} at the positions of run", 0.0, sentence)
    temperature, error = ratio_and_error(squares, -divergences)
    units = {"units": "J"}
    return xr.Dataset(
        {
            "temperature": ((), temperature, units | {"long_name": "configurational temperature"}),
            "error": ((), error, units | {"long_name": "standard error"}),
        }
    )


def _checked(forces: Forces, size: int) -> Forces:
    """Return a function that calls the user's one, and checks its result."""
    return lambda data: check_array("forces(data)", forces(data), size)


def _square_and_divergence(
    model: mujoco.MjModel, data: mujoco.MjData, forces: Forces, position: Array
) -> tuple[float, float]:
    """Return f . B and the divergence of B = M^-1 f with respect to sqrt(det M) dq."""

    def field(position: Array) -> tuple[Array, Array, float]:
        data.qpos[:] = position
        mujoco.mj_fwdPosition(model, data)
        force = forces(data)
        solution = np.empty((1, model.nv))
        mujoco.mj_solveM(model, data, solution, force[np.newaxis])
        return force, solution[0], -0.5 * float(np.log(data.qLDiagInv).sum())

    force, center, volume = field(position)
    translates = is_translation(model)
    divergence = 0.0
    for i in range(model.nv):
        step = STEP * (model.stat.extent if translates[i] else 1.0)
        change = np.zeros(model.nv)
        for change[i] in (step, -step):
            there = position.copy()
            mujoco.mj_integratePos(model, there, change, 1.0)
            _, solution, other = field(there)
            divergence += np.exp(other - volume) * solution[i] / (2 * change[i])
    return float(force @ center), divergence


def _records(run: xr.Dataset, **widths: int) -> list[Array]:
    """Return variables of a run as arrays of shape (replicas, times, width)."""
    found = []
    for name, width in widths.items():
        if name not in run:
            raise ArgumentError("variables of run", [*map(str, run)], f"must contain {name!r}")
        values = check_array(f"{name} of run", run[name], ..., width)
        if values.ndim not in (2, 3):
            raise ArgumentError(
                f"shape of {name} of run", values.shape, "must be (replica, time, width)"
            )
        found.append(values[np.newaxis] if values.ndim == 2 else values)
    shapes = {values.shape[:2] for values in found}
    if len(shapes) > 1:
        raise ArgumentError("shapes of run", [*shapes], "all variables must have the same times")
    replicas, times = shapes.pop()
    if times == 0 or replicas * times < BATCHES:
        raise ArgumentError(
            "number of records of run", replicas * times, f"must be at least {BATCHES}"
        )
    return found
