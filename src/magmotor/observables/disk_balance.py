"""The disk's energy balance along its Brownian path."""

import numpy as np
import xarray as xr

from magmotor import theory
from magmotor.noise import path_of
from magmotor.scenes import Disk


def disk_energy_balance(run: xr.Dataset, scene: Disk) -> xr.Dataset:
    """Energy against heat and the work of the noise, along the path of each replica.

    The paper's remark: dE = -c s^2 dt + (alpha^2/2)(1 + 1/sigma) dt + alpha s dW, s = v + omega.
    The last two terms together are the Stratonovich integral of alpha s dW, which is summed with
    the mean slip of each step, as the heat is.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate`, with every step recorded and `friction_ratio` zero.
    scene : Disk
        Its scene.

    Returns
    -------
    xarray.Dataset
        `heat` = int c s^2 dt, `injected` = (alpha^2/2)(1 + 1/sigma) t, `martingale` =
        int alpha s dW (Ito), and `residual` = E - E(0) + heat - injected - martingale.
    """
    path, first = path_of(run.attrs), int(run.attrs.get("first_step", 0))
    h = path.timestep
    slip = np.atleast_2d((run.v + run.omega).values)
    steps = slip.shape[1] - 1
    increments = np.array(
        [path.increments(steps, first=first, replica=r) for r in range(len(slip))]
    )
    mean_slip = (slip[:, 1:] + slip[:, :-1]) / 2
    heat = scene.friction * h * np.cumsum(mean_slip**2, axis=1)
    work = scene.noise * np.cumsum(mean_slip * increments, axis=1)
    injected = theory.injection_rate(scene) * run.time.values[1:]
    energy = np.atleast_2d(run.energy.values)
    gain = energy[:, 1:] - energy[:, :1]
    columns = {
        "heat": heat,
        "injected": np.broadcast_to(injected, heat.shape),
        "martingale": work - injected,
        "residual": gain + heat - work,
    }
    columns = {k: np.pad(v, ((0, 0), (1, 0))).reshape(run.v.shape) for k, v in columns.items()}
    return xr.Dataset({k: (run.v.dims, v) for k, v in columns.items()}, coords={"time": run.time})
