"""Temperatures of a run of any model, from its velocities and from its positions."""

import mujoco
import numpy as np
import xarray as xr

from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.checks import check_array, reject
from magmotor.mjcf.boltzmann.metropolis import joint_names, positions_only
from magmotor.numerics.batch_means import BATCHES, mean_and_error


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

    Velocities of an integrator deviate by O(h^2) even where its positions have no error.

    A record takes about 3 us for two links.
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


def _records(run: xr.Dataset, **widths: int) -> list[Array]:
    """Return variables of a run as arrays of shape (replicas, times, width)."""
    found = []
    for name, width in widths.items():
        if name not in run:
            raise reject("variables of run", [*map(str, run)], f"must contain {name!r}")
        values = check_array(f"{name} of run", run[name], ..., width)
        if values.ndim not in (2, 3):
            raise reject(f"shape of {name} of run", values.shape, "must be (replica, time, width)")
        found.append(values.reshape(-1, *values.shape[-2:]))
    shapes = {values.shape[:2] for values in found}
    if len(shapes) > 1:
        raise reject("shapes of run", [*shapes], "all variables must have the same times")
    replicas, times = shapes.pop()
    if times == 0 or replicas * times < BATCHES:
        raise reject("number of records of run", replicas * times, f"must be at least {BATCHES}")
    return found
