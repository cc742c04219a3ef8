"""The energy balance of disk and particle along the Brownian path."""

import numpy as np
import xarray as xr

from magmotor.common.checks import reject
from magmotor.device.analysis import OWN, analysis, checked_run
from magmotor.device.observable import labeled
from magmotor.devices.disk.scene import Disk, LangevinParticle
from magmotor.devices.disk.theory.coefficients import injection_rate
from magmotor.noise import path_of

LABELS = {
    "heat": ("1", "heat dissipated by friction"),
    "injected": ("1", "mean work of the noise"),
    "martingale": ("1", "work of the noise minus its mean"),
    "residual": ("1", "residual of the energy balance"),
}


@analysis("v", "energy", of=(Disk, LangevinParticle), records=2)
def disk_energy_balance(run: xr.Dataset, scene: Disk | LangevinParticle = OWN) -> xr.Dataset:
    """Compare the energy with the heat and the work of the noise along each replica's path.

    The paper's remark: dE = -c s^2 dt + (alpha^2/2)(1 + 1/sigma) dt + alpha s dW, s = v + omega.
    The last two terms together are the Stratonovich integral of alpha s dW. This integral and the
    heat are summed with the mean velocities of each step. The Langevin particle has s = v; a disk
    with a `friction_ratio` has a second slip with its own noise, and with background drag, v and
    omega have, too.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate`, or some of its replicas, or a part of it in time; the coordinates `step`
        and `replica` identify its noise. Every step must be recorded.
    scene : Disk or LangevinParticle, optional
        Scene of the run; by default, from the run's attributes.

    Returns
    -------
    xarray.Dataset
        From the first record on: `heat` = int c s^2 dt, `injected` = (alpha^2/2)(1 + 1/sigma) t,
        `martingale` = int alpha s dW (Ito), each with the parts of the drag, and `residual` = E -
        E(0) + heat - injected - martingale.

    Raises
    ------
    ValueError
        The run lacks a step between its first and its last, or the numbers of its steps and
        replicas.
    """
    run = checked_run("run", run, scene.velocity_names, (type(scene),))
    first, replicas = _first_step(run), _replicas(run)
    path = path_of(run.attrs)
    velocities = np.stack([run[name] for name in scene.velocity_names])
    mean = np.atleast_3d((velocities[..., 1:] + velocities[..., :-1]) / 2)
    rows = mean.reshape(len(velocities), len(replicas), -1)
    increments = np.array(
        [
            [path.increments(rows.shape[-1], first=first, replica=r, channel=j) for r in replicas]
            for j in range(scene.noise_matrix.shape[1])
        ]
    )
    power = np.sum(rows * np.tensordot(scene.friction_matrix, rows, axes=1), axis=0)
    driven = np.sum(np.tensordot(scene.noise_matrix.T, rows, axes=1) * increments, axis=0)
    heat = path.timestep * np.cumsum(power, axis=-1)
    work = np.cumsum(driven, axis=-1)
    injected = injection_rate(scene) * (run.time.values[1:] - run.time.values[0])
    energy = run.energy.values.reshape(len(replicas), -1)
    gain = energy[:, 1:] - energy[:, :1]
    columns = {
        "heat": heat,
        "injected": np.broadcast_to(injected, heat.shape),
        "martingale": work - injected,
        "residual": gain + heat - work,
    }
    columns = {k: np.pad(v, ((0, 0), (1, 0))).reshape(run.v.shape) for k, v in columns.items()}
    data = {k: (run.v.dims, v) for k, v in columns.items()}
    return labeled(xr.Dataset(data, coords={"time": run.time}), LABELS)


def _first_step(run: xr.Dataset) -> int:
    """Return the number of the run's first step, after a check that no later one is missing."""
    if "step" not in run.coords or run.step.dims != ("time",) or run.step.dtype.kind not in "iu":
        raise reject(
            "coordinates",
            [*map(str, run.coords)],
            "must include step, a number for each time, as simulate writes it",
        )
    if not {"seed", "timestep"} <= {*run.attrs}:
        raise reject(
            "attributes", [*run.attrs], "must include seed and timestep, as simulate writes them"
        )
    apart = np.diff(run.step.values)
    if (apart != 1).any():
        worst = int(apart[apart != 1][0])
        raise reject(
            "steps between two records", worst, "must be 1, since the noise of every step is needed"
        )
    return int(run.step.values[0])


def _replicas(run: xr.Dataset) -> list[int]:
    """Return the numbers of the run's replicas."""
    if "replicas" not in run.attrs:
        return [0]
    if "replica" not in run.coords or run.replica.dtype.kind not in "iu":
        raise reject(
            "coordinates", [*map(str, run.coords)], "must include replica, as simulate writes it"
        )
    return np.atleast_1d(run.replica.values).tolist()
