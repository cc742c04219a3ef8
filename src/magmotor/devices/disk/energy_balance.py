"""The disk's energy balance along its Brownian path."""

import numpy as np
import xarray as xr

from magmotor.common.checks import reject
from magmotor.device.analysis import OWN, analysis, checked_run
from magmotor.device.labels import labeled
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
    """Energy against heat and the work of the noise, along the path of each replica.

    The paper's remark: dE = -c s^2 dt + (alpha^2/2)(1 + 1/sigma) dt + alpha s dW, s = v + omega.
    The last two terms together are the Stratonovich integral of alpha s dW, which is summed with
    the mean slip of each step, as the heat is. The Langevin particle has s = v, and a disk with a
    `friction_ratio` a second slip with its own noise.

    Parameters
    ----------
    run : xarray.Dataset
        From `simulate`, or some of its replicas, or a part of it in time: its coordinates `step`
        and `replica` say which noise it had. Every step must be recorded.
    scene : Disk or LangevinParticle, optional
        Its scene; by default the one that the attributes of the run tell.

    Returns
    -------
    xarray.Dataset
        From the first record on: `heat` = int c s^2 dt, `injected` = (alpha^2/2)(1 + 1/sigma) t,
        `martingale` = int alpha s dW (Ito), and `residual` = E - E(0) + heat - injected -
        martingale.

    Raises
    ------
    ValueError
        The run does not hold every step between its first and its last, or does not say which
        steps and replicas it holds.
    """
    if isinstance(scene, Disk):
        run = checked_run("run", run, ("omega",), (Disk,))
    first, replicas = _first_step(run), _replicas(run)
    path = path_of(run.attrs)
    velocities = [run.v, run.omega] if isinstance(scene, Disk) else [run.v]
    slips = np.tensordot(scene.slip_directions, np.stack(velocities), axes=1)
    mean = np.atleast_3d((slips[..., 1:] + slips[..., :-1]) / 2)
    rows = mean.reshape(len(slips), len(replicas), -1)
    increments = np.array(
        [
            [path.increments(rows.shape[-1], first=first, replica=r, channel=j) for r in replicas]
            for j in range(len(slips))
        ]
    )
    heat = scene.friction * path.timestep * np.cumsum(np.sum(rows**2, axis=0), axis=-1)
    work = scene.noise * np.cumsum(np.sum(rows * increments, axis=0), axis=-1)
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
    """Number of the run's first step on its Brownian path, if it holds all that follow."""
    if "step" not in run.coords or run.step.dims != ("time",) or run.step.dtype.kind not in "iu":
        raise reject(
            "coordinates", [*map(str, run.coords)], "must be those of simulate, with step over time"
        )
    if not {"seed", "timestep"} <= {*run.attrs}:
        raise reject(
            "attributes", [*run.attrs], "must be those of simulate, with seed and timestep"
        )
    apart = np.diff(run.step.values)
    if (apart != 1).any():
        worst = int(apart[apart != 1][0])
        raise reject(
            "steps between two records", worst, "must be 1: the noise of every step is needed"
        )
    return int(run.step.values[0])


def _replicas(run: xr.Dataset) -> list[int]:
    """Numbers of the replicas that the run holds."""
    if "replicas" not in run.attrs:
        return [0]
    if "replica" not in run.coords or run.replica.dtype.kind not in "iu":
        raise reject(
            "coordinates", [*map(str, run.coords)], "must be those of simulate, with replica"
        )
    return np.atleast_1d(run.replica.values).tolist()
