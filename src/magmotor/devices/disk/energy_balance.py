"""The energy balance of disk and particle along the Brownian path."""

import math

import numpy as np
import xarray as xr

from magmotor.common.arrays import Array
from magmotor.common.exceptions import ArgumentError
from magmotor.device.analysis import OWN, analysis, checked_run
from magmotor.device.observable import labeled
from magmotor.devices.disk.scene import Disk, LangevinParticle, derivative
from magmotor.devices.disk.theory.closed_forms import injection_rate
from magmotor.noise import path_of
from magmotor.numerics.splittings import (
    KICKS,
    SPLITTINGS,
    exchange,
    friction_and_noise,
    response,
)

POSITIONS = ("x", "theta")

CURVES = ("rk4", "dop853")
"""Methods whose velocity within a step is a smooth curve, with a mean that the positions give."""

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
    The last two terms together are the Stratonovich integral of alpha s dW. The splittings'
    friction and noise are exact, so heat and work are those of this part of each step; for other
    methods, they are summed with the mean velocities of each step. The Langevin particle has s = v;
    a disk with a `friction_ratio` has a second slip with its own noise, and with background drag, v
    and omega have, too.

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
    x, *velocities = (
        run[name].values.reshape(len(replicas), -1) for name in ("x", *scene.velocity_names)
    )
    u, steps = np.stack(velocities), x.shape[-1] - 1
    increments = np.array(
        [
            [path.increments(steps, first=first, replica=r, channel=j) for r in replicas]
            for j in range(scene.noise_matrix.shape[1])
        ]
    )
    scheme = str(run.attrs.get("method", "")).rpartition("/")[2]
    if scheme in SPLITTINGS:
        heat, work = _by_parts(scene, scheme, path.timestep, x[:, :-1], u[..., :-1], increments)
    else:
        mean, change = (u[..., 1:] + u[..., :-1]) / 2, np.diff(u, axis=-1)
        if scheme in CURVES:
            position = [run[name].values.reshape(x.shape) for name in POSITIONS[: len(u)]]
            mean = np.diff(np.stack(position), axis=-1) / path.timestep
        heat = path.timestep * _form(scene.friction_matrix, mean, mean)
        if scheme in CURVES:
            heat += path.timestep / 12 * _form(scene.friction_matrix, change, change)
        work = np.sum(np.tensordot(scene.noise_matrix.T, mean, axes=1) * increments, axis=0)
    heat, work = np.cumsum(heat, axis=-1), np.cumsum(work, axis=-1)
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


def _by_parts(
    scene: Disk | LangevinParticle, scheme: str, timestep: float, x: Array, u: Array, dW: Array
) -> tuple[Array, Array]:
    """Return heat and work of steps that begin with x (R, T) and u (n, R, T): each is repeated."""
    masses, force = np.array(scene.masses), np.zeros_like(u)
    arguments = masses, scene.friction_matrix, scene.noise_matrix
    heat, work = np.zeros_like(x), np.zeros_like(x)
    splitting = SPLITTINGS[scheme]
    for code, fraction in zip(splitting.parts, splitting.fractions, strict=True):
        time = fraction * timestep
        if code == "A":
            x = x + time * u[0]
            continue
        if code in KICKS:
            force[0] = -derivative(scene.coefficients, x, 1)
        if code == "B":
            u = u + time * force / masses[:, np.newaxis, np.newaxis]
            continue
        lost, spread = friction_and_noise(*arguments, time, exact=True)
        change = np.tensordot(lost, u, axes=1) + np.tensordot(
            spread, dW / math.sqrt(timestep), axes=1
        )
        acting = force if code in KICKS else 0 * force
        change += np.tensordot(response(*arguments[:2], time) / masses, acting, axes=1)
        found, mean = exchange(*arguments, time), u + change / 2
        moved = np.tensordot(found.mean, mean, axes=1) + np.tensordot(found.force, acting, axes=1)
        gained = _form(np.diag(masses), change, mean) - np.sum(acting * moved, axis=0)
        taken = _form(found.heat, u, u) + _form(found.heat, u + change, u + change)
        taken = taken + found.unresolved if scene.noise else -gained
        heat, work, u = heat + taken, work + gained + taken, u + change
    return heat, work


def _form(matrix: Array, u: Array, w: Array) -> Array:
    """Return u M w over the first axis."""
    return np.sum(u * np.tensordot(matrix, w, axes=1), axis=0)


def _first_step(run: xr.Dataset) -> int:
    """Return the number of the run's first step, after a check that no later one is missing."""
    if "step" not in run.coords or run.step.dims != ("time",) or run.step.dtype.kind not in "iu":
        raise ArgumentError(
            "coordinates",
            [*map(str, run.coords)],
            "must include step, a number for each time, as simulate writes it",
        )
    if not {"seed", "timestep"} <= {*run.attrs}:
        raise ArgumentError(
            "attributes", [*run.attrs], "must include seed and timestep, as simulate writes them"
        )
    apart = np.diff(run.step.values)
    if (apart != 1).any():
        worst = int(apart[apart != 1][0])
        raise ArgumentError(
            "steps between two records", worst, "must be 1, since the noise of every step is needed"
        )
    return int(run.step.values[0])


def _replicas(run: xr.Dataset) -> list[int]:
    """Return the numbers of the run's replicas."""
    if "replicas" not in run.attrs:
        return [0]
    if "replica" not in run.coords or run.replica.dtype.kind not in "iu":
        raise ArgumentError(
            "coordinates", [*map(str, run.coords)], "must include replica, as simulate writes it"
        )
    return np.atleast_1d(run.replica.values).tolist()
